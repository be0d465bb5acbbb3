"""Values that a request of their own sets: outputs, memory bits, variables.

Class SET of docs/reference/rules.md 1: nothing is sent when the value is there already; a durable
marker stands before the request leaves; the request is sent once; the value is read back. Ctrl-C
waits for the end of that.

Inputs, outputs and memory bits (docs/reference/epson.md 1.2, notes 2 and 5).

Global Preserve variables.

Source: docs/reference/epson.md 1.2 note 4; ranges: docs/reference/spel.md 2.
"""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from decimal import Decimal
from operator import eq
from typing import Final

from robolink.controllers.driver_link import DriverPart, MarkedCommand
from robolink.controllers.epson.link import EpsonLink
from robolink.controllers.epson.session import as_sent
from robolink.errors import ConfigError, ReadBackError, RejectedError, RemoteProtocolError
from robolink.messages import known_names, tr
from robolink.model import Marker, NewEntry, Value, ValueReceipt, ValueT
from robolink.protocols import spel
from robolink.protocols.epson_text import Reply, Request, VariableType


class ValueChange(MarkedCommand[ValueT]):
    """One value to set.

    Args:
        link: The controller.
        request: What sets it.
        item: What it is, in plain values, for whoever settles a doubt later.
        requested: The new value.
        read: Reads the value that is there.
        same: Tells whether two values are equal for this controller.
    """

    def __init__(
        self,
        link: EpsonLink,
        request: Request,
        item: tuple[str, ...],
        requested: ValueT,
        read: Callable[[], ValueT],
        same: Callable[[ValueT, ValueT], bool],
    ) -> None:
        super().__init__(as_sent(request))
        self._link = link
        self._sent = request
        self._item = item
        self._requested = requested
        self._read = read
        self._same = same

    def preview(self) -> tuple[str, ...]:
        """Return the requests that :meth:`carry_out` would send besides its reads."""
        self._link.window.require_ready(self.request)
        return () if self._same(self.read(), self._requested) else (self.request,)

    def carry_out(self) -> ValueReceipt[ValueT]:
        """Set the value and confirm it.

        Raises:
            NotReadyError: The state forbids it, monitoring only included.
            RejectedError: The controller refused; nothing was set.
            ReadBackError: Another value is there afterwards.
            OutcomeUnknownError: No answer came; motion is blocked until ``recover``.
        """
        request, requested = self.request, self._requested
        with self._link.lock.held(request):
            self._link.window.require_ready(request)
            self._before = before = self.read()
            if self._same(before, requested):
                return ValueReceipt(request, before, requested, before, skipped=True)
            found = self._link.carry_out(self)
        if not self._same(found, requested):
            raise ReadBackError(
                tr(
                    "{request} was accepted, but reads back as {found!r}, not {requested!r}.",
                    request=request,
                    found=found,
                    requested=requested,
                ),
                remedy=tr("robolink did not repeat it. Find what else sets it."),
                request=request,
            )
        return ValueReceipt(request, before, requested, found, skipped=False)

    @property
    def details(self) -> Mapping[str, object]:
        """What it is, the old value and the new one."""
        return {"item": list(self._item), "before": self._before, "requested": self._requested}

    def send(self) -> None:
        """Send the request."""
        self._link.session.exchange(self._sent.name, *self._sent.parameters)

    def read(self) -> ValueT:
        """Read the value that is there."""
        return self._read()

    def refusal(self, marker: Marker, error: RejectedError) -> Iterable[NewEntry]:  # noqa: ARG002 - see below
        """Record nothing: the old value is there."""
        return ()


_HIGHEST: Final = 0xFFFF
"""Highest bit or port number that two bytes hold (docs/reference/epson.md 2.2); the hardware
decides which exist."""

_BIT: Final = re.compile("[01]")
_BYTE: Final = re.compile("[0-9A-Fa-f]{2}")
_WORD: Final = re.compile("[0-9A-Fa-f]{4}")


