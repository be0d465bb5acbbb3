"""Values as JSON documents that lose nothing, and the same values again (docs/json.md).

A document names its schema, ``robolink/value/ToolOffset/1``: package, class and version, and so
does each value in it. It holds each field under its own name. What each becomes is decided by the
annotations of the class alone.
"""

import re
import sys
from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, fields, is_dataclass
from datetime import datetime
from difflib import get_close_matches
from enum import Enum, Flag
from functools import cache
from math import inf, isfinite, nan
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Final,
    Literal,
    TypeGuard,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from robolink.deprecation import read_without_schema
from robolink.errors import DocumentError, RobolinkError
from robolink.messages import listed, tr
from robolink.model._arguments import plain_number, shown
from robolink.model._json_values import from_fields

T = TypeVar("T")

NOT_FINITE: Final[Mapping[str, float]] = {"Infinity": inf, "-Infinity": -inf, "NaN": nan}
"""Spelling in documents of the numbers that JSON lacks."""

MOST: Final = 2**1023
"""Largest whole number accepted as a float."""

_LISTS: Final[Mapping[Any, Any]] = {Sequence: tuple} | {it: it for it in (tuple, list, frozenset)}
_MAPPINGS: Final = (Mapping, dict)
_SCALARS: Final = frozenset({str, bool, int, float})
_ANYTHING: Final = (object, Any)


def schema_of(kind: type) -> str:
    """Return the name of the schema of a class: ``robolink/value/ToolOffset/1``.

    The number is the class's own ``json_version``, 1 where it has none.

    Args:
        kind: The class.
    """
    package = kind.__module__.partition(".")[0]
    return f"{package}/value/{kind.__name__}/{vars(kind).get('json_version', 1)}"


def to_json(value: object) -> dict[str, Any]:
    """Return a value as a JSON document, from which :func:`from_json` makes an equal one.

    A number that JSON has not is ``"NaN"``, ``"Infinity"`` or ``"-Infinity"``; a number of numpy is
    a plain one, bytes are hexadecimal, a time is ISO 8601. In a field of any type, such as
    ``details``, a tuple comes back as a list. What robolink returns has a schema in
    ``docs/values.schema.json``; a frozen dataclass of another package works alike.

    Args:
        value: A frozen dataclass, such as a ``ToolOffset`` or a ``CalibrationResult``.

    Raises:
        DocumentError: It is none, or a field of it holds what JSON cannot hold.

    Example:
        >>> from robolink import ToolOffset, from_json, to_json
        >>> document = to_json(ToolOffset(12, -3.5))
        >>> document["schema"], document["y_mm"]
        ('robolink/value/ToolOffset/1', -3.5)
        >>> from_json(ToolOffset, document) == ToolOffset(12, -3.5)
        True
    """
    if not is_value(type(value)):
        raise _no_document(type(value))
    return _tagged(value, type(value).__name__)


@read_without_schema(from_fields)
def from_json(kind: type[T], document: Mapping[str, Any]) -> T:
    """Return the value that :func:`to_json` made a document of.

    Args:
        kind: Its class, or a class that it derives from.
        document: The document, as ``json.loads`` returns it.

    Raises:
        DocumentError: It is of another class or a newer version, has a key that is not known or
            lacks one, or a value in it is not what the key stands for. Nothing is guessed.

    Example:
        >>> from robolink import ToolOffset, from_json
        >>> from_json(ToolOffset, {"schema": "robolink/value/ToolOffset/2"})
        Traceback (most recent call last):
        robolink.errors.DocumentError: This is robolink/value/ToolOffset/2, from a newer version; \
this one knows robolink/value/ToolOffset/1. Update robolink here, or write the document with this \
version.
    """
    if not _names_its_schema(document):
        raise DocumentError(
            tr("This is not a document of to_json: it names no schema."),
            remedy=tr(
                "Give what to_json returned. Fields without a schema are read by "
                "robolink.model.from_fields."
            ),
        )
    return _untagged(kind, document, kind.__name__)  # type: ignore[no-any-return]


def _names_its_schema(document: object) -> TypeGuard[Mapping[str, Any]]:
    return isinstance(document, Mapping) and isinstance(document.get("schema"), str)


def is_value(kind: Any) -> bool:  # noqa: ANN401 - any annotation
    """Tell whether a class is a frozen dataclass that can be made, whose objects are values."""
    if not isinstance(kind, type) or not is_dataclass(kind):
        return False
    frozen: bool = kind.__dataclass_params__.frozen  # type: ignore[attr-defined]
    return frozen and not getattr(kind, "__abstractmethods__", None)


