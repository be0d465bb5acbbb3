"""A stop from outside: reach the controller, stop it, confirm that, leave.

Nothing stands before the Abort, Stop or 2003 frame: no journal, no lease, no question, and no
import that the frame does not need (docs/decisions/0017-a-stop-has-its-own-way-to-the-wire.md).
What is imported inside the functions below is needed afterwards, or for one kind of controller
only.
"""

from typing import TYPE_CHECKING

from robolink import runtime
from robolink.controllers.stop_attempts import StopMeans, Stoppable, attempted
from robolink.errors import RejectedError, TransportClosedError
from robolink.messages import tr
from robolink.transport import LinkUrl, parse_url

if TYPE_CHECKING:
    from collections.abc import Callable

    from robolink.controllers.stop_attempts import StopWay
    from robolink.model import ControllerStatus, Secret
    from robolink.timing import Clock
    from robolink.transport import TraceSink


def stop_now(
    url: str | LinkUrl | Stoppable,
    *,
    password: "str | Secret | None" = None,
    timeout_s: float = 3.0,
    login_s: float | None = None,
    clock: "Clock | None" = None,
    trace: "TraceSink | None" = None,
    met: "Callable[[str], None] | None" = None,
) -> "ControllerStatus":
    """Stop a controller, whatever moves it, and return the state that confirms it.

    On an EPSON controller Abort, then Stop; on a mailbox 2003, which holds the group until a
    reset. Nothing is recorded.

    Args:
        url: Which controller. One that is open already is stopped over the link that it has.
        password: An EPSON controller's remote password, if one is set, or that of an OPC UA user.
        timeout_s: Longest wait for the connection, and for one answer.
        login_s: Longest wait for an EPSON controller's answer to the login, which it gives to one
            client; ``timeout_s`` if that is shorter, or this is not given.
        clock: Replaces the machine's clock; a simulator brings its own.
        trace: Called with (time in ns, "sent" or "received", bytes) for all traffic but a
            password; see :func:`robolink.connect`.
        met: Called with the name under which the controller is on record, once it stands and
            where it says of itself who it is.

    Raises:
        ConfigError: The URL is wrong.
        ConnectError: It is not reached. Of an EPSON controller LoginUnansweredError: it serves
            another client, who alone can stop it from a computer.
        RejectedError: It takes no stop from here.
        OutcomeUnknownError: It was told to stop and does not come to rest.
        TransportError, RemoteProtocolError: Whether it stops is not known.

    Example:
        >>> from robolink.controllers import stop_now
        >>> stop_now("epson+sim://stop-example").state.value
        'ready'
    """
    if not isinstance(url, (str, LinkUrl)):
        return _stopped(url)
    link = parse_url(url) if isinstance(url, str) else url
    given = password if isinstance(password, str) else password.reveal() if password else ""
    patience_s = timeout_s if login_s is None else min(login_s, timeout_s)
    means = StopMeans(given, timeout_s, patience_s, clock, met, runtime.random_number(32))
    return attempted(_way_of(link.kind), link, means, trace=trace)


def _stopped(controller: Stoppable) -> "ControllerStatus":
    """Stop a controller that is open, and return the state that confirms it.

    Where its session was over, the stop went out over a new link, and what that showed was noted.
    """
    ledger = getattr(controller, "ledger", None)
    before = ledger and ledger.seen
    controller.stop()
    try:
        return controller.status()
    except TransportClosedError:
        seen: tuple[ControllerStatus, int] | None = ledger and ledger.seen
        if seen is None or seen is before:
            raise
        return seen[0]


def _way_of(kind: str) -> "StopWay":
    """Return how a controller of this kind is stopped; no more is loaded than that needs."""
    if kind == "epson":
        from robolink.controllers.epson.rest import stop_over_new_link

        return stop_over_new_link
    if kind == "softmotion":
        from robolink.controllers.softmotion.rest import stop_over_new_link as stop_group

        return stop_group
    return _stop_map if kind == "plc" else _stop_other


def stop_requests(url: str) -> tuple[str, ...]:
    """Return what a stop sends, for display; nothing is opened.

    Raises:
        ConfigError: The URL is wrong.
    """
    kind = parse_url(url).kind
    if kind == "epson":
        from robolink.controllers.epson.session import as_sent
        from robolink.protocols.epson_text import Request

        return tuple(as_sent(Request(name)) for name in ("Abort", "Stop"))
    if kind == "softmotion":
        from robolink.controllers.softmotion.answers import describe
        from robolink.protocols.mailbox import Command, Opcode

        return (describe(Command(0, Opcode.STOP)),)
    return ()


def _stop_other(link: LinkUrl, means: StopMeans) -> "ControllerStatus":
    """Stop a controller of a kind that another package brings, by the means that it offers."""
    from robolink.controllers.registry import ConnectionTerms, opened
    from robolink.journal import open_log, signature_here
    from robolink.model import Secret
    from robolink.version import VERSION

    signature = signature_here(VERSION)
    terms = ConnectionTerms(
        signature,
        password=Secret(means.password) if means.password else None,
        timeout_s=means.timeout_s,
        clock=means.clock,
        # The journal is opened only when there is something to record.
        outcomes=open_log(link.address, durable=True, signature=signature, glance=True),
    )
    with opened(link, terms) as controller:
        controller.stop()
        return controller.status()


def _stop_map(link: LinkUrl, means: StopMeans) -> "ControllerStatus":
    del means
    raise RejectedError(
        tr("robolink neither moves nor stops a PLC with a map."),
        remedy=tr("Do it at the machine."),
        controller=link.identity,
        request="Stop",
    )
