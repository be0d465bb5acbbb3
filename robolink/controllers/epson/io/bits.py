"""Inputs, outputs and memory bits (docs/reference/epson.md 1.2, notes 2 and 5)."""

import re
from operator import eq
from typing import Final

from robolink.controllers.epson.io.values import Change, ValueSetter
from robolink.controllers.epson.link.link import EpsonLink
from robolink.errors import ConfigError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import ValueReceipt
from robolink.protocols import spel
from robolink.protocols.epson_text import Reply, Request

_HIGHEST: Final = 0xFFFF
"""Two bytes carry a bit or port number (docs/reference/epson.md 2.2); which exist depends on the
hardware."""

_BIT: Final = re.compile("[01]")
_BYTE: Final = re.compile("[0-9A-Fa-f]{2}")
_WORD: Final = re.compile("[0-9A-Fa-f]{4}")


class EpsonIo:
    """Bits, counted from 0; a byte is eight of them, a word sixteen, lowest bit first.

    Reading inputs and memory is legal at any time, while production runs and for a client
    that may only monitor. Outputs are read through Execute, because Remote Ethernet has no
    request for it, so they are read and switched only while Execute is available.

    Every method raises ConfigError for a number that cannot exist, and RejectedError for one
    that this controller does not have.
    """

    def __init__(self, link: EpsonLink) -> None:
        self._session = link.session
        self._window = link.window
        self._setter = ValueSetter(link)

    def read_input(self, bit: int) -> bool:
        """Read one input."""
        return self._number("GetIO", bit, _BIT) == 1

    def read_input_byte(self, port: int) -> int:
        """Read inputs 8 x ``port`` and the seven after it, as 0 to 255."""
        return self._number("GetIOByte", port, _BYTE)

    def read_input_word(self, port: int) -> int:
        """Read inputs 16 x ``port`` and the fifteen after it, as 0 to 65535."""
        return self._number("GetIOWord", port, _WORD)

    def read_memory(self, bit: int) -> bool:
        """Read one memory bit."""
        return self._number("GetMemIO", bit, _BIT) == 1

    def read_memory_byte(self, port: int) -> int:
        """Read memory bits 8 x ``port`` and the seven after it, as 0 to 255."""
        return self._number("GetMemIOByte", port, _BYTE)

    def read_memory_word(self, port: int) -> int:
        """Read memory bits 16 x ``port`` and the fifteen after it, as 0 to 65535."""
        return self._number("GetMemIOWord", port, _WORD)

    def read_output(self, bit: int) -> bool:
        """Read one output, through Execute.

        Raises:
            NotReadyError: Execute is not available now.
        """
        query = spel.print_output(_checked(bit))
        self._window.require_ready(query)
        return spel.parse_integer(self._window.printed(query)) != 0

    def set_output(self, bit: int, on: bool) -> ValueReceipt[bool]:
        """Switch one output and read it back.

        Raises:
            NotReadyError: The state forbids it.
            ReadBackError: It is not as asked: a program, or an output assigned to a remote
                function.
            OutcomeUnknownError: No answer came.
        """
        return self._setter.carry_out(self._output(bit, on))

    def preview_output(self, bit: int, on: bool) -> tuple[str, ...]:
        """Return what :meth:`set_output` would send besides its reads; reads only."""
        return self._setter.preview(self._output(bit, on))

    def set_memory(self, bit: int, on: bool) -> ValueReceipt[bool]:
        """Switch one memory bit and read it back; raises as :meth:`set_output`."""
        return self._setter.carry_out(self._memory(bit, on))

    def preview_memory(self, bit: int, on: bool) -> tuple[str, ...]:
        """Return what :meth:`set_memory` would send besides its reads; reads only."""
        return self._setter.preview(self._memory(bit, on))

    def _output(self, bit: int, on: bool) -> Change[bool]:
        request = _switch("SetIO", bit, on)
        return Change(request, ("output", str(bit)), on, lambda: self.read_output(bit), eq)

    def _memory(self, bit: int, on: bool) -> Change[bool]:
        request = _switch("SetMemIO", bit, on)
        return Change(request, ("memory", str(bit)), on, lambda: self.read_memory(bit), eq)

    def _number(self, name: str, at: int, form: re.Pattern[str]) -> int:
        reply = self._session.exchange(name, str(_checked(at)))
        if len(reply.fields) == 1 and form.fullmatch(reply.fields[0]):
            return int(reply.fields[0], 16)
        raise self._unreadable(name, reply)

    def _unreadable(self, name: str, reply: Reply) -> RemoteProtocolError:
        return RemoteProtocolError(
            tr("The controller answered {name} with {answer!r}.", name=name, answer=reply.fields),
            remedy=tr("Keep this text and report it with the controller's firmware version."),
            controller=self._session.identity,
            request=name,
            raw=",".join(reply.fields).encode("utf-8", "backslashreplace"),
        )


def _switch(name: str, bit: int, on: bool) -> Request:
    return Request(name, (str(_checked(bit)), str(int(on))))


def _checked(number: int) -> int:
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number <= _HIGHEST:
        raise ConfigError(
            tr("There is no bit or port {number!r}.", number=number),
            remedy=tr("Bits and ports are counted from 0."),
        )
    return number
