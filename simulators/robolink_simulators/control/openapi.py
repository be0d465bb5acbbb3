"""The control API as an OpenAPI document, made from the declared acts.

``python -m robolink_simulators.control.openapi`` prints it; the wheel holds it as
``robolink_simulators/control/openapi.json``, and every control port serves it.
"""

import json
from collections.abc import Mapping
from typing import Any, Final

from robolink_simulators.control.acts.declared import LONGEST_TEXT, ControlAct, Taken
from robolink_simulators.control.acts.registry import ACTS

_KINDS: Final = {
    "epson": "an EPSON controller",
    "softmotion": "a PLC with a mailbox",
    "plc": "a PLC with a register map",
}
_CELL: Final = {"name": "cell", "in": "path", "required": True, "schema": {"type": "string"}}


def openapi() -> dict[str, Any]:
    """Return the document; the server's URL is filled in by whoever reads it."""
    acts: dict[str, ControlAct] = {}
    kinds: dict[str, list[str]] = {}
    for kind, of_kind in ACTS.items():
        for name, act in of_kind.items():
            acts.setdefault(name, act)
            kinds.setdefault(name, []).append(kind)
    paths: dict[str, Any] = {
        "/": _looked_at("What is simulated here", with_cell=False),
        "/cells/{cell}": _looked_at("What a simulated controller is, and its acts"),
    }
    for name in sorted(acts):
        paths[f"/cells/{{cell}}/{name}"] = _path(acts[name], kinds[name])
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
        "components": {"schemas": _schemas()},
    }


def _path(act: ControlAct, kinds: list[str]) -> dict[str, Any]:
    of = "every kind" if len(kinds) == len(ACTS) else " or ".join(_KINDS[it] for it in kinds)
    operation = {
        "operationId": act.name,
        "summary": act.says,
        "description": f"At {of}.",
        "requestBody": {"content": {"application/json": {"schema": _object(act)}}},
        "responses": _responses(),
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


def _looked_at(summary: str, *, with_cell: bool = True) -> dict[str, Any]:
    path: dict[str, Any] = {"get": {"summary": summary, "responses": _responses()}}
    return {"parameters": [_CELL], **path} if with_cell else path


def _object(act: ControlAct) -> dict[str, Any]:
    needed = [it.name for it in act.takes if it.needed and it.default is None]
    schema: dict[str, Any] = {
        "type": "object",
        "additionalProperties": False,
        "properties": {it.name: _schema(it) for it in act.takes},
    }
    if needed:
        schema["required"] = needed
    return schema


def _schema(taken: Taken) -> Mapping[str, Any]:
    match taken.form:
        case "whole":
            lowest, highest = taken.whole_limits
            return {"type": "integer", "minimum": lowest, "maximum": highest}
        case "number":
            return {"type": "number", "minimum": taken.least, "maximum": taken.most}
        case "flag":
            return {"type": "boolean"}
        case "text" if taken.choices:
            return {"type": "string", "enum": list(taken.choices)}
        case "text":
            return {"type": "string", "maxLength": LONGEST_TEXT}
        case _:
            return {"type": ["string", "number", "boolean"]}


def _responses() -> dict[str, Any]:
    def told(description: str, schema: str) -> dict[str, Any]:
        reference = {"$ref": f"#/components/schemas/{schema}"}
        return {
            "description": description,
            "content": {"application/json": {"schema": reference}},
        }

    return {
        "200": told("Done; what it gives stands beside ok.", "Answer"),
        "400": told("A value is missing, wrong or unknown.", "Refusal"),
        "403": told("The token is another one.", "Refusal"),
        "404": told("There is no such cell or act.", "Refusal"),
        "409": told("The simulated robot cannot do it.", "Refusal"),
        "503": told("Too many clients are connected.", "Refusal"),
        "default": told("Refused for another reason: the method, the length.", "Refusal"),
    }


def _schemas() -> dict[str, Any]:
    common = {"schema": {"const": "robolink/control/1"}, "ok": {"type": "boolean"}}
    refusal = {**common, "error": {"type": "string"}, "remedy": {"type": "string"}}
    return {
        "Answer": {"type": "object", "properties": common, "required": ["schema", "ok"]},
        "Refusal": {"type": "object", "properties": refusal, "required": [*refusal]},
    }


if __name__ == "__main__":
    print(json.dumps(openapi(), indent=1))  # noqa: T201 - what the command is for
