"""What is wrong in a recipe, said by the path of the key: ``tools#2.approach.z_mm``.

Tables and numbers of a list are counted from 1, as people do, hence the sign.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robolink.config import Problem
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.recipe._schema import json_schema
from robolink.recipe._sentences import missing, one_of, sentence, unknown

if TYPE_CHECKING:
    from pydantic import ValidationError


def problems_of(error: "ValidationError") -> list[Problem]:
    """Return everything that pydantic objects to."""
    schema = json_schema()
    details = error.errors(include_url=False, include_input=False)
    return [_problem(detail, schema) for detail in details if not _follows(detail, details)]


def refusal(path: Path, problems: Sequence[Problem]) -> ConfigError:
    """Return the error that tells all problems of one recipe at once."""
    lines = "\n".join(f"    {problem}" for problem in problems)
    return ConfigError(
        tr(
            "The recipe {path} is wrong in {count} places:\n{lines}",
            path=path,
            count=len(problems),
            lines=lines,
        )
        if len(problems) > 1
        else tr("The recipe {path} is wrong:\n{lines}", path=path, lines=lines),
        remedy=tr("Correct it; docs/recipes.md explains every key. Nothing was sent."),
    )


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
            return Problem(place.path, unknown(place.key, place.table, tuple(schema["properties"])))
        case "missing":
            return Problem(place.path, missing(place.key))
        case "union_tag_invalid" | "union_tag_not_found":
            kinds = schema["properties"][place.key]["discriminator"]["mapping"]
            return Problem(f"{place.path}.kind", one_of(kinds))
    return Problem(place.path, sentence(detail))
