"""Asks which cell and which job, if neither was typed."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from robolink.errors import ConfigError, DeclinedError
from robolink.messages import spoken, tr
from robolink_cli.console.tables import columns, padded
from robolink_cli.prompts.current_desk import AskingDesk, current_desk
from robolink_cli.session.cell_recipes import (
    axes_of,
    duration_of,
    folders_of,
    of_this_cell,
    of_this_kind,
    recipes_at,
    told_of,
    with_pasts,
)
from robolink_cli.wizard.state import ChoiceSubject, choose_in_either_language

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink.recipe import LoadedRecipe, RecipePast
    from robolink_cli.session.context import CliContext
    from robolink_cli.wizard.state import Header


_WIDE: Final = 78
"""Columns of a row of the list."""


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
        found = of_this_kind(of_this_cell(_loaded(desk, paths), cell), url, axes_of(cell))
        ordered = with_pasts(found, url)
        loaded[:] = [recipe for recipe, _ in ordered]
        pasts = [past for _, past in ordered]
        unknown = axes_of(cell) is None
        details = tuple(
            (*told_of(*one), *_needs_tilt(one[0], unknown=unknown))
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

    axes = axes_of(cell)
    fitting = of_this_kind([load_recipe(path) for path in models().values()], url, axes)
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
    path = folders_of(cell)[0] / f"{name}.toml"
    copy_recipe(name, path)
    return ConfigError(
        tr("Written: {path}. Do not run it yet: its numbers are for a simulated cell.", path=path),
        remedy=tr("Enter yours, delete the line 'numbers', then: robolink recipe check FILE"),
    )


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


def _rows_of(loaded: "Sequence[LoadedRecipe]", pasts: "Sequence[RecipePast]") -> tuple[str, ...]:
    """Return the rows, with the recorded duration of each job here."""
    names = [f"{one.name}   ({one.path.name})" for one in loaded]
    told = ["".join(duration_of(past)) for past in pasts]
    wide = max(map(columns, names))
    if wide + 3 + max(map(columns, told)) > _WIDE:
        # The longest name decides: the duration is never cut off.
        return tuple(
            f"{time}   {name}" if time else name for name, time in zip(names, told, strict=True)
        )
    return tuple(
        f"{padded(name, wide)}   {time}".rstrip() for name, time in zip(names, told, strict=True)
    )


def _nothing() -> None:
    """No controller is connected yet."""