class EpsonIo(DriverPart):
    """Bits, counted from 0; a byte is eight of them, a word sixteen, lowest bit first.

    Reading inputs and memory is legal at any time, while production runs and for a client
    that may only monitor. Outputs are read through Execute, because Remote Ethernet has no
    request for it, so they are read and switched only while Execute is available.

    Every method raises ConfigError for a number that cannot exist, and RejectedError for one
    that this controller does not have.
    """

    def __init__(self, link: EpsonLink) -> None:
        super().__init__(link)
        self._link = link
        self._session = link.session
        self._window = link.window

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
        return self._output(bit, on).carry_out()

    def preview_output(self, bit: int, on: bool) -> tuple[str, ...]:
        """Return what :meth:`set_output` would send besides its reads; reads only."""
        return self._output(bit, on).preview()

    def set_memory(self, bit: int, on: bool) -> ValueReceipt[bool]:
        """Switch one memory bit and read it back; raises as :meth:`set_output`."""
        return self._memory(bit, on).carry_out()

    def preview_memory(self, bit: int, on: bool) -> tuple[str, ...]:
        """Return what :meth:`set_memory` would send besides its reads; reads only."""
        return self._memory(bit, on).preview()

    def _output(self, bit: int, on: bool) -> ValueChange[bool]:
        request = _switch("SetIO", bit, on)
        item = ("output", str(bit))
        return ValueChange(self._link, request, item, on, lambda: self.read_output(bit), eq)

    def _memory(self, bit: int, on: bool) -> ValueChange[bool]:
        request = _switch("SetMemIO", bit, on)
        item = ("memory", str(bit))
        return ValueChange(self._link, request, item, on, lambda: self.read_memory(bit), eq)

    def _number(self, name: str, at: int, form: re.Pattern[str]) -> int:
        reply = self._session.exchange(name, str(_checked(at)))
        if len(reply.fields) == 1 and form.fullmatch(reply.fields[0]):
            return int(reply.fields[0], 16)
        raise self._unreadable(name, reply)

    def _unreadable(self, name: str, reply: Reply) -> RemoteProtocolError:
        return RemoteProtocolError(
            tr("The controller answered {name} with {answer!r}.", name=name, answer=reply.fields),
            remedy=tr("Keep this text and report it with the controller's firmware version."),
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


MOST_ELEMENTS: Final = 100
"""Largest number of array elements in one request (docs/reference/epson.md 1.2 note 4)."""

_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,31}\$?", re.ASCII)
# Commas, quotes and parentheses would split the text; other characters are excluded because their
# handling is not documented.
_TEXT: Final = re.compile(r"[A-Za-z0-9_.:/+-](?:[A-Za-z0-9 _.:/+-]{0,253}[A-Za-z0-9_.:/+-])?")
_MOST_SUBSCRIPTS: Final = 3
_LARGEST_REAL: Final = 3.4028235e38
_RANGES: Final = {
    VariableType.BYTE: (-(2**7), 2**7 - 1),
    VariableType.INTEGER: (-(2**15), 2**15 - 1),
    VariableType.LONG: (-(2**31), 2**31 - 1),
}
_RELATIVE: Final = {VariableType.REAL: 5e-6, VariableType.DOUBLE: 5e-14}
"""Half of the last valid digit, relative: the types have 6 and 14 digits (docs/reference/spel.md
2)."""


class EpsonVariables(DriverPart):
    """Variables that the project in the controller declares Global Preserve.

    Reading is legal at any time, while production runs and for a client that may only
    monitor. Names hold letters, digits and underscores, with a ``$`` at the end of a
    string's; nothing else that a person typed goes into a request.

    Every method raises ConfigError for a name, a type or a value that cannot be, and
    RejectedError (15) for a variable that this controller does not have.
    """

    def __init__(self, link: EpsonLink) -> None:
        super().__init__(link)
        self._link = link
        self._session = link.session

    def text(self, name: str) -> str:
        """Read a variable of any type, as the controller writes it."""
        return ",".join(self._session.exchange("GetVariable", _checked_name(name)).fields)

    def read(self, name: str, kind: VariableType | str) -> Value:
        """Read one variable."""
        kind = variable_type(kind)
        reply = self._session.exchange("GetVariable", _checked_name(name), kind)
        return _from_text(",".join(reply.fields), kind)

    def read_array(
        self, name: str, indices: Sequence[int], kind: VariableType | str, *, count: int = 1
    ) -> tuple[Value, ...]:
        """Read ``count`` elements from ``indices`` on; the last subscript runs.

        Args:
            name: Name of the array.
            indices: Subscripts of the first element.
            kind: Type of its elements.
            count: How many, 1 to 100.

        Raises:
            ConfigError: Strings cannot be read so, nor more than 100 elements at once.

        Example:
            >>> import robolink
            >>> with robolink.connect("epson+sim://variables-example") as controller:
            ...     controller.variables.read_array("g_Real_table", (2, 1), "Real", count=3)
            (0.0, 0.0, 0.0)
        """
        kind = variable_type(kind)
        if kind is VariableType.STRING:
            raise ConfigError(
                tr("Arrays of strings cannot be read."), remedy=tr("Read single strings.")
            )
        if not 1 <= count <= MOST_ELEMENTS:
            raise ConfigError(
                tr("{count} elements cannot be read at once.", count=count),
                remedy=tr("Ask for 1 to {most}.", most=MOST_ELEMENTS),
            )
        element = f"{_checked_name(name)}({_subscripts(indices)})"
        fields = self._session.exchange("GetVariable", element, kind, str(count)).fields
        if len(fields) != count:
            raise RemoteProtocolError(
                tr(
                    "robolink requested {count} elements of {name}, but {found} arrived.",
                    count=count,
                    name=name,
                    found=len(fields),
                ),
                remedy=tr("Keep this text and report it with the controller's firmware version."),
                request=f"GetVariable,{element}",
            )
        return tuple(_from_text(field, kind) for field in fields)

    def write(self, name: str, value: Value, kind: VariableType | str) -> ValueReceipt[Value]:
        """Set one variable and read it back.

        Raises:
            NotReadyError: The state forbids it, monitoring only included.
            ReadBackError: Another value is there afterwards.
            OutcomeUnknownError: No answer came.
        """
        return self._change(name, value, variable_type(kind)).carry_out()

    def preview_write(self, name: str, value: Value, kind: VariableType | str) -> tuple[str, ...]:
        """Return what :meth:`write` would send besides its reads; reads only."""
        return self._change(name, value, variable_type(kind)).preview()

    def _change(self, name: str, value: Value, kind: VariableType) -> ValueChange[Value]:
        request = Request("SetVariable", (_checked_name(name), _to_text(value, kind), kind))
        return ValueChange(
            self._link,
            request,
            ("variable", name, kind),
            value,
            lambda: self.read(name, kind),
            lambda a, b: equal_values(a, b, kind),
        )


