"""The recipes that come along, and copies of them in which the numbers to be changed are marked."""

import re
from pathlib import Path
from typing import Final

from robolink.files.durable import write_whole
from robolink.files.named import require_free
from robolink.messages import tr
from robolink_cli.commands.shipped.shipped_files import (
    recipe_schema,
    recipes_folder,
    require_one_of,
)

_OF_THE_CELL: Final = re.compile(
    r"^[^#]*\b([xyz]_mm|origin_mm|mm_per_px|direction_deg|points|input|sideways_mm|down_mm|up_mm"
    r"|jump_mm)\b *="
)
"""Lines with numbers that depend on the cell."""

_MARK: Final = "# SIMULATED"

_NUMBERS: Final = (
    'numbers = "simulated"          # marked lines are of a simulated cell: put in yours, then '
    "delete this line"
)


def models() -> dict[str, Path]:
    """Return the recipes that come along, by name."""
    return {path.stem: path for path in sorted(recipes_folder().glob("*.toml"))}


def purpose_of(path: Path) -> str:
    """Return what a recipe is for, a sentence.

    Args:
        path: One that comes along.
    """
    from robolink_cli.commands.shipped.recipe_purposes import PURPOSES

    return PURPOSES.get(path.stem) or first_comment(path)


def copy_recipe(name: str, path: Path, *, replace: bool = False) -> None:
    """Copy a recipe that comes along; the copy runs on simulated controllers alone.

    Args:
        name: Its name.
        path: Where to.
        replace: Whether a file that is there may be overwritten.

    Raises:
        ConfigError: There is no such recipe, or the file is there or cannot be written.
    """
    found = models()
    require_one_of(name, list(found), remedy=tr("'robolink recipe list' lists them."))
    require_free(path, replace=replace)
    first, *lines = found[name].read_text(encoding="utf-8").splitlines()
    if not first.startswith("#:schema "):
        lines.insert(0, first)
    lines = [f"{line}  {_MARK}" if _OF_THE_CELL.match(line) else line for line in lines]
    named = next(at for at, line in enumerate(lines) if line.startswith("name ="))
    lines.insert(named + 1, _NUMBERS)
    text = "\n".join([f"#:schema {recipe_schema().resolve().as_uri()}", *lines, ""])
    write_whole(path, text.encode(), mode=0o666)


def first_comment(path: Path) -> str:
    """Return what a recipe says of itself first, in English; empty for nothing.

    Args:
        path: The recipe.
    """
    with path.open(encoding="utf-8") as lines:
        comments = (line[1:].strip() for line in lines if line.startswith("# "))
        return next(comments, "")
