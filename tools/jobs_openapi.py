"""What a line computer posts and reads at the panel, as an OpenAPI document.

``python -m tools.jobs_openapi`` prints it; ``docs/jobs.openapi.json`` holds it. The body is made
from the very table that judges it.
"""

import json
from typing import Any, Final

from robolink import __version__
from robolink.fleet import JobState, PlanKind, WaitReason, line_order_table

_TEXT: Final = {"type": "string"}
_MAYBE: Final = {"type": ["string", "null"]}
_PROBLEM: Final = {
    "type": "object",
    "properties": {"field": _TEXT, "what": _TEXT},
    "required": ["field", "what"],
}
_WHY: Final = {
    "type": "object",
    "properties": {
        "why": {"description": "What is wrong, in English.", **_TEXT},
        "differs": {"description": "Of 409: the fields.", "type": "array", "items": _TEXT},
        "problems": {"description": "Of 422: all of them.", "type": "array", "items": _PROBLEM},
    },
    "required": ["why"],
}
_ORDER: Final = {"type": "string", "minLength": 1, "maxLength": 64, "pattern": "^[ -~]+$"}

_JOB: Final = {
    "type": "object",
    "properties": {
        "schema": {"const": "robolink/line-job/1"},
        "order": {"description": "The line computer's id.", **_TEXT},
        "cell": _TEXT,
        "kind": {"enum": [str(kind) for kind in PlanKind]},
        "posted_at": {"description": "ISO 8601, UTC.", **_TEXT},
        "plan": {"description": "Id of the plan that it became.", **_TEXT},
        "journal_order": {"description": "The order of the change in the cell's journal.", **_TEXT},
        "state": {"enum": [str(state) for state in JobState]},
        "final": {"description": "Whether nothing more comes of it.", "type": "boolean"},
        "why": {"enum": [*(str(why) for why in WaitReason), None]},
        "waits_for": {"description": "The same in words.", **_MAYBE},
        "halts": {"description": "Why its plan stands.", "type": "array", "items": _TEXT},
        "attempt_count": {"type": "integer"},
        "begun_at": _MAYBE,
        "ended_at": _MAYBE,
        "exit_code": {"type": ["integer", "null"]},
        "error": _MAYBE,
        "reason": _MAYBE,
        "what": _MAYBE,
        "change": {"description": "Id of the change in the cell's journal.", **_MAYBE},
    },
}


def jobs_openapi() -> dict[str, Any]:
    """Return the document."""
    body = line_order_table().model_json_schema(ref_template="#/components/schemas/{model}")
    schemas: dict[str, Any] = body.pop("$defs")
    body["properties"]["order"] |= _ORDER
    schemas["LineOrder"] = body
    schemas["LineJob"] = {**_JOB, "required": [*_JOB["properties"]]}
    schemas["Refused"] = _WHY
    both = _refused(401, 403, 404, 405, 421, 429, 503)
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "Jobs that a line computer orders at the panel of robolink",
            "version": __version__,
            "license": {"name": "Apache-2.0", "identifier": "Apache-2.0"},
        },
        "security": [{"token": []}],
        "paths": {
            "/jobs": {
                "post": {
                    "operationId": "order_job",
                    "summary": "Order a job; the same order again is the same job.",
                    "requestBody": {"required": True, "content": _json("LineOrder")},
                    "responses": {
                        "201": _answer("It is on record.", "LineJob"),
                        "200": _answer("It was on record: the same job.", "LineJob"),
                        **_refused(400, 409, 413, 415, 422),
                        **both,
                    },
                }
            },
            "/jobs/{order}": {
                "get": {
                    "operationId": "look_at_job",
                    "summary": "Tell how a job stands.",
                    "parameters": [
                        {"name": "order", "in": "path", "required": True, "schema": _ORDER}
                    ],
                    "responses": {"200": _answer("How it stands.", "LineJob"), **both},
                }
            },
        },
        "components": {
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
            "schemas": schemas,
        },
    }


_WORDS: Final = {
    400: "No JSON object.",
    401: "No token that counts.",
    403: "Not with this token: kind, cell or permit group; or a browser asks.",
    404: "There is no job of this order.",
    405: "Another method.",
    408: "The body took too long.",
    409: "The same order with another job: `differs` names the fields.",
    413: "Longer than 4 kB.",
    415: "The body is no application/json.",
    421: "The panel is not called that.",
    422: "What is wrong stands in `problems`.",
    429: "Too many requests, or too many open jobs; see Retry-After.",
    503: "The plant's database does not answer; see Retry-After.",
}


def _refused(*statuses: int) -> dict[str, Any]:
    return {str(status): _answer(_WORDS[status], "Refused") for status in statuses}


def _answer(description: str, schema: str) -> dict[str, Any]:
    return {"description": description, "content": _json(schema)}


def _json(schema: str) -> dict[str, Any]:
    return {"application/json": {"schema": {"$ref": f"#/components/schemas/{schema}"}}}


if __name__ == "__main__":
    print(json.dumps(jobs_openapi(), indent=1, ensure_ascii=False))  # noqa: T201 - its purpose
