"""Asks which cell and which job, if neither was typed."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from robolink.errors import ConfigError, DeclinedError
from robolink.messages import spoken, tr
from robolink_cli.console.tables import columns, padded
from robolink_cli.prompts.current_desk import AskingDesk, current_desk
from robolink_cli.session.completion import address_of, is_recipe
from robolink_cli.wizard.state import ChoiceSubject, choose_in_either_language

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink.recipe import LoadedRecipe, RecipePast
    from robolink_cli.session.context import CliContext
    from robolink_cli.wizard.state import Header


_WIDE: Final = 78
"""Columns of a row of the list."""

_FOLDERS: Final = ("", "recipes")
"""Folders in which recipes are searched, relative to the cell file and to the working folder."""


def nobody_to_ask() -> DeclinedError:
    """Return the error of a command that would have to ask, where nobody is."""
    return DeclinedError(
        tr("There is nobody to ask here. Add --yes, or run it on a terminal."),
        remedy=tr("Nothing was sent."),
    )


def context_at_desk(context: "CliContext", job: str, *, steps: int = 0) -> "CliContext":
    """Return the context of a command; a person at a desk chooses a missing cell.

    Args:
        context: What it was told.
        job: What it is called in the first row, a sentence that was declared: the person may
            change the language.
        steps: How many numbered steps it has, 0 for none.

    Raises:
        ConfigError: There is no cell, or a cell file is wrong.
        DeclinedError: The person leaves.
    """
    from robolink_cli.session.context import context_of_cell, header_of

    desk = current_desk()
    if context.url is not None or desk is None:
        return context
    cell = choose_cell(desk, lambda: header_of(context, spoken(job), steps=steps))
    at = context_of_cell(cell.name)
    desk.regard(header_of(at, spoken(job), steps=steps))
    return at


def choose_cell(desk: AskingDesk, head: "Callable[[], Header]", *, marked: str = "") -> "Cell":
    """Let a person choose one of the cells of this computer; take the only one.

    Args:
        desk: Where.
        head: Makes the first row, in the language that is spoken by then.
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
                "To set one up: robolink cell new. To practise on a simulated robot: robolink "
                "docs tutorial"
            ),
        )
    if len(cells) == 1:
        return cells[0]
    rows = tuple(f"{cell.name}   {cell.settings.robot or cell.url}" for cell in cells)
    names = [cell.name for cell in cells]
    at = names.index(marked) if marked in names else 0

    def ask() -> tuple[str, ChoiceSubject]:
        desk.regard(head())
        return tr("Which cell?"), ChoiceSubject(tr("Choose"), (), rows, marked=at)

    return cells[choose_in_either_language(desk, ask, _nothing)]


def choose_recipe(
    desk: AskingDesk,
    cell: "Cell | None",
    url: str | None = None,
    *,
    head: "Callable[[], Header] | None" = None,
) -> "LoadedRecipe":
    """Let a person choose one of the recipes beside the cell file or here.

    Those of other cells, and those that this kind of controller could not carry out, are not among
    them. What was only used on another robot so far comes last.

    Args:
        desk: Where.
        cell: The cell, ``None`` where only a URL is known.
        url: The controller: what is on record of each recipe there is told beside it.
        head: Makes the first row, in the language that is spoken by then; ``None`` leaves it.

    Raises:
        ConfigError: There is none, or it is wrong; where there is none, one that comes along was
            copied if the person chose it.
        DeclinedError: The person leaves.
    """
    paths = recipes_at(cell)
    if not paths:
        raise _copied(desk, cell, url, head)
    loaded: list[LoadedRecipe] = []

    def ask() -> tuple[str, ChoiceSubject]:
        if head is not None:
            desk.regard(head())
        found = _of_this_kind(_of_this_cell(_loaded(desk, paths), cell), url, _axes(cell))
        ordered = sorted(
            zip(found, _pasts(found, url), strict=True),
            key=lambda one: one[1].elsewhere is not None,
        )
        loaded[:] = [recipe for recipe, _ in ordered]
        pasts = [past for _, past in ordered]
        unknown = _axes(cell) is None
        details = tuple(
            (*_told_of(*one), *_needs_tilt(one[0], unknown=unknown))
            for one in zip(loaded, pasts, strict=True)
        )
        rows = _rows_of(loaded, pasts)
        return tr("Which job?"), ChoiceSubject(tr("Choose"), (), rows, details=details)

    return loaded[choose_in_either_language(desk, ask, _nothing)]


