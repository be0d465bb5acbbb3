"""Who is at a serial line: asked once, without logging in (docs/reference/epson.md 2.1).

The line is listened to first, and nothing is sent into a conversation of others. Then Remote RS232
is turned on, and the status is asked for: five bytes that change and move nothing. A controller
refuses before a login, by a frame that only it sends.
"""

from contextlib import closing
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from robolink.controllers.epson.line import SERIAL
from robolink.controllers.epson.serial_opening import take_dialect
from robolink.errors import ConfigError, RemoteProtocolError
from robolink.messages import tr
from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_binary import Dialect, EpsonBinaryCodec
from robolink.protocols.epson_text import Opening, Refusal, Reply, Request
from robolink.timing import Clock, Deadline, SystemClock
from robolink.transport import LinkUrl, Transport, open_transport, parse_url

_STATUS: Final = "GetStatus"
_LISTENED_S: Final = 0.3
_MOST_BYTES: Final = 256
_SEND_S: Final = 1.0


class AtTheLine(StrEnum):
    """Who seems to be at a line."""

    CONTROLLER = "controller"
    OTHER = "other"
    TALKING = "talking"
    NOBODY = "nobody"


@dataclass(frozen=True, slots=True)
class LineProbe:
    """What a look at a serial line has shown.

    Attributes:
        line: Names the line.
        found: Who seems to be there: a controller with Remote RS232, something else, somebody who
            talks unasked, or nobody.
        sent: Every byte that was sent.
        received: The first bytes that came.
    """

    line: str
    found: AtTheLine
    sent: bytes
    received: bytes


def probe_line(url: str, *, timeout_s: float = 1.0, clock: Clock | None = None) -> LineProbe:
    """Ask who is at a serial line; nobody logs in.

    Args:
        url: The line, as a controller there would be named, with its baud rate.
        timeout_s: Longest wait for an answer, in seconds.
        clock: Replaces the machine's clock.

    Raises:
        ConfigError: The URL is wrong, or names no serial line of an EPSON controller.
        ConnectError: The port is missing, forbidden, or used by another program.
        TransportError: The line is gone.

    Example:
        >>> from robolink.controllers.epson.verify import probe_line
        >>> from robolink_simulators.epson import EpsonSimulator
        >>> from robolink_simulators.hosting.streams.epson import serve_serial
        >>> with serve_serial(EpsonSimulator(seed=1)) as host:  # a pseudo terminal
        ...     probe_line(host.url, timeout_s=1).found.value
        'controller'
    """
    link, clock = parse_url(url), clock or SystemClock()
    dialect, place = require_line(link)
    with closing(open_transport(place, timeout_s=timeout_s, clock=clock)) as transport:
        heard = _heard(transport, _LISTENED_S)
        if heard:
            return LineProbe(link.identity, AtTheLine.TALKING, b"", heard)
        return _asked(transport, dialect, link.identity, timeout_s)


def require_line(link: LinkUrl) -> tuple[Dialect, LinkUrl]:
    """Return the dialect of an EPSON serial line, and the line itself; opens nothing.

    Raises:
        ConfigError: It is none, or an option cannot be that.
    """
    if (link.kind, link.medium) != ("epson", SERIAL):
        raise ConfigError(
            tr("{identity} is not a serial line of an EPSON controller.", identity=link.identity),
            remedy=tr("Write for example {scheme}:///dev/ttyUSB0.", scheme="epson+serial"),
        )
    return take_dialect(link)


def _asked(transport: Transport, dialect: Dialect, line: str, timeout_s: float) -> LineProbe:
    codec = EpsonBinaryCodec(Role.HOST, dialect)
    opening = codec.send(Opening())
    transport.send(opening, deadline=Deadline.after(transport.clock, _SEND_S))
    # It is unknown if EOT is answered; such an answer does not answer the question.
    received = _heard(transport, _LISTENED_S)
    question = codec.send(Request(_STATUS))
    transport.send(question, deadline=Deadline.after(transport.clock, _SEND_S))
    deadline, found = Deadline.after(transport.clock, timeout_s), AtTheLine.NOBODY
    while found is not AtTheLine.CONTROLLER and len(received) < _MOST_BYTES:
        if not transport.wait_readable(deadline=deadline):
            break
        data = transport.receive_waiting()
        if not data:
            break
        received += data
        found = _judged(codec, data)
        if found is AtTheLine.OTHER:
            break
    if received and found is AtTheLine.NOBODY:
        found = AtTheLine.OTHER
    return LineProbe(line, found, opening + question, received[:_MOST_BYTES])


def _judged(codec: EpsonBinaryCodec, data: bytes) -> AtTheLine:
    """Return whose the bytes are; nobody's while they are no whole frame."""
    try:
        codec.receive_data(data)
        event = codec.next_event()
    except RemoteProtocolError:
        return AtTheLine.OTHER
    if event is NEED_DATA:
        return AtTheLine.NOBODY
    right = isinstance(event, (Reply, Refusal)) and event.name == _STATUS
    return AtTheLine.CONTROLLER if right else AtTheLine.OTHER


def _heard(transport: Transport, seconds: float) -> bytes:
    """Return what comes within some time, up to the first bytes of it."""
    heard, deadline = b"", Deadline.after(transport.clock, seconds)
    while len(heard) < _MOST_BYTES and transport.wait_readable(deadline=deadline):
        data = transport.receive_waiting()
        if not data:
            break
        heard += data
    return heard
