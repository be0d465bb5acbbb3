"""What a check says of certificates before they end: this computer's, and that of a server."""

from collections.abc import Iterator
from contextlib import suppress

from robolink.errors import RobolinkError
from robolink.inspection._inspection import InspectionCode, InspectionFinding
from robolink.messages import tr
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.transport import LinkUrl


def certificate_findings(url: LinkUrl, *, timeout_s: float = 3.0) -> Iterator[InspectionFinding]:
    """Yield what should be seen to soon; nothing for a controller without certificates.

    The server is asked on a connection of its own, where nobody logs in; one that does not answer
    to that is no finding, because the cell was reached just now.

    Args:
        url: Of the controller.
        timeout_s: Longest wait for the server's certificate.

    Raises:
        ConfigError: This computer's certificate cannot be read.
    """
    if url.medium != "opcua" or url.options.get("security") == "none":
        return
    # Here, because nothing else needs them.
    from robolink.transport.opcua.opening import ask_certificate
    from robolink.transport.opcua.own_certificate import find_own_certificate

    own = find_own_certificate()
    renewal = remedy_word(RemedyWord.RENEW_CERTIFICATE)
    if own is not None and own.ends_soon:
        yield InspectionFinding(
            InspectionCode.CERTIFICATE_ENDS,
            "own",
            tr("This computer's certificate for OPC UA ends on {day}.", day=own.ends.date()),
            tr("Run: {command}. Then trust the new one at each PLC.", command=renewal),
        )
    with suppress(RobolinkError):
        shown = ask_certificate(url, timeout_s=timeout_s)
        if shown.ends_soon:
            yield InspectionFinding(
                InspectionCode.CERTIFICATE_ENDS,
                "server",
                tr(
                    "The certificate of the PLC's OPC UA server ends on {day}.",
                    day=shown.ends.date(),
                ),
                tr("Make a new one in the PLC, then compare it: robolink cell trust"),
            )
