"""Values as JSON has them, and dataclasses rebuilt from them by their annotations.

What is kept or printed names each field of a value once, here by its own name, with its unit in
it. A class whose document is more than its fields says so in methods of its own, ``as_json`` and
``from_json``, which are used wherever such a value stands in another (docs/decisions/0005).
What loses nothing and is read strictly is a document of ``to_json``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from math import isfinite
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

T = TypeVar("T")


def json_value(value: Any) -> Any:  # noqa: ANN401 - any value, any JSON
    """Return a value as JSON: dataclasses as objects, enums by value, tuples as lists.

    JSON has no infinity: a number that is not finite is ``None``.

    Raises:
        TypeError: JSON has nothing for such a value.
    """
    kind = type(value)
    if kind is float:  # first: most values of a document, and far faster than the rest
        return value if isfinite(value) else None
    if kind is tuple or kind is list:
        return [*map(json_value, value)]
    match value:
        case Enum():
            return value.value
        case float():
            return json_value(float(value))
        case str() | int() | None:
            return value
        case Mapping():
            return {key: json_value(one) for key, one in value.items()}
        case Sequence():
            return [*map(json_value, value)]
    if own := getattr(value, "as_json", None):
        return own()
    if not is_dataclass(value):
        raise TypeError(f"not for JSON: {value!r}")
    return json_fields(value)


def json_fields(value: object, *names: str, **renamed: str) -> dict[str, Any]:
    """Return some attributes of a value as a JSON object, in this order.

    Args:
        value: Whose attributes; properties are among them.
        names: Attributes whose names are the keys; all fields where none is named.
        renamed: The attribute under each other key; these come last.

    Example:
        >>> from robolink.model import ToolOffset, json_fields
        >>> json_fields(ToolOffset(1, 2), "y_mm", length_mm="z_mm")
        {'y_mm': 2, 'length_mm': 0.0}
    """
    if not names and not renamed:
        names = tuple(field.name for field in fields(value))  # type: ignore[arg-type]
    own = {name: json_value(getattr(value, name)) for name in names}
    return own | {key: json_value(getattr(value, name)) for key, name in renamed.items()}


def from_fields(kind: type[T], document: Mapping[str, Any], *, partial: bool = False) -> T:
    """Return the dataclass whose fields a JSON object holds; further keys are ignored.

    Args:
        kind: The class. Its annotations say what each value is made into.
        document: The object, a key for each field.
        partial: Whether fields that are not there keep their defaults.

    Raises:
        KeyError, TypeError, ValueError: It is no such object.

    Example:
        >>> from robolink.model import ToolOffset, from_fields
        >>> from_fields(ToolOffset, {"x_mm": 12, "y_mm": -3.5}, partial=True).x_mm
        12.0
    """
    found = _annotations(kind).items()  # type: ignore[arg-type] # a class can be hashed
    known = [(name, as_) for name, as_ in found if name in document or not partial]
    return kind(**{name: _read(as_, document[name], partial) for name, as_ in known})


@cache
def _annotations(kind: type) -> Mapping[str, Any]:
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind)}


def _read(kind: Any, value: Any, partial: bool) -> Any:  # noqa: ANN401 - any of both
    origin, inner = get_origin(kind), get_args(kind)
    if origin is UnionType:  # ``X | None``
        (other,) = (one for one in inner if one is not NoneType)
        return None if value is None else _read(other, value, partial)
    if origin in (tuple, Sequence):
        return tuple(_read(inner[0], one, partial) for one in value)
    if origin in (Literal, Mapping) or kind is str or isinstance(value, kind):
        return value
    if own := getattr(kind, "from_json", None):
        return own(value)
    if isinstance(kind, type) and is_dataclass(kind):
        return from_fields(kind, value, partial=partial)
    return kind(value)
