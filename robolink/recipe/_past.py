"""The records of a recipe, before anything is connected: when, how long, what is due."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, Final

from robolink.methods import KEPT, ToolHistory
from robolink.model import EntryKind, Recorded, read_offset

if TYPE_CHECKING:
    from robolink.journal import Journal
    from robolink.recipe._loading import LoadedRecipe

_LOOKED_AT: Final = 1000
"""Number of newest entries that are searched for changes with a recipe."""

_LAST: Final = 5
"""Number of recent changes that give the usual duration."""


@dataclass(frozen=True, slots=True)
class RecipePast:
    """The records of a recipe.

    Attributes:
        last: The end of the last change with it on this controller; ``None`` for none.
        elsewhere: The same on another controller, where it was never used on this one.
        usual_s: How many seconds a change with it takes on this controller, from its first
            movement to the end of its test: the median of the last ones; ``None`` where it was
            never done, or no record says how long it took.
        changes_left: After how many more changes a full calibration is due, 0 for now; of several
            tools the one that comes first. ``None`` where the record does not say it.
    """

    last: Recorded | None = None
    elsewhere: Recorded | None = None
    usual_s: float | None = None
    changes_left: int | None = None


def pasts_of(
    recipes: Sequence["LoadedRecipe"], journal: "Journal", address: str
) -> tuple[RecipePast, ...]:
    """Return the records of each recipe.

    Args:
        recipes: The recipes.
        journal: The journal; it is read.
        address: Under which address the journal knows the controller, empty where none is known:
            then nothing is told.

    Raises:
        JournalError: It cannot be read.

    Example:
        >>> from robolink.journal import memory_journal
        >>> from robolink.recipe import pasts_of
        >>> pasts_of([], memory_journal("pasts-example"), "epson+tcp://192.168.0.1:5000")
        ()
    """
    if not address:
        return (RecipePast(),) * len(recipes)
    entries = list(journal.entries(kinds=KEPT, limit=_LOOKED_AT))
    names = journal.names_of(address)
    found = []
    for loaded in recipes:
        ends = [one for one in entries if one.signature.recipe == loaded.name]
        here = [one for one in ends if one.controller in names]
        last = _last_done(here)
        found.append(
            RecipePast(
                last,
                _last_done(ends) if last is None else None,
                _usual_s(here),
                _changes_left(loaded, journal, address),
            )
        )
    return tuple(found)


def _last_done(ends: Iterable[Recorded]) -> Recorded | None:
    return next((one for one in ends if one.kind is EntryKind.DONE), None)


def _usual_s(ends: Iterable[Recorded]) -> float | None:
    """Return the median duration of the last changes, from each tool's entry."""
    took: dict[str, float] = {}
    for one in ends:
        said = one.details.get("took_s")
        if isinstance(said, int | float) and len(took) < _LAST:
            took.setdefault(one.change, float(said))
    return median(took.values()) if took else None


def _changes_left(loaded: "LoadedRecipe", journal: "Journal", address: str) -> int | None:
    return min(changes_left_of(loaded, journal, address).values(), default=None)


def changes_left_of(loaded: "LoadedRecipe", journal: "Journal", address: str) -> dict[int, int]:
    """Return how many more changes each tool may have before a full calibration; 0 for none.

    Tools of which the record does not say it are left out.

    Args:
        loaded: The recipe.
        journal: The journal; it is read.
        address: Under which address the journal knows the controller.

    Raises:
        JournalError: It cannot be read.

    Example:
        >>> from pathlib import Path
        >>> from robolink.journal import memory_journal
        >>> from robolink.recipe import changes_left_of, load_recipe
        >>> from robolink_simulators.testkit.operator import written_recipe
        >>> loaded = load_recipe(written_recipe(Path.cwd()))
        >>> changes_left_of(loaded, memory_journal("left-example"), "epson+tcp://192.168.0.1:5000")
        {}
    """
    recipe = loaded.recipe
    tells = recipe.source.of_method.changes_left
    if tells is None or journal.robots_of(address):
        return {}  # with several robots, it is unknown here which one is meant
    left = {}
    for tool in recipe.tools:
        holds = journal.last_value(address, tool.number)
        history = ToolHistory(
            station=recipe.station.id,
            kept=journal.entries(controller=address, tool=tool.number, kinds=KEPT),
            holds=None if holds is None else read_offset(holds.details.get("value")),
            sigma_mm=recipe.tolerances.sigma_mm,
            interval_mm=recipe.tolerances.interval_mm,
        )
        found = tells(recipe.parameters, history)
        if found is not None:
            left[tool.number] = found
    return left
