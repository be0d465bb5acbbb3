"""recipe list, new, check: recipes to start from, and whether one is right."""

import re
from pathlib import Path
from typing import Annotated, Final

import click

from robolink.files.durable import write_whole
from robolink.files.named import require_free
from robolink.messages import declared, spoken, tr
from robolink_cli.commands.shipped.shipped_files import (
    recipe_schema,
    recipes_folder,
    require_one_of,
)
from robolink_cli.console.render import emit_json, json_is_on, say, say_listed
from robolink_cli.options.consent import Overwrite
from robolink_cli.options.declaration import CliArgument
from robolink_cli.options.shared import json_option
from robolink_cli.session.completion import complete_recipe

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
    """Return the shipped recipes, by name."""
    return {path.stem: path for path in sorted(recipes_folder().glob("*.toml"))}


def purpose_of(path: Path) -> str:
    """Return the purpose of a recipe, a sentence.

    Args:
        path: One that comes along.
    """
    return PURPOSES.get(path.stem) or first_comment(path)


def copy_recipe(name: str, path: Path, *, replace: bool = False) -> None:
    """Copy a shipped recipe; the copy runs on simulated controllers alone.

    Args:
        name: Its name.
        path: Where to.
        replace: Whether a file that is there may be overwritten.

    Raises:
        ConfigError: There is no such recipe, or the file is there or cannot be written.
    """
    found = models()
    missing = tr("No recipe {name!r}.", name=name)
    require_one_of(name, list(found), missing, remedy=tr("To see all: robolink recipe list"))
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
    """Return the first comment of a recipe, in English; empty for none.

    Args:
        path: The recipe.
    """
    with path.open(encoding="utf-8") as lines:
        comments = (line[1:].strip() for line in lines if line.startswith("# "))
        return next(comments, "")


@click.group()
def recipe() -> None:
    """Recipes: copy one to start from, and check your own."""


def _complete_model(_: click.Context, __: click.Parameter, start: str) -> list[str]:
    """Return the recipes that come with robolink whose names begin so, for TAB."""
    return [name for name in models() if name.startswith(start)]


@recipe.command("list")
@json_option
def list_models() -> None:
    """List the recipes that come with robolink."""
    purposes = {name: purpose_of(path) for name, path in models().items()}
    if json_is_on():
        entries = [{"name": name, "purpose": text} for name, text in purposes.items()]
        emit_json("robolink/recipes/1", {"recipes": entries})
        return
    say_listed({name: spoken(text) for name, text in purposes.items()})
    say(tr("To start from one: robolink recipe new NAME FILE"))


@recipe.command("new", short_help="Copy a recipe to a file of your own.")
@json_option
def new(
    *,
    name: Annotated[str, CliArgument(shell_complete=_complete_model)],
    file: Annotated[Path | None, CliArgument()] = None,
    force: Overwrite = False,
) -> None:
    """Copy the recipe NAME to FILE; without FILE to NAME.toml in the working folder.

    Its numbers are for the simulated cell, and with them it runs only on simulated controllers.
    Enter your own in the marked lines, delete the line 'numbers', then run 'robolink recipe check
    FILE'. Its first line tells an editor the allowed keys.
    """
    wanted = name.removesuffix(".toml")
    path = file or Path(f"{wanted}.toml")
    copy_recipe(wanted, path, replace=force)
    if json_is_on():
        emit_json("robolink/recipe-new/1", {"recipe": wanted, "path": str(path)})
    else:
        say(tr("Written: {path}", path=path))
        say(tr("Enter the numbers of your cell, then: robolink recipe check {path}", path=path))


@recipe.command("check")
@json_option
def check(
    *,
    file: Annotated[Path, CliArgument(shell_complete=complete_recipe)],
) -> int:
    """List every error in the recipe FILE. Connects to no controller."""
    from robolink.recipe import check_recipe

    problems = check_recipe(file)
    if json_is_on():
        entries = [{"where": one.where, "what": one.what} for one in problems]
        emit_json("robolink/recipe-check/1", {"ok": not problems, "problems": entries})
    elif problems:
        for one in problems:
            say(": ".join(filter(None, (one.where, one.what))))
    else:
        say(tr("The recipe {path} is valid.", path=file))
    return 2 if problems else 0


PURPOSES: Final = {
    "five-axes-pivot": declared(
        "A robot that can tilt its tool, a pin and a person: X, Y and Z in one measurement."
    ),
    "gantry-touch-probe": declared(
        "The length of a nozzle on a gantry (Kin_Gantry3), by a touch probe; nobody touches "
        "anything."
    ),
    "held-board": declared(
        "A board that the gripper holds, and an up-looking camera; nobody touches anything."
    ),
    "leaning-plate": declared(
        "A robot that can tilt its tool, a flat plate that leans, and a person: X, Y and Z "
        "without a pin."
    ),
    "needle-beams": declared(
        "A dispensing needle and two crossed light beams; nobody touches anything."
    ),
    "needle-one-touch": declared("The change of a dispensing needle with one touch: X, Y and Z."),
    "nozzle-and-camera": declared(
        "A nozzle and an up-looking camera that nobody has calibrated; both are found in one "
        "pattern."
    ),
    "pendant-points": declared("Points that were taught on the pendant; nothing moves."),
    "pick-nozzle-camera": declared(
        "A pick nozzle and an up-looking camera; nobody touches anything."
    ),
    "scara-pin": declared("A SCARA, a pin and a person."),
    "sphere": declared(
        "A robot that can tilt its tool, a ball, and a person: X, Y and Z without a pin."
    ),
    "two-nozzles": declared(
        "Two nozzles on one head: both are measured before one is written; all are written or none."
    ),
}
