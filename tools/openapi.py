"""The control API as an OpenAPI document, made from the declared acts.

``python -m tools.openapi`` prints it; the wheel holds it as
``robolink_simulators/control/openapi.json``, and every control port serves it.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from inspect import cleandoc
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, cast, get_args, get_origin, get_type_hints

from robolink_simulators.control.acts import ACTS
from robolink_simulators.control.answers import LEFT_OUT, CellAbout, CellsAbout, Described
from robolink_simulators.control.declared_acts import (
    LONGEST_TEXT,
    NONE,
    PRINTABLE,
    ControlAct,
    Taken,
)

_PLAIN: Final = {bool: "boolean", int: "integer", float: "number", str: "string", NoneType: "null"}
_SECTION: Final = re.compile(r"\n\n(?=\w+:\n)")
_ATTRIBUTE: Final = re.compile(r"^    (?! )([\w, ]+): ((?:.|\n {8})+)", re.MULTILINE)


class AnswerSchemas:
    """Collects the schemas, one for each dataclass.

    Attributes:
        named: Those that were needed so far, by name.
    """

    def __init__(self) -> None:
        self.named: dict[str, Any] = {}

    def of(self, described: Described) -> dict[str, Any]:
        """Return the schema of a type; that of a dataclass is referred to.

        Raises:
            TypeError: It is none that JSON is made of.
        """
        if described in _PLAIN:
            return {"type": _PLAIN[described]}
        if is_dataclass(described):
            return self._referred(described)
        parts, origin = get_args(described), cast("object", get_origin(described))
        match origin:
            case _ if origin is Literal:
                return {"type": "string", "enum": list(parts)}
            case _ if origin in (Union, UnionType):
                return self._one_of(parts)
            case _ if origin is tuple:
                schema: dict[str, Any] = {"type": "array", "items": self.of(parts[0])}
                if parts[-1] is not Ellipsis:
                    schema |= {"minItems": len(parts), "maxItems": len(parts)}
                return schema
            case _ if origin is Mapping:
                return {"type": "object", "additionalProperties": self.of(parts[1])}
            case _:
                raise TypeError(described)

    def _one_of(self, parts: tuple[Any, ...]) -> dict[str, Any]:
        schemas = [self.of(part) for part in parts]
        if all(schema.keys() == {"type"} for schema in schemas):
            return {"type": [schema["type"] for schema in schemas]}
        return {"oneOf": schemas}

    def _referred(self, described: Any) -> dict[str, Any]:  # noqa: ANN401 - a dataclass
        name = described.__name__
        if name not in self.named:
            self.named[name] = {}  # stops the recursion for a class that contains itself
            says, about = _answered(described)
            hints = get_type_hints(described, include_extras=True)
            properties, needed = {}, []
            for field in fields(described):
                hint = hints[field.name]
                if get_origin(hint) is Annotated and LEFT_OUT in get_args(hint):
                    hint = get_args(hint)[0]
                else:
                    needed.append(field.name)
                said = {"description": about[field.name]} if field.name in about else {}
                properties[field.name] = {**self.of(hint), **said}
            self.named[name] = {
                "description": says,
                "type": "object",
                "properties": properties,
                "required": needed,
            }
        return {"$ref": f"#/components/schemas/{name}"}


def _answered(described: type) -> tuple[str, dict[str, str]]:
    """Return what the docstring of a dataclass says of it and of its attributes."""
    first, *sections = _SECTION.split(cleandoc(described.__doc__ or ""))
    section = next((it for it in sections if it.startswith("Attributes:")), "")
    return " ".join(first.partition("\n\n")[0].split()), dict(_attributes(section))


def _attributes(section: str) -> Iterator[tuple[str, str]]:
    for names, says in _ATTRIBUTE.findall(section):
        for name in names.split(", "):
            yield name, " ".join(says.split()).replace("``None``", "null")


_KINDS: Final = {
    "epson": "an EPSON controller",
    "softmotion": "a PLC with a mailbox",
    "plc": "a PLC with a register map",
}
_REFUSALS: Final = {
    "400": ("Wrong", "A value is missing, wrong or unknown."),
    "403": ("Forbidden", "The token is another one, or a web page asks."),
    "404": ("Unknown", "There is no such cell or act."),
    "405": ("NotAllowed", "This method is not answered here."),
    "409": ("NotNow", "The simulated robot cannot do it, or not as it is now."),
    "503": ("Full", "Too many clients are connected."),
    "default": ("Refused", "Refused for another reason, such as the length."),
}
"""Refusals by status: a name and the reason."""

_CELL: Final = {"name": "cell", "in": "path", "required": True, "schema": {"type": "string"}}


def openapi() -> dict[str, Any]:
    """Return the document; the server's URL is filled in by whoever reads it."""
    answers = AnswerSchemas()
    acts: dict[str, ControlAct] = {}
    kinds: dict[str, list[str]] = {}
    for kind, of_kind in ACTS.items():
        for name, act in of_kind.items():
            acts.setdefault(name, act)
            kinds.setdefault(name, []).append(kind)
    paths: dict[str, Any] = {
        "/": _looked_at("What is simulated here", answers.of(CellsAbout), with_cell=False),
        "/cells/{cell}": _looked_at(
            "What a simulated controller is, and its acts", answers.of(CellAbout)
        ),
    }
    for name in sorted(acts):
        paths[f"/cells/{{cell}}/{name}"] = _path(acts[name], kinds[name], answers)
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "robolink control API",
            "version": "1.0",
            "description": "What tests and pipelines do to simulated controllers past the wire.",
            "license": {"name": "Apache-2.0"},
        },
        "servers": [
            {
                "url": "http://{host}:{port}/{token}/v1",
                "variables": {
                    "host": {"default": "127.0.0.1"},
                    "port": {"default": "0"},
                    "token": {"default": "", "description": "Drawn anew at each start."},
                },
            }
        ],
        "paths": paths,
        "components": {
            "schemas": {**_schemas(), **answers.named},
            "responses": _refusals(),
        },
    }


