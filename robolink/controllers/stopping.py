"""A stop from outside: reach the controller, stop it, confirm that, leave.

Nothing stands before the Abort, Stop or 2003 frame: no journal, no lease, no question, and no
import that the frame does not need (docs/decisions/0017-a-stop-has-its-own-way-to-the-wire.md).
What is imported inside the functions below is needed afterwards, or for one kind of controller
only.
"""

from contextlib import suppress
from typing import TYPE_CHECKING, Final, NamedTuple

from robolink import runtime
from robolink.errors import (
    Concerning,
    ConnectError,
    LoginRefusedError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportError,
)
from robolink.messages import tr
from robolink.package_log import PackageLog
from robolink.transport import LinkUrl, parse_url, told_to

if TYPE_CHECKING:
    from collections.abc import Callable

    from robolink.controllers.epson.line import EpsonConversation
    from robolink.controllers.softmotion.wire import MailboxWire
    from robolink.model import Controller, ControllerStatus, Secret
    from robolink.timing import Clock
    from robolink.transport import TraceSink

_LOG: Final = PackageLog(__package__)

_TRIES: Final = 3
"""Number of attempts to stop. A stop may be repeated: after a lost answer, or if another client
overwrote it in a mailbox, the robot must not go on moving."""

_REFUSED_NS: Final = 1_000_000_000
"""Time in ns for which a mailbox is asked again that refuses to be looked at."""

_AGAIN_S: Final = 0.04
"""Time between two such attempts, in s."""


def stop_now(
    url: "str | Controller",
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
    if not isinstance(url, str):
        url.stop()
        return url.status()
    link = parse_url(url)
    kinds = {"epson": _stop_epson, "softmotion": _stop_group, "plc": _stop_map}
    stop = kinds.get(link.kind, _stop_other)
    given = password if isinstance(password, str) else password.reveal() if password else ""
    patience_s = timeout_s if login_s is None else min(login_s, timeout_s)
    means = _Means(given, timeout_s, patience_s, clock, met, runtime.random_number(32))
    tries_left = _TRIES
    refused_until_ns = runtime.monotonic_ns() + _REFUSED_NS
    while True:
        try:
            with told_to(trace):
                status = stop(link, means)
            _LOG.decided("stop acknowledged: it rests", controller=link.identity, request="stop")
            return status
        except (TransportError, RemoteProtocolError) as error:
            tries_left -= 1
            if isinstance(error, ConnectError) or not tries_left:
                raise
        except RejectedError as error:
            # A PLC that is busy for a moment refuses a look. A password is never tried again.
            by_mailbox = link.kind == "softmotion" and not isinstance(error, LoginRefusedError)
            if not by_mailbox or runtime.monotonic_ns() >= refused_until_ns:
                raise
            runtime.sleep(_AGAIN_S)


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


class _Means(NamedTuple):
    """The means to reach a controller; see :func:`stop_now`."""

    password: str
    timeout_s: float
    login_s: float
    clock: "Clock | None"
    met: "Callable[[str], None] | None"
    owner: int
    """Token of all attempts in a mailbox. With a new token, an attempt would be superseded by the
    one before, whose answer was lost and whose command is acknowledged only now."""


def _stop_epson(link: LinkUrl, means: _Means) -> "ControllerStatus":
    from robolink.controllers.epson.line import EpsonConversation, open_line
    from robolink.controllers.epson.rest import bring_to_rest

    opened = open_line(link, timeout_s=means.timeout_s, clock=means.clock)
    talk = EpsonConversation(opened, timeout_s=means.login_s)
    try:
        with Concerning(talk.identity):
            talk.login(means.password)
            talk.timeout_s = means.timeout_s
            now = bring_to_rest(talk.exchange, talk.clock, controller=talk.identity)
            from robolink.controllers.epson.answers import may_log_out, status_from_flags

            status = status_from_flags(*now)
            if means.met is not None:
                _tell_who(talk, means.met)
            if may_log_out(status):
                with suppress(RobolinkError):  # it has stopped: a failure here is harmless
                    talk.exchange("Logout")
            return status
    finally:
        talk.close()


def _tell_who(talk: "EpsonConversation", met: "Callable[[str], None]") -> None:
    """Say which controller has stopped, if this firmware reports it without an Execute."""
    from robolink.controllers.epson.link import name_from

    def asked() -> str:
        number = talk.exchange("GetContNo").fields
        robots = talk.exchange("GetRobotSerial", "0").fields
        return name_from([text.strip() for text in number], [text.strip() for text in robots])

    _tell_what_is_said_twice(asked, met)


def _stop_group(link: LinkUrl, means: _Means) -> "ControllerStatus":
    from robolink.controllers.softmotion.commands import CommandSender
    from robolink.controllers.softmotion.snapshots import Snapshots
    from robolink.controllers.softmotion.wire import MailboxWire
    from robolink.transport import open_mailbox_link

    password = None
    if means.password:
        from robolink.model import Secret  # here, because no other mailbox has a login

        password = Secret(means.password)
    mailbox = open_mailbox_link(
        link, timeout_s=means.timeout_s, clock=means.clock, password=password, stopping=True
    )
    wire = MailboxWire(mailbox, owner=means.owner, timeout_s=means.timeout_s)
    try:
        with Concerning(wire.identity):
            now = CommandSender(wire, Snapshots(wire)).bring_to_rest()
        from robolink.controllers.softmotion.condition import status_of

        if means.met is not None:
            _tell_which(wire, means.met)
        return status_of(now)
    finally:
        wire.close()


def _tell_which(wire: "MailboxWire", met: "Callable[[str], None]") -> None:
    """Say which PLC has stopped, if its program has a number."""
    from robolink.controllers.softmotion.mailbox import identity_of, read_device_id

    def asked() -> str:
        device_id = read_device_id(wire)
        return "" if device_id is None else identity_of(wire, device_id).name

    _tell_what_is_said_twice(asked, met)


def _tell_what_is_said_twice(asked: "Callable[[], str]", met: "Callable[[str], None]") -> None:
    """Ask twice which controller has stopped: an answer that was damaged names another one.

    The note of a stop that names another one holds nothing back here; one without a name does.
    """
    with suppress(RobolinkError):
        if (name := asked()) and name == asked():
            met(name)


def _stop_other(link: LinkUrl, means: _Means) -> "ControllerStatus":
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


def _stop_map(link: LinkUrl, means: _Means) -> "ControllerStatus":
    del means
    raise RejectedError(
        tr("robolink neither moves nor stops a PLC with a map."),
        remedy=tr("Do it at the machine."),
        controller=link.identity,
        request="Stop",
    )
