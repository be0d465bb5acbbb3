"""What callers give: numbers of other libraries, and tuples where a value belongs."""

import inspect
import reprlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import lru_cache, wraps
from numbers import Integral, Real
from types import SimpleNamespace, UnionType
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

from robolink.errors import ConfigError
from robolink.messages import tr

_P = ParamSpec("_P")
_R = TypeVar("_R")


def plain_number(value: Any) -> float | None:  # noqa: ANN401 - whatever a caller gave
    """Return a number as Python's own ``int`` or ``float``, ``None`` for what is no number.

    A truth value is no number. A number wider than a float is rounded to the nearest one.

    Args:
        value: What was given.
    """
    if isinstance(value, float):  # first, without an ABC check: numpy's float64 is a float
        return float(value)
    if getattr(value, "shape", None) == ():  # a numpy scalar; this module does not import numpy
        value = value.item()
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    return int(value) if isinstance(value, Integral) else float(value)


def required_number(value: object, name: str) -> float:
    """Return a number that a frozen value holds, which from now on is one of Python's own.

    Args:
        value: The value that is being made.
        name: The field.

    Raises:
        ConfigError: The field holds no number.
    """
    given = getattr(value, name)
    number = plain_number(given)
    if number is None:
        raise not_a_number(name, given)
    if type(number) is not type(given):
        object.__setattr__(value, name, number)
    return number


def not_a_number(name: str, value: object) -> ConfigError:
    """Return the error for a field that holds no number, or one that is not finite."""
    return ConfigError(
        tr("{name} is not a number: {value}.", name=name, value=shown(value)),
        remedy=tr("Give a finite decimal number."),
    )


def shown(value: object) -> str:
    """Return a value for a sentence: on one line, and cut where it is long."""
    try:
        return " ".join(reprlib.repr(value).split())
    except Exception:
        return f"<{type(value).__name__}>"


def misgiven(
    function: Callable[..., object], args: Iterable[object], named: Mapping[str, Any]
) -> Iterator[ConfigError]:
    """Yield an error for each argument that is not the value that its annotation names.

    Args:
        function: What was called.
        args: The arguments that were given by their place.
        named: Those that were given by name.

    Example:
        >>> from robolink.model import describe_pose, misgiven
        >>> [error.what for error in misgiven(describe_pose, [(1, 2, 3)], {})]
        ['pose is not a Pose but (1, 2, 3) (tuple).']
    """
    try:
        given = _signature(function).bind(*args, **named).arguments
    except TypeError:  # the arguments do not fit: Python's own error says so
        return
    for name, value in given.items():
        yield from _wrong_at(name, value, _hint(inspect.unwrap(function), name))


def checks_arguments(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Let a procedure refuse at its call what is no ``Pose``, ``ToolOffset`` or other value.

    Otherwise it would show once the robot has moved.

    Example:
        >>> from robolink.model import Pose, checks_arguments
        >>> @checks_arguments
        ... def approach(target: Pose):
        ...     yield target
        >>> approach((300, 0, 100, 0))
        Traceback (most recent call last):
        robolink.errors.ConfigError: target is not a Pose but (300, 0, 100, 0) (tuple). Write \
Pose(x_mm, y_mm, z_mm, u_deg).
    """

    @wraps(function)
    def checking(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        for wrong in misgiven(function, args, kwargs):
            raise wrong
        return function(*args, **kwargs)

    return checking


_signature = lru_cache(maxsize=64)(inspect.signature)


@lru_cache(maxsize=256)
def _hint(function: Callable[..., object], name: str) -> Any:  # noqa: ANN401 - any annotation
    only = SimpleNamespace(__annotations__={name: function.__annotations__.get(name)})
    try:
        return get_type_hints(only, function.__globals__)[name]
    except NameError:  # a name that only the type checker knows
        return None


def _wrong_at(name: str, value: object, kind: Any) -> Iterator[ConfigError]:  # noqa: ANN401 - any annotation
    members = _members(kind)
    if any(isinstance(one, type) and isinstance(value, one) for one in members):
        return
    for wanted in filter(is_dataclass, members):
        yield not_of_class(name, value, wanted)
        return
    for one in members:
        inner = [it for it in get_args(one)[:1] if any(map(is_dataclass, _members(it)))]
        if get_origin(one) is not None and inner:
            kinds = [it for it in _members(inner[0]) if is_dataclass(it)]
            if isinstance(value, str) or not isinstance(value, Iterable):
                yield not_of_class(f"{name}[0]", value, kinds[0])
                continue
            if isinstance(value, Iterator):  # an iterator can be read only once
                continue
            for number, item in enumerate(value):
                yield from _wrong_at(f"{name}[{number}]", item, inner[0])


def _members(kind: Any) -> tuple[Any, ...]:  # noqa: ANN401 - any annotation
    return get_args(kind) if get_origin(kind) in (UnionType, Union) else (kind,)


def not_of_class(name: str, value: object, kind: Any) -> ConfigError:  # noqa: ANN401 - a dataclass
    """Return the error for an argument that is not of a class.

    Args:
        name: The argument.
        value: What was given.
        kind: The class, a dataclass.

    Example:
        >>> from robolink import ToolOffset
        >>> from robolink.model import not_of_class
        >>> print(not_of_class("offset", (1, 2, 3), ToolOffset))
        offset is not a ToolOffset but (1, 2, 3) (tuple). Write ToolOffset(x_mm, y_mm, z_mm, \
u_deg, v_deg, w_deg).
    """
    needed = [
        field.name
        for field in fields(kind)
        if field.default is MISSING and field.default_factory is MISSING
    ]
    names = needed or [field.name for field in fields(kind)]
    return ConfigError(
        tr(
            "{name} is not a {kind} but {given} ({type}).",
            name=name,
            kind=kind.__name__,
            given=shown(value),
            type=type(value).__name__,
        ),
        remedy=tr("Write {call}.", call=f"{kind.__name__}({', '.join(names)})"),
    )
