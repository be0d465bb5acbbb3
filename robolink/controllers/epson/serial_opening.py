"""Before the first request on a serial line: its dialect, silence, and EOT.

A serial line outlives every session on it. What an earlier one left behind, the late answer to a
question whose time-out ended it above all, would be taken for the answer to a new one. So the line
is listened to until it is silent, turned on, and listened to once more: whether the controller
answers EOT is not known, and what it answers is not needed (docs/reference/epson.md 2.1). What
comes later than that is noticed by its letter, or because nobody asked.
"""

from dataclasses import replace
from typing import Final, Literal

from robolink.errors import RemoteProtocolError, TransportBrokenError
from robolink.messages import tr
from robolink.protocols import Role
from robolink.protocols.epson_binary import Dialect, EpsonBinaryCodec, Letters, NakCode, Numbers
from robolink.protocols.epson_text import Opening
from robolink.timing import Deadline
from robolink.transport import LinkUrl, Transport, UrlOptions

_QUIET_S: Final = 0.1
"""Shortest pause that counts as silence, in s: USB adapters and device servers deliver data in
portions, tens of milliseconds apart."""

_LONGEST_S: Final = 3.0
_MOST_BYTES: Final = 65536
_SEND_S: Final = 1.0

_DIALECT_OPTIONS: Final = ("numbers", "nak_code", "letters", "word_port_bytes")
_WORD_PORTS: Final[dict[str, Literal[1, 2]]] = {"1": 1, "2": 2}


def take_dialect(url: LinkUrl) -> tuple[Dialect, LinkUrl]:
    """Return what a URL says about the frames, and the URL without it.

    Raises:
        ConfigError: An option cannot be that.
    """
    told = {name: text for name, text in url.options.items() if name in _DIALECT_OPTIONS}
    options = UrlOptions(replace(url, options=told))
    dialect = Dialect(
        numbers=options.take_choice("numbers", Numbers.BINARY, {n.value: n for n in Numbers}),
        nak_code=options.take_choice("nak_code", NakCode.DIGITS, {n.value: n for n in NakCode}),
        letters=options.take_choice("letters", Letters.DOCUMENTED, {n.value: n for n in Letters}),
        word_port_bytes=options.take_choice("word_port_bytes", "1", _WORD_PORTS),
    )
    rest = {name: text for name, text in url.options.items() if name not in told}
    return dialect, replace(url, options=rest)


def turn_on(transport: Transport) -> int:
    """Wait until the line is silent, turn Remote RS232 on, and wait for silence again.

    Returns:
        How many bytes were there that nobody had asked for.

    Raises:
        RemoteProtocolError: It does not fall silent.
        TransportError: The line is gone.
    """
    found = _silence(transport)
    opening = EpsonBinaryCodec(Role.HOST).send(Opening())
    transport.send(opening, deadline=Deadline.after(transport.clock, _SEND_S))
    return found + _silence(transport)


def _silence(transport: Transport) -> int:
    """Read until nothing comes for a while; return how much came."""
    clock, found = transport.clock, 0
    deadline = Deadline.after(clock, _LONGEST_S)
    while transport.wait_readable(deadline=Deadline.after(clock, _QUIET_S)):
        data = transport.receive_waiting()
        if data == b"":
            raise TransportBrokenError(
                tr("{identity} closed the connection.", identity=transport.identity),
                remedy=tr("Check the adapter or the device server, then connect again."),
                controller=transport.identity,
            )
        found += len(data or b"")
        if found > _MOST_BYTES or deadline.expired:
            raise RemoteProtocolError(
                tr("The line {identity} is never quiet.", identity=transport.identity),
                remedy=tr(
                    "Check the baud rate and parity, that no other program uses the line, "
                    "and that the control device is Remote RS232."
                ),
                controller=transport.identity,
            )
    return found
