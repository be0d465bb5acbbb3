"""A stop from outside: reach the controller, stop it, see it rest, leave.

Nothing stands before the Abort, Stop or 2003 frame: no journal, no lease, no question, and no
import that the frame does not need (design part 4, docs/decisions/0017). What is imported inside
the functions below is needed afterwards, or for one kind of controller only.
"""

from typing import TYPE_CHECKING, Final

from robolink.errors import (
    ConfigError,
    ConnectError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportError,
)
from robolink.messages import tr
from robolink.transport import LinkUrl, parse_url

if TYPE_CHECKING:
    from robolink.model import ControllerStatus, Secret
    from robolink.timing import Clock

_TRIES: Final = 3
"""A stop may be repeated: an answer that was lost, or another client's words over ours in a
mailbox, is no reason to leave the robot moving."""


def stop_now(
    url: str,
    *,
    password: "str | Secret | None" = None,
    timeout_s: float = 3.0,
    clock: "Clock | None" = None,
) -> "ControllerStatus":
    """Bring a controller to rest, whoever moves it, and return the state that shows it.

    On an EPSON controller Abort, then Stop; on a mailbox 2003, which holds the group until a
    reset. Nothing is recorded.

    Args:
        url: Which controller.
        password: An EPSON controller's remote password, if one is set.
        timeout_s: Longest wait for the connection, and for one answer.
        clock: Replaces the machine's clock; a simulator brings its own.

    Raises:
        ConfigError: The URL is wrong.
        ConnectError: It is not reached. Of an EPSON controller LoginUnansweredError: it serves
            another client, who alone can stop it from a computer.
        RejectedError: It takes no stop from here.
        OutcomeUnknownError: It was told to stop and does not come to rest.
        TransportError, RemoteProtocolError: Whether it stops is not known.
    """
    link = parse_url(url)
    kinds = {"epson": _stop_epson, "softmotion": _stop_group, "plc": _stop_map}
    if link.kind not in kinds:
        raise ConfigError(
            tr("robolink does not know controllers of the kind {kind!r}.", kind=link.kind),
            remedy=tr("Write for example epson+tcp://192.168.0.1:5000."),
        )
    given = password if isinstance(password, str) else password.reveal() if password else ""
    for tries_left in reversed(range(_TRIES)):
        try:
            return kinds[link.kind](link, given, timeout_s, clock)
        except (TransportError, RemoteProtocolError) as error:
            if isinstance(error, ConnectError) or not tries_left:
                raise
    raise AssertionError  # the last try returns or raises


def press_the_button(error: RobolinkError) -> RobolinkError:
    """Put in front of an error of a stop what a person has to do first."""
    error.remedy = " ".join(
        (tr("The stop is not confirmed: press the emergency stop."), error.remedy)
    ).rstrip()
    return error


def _stop_epson(
    link: LinkUrl, password: str, timeout_s: float, clock: "Clock | None"
) -> "ControllerStatus":
    from robolink.controllers.epson._stop_line import StopLine
    from robolink.transport import open_transport

    line = StopLine(open_transport(link, timeout_s=timeout_s, clock=clock), timeout_s=timeout_s)
    try:
        line.login(password)
        flags, code = line.stop()
        from robolink.controllers.epson._answers import status_from_flags

        line.leave(flags)
        return status_from_flags(flags, code)
    finally:
        line.close()


def _stop_group(
    link: LinkUrl, password: str, timeout_s: float, clock: "Clock | None"
) -> "ControllerStatus":
    del password  # a mailbox has none
    import secrets

    from robolink.controllers.softmotion._orders import Orders
    from robolink.controllers.softmotion._snapshots import Snapshots
    from robolink.controllers.softmotion._stopping import bring_group_to_rest
    from robolink.controllers.softmotion._wire import MailboxWire
    from robolink.transport import open_stop_link

    mailbox = open_stop_link(link, timeout_s=timeout_s, clock=clock)
    owner = 1 + secrets.randbelow(0xFFFF_FFFF)
    wire = MailboxWire(mailbox, owner=owner, timeout_s=timeout_s)
    try:
        snapshots = Snapshots(wire)
        now = bring_group_to_rest(
            Orders(wire, snapshots), snapshots, wire.clock, controller=wire.identity
        )
        from robolink.controllers.softmotion._condition import status_of

        return status_of(now)
    finally:
        wire.close()


def _stop_map(
    link: LinkUrl, password: str, timeout_s: float, clock: "Clock | None"
) -> "ControllerStatus":
    del password, timeout_s, clock
    raise RejectedError(
        tr("A PLC with a register map is neither moved nor stopped by robolink."),
        remedy=tr("Do it at the machine."),
        controller=link.identity,
        request="Stop",
    )
