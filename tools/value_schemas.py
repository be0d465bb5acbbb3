"""Writes docs/values.schema.json: the JSON Schema of each value of the library that holds data.

::

    .venv/bin/python -m tools.value_schemas        # a test compares the file with the classes

A class whose fields differ from what is published needs the next ``json_version`` first: programs
have documents of the old form. The old schema stays in the file.
"""

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import is_dataclass
from datetime import datetime
from enum import Enum, Flag
from importlib import import_module
from pathlib import Path
from types import NoneType
from typing import Any, Final, Literal, get_args, get_origin

from robolink.errors import DocumentError
from robolink.model._documents import (
    NOT_FINITE,
    enum_word,
    is_value,
    members_of,
    schema_of,
    value_fields,
)

FILE: Final = Path(__file__).parents[1] / "docs" / "values.schema.json"
_DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"
_TITLE: Final = "What robolink.to_json makes of values"
_ABOUT: Final = (
    "One entry of $defs for each class, named after its schema: ToolOffset-1 describes the "
    "document robolink/value/ToolOffset/1, whose schema key says so. A value inside another has "
    "that key too. Names of numbers end with their unit."
)
_PLAIN: Final[Mapping[Any, dict[str, Any]]] = {
    str: {"type": "string"},
    bool: {"type": "boolean"},
    int: {"type": "integer"},
    float: {"$ref": "#/$defs/number"},
    bytes: {"type": "string", "pattern": "^([0-9a-f]{2})*$"},
    datetime: {"type": "string", "format": "date-time"},
    object: {},
    Any: {},
    NoneType: {"type": "null"},
}
_NUMBER: Final = {"anyOf": [{"type": "number"}, {"enum": [*NOT_FINITE]}]}


RESULTS: Final = (
    "robolink",
    "robolink.accuracy",
    "robolink.backup",
    "robolink.calibration",
    "robolink.calibration_run",
    "robolink.controller_outcome",
    "robolink.controllers",
    "robolink.controllers.epson.verify",
    "robolink.drift",
    "robolink.inspection",
    "robolink.journal",
    "robolink.model",
    "robolink.pose_tables",
    "robolink.report",
    "robolink.stations",
    "robolink.transaction",
)
"""Packages whose values programs store or pass on."""

BESIDE: Final = ("robolink.runner", "robolink.transport")
"""Further packages whose values occur inside those. A long test checks that there are no others."""


class NotDataError(Exception):
    """A field of a class holds what no document can."""


def key_of(kind: type) -> str:
    """Return where the schema of a class stands."""
    _, _, name, version = schema_of(kind).split("/")
    return f"{name}-{version}"


def values(others: Iterable[str] = BESIDE) -> dict[str, type]:
    """Return every public class of values, by where it is imported from.

    Args:
        others: The packages beside :data:`RESULTS`.
    """
    found: dict[type, str] = {}
    for package in (*RESULTS, *others):
        module = import_module(package)
        for name in module.__all__:
            thing = getattr(module, name)
            if is_dataclass(thing) and isinstance(thing, type):
                found.setdefault(thing, f"{package}.{name}")
    return {name: kind for kind, name in found.items()}


class Writer:
    """Makes the schemas of classes, and of those that stand in them."""

    def __init__(self, kinds: Sequence[type]) -> None:
        self._kinds = kinds

    def document(self, kind: type, name: str) -> dict[str, Any]:
        """Return the schema of a class.

        Raises:
            NotDataError: It is no value, or a field holds no data.
        """
        if not is_value(kind):
            raise NotDataError("it can be changed")
        annotations = value_fields(kind)
        properties: dict[str, Any] = {"schema": {"const": schema_of(kind)}}
        for field, as_ in annotations.items():
            properties[field] = self._held(as_, field, (kind,))
        return {
            "description": name,
            "type": "object",
            "required": [*properties],
            "properties": properties,
            "additionalProperties": False,
        }

    def _held(self, kind: object, at: str, inside: tuple[type, ...]) -> dict[str, Any]:
        found = [self._member(one, at, inside) for one in members_of(kind)]
        flat = [one for it in found for one in it.get("anyOf", [it])]
        return flat[0] if len(flat) == 1 else {"anyOf": flat}

    def _member(self, kind: Any, at: str, inside: tuple[type, ...]) -> dict[str, Any]:  # noqa: ANN401 - any annotation
        if kind in _PLAIN:
            return _PLAIN[kind]
        origin, inner = get_origin(kind), get_args(kind)
        if origin is Literal:
            return {"enum": [enum_word(one) if isinstance(one, Enum) else one for one in inner]}
        if origin in (tuple, Sequence, list, frozenset):
            if origin is tuple and inner[-1] is not ...:
                items = [self._held(one, at, inside) for one in inner]
                alike = all(one == items[0] for one in items)
                held: dict[str, Any] = (
                    {"items": items[0]} if alike else {"prefixItems": items, "items": False}
                )
                return {"type": "array", **held, "minItems": len(items), "maxItems": len(items)}
            return {"type": "array", "items": self._held(inner[0], at, inside)}
        if origin in (Mapping, dict) and self._is_key(inner[0]):
            return {"type": "object", "additionalProperties": self._held(inner[1], at, inside)}
        if isinstance(kind, type) and issubclass(kind, Flag):
            return {"type": "integer"}
        if isinstance(kind, type) and issubclass(kind, Enum):
            return {"enum": [enum_word(one) for one in kind]}
        if is_value(kind):
            return self._value(kind, at, inside)
        raise NotDataError(f"{at} holds {getattr(kind, '__name__', kind)}")

    def _value(self, kind: type, at: str, inside: tuple[type, ...]) -> dict[str, Any]:
        if kind not in inside:
            for field, as_ in value_fields(kind).items():
                self._held(as_, f"{at}.{field}", (*inside, kind))
        names = [f"#/$defs/{key_of(one)}" for one in (kind, *self._derived(kind))]
        found = [{"$ref": name} for name in names]
        return found[0] if len(found) == 1 else {"anyOf": found}

    def may_stand_in(self, kind: Any) -> list[type]:  # noqa: ANN401 - any annotation
        """Return the classes whose values may stand where an annotation says what does."""
        if is_value(kind):
            return [kind, *self._derived(kind)]
        parts = get_args(kind) or [one for one in members_of(kind) if one is not kind]
        return [one for part in parts for one in self.may_stand_in(part)]

    def _derived(self, kind: type) -> list[type]:
        return [one for one in self._kinds if issubclass(one, kind) and one is not kind]

    @staticmethod
    def _is_key(kind: object) -> bool:
        return kind in (int, str) or (isinstance(kind, type) and issubclass(kind, Enum))


