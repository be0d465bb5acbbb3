"""The errors of a simulator's clients when no simulator answers."""

from robolink.errors import (
    ConnectError,
    RemoteProtocolError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.messages import tr


def nobody_listens(url: str) -> ConnectError:
    """Return the error for a port that accepts no connection.

    Args:
        url: Where, without its token; so in all of these.
    """
    return ConnectError(
        tr("No simulator listens on {url}.", url=url),
        remedy=tr("Start one with 'robolink sim epson' or 'robolink sim softmotion'."),
    )


def is_gone(url: str) -> TransportBrokenError:
    """Return the error for a simulator that answered before and accepts no connection any more."""
    return TransportBrokenError(
        tr("The simulator at {url} is gone.", url=url),
        remedy=tr("Start it again."),
    )


def ended_unanswered(url: str) -> TransportBrokenError:
    """Return the error for a connection that ended before the answer was whole."""
    return TransportBrokenError(
        tr("The connection to {url} ended without an answer.", url=url),
        remedy=tr("Look whether it was done before you repeat it. Is the simulator running?"),
    )


def is_silent(url: str, timeout_s: float) -> TransportTimeoutError:
    """Return the error for an answer that did not come in time."""
    return TransportTimeoutError(
        tr("No answer came from {url} within {seconds:g} s.", url=url, seconds=timeout_s),
        remedy=tr(
            "If a simulator listens there, look whether it was done before you repeat it; "
            "otherwise take the URL that 'robolink sim' prints."
        ),
    )


def is_no_simulator(url: str) -> RemoteProtocolError:
    """Return the error for an answer that no simulator gives."""
    return RemoteProtocolError(
        tr("{url} answers, but is no robolink simulator.", url=url),
        remedy=tr("Give the URL of a simulator; 'robolink sim' prints it."),
    )
