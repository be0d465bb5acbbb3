"""Checks a document against a JSON schema, for the keywords that our schemas use.

A key that no schema names counts as a fault here, although clients must accept unknown keys: every
key of an answer must be described.
"""

import re
from typing import Any, Final

_TYPES: Final[dict[str, tuple[type, ...]]] = {
    "object": (dict,),
    "array": (list,),
    "string": (str,),
    "integer": (int,),
    "number": (int, float),
    "boolean": (bool,),
    "null": (type(None),),
}
_KNOWN: Final = frozenset(
    {"description", "type", "enum", "const", "properties", "required", "additionalProperties"}
    | {"unevaluatedProperties"}
    | {"items", "minItems", "maxItems", "oneOf", "anyOf", "allOf", "$ref", "x-commands"}
    | {"pattern", "format"}
)

_PARTS: Final = ("allOf", "oneOf", "anyOf")


class Schemas:
    """The schemas of an OpenAPI document.

    Args:
        document: The document.
    """

    def __init__(self, document: dict[str, Any]) -> None:
        self._document = document

    def answer_to(self, path: str, method: str, status: int) -> dict[str, Any]:
        """Return the schema for the answer of an operation."""
        responses = self._document["paths"][path][method]["responses"]
        told = responses.get(str(status), responses["default"])
        told = self._referred(told) if "$ref" in told else told
        schema: dict[str, Any] = told["content"]["application/json"]["schema"]
        return schema

    def wrong(self, schema: dict[str, Any], value: object, at: str = "") -> list[str]:
        """Return the faults of a value, each with its place."""
        if not schema:  # any value is valid
            return []
        found = self._differs(schema, value, at)
        if isinstance(value, dict) and not self._says_what_else(schema):
            found += self._undescribed(schema, value, at)
        return found

    def _differs(self, schema: dict[str, Any], value: Any, at: str) -> list[str]:
        assert schema.keys() <= _KNOWN, schema
        if "$ref" in schema:
            return self._differs(self._referred(schema), value, at)
        found = [it for part in schema.get("allOf", ()) for it in self._differs(part, value, at)]
        if "oneOf" in schema:
            tried = [self._differs(part, value, at) for part in schema["oneOf"]]
            if tried.count([]) != 1:
                found.append(f"{at} fits {tried.count([])} of {len(tried)}: {tried}")
        if "anyOf" in schema:
            parts = schema["anyOf"]
            if all(self._differs(part, value, at) for part in parts):  # up to the first fit
                found.append(f"{at} fits none of {len(parts)}")
        if "pattern" in schema and not re.search(schema["pattern"], value):
            found.append(f"{at} is {value!r}")
        if "const" in schema and value != schema["const"]:
            found.append(f"{at} is {value!r}")
        if "enum" in schema and value not in schema["enum"]:
            found.append(f"{at} is {value!r}")
        if "type" in schema:
            found += self._of_type(schema, value, at)
        return found

    def _of_type(self, schema: dict[str, Any], value: Any, at: str) -> list[str]:
        names = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
        kinds = tuple(kind for name in names for kind in _TYPES[name])
        if not isinstance(value, kinds) or (isinstance(value, bool) and "boolean" not in names):
            return [f"{at} is {value!r}, no {names}"]
        if isinstance(value, list):
            least, most = schema.get("minItems", 0), schema.get("maxItems", len(value))
            found = [] if least <= len(value) <= most else [f"{at} has {len(value)} items"]
            each = enumerate(value)
            return found + [
                w for n, it in each for w in self.wrong(schema["items"], it, f"{at}/{n}")
            ]
        if not isinstance(value, dict):
            return []
        found = [
            f"{at}/{name} is missing" for name in schema.get("required", ()) if name not in value
        ]
        if False in (schema.get("additionalProperties"), schema.get("unevaluatedProperties")):
            found += self._undescribed(schema, value, at)
        for name, held in value.items():
            inner = schema.get("properties", {}).get(name) or schema.get("additionalProperties")
            if isinstance(inner, dict):
                found += self.wrong(inner, held, f"{at}/{name}")
        return found

    def _says_what_else(self, schema: dict[str, Any]) -> bool:
        """Return whether the schema, or one of its parts, says which other keys are allowed."""
        if "$ref" in schema:
            return self._says_what_else(self._referred(schema))
        parts = [it for key in _PARTS for it in schema.get(key, ())]
        says = {"additionalProperties", "unevaluatedProperties"} & schema.keys()
        return bool(says) or any(map(self._says_what_else, parts))

    def _undescribed(self, schema: dict[str, Any], value: dict[str, Any], at: str) -> list[str]:
        unnamed = value.keys() - self._names(schema)
        return [f"{at}/{name} is not described" for name in sorted(unnamed)]

    def _names(self, schema: dict[str, Any]) -> set[str]:
        """Return the keys that the schema and its parts name."""
        if "$ref" in schema:
            return self._names(self._referred(schema))
        parts = [it for key in _PARTS for it in schema.get(key, ())]
        return {*schema.get("properties", ())}.union(*map(self._names, parts))

    def _referred(self, schema: dict[str, Any]) -> dict[str, Any]:
        found: dict[str, Any] = self._document
        for step in schema["$ref"].removeprefix("#/").split("/"):
            found = found[step]
        return found