@cache
def value_fields(kind: type) -> Mapping[str, Any]:
    """Return the annotation of each field that a value is made of."""
    try:
        hints = get_type_hints(kind)
    except NameError as error:  # a name that only the type checker knows
        raise _no_document(kind) from error
    return {field.name: hints[field.name] for field in fields(kind) if field.init}


def members_of(kind: Any) -> tuple[Any, ...]:  # noqa: ANN401 - any annotation
    """Return what a field may hold by its annotation: the members of a union, or it alone."""
    if isinstance(kind, TypeVar):
        bounds = kind.__constraints__ or (kind.__bound__ or object,)
        return tuple(one for part in bounds for one in members_of(part))
    if get_origin(kind) is Annotated:
        return members_of(get_args(kind)[0])
    if get_origin(kind) in (UnionType, Union):
        return tuple(one for part in get_args(kind) for one in members_of(part))
    return (kind,)


# Writing.


def _tagged(value: object, at: str) -> dict[str, Any]:
    annotations = value_fields(type(value))  # type: ignore[arg-type] # a class can be hashed
    if "schema" in annotations:
        raise _not_for_json(value, f"{at}.schema")
    return {"schema": schema_of(type(value))} | {
        name: _written(kind, getattr(value, name), f"{at}.{name}")
        for name, kind in annotations.items()
    }


def _written(kind: Any, value: Any, at: str) -> Any:  # noqa: ANN401 - any value, any JSON
    members = members_of(kind)
    if value is None and NoneType in members:
        return None
    others = [one for one in members if one is not NoneType]
    if len(others) == 1:
        return _written_as(others[0], value, at)
    if is_value(type(value)) and any(isinstance(value, one) for one in others if is_value(one)):
        return _tagged(value, at)
    for one in sorted(others, key=lambda one: one is not type(value)):  # the exact type first
        try:
            found = _written_as(one, value, at)
        except DocumentError:
            continue
        if not (isinstance(found, str) and one is float and str in others):
            return found
    raise _not_for_json(value, at)


def _written_as(kind: Any, value: Any, at: str) -> Any:  # noqa: ANN401 - as above
    if kind in _SCALARS:
        return _scalar_written(kind, value, at)
    if kind in _ANYTHING:
        return _anything(value, at)
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Literal:
        if value in inner:
            return enum_word(value) if isinstance(value, Enum) else value
    elif origin in _LISTS:
        if isinstance(value, Sequence | frozenset) and not isinstance(value, str | bytes):
            ordered = sorted(value, key=repr) if isinstance(value, frozenset) else value
            return [_written(as_, one, f"{at}[{n}]") for n, as_, one in _each(inner, ordered, at)]
    elif origin in _MAPPINGS:
        if isinstance(value, Mapping) and _may_be_key(inner[0]):
            return {
                str(_written(inner[0], key, at)): _written(inner[1], one, f"{at}[{key!r}]")
                for key, one in value.items()
            }
    elif is_value(kind):
        if isinstance(value, kind):
            return _tagged(value, at)
    elif isinstance(kind, type):
        return _leaf_written(kind, value, at)
    raise _not_for_json(value, at)


def _scalar_written(kind: type, value: Any, at: str) -> Any:  # noqa: ANN401 - as above
    if type(value) is kind and kind is not float:
        return value
    if kind is str and isinstance(value, str):
        return value.value if isinstance(value, Enum) else value
    if kind is bool and getattr(value, "shape", None) == () and type(value.item()) is bool:
        return value.item()
    number = plain_number(value) if kind in (int, float) else None
    if number is None or (isinstance(number, int) and abs(number) > MOST):
        raise _not_for_json(value, at)
    if not isfinite(number):
        if kind is float:
            return "NaN" if number != number else f"{'-' * (number < 0)}Infinity"
    elif (found := kind(number)) == number:
        return found
    raise _not_for_json(value, at)


def _leaf_written(kind: type, value: Any, at: str) -> Any:  # noqa: ANN401 - as above
    if issubclass(kind, Enum):
        try:
            return enum_word(kind(value))
        except ValueError:
            raise _not_for_json(value, at) from None
    if kind is bytes and isinstance(value, bytes):
        return value.hex()
    if kind is datetime and isinstance(value, datetime):
        return value.isoformat()
    raise _not_for_json(value, at)


def enum_word(member: Enum) -> str | int:
    """Return how a document spells a member: its value, or its name where that is no word."""
    return member.value if isinstance(member.value, str | int) else member.name