def _loaded(desk: AskingDesk, paths: Sequence[Path]) -> "list[LoadedRecipe]":
    """Return the correct recipes; show the errors of the others.

    Raises:
        ConfigError: There is none.
    """
    from robolink.recipe import load_recipe

    loaded = []
    for path in paths:
        try:
            loaded.append(load_recipe(path))
        except ConfigError as error:
            desk.tell(f"{path}: {error.what}")
    if not loaded:
        raise ConfigError(
            tr("No recipe beside the cell file or in this folder is valid."),
            remedy=tr("To list the errors of one: robolink recipe check FILE"),
        )
    return loaded


def _copied(
    desk: AskingDesk,
    cell: "Cell | None",
    url: str | None,
    head: "Callable[[], Header] | None",
) -> ConfigError:
    """Let a person copy a shipped recipe; return that it is not run unchanged.

    Raises:
        ConfigError: None of them can be run by this kind of controller.
        DeclinedError: The person leaves.
    """
    from robolink.recipe import load_recipe
    from robolink_cli.commands.shipped.recipe import copy_recipe, models, purpose_of

    axes = _axes(cell)
    fitting = _of_this_kind([load_recipe(path) for path in models().values()], url, axes)
    # Recipes for every robot come first.
    fitting.sort(key=lambda one: one.recipe.source.of_method.needs.tilt)

    def ask() -> tuple[str, ChoiceSubject]:
        if head is not None:
            desk.regard(head())
        said = tr("Its numbers are for a simulated cell: replace them before you run it.")
        rows = tuple(one.path.stem for one in fitting)
        details = tuple(
            (spoken(purpose_of(one.path)), *_needs_tilt(one, unknown=axes is None), said)
            for one in fitting
        )
        question = tr("There is no recipe here yet. Which one do you want to start from?")
        return question, ChoiceSubject(
            tr("Choose"), (), rows, details=details, does=tr("Copy it"), enters=False
        )

    name = fitting[choose_in_either_language(desk, ask, _nothing)].path.stem
    path = _folders(cell)[0] / f"{name}.toml"
    copy_recipe(name, path)
    return ConfigError(
        tr("Written: {path}. Do not run it yet: its numbers are for a simulated cell.", path=path),
        remedy=tr("Enter yours, delete the line 'numbers', then: robolink recipe check FILE"),
    )


def _of_this_cell(loaded: "list[LoadedRecipe]", cell: "Cell | None") -> "list[LoadedRecipe]":
    """Return the recipes that may be run here.

    Raises:
        ConfigError: There is none.
    """
    name = cell.name if cell else ""
    fitting = [one for one in loaded if one.recipe.is_for(name)]
    if fitting:
        return fitting
    others = (f"{one.path.name} ({', '.join(one.recipe.cells)})" for one in loaded)
    raise ConfigError(
        tr("Every recipe found here is for another cell: {recipes}.", recipes=", ".join(others)),
        remedy=tr("Name that cell, or write a recipe for this one: robolink recipe list"),
    )


def _axes(cell: "Cell | None") -> int | None:
    """Return the number of axes of a cell's robot, if the cell file names a model."""
    from robolink.controllers import axes_of_model

    if cell is None:
        return None
    return axes_of_model(cell.url.partition("+")[0], cell.settings.robot)


def _needs_tilt(loaded: "LoadedRecipe", *, unknown: bool) -> tuple[str, ...]:
    """Return what a recipe needs of a robot that is not yet known to have it."""
    if not unknown or not loaded.recipe.source.of_method.needs.tilt:
        return ()
    return (
        tr(
            "Needs a robot that tilts its tool. The cell file does not name the robot, so "
            "robolink checks this after connecting."
        ),
    )


