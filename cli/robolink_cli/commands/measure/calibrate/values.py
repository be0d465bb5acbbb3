"""How a person types a method's parameters: numbers in their limits, lists, lines."""

import dataclasses
import math
from typing import Any, get_args, get_origin

import click
from annotated_types import Ge, Gt, Le

from robolink.messages import tr
from robolink.methods import ParameterField, fields_of
from robolink.methods.parameter_checks import bare, refusals
from robolink_cli.console.numbers import DECIMAL, NumberInside, decimal

_NUMBERS = (float, int)


def type_of(field: ParameterField) -> click.ParamType[Any]:
    """Return the type of one value of an option."""
    if field.kind in _NUMBERS:
        return _number(field.kind, field.metadata)
    if field.kind is str:
        return click.STRING
    choices = get_args(field.kind)
    if get_origin(field.kind) is not tuple:
        return click.Choice(choices)
    element, _ = bare(choices[0])
    if is_repeated(field):
        return _Line(element)
    return _Numbers(field.kind, field.metadata, element)


def is_repeated(field: ParameterField) -> bool:
    """Return whether the option is given once for each part of the value."""
    arguments = get_args(field.kind)
    if get_origin(field.kind) is not tuple or arguments[1:] != (Ellipsis,):
        return False
    return bare(arguments[0])[0] not in _NUMBERS


def as_typed(value: object) -> object:
    """Return a default as a person would type it."""
    if isinstance(value, tuple):
        return ",".join(f"{number:g}" for number in value)
    return value


def _number(kind: type[Any], metadata: tuple[object, ...]) -> click.ParamType[Any]:
    limits: dict[str, Any] = {}
    for limit in metadata:
        match limit:
            case Ge(ge):
                limits["min"] = ge
            case Gt(gt):
                limits |= {"min": gt, "min_open": True}
            case Le(le):
                limits["max"] = le
    if not limits:
        return DECIMAL if kind is float else click.INT
    made: click.ParamType[Any] = (_FloatInside if kind is float else _IntInside)(**limits)
    made.metadata = metadata  # type: ignore[attr-defined]
    return made


class _FloatInside(NumberInside):
    """A number that is refused in the words of a recipe."""

    metadata: tuple[object, ...] = ()

    def inside(
        self, number: float, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number."""
        for why in refusals(number, float, self.metadata):
            self.fail(why, param, ctx)
        return number


class _IntInside(click.IntRange):
    """A whole number that is refused in the words of a recipe."""

    metadata: tuple[object, ...] = ()

    def convert(
        self,
        value: Any,  # noqa: ANN401 - click's form
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> int:
        """Return the number."""
        number: int = click.INT.convert(value, param, ctx)
        for why in refusals(number, int, self.metadata):
            self.fail(why, param, ctx)
        return number


class _Numbers(click.ParamType[Any]):
    """Numbers with commas between them: as many as there are, or rows of them."""

    name = "numbers"

    def __init__(
        self,
        kind: Any,  # noqa: ANN401 - a type
        metadata: tuple[object, ...],
        element: Any,  # noqa: ANN401 - a type
    ) -> None:
        self._kind = kind
        self._metadata = metadata
        self._rows = element if get_origin(element) is tuple else None

    def convert(
        self,
        value: Any,  # noqa: ANN401 - click's form
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> tuple[Any, ...]:
        """Return the numbers."""
        if isinstance(value, tuple):
            return value
        numbers = _parsed(self, value, param, ctx)
        arguments = get_args(self._kind)
        if arguments[1:] != (Ellipsis,):
            width = len(get_args(self._rows)) if self._rows else 1
            if len(numbers) != len(arguments) * width:
                self.fail(_must_hold(len(arguments) * width), param, ctx)
            if self._rows:
                return tuple(
                    numbers[place : place + width] for place in range(0, len(numbers), width)
                )
        for why in refusals(numbers, self._kind, self._metadata):
            self.fail(why, param, ctx)
        return numbers


class _Line(click.ParamType[Any]):
    """One pair of numbers, or one line of a table, with commas between its values."""

    name = "values"

    def __init__(self, element: Any) -> None:  # noqa: ANN401 - a type
        self._element = element

    def convert(
        self,
        value: Any,  # noqa: ANN401 - click's form
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> Any:  # noqa: ANN401 - of the element's type
        """Return the pair, or the line."""
        if not isinstance(value, str):
            return value
        numbers = _parsed(self, value, param, ctx)
        if not dataclasses.is_dataclass(self._element):
            count = len(get_args(self._element))
            if len(numbers) != count:
                self.fail(_must_hold(count), param, ctx)
            return numbers
        keys = fields_of(self._element)  # type: ignore[arg-type]
        if len(numbers) != len(keys):
            self.fail(_must_hold(len(keys)), param, ctx)
        given = {}
        for key, number in zip(keys, numbers, strict=True):
            for why in refusals(number, key.kind, key.metadata):
                self.fail(f"{key.name}: {why}", param, ctx)
            if key.kind is int and number != int(number):
                self.fail(f"{key.name}: {tr('must be a whole number')}", param, ctx)
            given[key.name] = key.kind(number)
        return self._element(**given)  # type: ignore[operator]


def _parsed(
    kind: click.ParamType[Any], text: str, param: click.Parameter | None, ctx: click.Context | None
) -> tuple[float, ...]:
    try:
        numbers = tuple(decimal(part.strip()) for part in text.split(","))
    except ValueError:
        kind.fail(tr("must be numbers with commas between them"), param, ctx)
    if not all(map(math.isfinite, numbers)):
        kind.fail(tr("must be a finite number"), param, ctx)
    return numbers


def _must_hold(count: int) -> str:
    return tr("must hold {count} numbers", count=count)
