"""The line to a controller: its bytes, and the frames in which both ends speak.

Over TCP, and in process, that is Remote Ethernet; on a serial line Remote RS232, whose frames are
loaded only there, since a stop is timed (docs/decisions/0017).
What an unanswered or a refused login means stands here too: a stop needs nothing else of the
answers.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from robolink.errors import LoginRefusedError, LoginUnansweredError, RejectedError
from robolink.messages import tr
from robolink.protocols import Role
from robolink.protocols.epson_text import EpsonTextCodec, ErrorCode, Event
from robolink.timing import Clock
from robolink.transport import LinkUrl, TraceSink, TracingTransport, Transport, open_transport
from robolink.ways import Way, way

if TYPE_CHECKING:
    from robolink.protocols.epson_binary import Dialect


SERIAL: Final = "serial"
"""The medium of Remote RS232."""


class LineCodec(Protocol):
    """What cuts the bytes of a line into events, and makes bytes of them."""

    @property
    def bytes_held(self) -> bytes:
        """What has arrived and is part of no event yet."""

    def carries(self, name: str, *parameters: str) -> bool:
        """Whether a command can be sent, with these parameters where any are given."""

    def send(self, event: Event) -> bytes:
        """Return the bytes of one message."""

    def receive_data(self, data: bytes) -> None:
        """Take what was received; ``b""`` means that the far side closed."""

    def next_event(self) -> object:
        """Return the next event, or ``NEED_DATA``."""


@dataclass(frozen=True, slots=True)
class EpsonLine:
    """An open line.

    Attributes:
        transport: Moves the bytes.
        codec: Frames them.
        outlives_sessions: Whether bytes of an earlier session may still come.
    """

    transport: Transport
    codec: LineCodec
    outlives_sessions: bool = False

    def require_carried(self, name: str, *parameters: str) -> None:
        """Refuse a request that this line has no frame for, as older firmware would.

        Raises:
            RejectedError: With code 11, unknown command. Nothing was sent.
        """
        if self.codec.carries(name, *parameters):
            return
        if self.codec.carries(name):
            what = tr("{name} cannot read several values over Remote RS232.", name=name)
        else:
            what = tr("Remote RS232 has no {name}, or no manual prints its letter.", name=name)
        raise RejectedError(
            what,
            code=ErrorCode.UNKNOWN_COMMAND,
            remedy=tr("Nothing was sent. Use Remote Ethernet for it (docs/remote-rs232.md)."),
            controller=self.transport.identity,
            request=name,
        )


def text_line(transport: Transport) -> EpsonLine:
    """Return a line of Remote Ethernet over any transport."""
    return EpsonLine(transport, EpsonTextCodec(Role.HOST))


def open_line(
    url: str | LinkUrl,
    *,
    timeout_s: float,
    clock: Clock | None = None,
    traces: tuple[TraceSink, ...] = (),
) -> EpsonLine:
    """Open the line that a URL names; a serial one is silenced and turned on.

    Args:
        url: The controller. On a serial line it may say what the manuals leave open; see
            :class:`robolink.protocols.epson_binary.Dialect`.
        timeout_s: Longest wait for the connection.
        clock: Replaces the machine's clock.
        traces: Each is told of all traffic but the login.

    Raises:
        ConfigError: The URL or an option is wrong.
        ConnectError: No connection could be made.
        RemoteProtocolError: The serial line does not fall silent.
    """
    from robolink.transport import parse_url

    link = parse_url(url) if isinstance(url, str) else url
    dialect = None
    if link.medium == SERIAL:
        from robolink.controllers.epson.serial_opening import take_dialect

        dialect, link = take_dialect(link)
    transport: Transport = open_transport(link, timeout_s=timeout_s, clock=clock)
    for trace in traces:
        transport = TracingTransport(transport, trace)
    if dialect is None:
        return text_line(transport)
    return _turned_on(transport, dialect)


def _turned_on(transport: Transport, dialect: "Dialect") -> EpsonLine:
    from robolink.controllers.epson.serial_opening import turn_on
    from robolink.protocols.epson_binary import EpsonBinaryCodec

    try:
        turn_on(transport)
    except BaseException:
        transport.close()
        raise
    codec = EpsonBinaryCodec(Role.HOST, dialect)
    return EpsonLine(transport, codec, outlives_sessions=True)


PASSWORD_REFUSALS: Final = (13, 98)
"""The password is wrong, or one is demanded (docs/reference/epson.md 1.6)."""


def unanswered(controller: str) -> LoginUnansweredError:
    """Return the error for a controller that is reached and does not answer the login."""
    return LoginUnansweredError(
        tr("{identity} can be reached, but does not answer the login.", identity=controller),
        remedy=tr(
            "Only one client may be logged in: close the other one. If there is none, "
            "check that this port is the controller's Remote Ethernet port."
        ),
        controller=controller,
        request="Login",
    )


def refused(code: int, controller: str) -> LoginRefusedError:
    """Return the error for a password that the controller does not take."""
    return LoginRefusedError(
        tr("The controller refused the login (code {code}).", code=code),
        code=code,
        remedy=tr(
            "Give the password that is set on the controller's Remote Ethernet page: "
            "{password}. No second attempt was made.",
            password=way(Way.PASSWORD),
        ),
        controller=controller,
        request="Login",
    )
