"""The recipes that a cell can use, and what is on record of each; nothing is sent."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

from robolink.errors import ConfigError, RobolinkError
from robolink.messages import spoken, tr
from robolink_cli.session.completion import address_of, is_recipe

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink.recipe import LoadedRecipe, RecipePast

_FOLDERS: Final = ("", "recipes")
"""Folders in which recipes are searched, relative to the cell file and to the working folder."""


def recipes_for(cell: "Cell") -> "list[tuple[LoadedRecipe, RecipePast]]":
    """Return the recipes that a person could choose on a cell, in that order, with their records.

    Files that are none, or wrong, are left out.

    Args:
        cell: The cell.
    """
    from robolink.recipe import load_recipe

    loaded = []
    for path in recipes_at(cell):
        with suppress(RobolinkError, OSError):
            loaded.append(load_recipe(path))
    if not loaded:
        return []
    try:
        found = of_this_kind(of_this_cell(loaded, cell), cell.url, axes_of(cell))
    except ConfigError:
        return []
    return with_pasts(found, cell.url)


def record_of(loaded: "LoadedRecipe", past: "RecipePast") -> tuple[str, ...]:
    """Return how long a recipe takes, for which tools, when it was used last, and what is due.

    Args:
        loaded: The recipe.
        past: Its records.
    """
    _, tools, *rest = told_of(loaded, past)
    return (" \N{MIDDLE DOT} ".join((*duration_of(past), tools)), *rest)


def recipes_at(cell: "Cell | None") -> list[Path]:
    """Return the recipe files beside the cell file and in the working folder.

    Args:
        cell: The cell, ``None`` where only a URL is known.
    """
    found: dict[Path, None] = {}
    for root in folders_of(cell):
        for folder in _FOLDERS:
            place = root / folder
            if place.is_dir():
                for path in sorted(place.iterdir()):
                    if is_recipe(path):
                        found[path.resolve()] = None
    return list(found)


def folders_of(cell: "Cell | None") -> list[Path]:
    """Return the folder of the cell file, if there is one, and the working folder."""
    here = [Path.cwd()]
    return [cell.origins["url"].parent, *here] if cell and "url" in cell.origins else here


def of_this_cell(loaded: "list[LoadedRecipe]", cell: "Cell | None") -> "list[LoadedRecipe]":
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


def of_this_kind(
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


def axes_of(cell: "Cell | None") -> int | None:
    """Return the number of axes of a cell's robot, if the cell file names a model."""
    from robolink.controllers import axes_of_model

    if cell is None:
        return None
    return axes_of_model(cell.url.partition("+")[0], cell.settings.robot)


def with_pasts(
    found: "list[LoadedRecipe]", url: str | None
) -> "list[tuple[LoadedRecipe, RecipePast]]":
    """Return recipes with their records; what was only used on another robot so far comes last."""
    both = zip(found, _pasts(found, url), strict=True)
    return sorted(both, key=lambda one: one[1].elsewhere is not None)


def _pasts(loaded: "list[LoadedRecipe]", url: str | None) -> "tuple[RecipePast, ...]":
    """Return the records of each recipe; nothing if there is no readable record."""
    from robolink.journal import open_journal
    from robolink.recipe import RecipePast, pasts_of

    try:
        address = address_of(url)
        return pasts_of(loaded, open_journal(address=address, read_only=True), address)
    except (RobolinkError, OSError):
        return (RecipePast(),) * len(loaded)  # a list of jobs needs no record


def duration_of(past: "RecipePast") -> tuple[str, ...]:
    """Return how long a recipe takes on this controller; nothing where that is not on record.

    Args:
        past: Its records.
    """
    if past.usual_s is None:
        return ()
    return (tr("about {n} min", n=max(1, round(past.usual_s / 60))),)


def told_of(loaded: "LoadedRecipe", past: "RecipePast") -> tuple[str, ...]:
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