def _of_this_kind(
    loaded: "list[LoadedRecipe]", url: str | None, axes: int | None
) -> "list[LoadedRecipe]":
    """Return the recipes that this robot can carry out as far as known; a run refuses the rest.

    Raises:
        ConfigError: There is none.
    """
    from robolink.controllers import capabilities_of_kind
    from robolink.recipe import beyond

    able = capabilities_of_kind((url or "").partition("+")[0])
    if able is None:
        return loaded
    found = [(one, beyond(one.recipe, able, axes=axes)) for one in loaded]
    fitting = [one for one, why in found if not why]
    if fitting:
        return fitting
    told = (f"{one.path.name}: {' '.join(why)}" for one, why in found)
    raise ConfigError(
        tr("No recipe found here runs on this controller. {recipes}", recipes=" ".join(told)),
        remedy=tr("Write a recipe for this kind of controller: robolink recipe list"),
    )


def _pasts(loaded: "list[LoadedRecipe]", url: str | None) -> "tuple[RecipePast, ...]":
    """Return the records of each recipe; nothing if there is no readable record."""
    from robolink.errors import RobolinkError
    from robolink.journal import open_journal
    from robolink.recipe import RecipePast, pasts_of

    try:
        return pasts_of(loaded, open_journal(read_only=True), address_of(url))
    except (RobolinkError, OSError):
        return (RecipePast(),) * len(loaded)  # a list of jobs needs no record


def _rows_of(loaded: "Sequence[LoadedRecipe]", pasts: "Sequence[RecipePast]") -> tuple[str, ...]:
    """Return the rows, with the recorded duration of each job here."""
    names = [f"{one.name}   ({one.path.name})" for one in loaded]
    told = [
        "" if past.usual_s is None else tr("about {n} min", n=max(1, round(past.usual_s / 60)))
        for past in pasts
    ]
    wide = max(map(columns, names))
    if wide + 3 + max(map(columns, told)) > _WIDE:
        # The longest name decides: the duration is never cut off.
        return tuple(
            f"{time}   {name}" if time else name for name, time in zip(names, told, strict=True)
        )
    return tuple(
        f"{padded(name, wide)}   {time}".rstrip() for name, time in zip(names, told, strict=True)
    )


def _told_of(loaded: "LoadedRecipe", past: "RecipePast") -> tuple[str, ...]:
    """Return what a recipe does, for which tools, when it last did, and what is due."""
    from robolink.timing import local_label

    recipe = loaded.recipe
    said = [
        spoken(recipe.source.of_method.summary),
        tr("Tool: {numbers}", numbers=", ".join(str(one.number) for one in recipe.tools)),
    ]
    if past.last is not None:
        when, nozzle = local_label(past.last.at), past.last.signature.nozzle
        said.append(
            tr("Last change with it on this robot: {when}, needle {id}", when=when, id=nozzle)
            if nozzle
            else tr("Last change with it on this robot: {when}", when=when)
        )
    if past.elsewhere is not None:
        said.append(
            tr(
                "Used so far only on another robot, {robot}, last {when}. Do its poses fit here?",
                robot=past.elsewhere.controller,
                when=local_label(past.elsewhere.at),
            )
        )
    if past.changes_left is not None:
        said.append(due_in(past.changes_left))
    return tuple(said)


def due_in(left: int) -> str:
    """Return how many more changes are allowed before a full calibration, in words.

    Args:
        left: So many, 0 for now.
    """
    if left == 0:
        return tr("A full calibration is due now.")
    if left == 1:
        return tr("A full calibration is due after one more change.")
    return tr("A full calibration is due after {n} more changes.", n=left)


def recipes_at(cell: "Cell | None") -> list[Path]:
    """Return the recipe files beside the cell file and in the working folder.

    Args:
        cell: The cell, ``None`` where only a URL is known.
    """
    found: dict[Path, None] = {}
    for root in _folders(cell):
        for folder in _FOLDERS:
            place = root / folder
            if place.is_dir():
                for path in sorted(place.iterdir()):
                    if is_recipe(path):
                        found[path.resolve()] = None
    return list(found)


def _folders(cell: "Cell | None") -> list[Path]:
    """Return the folder of the cell file, if there is one, and the working folder."""
    here = [Path.cwd()]
    return [cell.origins["url"].parent, *here] if cell and "url" in cell.origins else here


def _nothing() -> None:
    """No controller is connected yet."""
