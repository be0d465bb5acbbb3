"""The page of all recipe keys, made from their declarations: docs/recipe-keys.md.

``python -m robolink.recipe.page`` prints it.
"""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from robolink.recipe._recipe import json_schema

_OPENING: Final = """\
# Every key of a recipe

*For integrators. Reference.*

How to write a recipe, and which decisions have no default: [recipes](recipes.md). How keys go
together: [recipe rules](reference/recipe-rules.md).

    basis = "absolute"     # a key at the top of the file, above the first [table]

    [tolerances]           # a table
    drift_mm = 0.2         # a key of the table

Limits are inclusive. Lengths are in mm, angles in degrees. Poses are those of the flange (Tool 0),
in base coordinates. The keys of a `[source]` besides its `kind` depend on the method:
[methods](methods.md).

This page is made from the code: `python -m robolink.recipe.page > docs/recipe-keys.md`.
"""

_TABLES: Final = {
    "Recipe": "The top of the file",
    "BeamLine": "`[[source.beams]]`",
    "StationTable": "`[station]`",
    "Poses": "`[poses]`",
    "FlangePose": "A pose",
    "Tool": "`[[tools]]`",
    "PoseFile": "`[tools.poses]`",
    "Speeds": "`[speeds]`",
    "Box": "`[box]`",
    "Tolerances": "`[tolerances]`",
    "AccuracyTable": "`[accuracy]`",
    "RefusalTable": "`[refusal]`",
    "Prompt": "`[[prompts]]`",
    "Output": "`[[outputs]]`",
}
"""Headings of the tables, in the order of the page."""

_UNITS: Final = {"_mm": "mm", "_px": "px", "_deg": "degrees", "mm_s": "mm/s", "percent": "%"}

Schema = Mapping[str, Any]


def recipe_page() -> str:
    """Return the page."""
    schema = json_schema()
    tables = {"Recipe": schema, **schema["definitions"]}
    return "\n".join([_OPENING, *(line for name in _TABLES for line in _table(name, tables))])


def _table(name: str, tables: Mapping[str, Schema]) -> Iterator[str]:
    table = tables[name]
    required = table.get("required", ())
    yield f"## {_TABLES[name]}\n"
    yield f"{_one_line(table['description'])}\n"
    yield "| key | unit | default | limits | meaning |"
    yield "|---|---|---|---|---|"
    for key, value in table["properties"].items():
        cells = (
            f"`{key}`",
            next((unit for end, unit in _UNITS.items() if key.endswith(end)), ""),
            "required" if key in required else _written(value.get("default")),
            _limits(value),
            _meaning(value, tables),
        )
        yield "| " + " | ".join(cells) + " |"
    yield ""


def _meaning(value: Schema, tables: Mapping[str, Schema]) -> str:
    told = value.get("description") or tables[_pointed_at(value)]["description"]
    return _one_line(told).replace("|", "\\|")


def _limits(value: Schema) -> str:
    """Return the allowed values, in words."""
    if "enum" in value:
        return ", ".join(f'`"{word}"`' for word in value["enum"])
    if value.get("type") == "boolean":
        return "`true`, `false`"
    low, high = value.get("minimum"), value.get("maximum")
    if low is not None and high is not None:
        return f"{low:g} to {high:g}"
    if low is not None:
        return f"from {low:g}"
    if "maxLength" in value:
        return f"{value.get('minLength', 0)} to {value['maxLength']} characters"
    if value.get("type") == "array":
        return _of_array(value)
    return "a table" if _pointed_at(value) else ""


def _of_array(value: Schema) -> str:
    inner = _limits(value.get("items", {}))
    count = f"{value['minItems']} and more" if "minItems" in value else "any number"
    return f"{count}; each {inner}" if inner else count


def _pointed_at(value: Schema) -> str:
    """Return the name of the table that a key holds, empty for none."""
    return str(value.get("$ref", "")).rpartition("/")[2]


def _written(default: object) -> str:
    """Return a default as a person would type it; empty if it cannot be typed."""
    if isinstance(default, str) and default:
        return f'`"{default}"`'
    return f"{default:g}" if isinstance(default, (int, float)) else ""


def _one_line(text: str) -> str:
    return " ".join(text.split())


if __name__ == "__main__":
    print(recipe_page(), end="")  # noqa: T201 - the page is made from this output