def variable_type(text: str) -> VariableType:
    """Return the type called ``text`` in any case.

    Raises:
        ConfigError: There is none.
    """
    for kind in VariableType:
        if kind.lower() == text.lower():
            return kind
    raise ConfigError(
        tr("There is no variable type {text!r}.", text=text),
        remedy=known_names(VariableType, text),
    )


def typed_value(text: str, kind: VariableType | str) -> Value:
    """Return what a person typed as a value of ``kind``.

    Raises:
        ConfigError: It is none.
    """
    kind = variable_type(kind)
    try:
        value = _from_text(text, kind)
    except RemoteProtocolError as error:
        raise _unfit(text, kind) from error
    _to_text(value, kind)
    return value


def equal_values(a: object, b: object, kind: VariableType | str = "") -> bool:
    """Return whether two values are equal to a controller that keeps 6 or 14 digits."""
    tolerance = _RELATIVE.get(variable_type(kind), 0.0) if kind else 0.0
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        return math.isclose(a, b, rel_tol=tolerance, abs_tol=0.0)
    return a == b


def _checked_name(name: str) -> str:
    if not _NAME.fullmatch(name):
        raise ConfigError(
            tr("{name!r} is not a variable's name.", name=name),
            remedy=tr("Names hold letters, digits and underscores; a string's ends in $."),
        )
    return name


def _subscripts(indices: Sequence[int]) -> str:
    plain = all(isinstance(i, int) and not isinstance(i, bool) and i >= 0 for i in indices)
    if not (plain and 1 <= len(indices) <= _MOST_SUBSCRIPTS):
        raise ConfigError(
            tr("{indices} are not subscripts.", indices=list(indices)),
            remedy=tr("Give one to three whole numbers, each 0 or more."),
        )
    return ",".join(str(index) for index in indices)


def _from_text(text: str, kind: VariableType) -> Value:
    if kind is VariableType.STRING:
        return text
    if kind is VariableType.BOOLEAN:
        return spel.parse_boolean(text)
    return spel.parse_number(text) if kind in _RELATIVE else spel.parse_integer(text)


def _to_text(value: Value, kind: VariableType) -> str:
    """Return ``value`` as SetVariable takes it; that it takes 1 for True is assumed."""
    if isinstance(value, str):
        if kind is VariableType.STRING and _TEXT.fullmatch(value):
            return value
    elif isinstance(value, bool):
        if kind is VariableType.BOOLEAN:
            return str(int(value))
    elif kind in _RELATIVE:
        largest = _LARGEST_REAL if kind is VariableType.REAL else math.inf
        if math.isfinite(value) and abs(value) <= largest:
            return format(Decimal(repr(value)), "f")
    elif kind in _RANGES and isinstance(value, int):
        low, high = _RANGES[kind]
        if low <= value <= high:
            return str(value)
    raise _unfit(value, kind)


def _unfit(value: Value, kind: VariableType) -> ConfigError:
    takes = {
        VariableType.STRING: tr("1 to 255 letters, digits, blanks and _ . : / + -"),
        VariableType.BOOLEAN: tr("true or false"),
    }
    low, high = _RANGES.get(kind, (0, 0))
    whole = tr("a whole number from {low} to {high}", low=low, high=high)
    number = tr("a decimal number")
    return ConfigError(
        tr("{value!r} is not a value of type {kind}.", value=value, kind=kind.value),
        remedy=tr("It takes {what}.", what=takes.get(kind, whole if low else number)),
    )