@cache
def _by_word(kind: type[Enum]) -> Mapping[str | int, Enum]:
    return {enum_word(one): one for one in kind}


def _anything(value: Any, at: str) -> Any:  # noqa: ANN401 - as above
    try:
        return _plain(value, at)
    except RecursionError:
        raise DocumentError(
            tr("{field} is nested too deeply.", field=at), remedy=_give_its_type()
        ) from None


def _plain(value: Any, at: str) -> Any:  # noqa: ANN401 - as above
    """Return plain JSON values as they are; what stands in a field of any type is nothing else."""
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {str(key): _plain(one, f"{at}[{key!r}]") for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one, f"{at}[{n}]") for n, one in enumerate(value)]
    if getattr(value, "shape", None) == () and type(value.item()) is bool:
        return value.item()
    number = plain_number(value)
    if number is None or not isfinite(number):
        raise _not_for_json(value, at)
    return number


def _each(inner: tuple[Any, ...], values: Any, at: str) -> Iterator[tuple[int, Any, Any]]:  # noqa: ANN401 - as above
    """Yield number, annotation and value of each item of a tuple or another list."""
    kinds = inner if len(inner) > 1 and inner[-1] is not ... else inner[:1] * len(values)
    if len(kinds) != len(values):
        raise DocumentError(
            tr(
                "{field} has {found} items, not {count}.",
                field=at,
                found=len(values),
                count=len(kinds),
            ),
            remedy=_give_its_type(),
        )
    return zip(range(len(kinds)), kinds, values, strict=True)


def _may_be_key(kind: Any) -> bool:  # noqa: ANN401 - any annotation
    return kind in (int, str) or (isinstance(kind, type) and issubclass(kind, Enum))


def _no_document(kind: type) -> DocumentError:
    return DocumentError(
        tr("A {kind} cannot become a JSON document.", kind=kind.__name__),
        remedy=tr("Give a value of robolink or another frozen dataclass that holds only data."),
    )


def _not_for_json(value: object, at: str) -> DocumentError:
    return DocumentError(
        tr("{field} holds {value}, which JSON cannot hold there.", field=at, value=shown(value)),
        remedy=_give_its_type(),
    )


def _give_its_type() -> str:
    return tr("Give the field a value of its type.")


# Reading.


def _untagged(kind: type, document: Mapping[str, Any], at: str) -> Any:  # noqa: ANN401 - any value
    """Return the value of a document that names its schema: of this class or one derived."""
    schema = document["schema"]
    stem, _, given = schema.rpartition("/")
    found = _class_named(stem, kind)
    if found is None or not re.fullmatch("[0-9]{1,9}", given):
        raise DocumentError(
            tr(
                "{field} is {schema}, not {expected}.",
                field=at,
                schema=schema,
                expected=schema_of(kind),
            ),
            remedy=tr(
                "Read it as the class that its schema names. Import a class of another package "
                "first."
            ),
        )
    known = schema_of(found)
    newest = int(known.rpartition("/")[2])
    if not 0 < int(given) <= newest:
        raise DocumentError(
            tr(
                "This is {schema}, from a newer version; this one knows {known}.",
                schema=schema,
                known=known,
            ),
            remedy=tr("Update robolink here, or write the document with this version."),
        )
    own = {name: one for name, one in document.items() if name != "schema"}
    return _made(found, own, at, older=int(given) < newest)


def _class_named(stem: str, kind: type) -> type | None:
    """Return the class of this name, which is ``kind`` or derives from it."""
    known = (one for one in _derived(kind, stem) if is_value(one))
    return next((one for one in known if schema_of(one).rpartition("/")[0] == stem), None)


def _derived(kind: type, stem: str) -> Iterator[type]:
    """Yield a class and those that derive from it: what its packages hand out, what is loaded."""
    yield kind
    name = stem.rpartition("/")[2]
    package = kind.__module__
    while package := package.rpartition(".")[0]:
        module = sys.modules.get(package)
        if name in getattr(module, "__all__", ()):
            found = getattr(module, name)
            if isinstance(found, type) and issubclass(found, kind):
                yield found
    # The newest first: a class with slots is created from one without, which stays in the list.
    subclasses: list[type] = kind.__subclasses__()
    for one in reversed(subclasses):
        yield from _derived(one, stem)