def schemas(others: Iterable[str] = BESIDE) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the schema of each class, and of each that has none why it has none.

    Args:
        others: The packages beside :data:`RESULTS`.
    """
    found: dict[str, Any] = {}
    without: dict[str, str] = {}
    named = values(others)
    fit: dict[str, type] = {}
    for name, kind in named.items():
        if name.rpartition(".")[0] not in RESULTS:
            continue
        try:
            Writer(()).document(kind, name)
        except (DocumentError, NotDataError) as error:
            without[name] = str(error)
        else:
            fit[name] = kind
    writer = Writer([*named.values()])
    for name, kind in fit.items():
        found[key_of(kind)] = writer.document(kind, name)
    homes = {kind: name for name, kind in named.items()}
    for key, kind in _beneath(fit.values(), writer).items():
        found.setdefault(key, writer.document(kind, homes.get(kind, kind.__name__)))
    return dict(sorted(found.items())), without


def _beneath(kinds: Iterable[type], writer: Writer) -> dict[str, type]:
    """Return every class that stands in one of these, by its key."""
    found: dict[str, type] = {}
    todo = [*kinds]
    while todo:
        for as_ in value_fields(todo.pop()).values():
            for one in writer.may_stand_in(as_):
                if key_of(one) not in found:
                    found[key_of(one)] = one
                    todo.append(one)
    return found


def whole(earlier: Mapping[str, Any], found: Mapping[str, Any]) -> dict[str, Any]:
    """Return the file.

    Args:
        earlier: What is published; of it stays what no class has any more in this version.
        found: The schemas of the classes.
    """
    return {
        "$schema": _DIALECT,
        "title": _TITLE,
        "description": _ABOUT,
        "$defs": {**dict(sorted({**earlier, **found}.items())), "number": _NUMBER},
    }


def changed(earlier: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return the schemas that are published otherwise: their classes need the next version."""
    return [key for key, one in earlier.items() if key in now and now[key] != one]


def text_of(schema: Mapping[str, Any]) -> str:
    """Return the file as text: a line a field."""
    head = json.dumps({**schema, "$defs": None}, indent=2).removesuffix("null\n}")
    rows = (f'"{key}": {_definition(one)}' for key, one in schema["$defs"].items())
    return head + "{\n    " + ",\n    ".join(rows) + "\n  }\n}\n"


def _definition(one: Mapping[str, Any]) -> str:
    if "properties" not in one:
        return json.dumps(one)
    head = {key: value for key, value in one.items() if key != "properties"}
    rows = [f'"{name}": {json.dumps(held)}' for name, held in one["properties"].items()]
    held = '"properties": {\n        ' + ",\n        ".join(rows) + "\n      }"
    return json.dumps(head)[:-1] + f",\n      {held}\n    }}"


def main() -> None:
    """Write the file, unless that would change what is published."""
    earlier = json.loads(FILE.read_text(encoding="utf-8"))["$defs"] if FILE.exists() else {}
    found, _ = schemas()
    if wrong := changed(earlier, found):
        sys.exit(f"Raise json_version, and that of what holds it: {', '.join(wrong)}")
    FILE.write_text(text_of(whole(earlier, found)), encoding="utf-8")


if __name__ == "__main__":
    main()
