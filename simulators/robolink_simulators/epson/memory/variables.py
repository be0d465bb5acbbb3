"""Global Preserve variables, as GetVariable and SetVariable reach them.

Source: docs/reference/epson.md 1.2 note 4.
"""

import math
import re
from collections.abc import Callable, Mapping, MutableSequence, Sequence
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.protocols.epson_text import ErrorCode, VariableType
from robolink_simulators.epson.condition import RequestRefused, malformed

Value = bool | int | float | str


_RANGES: Final = {
    VariableType.BYTE: (-(2**7), 2**7 - 1),
    VariableType.INTEGER: (-(2**15), 2**15 - 1),
    VariableType.LONG: (-(2**31), 2**31 - 1),
}
_SHOWN_AS: Final = {
    **{kind.lower(): kind for kind in VariableType},
    "ubyte": VariableType.INTEGER,
    "short": VariableType.INTEGER,
}
"""Types on the wire by the types of programs. Types without an equivalent on the wire are sent as
wider ones (assumed).
"""

_DIGITS: Final = {VariableType.REAL: 6, VariableType.DOUBLE: 14}
_TRUTH: Final = {"true": True, "-1": True, "1": True, "false": False, "0": False}
_MAX_STRING: Final = 255
_MAX_COUNT: Final = 100
_REFERENCE: Final = re.compile(r"([A-Za-z_][A-Za-z0-9_]*\$?)(?:\((\d+(?:,\d+){0,2})\))?", re.ASCII)
_WHOLE: Final = re.compile(r"[+-]?\d{1,19}", re.ASCII)
_DECIMAL: Final = re.compile(
    r"[+-]?(\d{1,300}\.?\d{0,300}|\.\d{1,300})(E[+-]?\d{1,3})?", re.ASCII | re.I
)


class _Variable:
    """One declared variable; a scalar has no bounds. Subscripts run from 0 to the bound."""

    __slots__ = ("_held", "bounds", "kind")

    def __init__(self, kind: VariableType, bounds: tuple[int, ...]) -> None:
        self.kind = kind
        self.bounds = bounds
        self._held: MutableSequence[Any] | None = None

    @property
    def _values(self) -> MutableSequence[Any]:
        """Every element, in a row; made at first use."""
        if self._held is None:
            start: Value = "" if self.kind is VariableType.STRING else 0
            self._held = [start] * math.prod(bound + 1 for bound in self.bounds)
        return self._held

    def index(self, subscripts: Sequence[int]) -> int:
        """Return where an element stands."""
        pairs = list(zip(subscripts, self.bounds, strict=False))
        if len(subscripts) != len(self.bounds) or any(i > bound for i, bound in pairs):
            raise RequestRefused(ErrorCode.NO_SUCH_VARIABLE)
        position = 0
        for i, bound in pairs:
            position = position * (bound + 1) + i
        return position

    def share(self, values: MutableSequence[Any]) -> None:
        """Share the content of a program's variable."""
        self._held = values

    def copied(self) -> list[Value]:
        """Return a copy of every element."""
        return list(self._values)

    def take(self, values: Sequence[Value]) -> None:
        """Restore what :meth:`copied` returned."""
        self._values[:] = values

    def row(self, subscripts: Sequence[int], count: int) -> list[Value]:
        """Return ``count`` elements; the last subscript runs and must not pass its bound."""
        start = self.index(subscripts)
        if subscripts[-1] + count - 1 > self.bounds[-1]:
            raise RequestRefused(ErrorCode.NO_SUCH_VARIABLE)
        return list(self._values[start : start + count])

    def get(self, subscripts: Sequence[int]) -> Value:
        value: Value = self._values[self.index(subscripts)]
        return value

    def set(self, subscripts: Sequence[int], value: Value) -> None:
        self._values[self.index(subscripts)] = value


