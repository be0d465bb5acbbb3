"""Global Preserve variables.

Source: docs/reference/epson.md 1.2 note 4; ranges: docs/reference/spel.md 2.
"""

import math
import re
from collections.abc import Sequence
from decimal import Decimal
from typing import Final

from robolink.controllers.epson.io.values import Change, ValueSetter
from robolink.controllers.epson.link.link import EpsonLink
from robolink.errors import ConfigError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import Value, ValueReceipt
from robolink.protocols import spel
from robolink.protocols.epson_text import Request, VariableType

MOST_ELEMENTS: Final = 100
"""Elements of an array that one request may ask for (docs/reference/epson.md 1.2 note 4)."""

_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,31}\$?", re.ASCII)
# Commas, quotes and parentheses would be cut elsewhere; the rest is left out because nothing
# says how it fares.
_TEXT: Final = re.compile(r"[A-Za-z0-9_.:/+-](?:[A-Za-z0-9 _.:/+-]{0,253}[A-Za-z0-9_.:/+-])?")
_MOST_SUBSCRIPTS: Final = 3
_LARGEST_REAL: Final = 3.4028235e38
_RANGES: Final = {
    VariableType.BYTE: (-(2**7), 2**7 - 1),
    VariableType.INTEGER: (-(2**15), 2**15 - 1),
    VariableType.LONG: (-(2**31), 2**31 - 1),
}
_RELATIVE: Final = {VariableType.REAL: 5e-6, VariableType.DOUBLE: 5e-14}
"""Half of the last of the valid digits, 6 and 14 (docs/reference/spel.md 2)."""


class EpsonVariables:
    """Variables that the project in the controller declares Global Preserve.

    Reading is legal at any time, while production runs and for a client that may only
    monitor. Names hold letters, digits and underscores, with a ``$`` at the end of a
    string's; nothing else that a person typed goes into a request.

    Every method raises ConfigError for a name, a type or a value that cannot be, and
    RejectedError (15) for a variable that this controller does not have.
    """

    def __init__(self, link: EpsonLink) -> None:
        self._session = link.session
        self._setter = ValueSetter(link)

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
                    "{count} elements of {name} were requested, but {found} arrived.",
                    count=count,
                    name=name,
                    found=len(fields),
                ),
                remedy=tr("Keep this text and report it with the controller's firmware version."),
                controller=self._session.identity,
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
        return self._setter.carry_out(self._change(name, value, variable_type(kind)))

    def preview_write(self, name: str, value: Value, kind: VariableType | str) -> tuple[str, ...]:
        """Return what :meth:`write` would send besides its reads; reads only."""
        return self._setter.preview(self._change(name, value, variable_type(kind)))

    def _change(self, name: str, value: Value, kind: VariableType) -> Change[Value]:
        request = Request("SetVariable", (_checked_name(name), _to_text(value, kind), kind))
        return Change(
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
        remedy=tr("These are known: {names}.", names=", ".join(VariableType)),
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
    """Tell whether two values are equal to a controller that keeps 6 or 14 digits."""
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
