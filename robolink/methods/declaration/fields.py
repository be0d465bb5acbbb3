"""The fields of a method's parameters, as commands, recipes and docs read them."""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Len, MaxLen, MinLen

from robolink.files.key_problems import at_least, at_most, holds_at_least, holds_at_most, more_than
from robolink.methods.declaration.method import Help, Option, Unit

_NOTES = "__annotations__"
_UNITS = ("_mm_s", "_mm_per_px", "_mm", "_deg")


@dataclass(frozen=True, slots=True)
class ParameterField:
    """One parameter.

    Attributes:
        name: Its name; the key in a recipe.
        kind: Its type without limits: ``float``, ``tuple[Pair, ...]`` ..; never ``None``.
        metadata: Its limits.
        default: What counts when nobody says it.
        required: Whether somebody has to say it.
        help: What it means.
        unit: Its unit, empty for none.
        option: How a command offers it.
    """

    name: str
    kind: Any
    metadata: tuple[object, ...]
    default: object
    required: bool
    help: str
    unit: str
    option: Option

    @property
    def flag(self) -> str:
        """The name of its option."""
        if self.option.flag:
            return self.option.flag.partition("/")[0]
        stem = next((self.name.removesuffix(u) for u in _UNITS if self.name.endswith(u)), self.name)
        return "--" + stem.replace("_", "-")

    @property
    def in_recipe(self) -> bool:
        """Whether it is a key of ``[source]``."""
        return not self.option.from_recipe


# No functools.cache: to mypy a dataclass with a hash of its own is no Hashable as a type.
_read: dict[type[Any], tuple[ParameterField, ...]] = {}


def fields_of(parameters: type[Any]) -> tuple[ParameterField, ...]:
    """Return the parameters of a method, its own before those that it shares with others.

    Args:
        parameters: A :class:`MethodParameters`, or a dataclass that is part of one.
    """
    if parameters not in _read:
        hints = get_type_hints(parameters, include_extras=True)
        order = [name for owner in parameters.__mro__ for name in vars(owner).get(_NOTES, ())]
        found = sorted(dataclasses.fields(parameters), key=lambda one: order.index(one.name))
        _read[parameters] = tuple(_field(one, hints[one.name]) for one in found)
    return _read[parameters]


def _field(one: "dataclasses.Field[Any]", hint: object) -> ParameterField:
    kind, metadata = bare(hint)

    def said(wanted: type[Any]) -> Any:  # noqa: ANN401 - the annotation's own
        return next((item for item in metadata if isinstance(item, wanted)), None)

    explained, unit = said(Help), said(Unit)
    assert explained is not None, one.name  # noqa: S101 - a declaration without help is a mistake
    return ParameterField(
        one.name,
        kind,
        tuple(item for item in metadata if not isinstance(item, (Help, Unit, Option))),
        None if one.default is dataclasses.MISSING else one.default,
        one.default is dataclasses.MISSING,
        explained.sentence,
        unit.name if unit else "",
        said(Option) or Option(),
    )


def bare(hint: object) -> tuple[Any, tuple[object, ...]]:
    """Return a type without ``None`` and without metadata, and the metadata, outermost first."""
    metadata: tuple[object, ...] = ()
    while True:
        origin = get_origin(hint)
        if origin is Annotated:
            hint, *more = get_args(hint)
            metadata = (*more, *metadata)
        elif origin in (UnionType, Union):
            (hint,) = (part for part in get_args(hint) if part is not NoneType)
        else:
            return hint, metadata


def refusals(value: object, kind: object, metadata: tuple[object, ...]) -> Iterator[str]:
    """Yield why a value of the right type breaks its limits, in the words of every refusal."""
    if isinstance(value, tuple):
        yield from _of_length(len(value), metadata)
        arguments = get_args(kind)
        repeated = len(arguments) == 2 and arguments[1] is Ellipsis
        for place, item in enumerate(value):
            inner, limits = bare(arguments[0 if repeated else place])
            yield from refusals(item, inner, limits)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield from _of_size(value, metadata)


def _of_size(value: float, metadata: tuple[object, ...]) -> Iterator[str]:
    for limit in metadata:
        match limit:
            case Ge(ge) if not value >= ge:  # type: ignore[operator]
                yield at_least(ge)
            case Gt(gt) if not value > gt:  # type: ignore[operator]
                yield more_than(gt)
            case Le(le) if not value <= le:  # type: ignore[operator]
                yield at_most(le)


def _of_length(count: int, metadata: tuple[object, ...]) -> Iterator[str]:
    for limit in metadata:
        match limit:
            case MinLen(least) | Len(min_length=least) if count < least:
                yield holds_at_least(least)
            case MaxLen(most) | Len(max_length=most) if most is not None and count > most:
                yield holds_at_most(most)