def _made(kind: type, document: Mapping[str, Any], at: str, *, older: bool) -> Any:  # noqa: ANN401 - any value
    """Return the value of these keys; an older document may lack keys that have a default."""
    annotations = value_fields(kind)
    for key in document:
        if key not in annotations:
            raise _not_known(str(key), annotations, at)
    for field in fields(kind):
        needed = not older or (field.default is MISSING and field.default_factory is MISSING)
        if field.init and needed and field.name not in document:
            raise _misread(tr("{field} is missing.", field=f"{at}.{field.name}"))
    own = {name: _read(annotations[name], one, f"{at}.{name}") for name, one in document.items()}
    try:
        return kind(**own)
    except (TypeError, ValueError, RobolinkError) as error:
        said = error.what if isinstance(error, RobolinkError) else str(error)
        raise DocumentError(
            listed(tr("{field} cannot be made of this document:", field=at), [said]),
            remedy=_what_to_do(),
        ) from error


def _read(kind: Any, value: Any, at: str) -> Any:  # noqa: ANN401 - any JSON, any value
    members = members_of(kind)
    if value is None and NoneType in members:
        return None
    others = [one for one in members if one is not NoneType]
    if len(others) > 1 and _names_its_schema(value):
        stem = value["schema"].rpartition("/")[0]
        named = [one for one in others if is_value(one) and _class_named(stem, one)]
        others = named or others
    if len(others) == 1:
        return _read_as(others[0], value, at)
    for one in sorted(others, key=lambda one: one is not type(value)):  # the exact type first
        try:
            return _read_as(one, value, at)
        except DocumentError:
            continue
    raise _of_another_type(value, at)


def _read_as(kind: Any, value: Any, at: str) -> Any:  # noqa: ANN401 - as above
    if kind in _SCALARS:
        return _scalar_read(kind, value, at)
    if kind in _ANYTHING:
        return _anything(value, at)
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Literal:
        words = {enum_word(one) if isinstance(one, Enum) else one: one for one in inner}
        if isinstance(value, Hashable) and value in words:
            return words[value]
    elif origin in _LISTS:
        if isinstance(value, list):
            each = _each(inner, value, at)
            return _LISTS[origin](_read(as_, one, f"{at}[{n}]") for n, as_, one in each)
    elif origin in _MAPPINGS:
        if isinstance(value, Mapping) and _may_be_key(inner[0]):
            return {
                _key_read(inner[0], key, at): _read(inner[1], one, f"{at}[{key!r}]")
                for key, one in value.items()
            }
    elif is_value(kind):
        if _names_its_schema(value):
            return _untagged(kind, value, at)
    elif isinstance(kind, type):
        return _leaf_read(kind, value, at)
    raise _of_another_type(value, at)


def _scalar_read(kind: type, value: Any, at: str) -> Any:  # noqa: ANN401 - as above
    if type(value) is kind or (kind is str and isinstance(value, str)):
        return value
    if kind is float:
        if isinstance(value, str) and value in NOT_FINITE:
            return NOT_FINITE[value]
        if type(value) is int and abs(value) <= MOST:
            return float(value)
    raise _of_another_type(value, at)


def _leaf_read(kind: type, value: Any, at: str) -> Any:  # noqa: ANN401 - as above
    with suppress(KeyError, TypeError, ValueError):
        if issubclass(kind, Enum) and type(value) is not bool:
            if issubclass(kind, Flag) and (found := kind(value)).value == value:
                return found
            return _by_word(kind)[value]
        if kind is bytes:
            return bytes.fromhex(value)
        if kind is datetime:
            return datetime.fromisoformat(value)
    raise _of_another_type(value, at)


def _key_read(kind: type, key: str, at: str) -> Any:  # noqa: ANN401 - as above
    if kind is not int:
        return _read_as(kind, key, at)
    with suppress(ValueError):
        if str(found := int(key)) == key:
            return found
    raise _of_another_type(key, at)


def _not_known(key: str, known: Collection[str], at: str) -> DocumentError:
    near = get_close_matches(key, known, n=1)
    return _misread(
        tr("{field} is not known.", field=f"{at}.{key}"),
        tr("Did you mean {names}?", names=near[0]) if near else "",
    )


def _of_another_type(value: object, at: str) -> DocumentError:
    return _misread(
        tr("{field} is {value}, a value of another type.", field=at, value=shown(value))
    )


def _misread(what: str, hint: str = "") -> DocumentError:
    return DocumentError(what, remedy=f"{hint} {_what_to_do()}".lstrip())


def _what_to_do() -> str:
    return tr("Compare the document with its schema in docs/values.schema.json.")
