"""cell trust, certificate: whom this computer believes over OPC UA, and by what it is known."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink import runtime
from robolink.errors import ConfigError, DeclinedError
from robolink.messages import tr
from robolink_cli.console.person import Person, person_here
from robolink_cli.console.render import emit, emit_json, json_is_on, say
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.prompts.questions import asked_for_text
from robolink_cli.session.context import CliContext, controller_options

if TYPE_CHECKING:
    from robolink.transport.opcua.server_certificate import OfferedCertificate

_GROUP: Final = 4
_GROUPS_IN_LINE: Final = 8
_HIDEABLE: Final = 10
"""Groups of the shorter of the two fingerprints."""
_HIDDEN: Final = "____"


@click.command()
@controller_options
def trust(context: CliContext) -> None:
    """Compare the certificate of a PLC's OPC UA server, and keep it in the cell file.

    Nobody logs in for that. One group of the fingerprint is hidden: type it as the PLC itself
    shows it. With --json it only shows the certificate and keeps nothing.
    """
    from robolink.config import find_cell, set_cell_key
    from robolink.transport import parse_url
    from robolink.transport.opcua.opening import ask_certificate
    from robolink.transport.opcua.security import fingerprint_digits

    link = parse_url(context.require_url())
    if link.medium != "opcua":
        raise ConfigError(
            tr("{identity} is not reached over OPC UA.", identity=link.identity),
            remedy=tr("Only OPC UA servers have a certificate to compare."),
        )
    shown = ask_certificate(link, timeout_s=context.timeout_s)
    pinned = fingerprint_digits(link.options.get("server_certificate", ""))
    remarks = shown.remarks(link.host)
    if json_is_on():
        emit_json("robolink/cell-trust/1", _payload(shown, remarks, kept=pinned == shown.digits))
        return
    if pinned == shown.digits:
        _show(shown, remarks)
        say(tr("This is the certificate that was compared. Nothing was changed."))
        return
    hidden = runtime.random_number(16) % _HIDEABLE
    _show(shown, remarks, hidden)
    if pinned:
        say(
            tr(
                "ANOTHER CERTIFICATE WAS COMPARED BEFORE: {digits}",
                digits=" ".join(_groups(pinned)),
            )
        )
        say(tr("If nobody has changed it at the PLC, something stands in between: find out what."))
    _compare(shown, hidden)
    if context.cell is None:
        say(tr("Add to the URL: {option}", option=f"server_certificate={shown.digits}"))
        return
    origins, name = context.cell.origins, context.cell.name
    path = origins.get("server_certificate", origins["url"])
    set_cell_key(path, name, "server_certificate", shown.fingerprint)
    kept = parse_url(find_cell(name).url).options.get("server_certificate", "")
    if fingerprint_digits(kept) != shown.digits:
        raise ConfigError(
            tr("{path} was written, but another file says otherwise.", path=path),
            remedy=tr("Compare server_certificate and url of {cell} in all cell files.", cell=name),
        )
    say(tr("Written: {path}", path=path))


@click.command()
@json_option
def certificate(
    *,
    replace: Annotated[
        bool,
        CliOption(help="Replace the one that there is; then trust the new one at each PLC."),
    ] = False,
) -> None:
    """Show this computer's certificate for OPC UA; make it if there is none.

    Trust it at the PLC, by its fingerprint or from the file. The key never leaves this computer.
    """
    from robolink.transport.opcua.opening import require_asyncua

    require_asyncua()
    from robolink.transport.opcua.own_certificate import make_own_certificate, own_certificate

    own = make_own_certificate(replace=True) if replace else own_certificate()
    payload = {
        "path": str(own.public_path),
        "application_uri": own.application_uri,
        "fingerprint_sha256": own.fingerprint,
        "valid_until": own.ends.date().isoformat(),
        "days_left": own.days_left,
    }

    def tell() -> None:
        say(tr("Certificate: {path}", path=own.public_path))
        say(tr("For: {names}", names=own.application_uri))
        say(tr("Until: {day}", day=own.ends.date()))
        say(tr("SHA-256 fingerprint: {fingerprint}", fingerprint=own.fingerprint))

    emit("cell-certificate", payload, tell)


def _payload(
    shown: "OfferedCertificate", remarks: Sequence[str], *, kept: bool
) -> dict[str, object]:
    return {
        "name": shown.name,
        "application_uri": shown.application_uri,
        "hosts": list(shown.hosts),
        "fingerprint_sha256": shown.fingerprint,
        "valid_from": shown.begins.date().isoformat(),
        "valid_until": shown.ends.date().isoformat(),
        "remarks": list(remarks),
        "kept": kept,
    }


def _show(shown: "OfferedCertificate", remarks: Sequence[str], hidden: int | None = None) -> None:
    say(tr("Server: {name}  {uri}", name=shown.name or "-", uri=shown.application_uri))
    say(tr("Valid: {begin} to {end}", begin=shown.begins.date(), end=shown.ends.date()))
    for remark in remarks:
        say(remark)
    say(tr("Fingerprint, SHA-256:"))
    for line in _grouped(shown.digits, hidden):
        say(f"    {line}")
    say(tr("Thumbprint, SHA-1, for tools that show nothing else:"))
    for line in _grouped(shown.thumbprint, hidden):
        say(f"    {line}")


def _groups(digits: str) -> list[str]:
    return [digits[at : at + _GROUP].upper() for at in range(0, len(digits), _GROUP)]


def _grouped(digits: str, hidden: int | None = None) -> list[str]:
    """Return a fingerprint in lines of eight groups, one of them hidden."""
    groups = [_HIDDEN if at == hidden else group for at, group in enumerate(_groups(digits))]
    return [
        " ".join(groups[at : at + _GROUPS_IN_LINE]) for at in range(0, len(groups), _GROUPS_IN_LINE)
    ]


def _compare(shown: "OfferedCertificate", hidden: int) -> None:
    """Ask for the hidden group, as only the PLC shows it.

    Raises:
        DeclinedError: Nobody is at a terminal, or what was typed is not that group.
    """
    if person_here() is not Person.TERMINAL:
        raise DeclinedError(
            tr("A person compares it at a terminal, and there is none."),
            remedy=tr(
                "Nothing was kept. Or compare it elsewhere, and add server_certificate to the "
                "cell file in an editor."
            ),
        )
    first = hidden * _GROUP + 1
    typed = asked_for_text(
        tr(
            "Look at the certificate in the PLC's own tool. Is all the rest the same? Then type "
            "what it shows in place of {hidden} (digits {first} to {last}):",
            hidden=_HIDDEN,
            first=first,
            last=first + _GROUP - 1,
        )
    )
    said = "".join(typed.split()).replace(":", "").upper()
    if said not in (_groups(shown.digits)[hidden], _groups(shown.thumbprint)[hidden]):
        raise DeclinedError(
            tr("That is not what this server's certificate has there."),
            remedy=tr(
                "Nothing was kept. If you read it right, another computer answers in the PLC's "
                "place: find out which."
            ),
        )