def _path(act: ControlAct, kinds: list[str], answers: AnswerSchemas) -> dict[str, Any]:
    of = "every kind" if len(kinds) == len(ACTS) else " or ".join(_KINDS[it] for it in kinds)
    operation = {
        "operationId": act.name,
        "summary": act.says,
        "description": f"At {of}.",
        "requestBody": _body(act),
        "responses": _responses(None if act.gives is None else answers.of(act.gives)),
    }
    path: dict[str, Any] = {"parameters": [_CELL], "post": operation}
    if act.reads:
        asked = [
            {"name": it.name, "in": "query", "required": it.needed, "schema": _schema(it)}
            for it in act.takes
        ]
        looked = {**operation, "operationId": f"look_{act.name}", "parameters": asked}
        del looked["requestBody"]
        path["get"] = looked
    return path


def _looked_at(summary: str, gives: Mapping[str, Any], *, with_cell: bool = True) -> dict[str, Any]:
    path: dict[str, Any] = {"get": {"summary": summary, "responses": _responses(gives)}}
    return {"parameters": [_CELL], **path} if with_cell else path


def _body(act: ControlAct) -> dict[str, Any]:
    needed = [it.name for it in act.takes if it.needed and it.default is None]
    schema: dict[str, Any] = {
        "type": "object",
        "additionalProperties": False,
        "properties": {it.name: _schema(it) for it in act.takes},
    }
    if needed:
        schema["required"] = needed
    return {"required": bool(needed), "content": {"application/json": {"schema": schema}}}


def _schema(taken: Taken) -> Mapping[str, Any]:
    match taken.form:
        case "whole":
            lowest, highest = taken.whole_limits
            whole = {"type": "integer", "minimum": lowest, "maximum": highest}
            return {"anyOf": [whole, {"enum": [None, NONE]}]} if taken.or_none else whole
        case "number":
            return {"type": "number", "minimum": taken.least, "maximum": taken.most}
        case "flag":
            return {"type": ["boolean", "integer"], "minimum": 0, "maximum": 1}
        case _ if taken.choices:
            return {"type": "string", "enum": list(taken.choices)}
        case _:
            text = {"type": "string", "maxLength": LONGEST_TEXT}
            return {**text, "pattern": f"^{PRINTABLE}$"} if taken.ascii else text


def _responses(gives: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return what may be answered; ``gives`` is what stands beside ``ok``, if anything."""
    answer: Mapping[str, Any] = {"$ref": "#/components/schemas/Answer"}
    done = _told("Done.", answer if gives is None else {"allOf": [answer, gives]})
    refused = {
        status: {"$ref": f"#/components/responses/{name}"}
        for status, (name, _) in _REFUSALS.items()
    }
    return {"200": done, **refused}


def _refusals() -> dict[str, Any]:
    """Return each refusal by its name."""
    refusal = {"$ref": "#/components/schemas/Refusal"}
    told = {name: _told(why, refusal) for name, why in _REFUSALS.values()}
    told["NotAllowed"]["headers"] = {
        "Allow": {"description": "The methods that are.", "schema": {"type": "string"}}
    }
    return told


def _told(description: str, schema: Mapping[str, Any]) -> dict[str, Any]:
    return {"description": description, "content": {"application/json": {"schema": schema}}}


def _schemas() -> dict[str, Any]:
    schema = {"schema": {"const": "robolink/control/1"}}
    answer = {**schema, "ok": {"const": True}}
    refusal = {
        **schema,
        "ok": {"const": False},
        "error": {"type": "string", "description": "What happened."},
        "remedy": {"type": "string", "description": "What to do next."},
    }
    return {
        "Answer": {"type": "object", "properties": answer, "required": [*answer]},
        "Refusal": {"type": "object", "properties": refusal, "required": [*refusal]},
    }


if __name__ == "__main__":
    print(json.dumps(openapi(), indent=1))  # noqa: T201 - what the command is for
