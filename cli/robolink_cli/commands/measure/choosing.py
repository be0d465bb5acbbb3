"""Which cell and which job: what is asked of whoever typed neither."""

from pathlib import Path
from typing import TYPE_CHECKING, Final

from robolink.errors import ConfigError, DeclinedError
from robolink.messages import spoken, tr
from robolink_cli.prompts.present import AskingDesk, present_desk
from robolink_cli.wizard.choices import ChoiceSubject, choose

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink.recipe import LoadedRecipe
    from robolink_cli.session.context import CliContext

_LOOKED_AT: Final = 500
"""So many of the newest changes are looked at for the last one with a recipe."""

_FOLDERS: Final = ("", "recipes")
"""Where recipes are looked for, beside the cell file and in the working folder."""


def nobody_to_ask() -> DeclinedError:
    """Return the end of a command that would have to ask, where nobody is."""
    return DeclinedError(
        tr("There is nobody to ask here. Add --yes, or run it on a terminal."),
        remedy=tr("Nothing was sent."),
    )


def context_at_desk(context: "CliContext", job: str) -> "CliContext":
    """Return what a command was told, with a cell where it names none and somebody is at a desk.

    Args:
        context: What it was told.
        job: What it is called in the first row.

    Raises:
        ConfigError: There is no cell, or a cell file is wrong.
        DeclinedError: The person leaves.
    """
    from robolink_cli.session.context import context_of_cell
    from robolink_cli.session.guidance import header_of

    desk = present_desk()
    if context.url is not None or desk is None:
        return context
    at = context_of_cell(choose_cell(desk).name)
    desk.regard(header_of(at, job))
    return at


def choose_cell(desk: AskingDesk, marked: str = "") -> "Cell":
    """Have one of the cells of this computer chosen; the only one is taken.

    Args:
        desk: Where.
        marked: Name of the one that is marked; empty for the first.

    Raises:
        ConfigError: There is none.
        DeclinedError: The person leaves.
    """
    from robolink.config import load_cells

    cells = list(load_cells().values())
    if not cells:
        raise ConfigError(
            tr("No cell is set up on this computer."),
            remedy=tr(
                "To set one up: robolink docs cell-files. To practise on a simulated robot: "
                "robolink docs tutorial"
            ),
        )
    if len(cells) == 1:
        return cells[0]
    rows = tuple(f"{cell.name}   {cell.settings.robot or cell.url}" for cell in cells)
    names = [cell.name for cell in cells]
    at = names.index(marked) if marked in names else 0
    subject = ChoiceSubject(tr("Choose"), (), rows, marked=at)
    return cells[choose(desk, tr("Which cell?"), subject, _nothing)]


def choose_recipe(desk: AskingDesk, cell: "Cell | None") -> "LoadedRecipe":
    """Have one of the recipes chosen that stand beside the cell file or here.

    Raises:
        ConfigError: There is none, or it is wrong.
        DeclinedError: The person leaves.
    """
    from robolink.recipe import load_recipe

    paths = _recipes(cell)
    loaded = []
    for path in paths:
        try:
            loaded.append(load_recipe(path))
        except ConfigError as error:
            desk.tell(f"{path}: {error.what}")
    if not loaded:
        raise ConfigError(
            tr("There is no recipe beside the cell file, nor in this folder."),
            remedy=tr(
                "To begin with one that comes along: robolink recipe list. To measure one tool "
                "without a recipe: robolink calibrate two-pose --tool N"
            ),
        )
    rows = tuple(f"{one.name}   ({one.path.name})" for one in loaded)
    details = tuple(_told_of(one) for one in loaded)
    subject = ChoiceSubject(tr("Choose"), (), rows, details=details)
    return loaded[choose(desk, tr("Which job?"), subject, _nothing)]


def _told_of(loaded: "LoadedRecipe") -> tuple[str, ...]:
    """Return what a recipe does, for which tools, and when it did so last on this computer."""
    from robolink.errors import RobolinkError
    from robolink.journal import open_journal
    from robolink.model import EntryKind
    from robolink.timing import local_label

    recipe = loaded.recipe
    said = [
        spoken(recipe.source.of_method.summary),
        tr("Tool: {numbers}", numbers=", ".join(str(one.number) for one in recipe.tools)),
    ]
    try:
        entries = open_journal(read_only=True).entries(kinds=(EntryKind.DONE,), limit=_LOOKED_AT)
        last = next((one for one in entries if one.signature.recipe == loaded.name), None)
    except (RobolinkError, OSError):
        last = None  # a list of jobs needs no record
    if last is None:
        return tuple(said)
    when, nozzle = local_label(last.at), last.signature.nozzle
    if nozzle:
        said.append(tr("Last change with it from here: {when}, needle {id}", when=when, id=nozzle))
    else:
        said.append(tr("Last change with it from here: {when}", when=when))
    return tuple(said)


def _recipes(cell: "Cell | None") -> list[Path]:
    from robolink_cli.session.completing import is_recipe

    roots = [Path.cwd()]
    if cell is not None and "url" in cell.origins:
        roots.insert(0, cell.origins["url"].parent)
    found: dict[Path, None] = {}
    for root in roots:
        for folder in _FOLDERS:
            place = root / folder
            if place.is_dir():
                for path in sorted(place.iterdir()):
                    if is_recipe(path):
                        found[path.resolve()] = None
    return list(found)


def _nothing() -> None:
    """No controller is connected yet."""