class Variables:
    """The declared variables of the project in the controller.

    Args:
        true_text: How a True Boolean is shown (open, see ``EpsonOptions.true_value``).
        project: Declares what the project declares, when somebody first asks for a variable.
    """

    def __init__(
        self, true_text: str, project: "Callable[[Variables], None] | None" = None
    ) -> None:
        self._true_text = true_text
        self._project = project
        self._declared: dict[str, _Variable] = {}

    @property
    def _variables(self) -> dict[str, _Variable]:
        if self._project is not None:
            declare, self._project = self._project, None
            early, self._declared = self._declared, {}
            declare(self)
            self._declared |= early
        return self._declared

    def declare(
        self, name: str, kind: VariableType, *bounds: int, value: Value | None = None
    ) -> None:
        """Declare a scalar, or an array whose subscripts run from 0 to each bound.

        Raises:
            ConfigError: A value was given for an array.
        """
        variable = _Variable(kind, bounds)
        if value is not None:
            if bounds:
                raise ConfigError(
                    tr("The array {name} takes no single value.", name=name),
                    remedy=tr("Declare it without a value and set its elements."),
                )
            variable.set((), value)
        self._declared[name.lower()] = variable

    def adopt(
        self, name: str, type_name: str, bounds: tuple[int, ...], values: MutableSequence[Any]
    ) -> None:
        """Show a Global Preserve variable of a program, as far as Remote Ethernet's types allow.

        Args:
            name: Its name.
            type_name: Its type as SPEL+ has it, in lower case.
            bounds: Its highest subscripts.
            values: What it holds; the program and the remote client share it.
        """
        variable = _Variable(_SHOWN_AS.get(type_name, VariableType.LONG), bounds)
        variable.share(values)
        self._variables[name.lower()] = variable

    def get(self, reference: str, *rest: str) -> tuple[str, ...]:
        """Answer ``GetVariable,reference[,type[,count]]``.

        Raises:
            Refused: 14 or 15.
        """
        variable, subscripts = self._find(reference)
        self._check_type(variable, rest[:1])
        if not subscripts:  # a count is then one parameter too many
            return (self._shown(variable.kind, variable.get(())),)
        stated = rest[1].strip() if len(rest) > 1 else ""
        if variable.kind is VariableType.STRING or not stated.isdecimal():
            raise RequestRefused(ErrorCode.BAD_COUNT)
        count = int(stated)
        if not 1 <= count <= _MAX_COUNT:
            raise RequestRefused(ErrorCode.BAD_COUNT)
        return tuple(self._shown(variable.kind, v) for v in variable.row(subscripts, count))

    def set(self, reference: str, text: str, *rest: str) -> tuple[str, ...]:
        """Carry out ``SetVariable,reference,value[,type]``; there is nothing to answer.

        Raises:
            Refused: 12, 14 or 15.
        """
        variable, subscripts = self._find(reference)
        self._check_type(variable, rest)
        if subscripts and variable.kind is VariableType.STRING:
            raise RequestRefused(ErrorCode.BAD_COUNT)
        variable.set(subscripts, _parsed(variable.kind, text))
        return ()

    def values(self) -> dict[str, list[Value]]:
        """Return a copy of each variable's content, element by element."""
        return {name: it.copied() for name, it in self._variables.items()}

    def put_back(self, values: Mapping[str, Sequence[Value]]) -> None:
        """Restore what :meth:`values` returned."""
        for name, held in values.items():
            self._variables[name].take(held)

    def holds(self, name: str) -> bool:
        """Return whether the project declares a variable."""
        return name.lower() in self._variables

    def read(self, name: str) -> Value:
        """Return a scalar as a program reads it.

        Raises:
            Refused: There is no such scalar.
        """
        variable, subscripts = self._find(name)
        return variable.get(subscripts)

    def _find(self, reference: str) -> tuple[_Variable, tuple[int, ...]]:
        match = _REFERENCE.fullmatch(reference.strip())
        variable = self._variables.get(match[1].lower()) if match else None
        if match is None or variable is None:
            raise RequestRefused(ErrorCode.NO_SUCH_VARIABLE)
        subscripts = tuple(int(i) for i in match[2].split(",")) if match[2] else ()
        variable.index(subscripts)
        return variable, subscripts

    def _check_type(self, variable: _Variable, stated: Sequence[str]) -> None:
        # Reading a number as text, or text as a number, is error 14 (docs/reference/epson.md 1.2).
        # Assumed: so is reading one kind of number as another.
        if stated and stated[0].strip().lower() != variable.kind.lower():
            raise RequestRefused(ErrorCode.BAD_COUNT)

    def _shown(self, kind: VariableType, value: Value) -> str:
        if kind is VariableType.BOOLEAN:
            return self._true_text if value else "0"
        if kind in _DIGITS:
            return f"{value:.{_DIGITS[kind]}g}".upper()
        return str(value)


def _parsed(kind: VariableType, text: str) -> Value:
    if kind is VariableType.STRING:
        if len(text) > _MAX_STRING:
            raise malformed()
        return text
    if kind is VariableType.BOOLEAN:
        if text.lower() not in _TRUTH:
            raise malformed()
        return _TRUTH[text.lower()]
    if kind in _DIGITS:
        if not _DECIMAL.fullmatch(text) or not math.isfinite(value := float(text)):
            raise malformed()
        return value
    low, high = _RANGES[kind]
    if not _WHOLE.fullmatch(text) or not low <= int(text) <= high:
        raise malformed()
    return int(text)


def project_variables(true_text: str) -> Variables:
    """Return the declarations of the project in the simulated controller: one of each kind."""
    return Variables(true_text, _declare_project)


def _declare_project(variables: Variables) -> None:
    variables.declare("VERSION$", VariableType.STRING, value="SIMULATED")
    for kind in VariableType:
        if kind is not VariableType.STRING:
            variables.declare(f"g_{kind}", kind)
            variables.declare(f"g_{kind}_table", kind, 15, 5)
