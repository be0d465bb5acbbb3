"""A view as JSON, and back: strict both ways.

What is read is checked as if anybody had written it: no key too many, none too few, and each value
of the type that the record names. Numbers are finite.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Any, Final, Union, get_args, get_origin, get_type_hints

from robolink_cli.wizard.views.records import (
    CheckView,
    ChoiceView,
    EndView,
    FitView,
    MovingView,
    QuestionView,
    TouchView,
    ValuesView,
    View,
    WaitView,
)

KINDS: Final[Mapping[str, type]] = {
    "choice": ChoiceView,
    "check": CheckView,
    "moving": MovingView,
    "wait": WaitView,
    "touch": TouchView,
    "fit": FitView,
    "values": ValuesView,
    "question": QuestionView,
    "end": EndView,
}
"""The bodies, by the word that names them in JSON."""

KIND_OF: Final = {body: kind for kind, body in KINDS.items()}

_KIND: Final = "kind"


class WireError(ValueError):
    """What came is not a view."""


def to_wire(view: View) -> dict[str, object]:
    """Return a view as plain JSON values; its body has a ``kind``.

    Raises:
        WireError: A number in it is not finite.
    """
    written = _written(view, "view")
    assert isinstance(written, dict)  # noqa: S101 - a record is written as one
    return written


def from_wire(data: object) -> View:
    """Return the view of plain JSON values.

    Args:
        data: What :func:`to_wire` returns, after a way through JSON.

    Raises:
        WireError: It is none; names what does not fit.
    """
    view: View = _reader(View)(data, "view")
    return view


def _written(value: object, where: str) -> object:
    if is_dataclass(value) and not isinstance(value, type):
        names = [one.name for one in fields(value)]
        shown = {name: _written(getattr(value, name), f"{where}.{name}") for name in names}
        kind = KIND_OF.get(type(value))
        return shown if kind is None else {_KIND: kind, **shown}
    if isinstance(value, tuple):
        return [_written(one, f"{where}[{index}]") for index, one in enumerate(value)]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, float) and not math.isfinite(value):
        raise WireError(f"{where} is not finite")
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    raise WireError(f"{where} is of no type that a view has")


_Reader = Callable[[object, str], Any]


@cache
def _reader(hint: Any) -> _Reader:  # noqa: ANN401 - a type, or a union of types
    """Return what reads values of a type."""
    if get_origin(hint) in (Union, UnionType):
        return _union(get_args(hint))
    if get_origin(hint) is tuple:
        return _tuple(get_args(hint))
    if isinstance(hint, type) and is_dataclass(hint):
        return _record(hint)
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _enum(hint)
    return _plain(hint)


def _union(hints: tuple[Any, ...]) -> _Reader:
    """Return what reads one of several types: a body by its kind, or a value that may be null."""
    if set(hints) == set(KIND_OF):
        return _body
    (one,) = (hint for hint in hints if hint is not NoneType)
    read = _reader(one)
    return lambda data, where: None if data is None else read(data, where)


def _body(data: object, where: str) -> object:
    if not isinstance(data, dict):
        raise WireError(f"{where} is no object")
    kind = data.get(_KIND)
    if not isinstance(kind, str) or kind not in KINDS:
        raise WireError(f"{where} is of no known kind")
    rest = {key: value for key, value in data.items() if key != _KIND}
    return _reader(KINDS[kind])(rest, where)


def _tuple(hints: tuple[Any, ...]) -> _Reader:
    if len(hints) == 2 and hints[1] is Ellipsis:
        read = _reader(hints[0])

        def any_number(data: object, where: str) -> tuple[object, ...]:
            if not isinstance(data, list):
                raise WireError(f"{where} is no list")
            return tuple(read(one, f"{where}[{index}]") for index, one in enumerate(data))

        return any_number
    readers = [_reader(hint) for hint in hints]

    def as_many(data: object, where: str) -> tuple[object, ...]:
        if not isinstance(data, list) or len(data) != len(readers):
            raise WireError(f"{where} is no list of {len(readers)}")
        pairs = enumerate(zip(readers, data, strict=True))
        return tuple(read(one, f"{where}[{index}]") for index, (read, one) in pairs)

    return as_many


def _record(record: type) -> _Reader:
    hints = get_type_hints(record)
    readers = {name: _reader(hint) for name, hint in hints.items()}

    def read(data: object, where: str) -> object:
        if not isinstance(data, dict):
            raise WireError(f"{where} is no object")
        for name in data.keys() ^ readers.keys():
            has = "lacks" if name in readers else "has an unknown"
            raise WireError(f"{where} {has} {name!r}")
        return record(**{name: one(data[name], f"{where}.{name}") for name, one in readers.items()})

    return read


def _enum(members: type[Enum]) -> _Reader:
    def read(data: object, where: str) -> Enum:
        if not isinstance(data, str):
            raise WireError(f"{where} is no word")
        try:
            return members(data)
        except ValueError as error:
            raise WireError(f"{where} is no known word") from error

    return read


def _plain(wanted: type) -> _Reader:
    def read(data: object, where: str) -> object:
        if wanted is float and type(data) in (int, float):
            assert isinstance(data, (int, float))  # noqa: S101 - just looked at
            if not math.isfinite(data):
                raise WireError(f"{where} is not finite")
            return float(data)
        if type(data) is not wanted:
            raise WireError(f"{where} is no {wanted.__name__}")
        return data

    return read
