"""What is wrong in a recipe, said by the path of the key: ``tools#2.approach.z_mm``.

Tables and numbers of a list are counted from 1, as people do, hence the sign.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from robolink.files.key_problems import is_not_known, one_of, sentence
from robolink.files.toml import Problem
from robolink.messages import tr
from robolink.methods import method_names
from robolink.recipe.file.schema import json_schema

if TYPE_CHECKING:
    from pydantic import ValidationError


@cache
def _known_schema(_methods: tuple[str, ...]) -> dict[str, Any]:
    """Return the schema, only to be read; making it takes longer than checking a recipe."""
    return json_schema()


def problems_of(error: "ValidationError") -> list[Problem]:
    """Return everything that pydantic objects to."""
    schema = _known_schema(method_names())
    details = error.errors(include_url=False, include_input=False)
    return [_problem(detail, schema) for detail in details if not _follows(detail, details)]


@dataclass(frozen=True, slots=True)
class _Place:
    """Where in a recipe something stands.

    Attributes:
        path: Path of the key.
        key: The key itself.
        table: The keys that are known beside it.
    """

    path: str
    key: str
    table: tuple[str, ...]

    @classmethod
    def of(cls, location: Sequence[int | str], schema: dict[str, Any]) -> "_Place":
        """Follow pydantic's location through the schema.

        A kind of source stands in the location, too, and in no path.
        """
        path, key, table, node = "", "", (), schema
        for step in location:
            node = _resolved(node, schema)
            if isinstance(step, int):
                path, node = f"{path}#{step + 1}", node["items"]
            elif "discriminator" in node:
                node = {"$ref": node["discriminator"]["mapping"][step]}
            else:
                key, table = step, tuple(node["properties"])
                path, node = f"{path}.{key}" if path else key, node["properties"].get(key, {})
        return cls(path, key, table)


def _resolved(node: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    reference: str = node.get("$ref", "")
    named: dict[str, Any] = schema["definitions"].get(reference.rpartition("/")[2], node)
    return named


def _follows(detail: Any, details: Sequence[Any]) -> bool:  # noqa: ANN401 - pydantic's own form
    """Tell whether a list is called too short only because what it holds is wrong."""
    place = detail["loc"]
    return detail["type"] == "too_short" and any(
        len(other["loc"]) > len(place) and other["loc"][: len(place)] == place for other in details
    )


def _problem(detail: Any, schema: dict[str, Any]) -> Problem:  # noqa: ANN401 - pydantic's own form
    place = _Place.of(detail["loc"], schema)
    match detail["type"]:
        case "extra_forbidden":
            return Problem(place.path, _unknown(place, tuple(schema["properties"])))
        case "missing":
            return Problem(place.path, _missing(place.key))
        case "union_tag_invalid" | "union_tag_not_found":
            kinds = schema["properties"][place.key]["discriminator"]["mapping"]
            return Problem(f"{place.path}.kind", one_of(kinds))
        case "string_pattern_mismatch":
            said = tr("must not hold control characters or, except in notes, line breaks")
            return Problem(place.path, said)
    return Problem(place.path, sentence(detail))


def _unknown(place: _Place, top: Sequence[str]) -> str:
    """Return what to say about a key that does not exist where it stands.

    Args:
        place: Where it stands.
        top: The keys that are known at the top of the file.
    """
    if place.key in top:
        return tr("belongs at the top of the file, above the first line with a [table]")
    return is_not_known(place.key, place.table)


def _missing(key: str) -> str:
    """Return what to say about a key that is required."""
    match key:
        case "basis":
            return tr(
                "is missing, and it has to be decided, because taught points agree only with the "
                'tool value that they were taught with. Write "difference" to move the stored '
                "value by how much the tip moved against the reference of the same tool at the "
                "same station (the first run only records that reference, with the nozzle still "
                'on with which the points were taught), or "absolute" to write what was measured.'
            )
        case "z":
            return tr(
                'is missing: write "kept" when the new nozzle is as long as the old one (the '
                'person confirms it each time), "typed" when the person enters Z each time, or '
                '"measured" when the touch of the pin gives it'
            )
        case "tools":
            return tr("is missing: write one [[tools]] table for each tool")
        case "schema":
            return tr('is missing: begin the file with schema = "robolink/recipe/1"')
    return tr("is missing")
