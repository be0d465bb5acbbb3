"""How a cell stands by its record, in one row at the plant.

The agent at the cell's home derives it from the journal and notes it. It says nothing that is not
on record, and nothing is asked of a controller.
"""

import json
import math
from bisect import bisect_left
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Final

from robolink.fleet.plant_view.later_proofs import KEPT
from robolink.model import EntryKind, Recorded, RecordedCheck, read_offset

COUNTED: Final = {
    EntryKind.DONE: "done",
    EntryKind.NOT_APPLIED: "not_applied",
    EntryKind.ROLLED_BACK: "rolled_back",
    EntryKind.CONFLICT: "conflict",
    EntryKind.REFUSED: "refused",
}
"""Entries with which a change of one tool ends, and what they are called where they are counted."""

READ: Final = (*COUNTED, EntryKind.DECISION)
"""Entries that a state follows from."""

BOUNDS_MM: Final = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Upper bounds of the histogram of corrections, mm; whatever is larger counts beyond them."""

_DOCUMENT: Final = 1


@dataclass(frozen=True, slots=True)
class RecipeInUse:
    """The recipe of the last kept change that was made by one.

    Attributes:
        name: Its name.
        hash: SHA-256 of its file.
        since: Label of the first kept change with that hash, without another in between.
    """

    name: str
    hash: str
    since: str


@dataclass(frozen=True, slots=True)
class CellState:
    """How a cell stands by its record.

    Attributes:
        controller: Its identity, as in the journal.
        journal: Where that journal lies: computer and file, or the URL of its database.
        noted_at: When it was noted, as a label; empty before.
        changed_at: Label of the last kept change; empty for none.
        changes: How many changes of a tool ended in each way, by :data:`COUNTED`.
        corrections: How many kept changes moved the stored tip by up to each of
            :data:`BOUNDS_MM`, and beyond, each counted once.
        moved_mm: By how much all of them did together, mm.
        recipe: The recipe in use; ``None`` where no kept change was made by one.
        unsettled_since: Label of the oldest job that was begun and is not proved finished; empty
            for none.
        checked_at: Label of the last check; empty for none.
        well: Whether that found nothing; ``None`` without one.
        verdict: What it found, in words.
    """

    controller: str = ""
    journal: str = ""
    noted_at: str = field(default="", compare=False)
    changed_at: str = ""
    changes: Mapping[str, int] = field(default_factory=dict, hash=False)
    corrections: tuple[int, ...] = (0,) * (len(BOUNDS_MM) + 1)
    moved_mm: float = 0.0
    recipe: RecipeInUse | None = None
    unsettled_since: str = ""
    checked_at: str = ""
    well: bool | None = None
    verdict: str = ""

    def document(self) -> dict[str, object]:
        """Return it as plain JSON, as it is stored."""
        said = {**asdict(self), "form": _DOCUMENT, "corrections": list(self.corrections)}
        del said["noted_at"]
        return said

    def as_json(self, cell: str) -> dict[str, object]:
        """Return it for other programs, plain JSON.

        Args:
            cell: Name of the cell.
        """
        bounds = (*(f"{bound:g}" for bound in BOUNDS_MM), "more")
        return {
            "cell": cell,
            "controller": self.controller or None,
            "noted_at": self.noted_at or None,
            "unsettled_since": self.unsettled_since or None,
            "checked_at": self.checked_at or None,
            "well": self.well,
            "verdict": self.verdict or None,
            "changed_at": self.changed_at or None,
            "changes": {name: self.changes.get(name, 0) for name in COUNTED.values()},
            "corrections_mm": dict(zip(bounds, self.corrections, strict=True)),
            "recipe": None if self.recipe is None else asdict(self.recipe),
        }

    @classmethod
    def from_row(cls, noted_at: str, document: str) -> "CellState":
        """Return what was stored.

        Args:
            noted_at: When.
            document: The JSON text.
        """
        said = json.loads(document)
        del said["form"]
        recipe = said.pop("recipe")
        return cls(
            **{**said, "corrections": tuple(said["corrections"])},
            noted_at=noted_at,
            recipe=None if recipe is None else RecipeInUse(**recipe),
        )

    def after(self, entries: Iterable[Recorded]) -> "CellState":
        """Return how it stands after further entries of its controller.

        Args:
            entries: Those of the kinds in :data:`READ`, oldest first, each once.

        Example:
            >>> from robolink import ToolOffset
            >>> from robolink.controllers import SimpleController
            >>> from robolink.fleet import CellState
            >>> from robolink.transaction import Wanted, change_tools
            >>> controller = SimpleController(identity="memory+object://cell-state")
            >>> _ = change_tools(controller, [Wanted(3, ToolOffset(1, 2, -30), None)])
            >>> entries = reversed(list(controller.outcomes.recorded()))
            >>> CellState().after(entries).changes
            {'done': 1}
        """
        changes, corrections = dict(self.changes), list(self.corrections)
        moved_mm, changed_at, recipe = self.moved_mm, self.changed_at, self.recipe
        for entry in entries:
            if entry.tool is None:
                continue
            if entry.kind in KEPT and "value" in entry.details:
                recipe = _recipe_after(recipe, entry)
            if entry.kind not in COUNTED:
                continue
            name = COUNTED[entry.kind]
            changes[name] = changes.get(name, 0) + 1
            if entry.kind is not EntryKind.DONE:
                continue
            changed_at = entry.at
            moved = distance_mm(entry)
            if moved is not None:
                corrections[bisect_left(BOUNDS_MM, moved)] += 1
                moved_mm += moved
        return replace(
            self,
            changed_at=changed_at,
            changes=changes,
            corrections=tuple(corrections),
            moved_mm=round(moved_mm, 6),
            recipe=recipe,
        )

    def checked(self, check: RecordedCheck) -> "CellState":
        """Return how it stands after a check, as :attr:`checked_at` and what follows it say."""
        return replace(self, checked_at=check.at, well=check.well, verdict=check.verdict)


def _recipe_after(before: RecipeInUse | None, entry: Recorded) -> RecipeInUse | None:
    name, its_hash = entry.signature.recipe, entry.signature.recipe_hash
    if not its_hash:
        return before
    if before is not None and before.hash == its_hash:
        return replace(before, name=name)
    return RecipeInUse(name, its_hash, entry.at)


def distance_mm(entry: Recorded) -> float | None:
    """Return by how much a change moved the stored tip; ``None`` where it first defined one."""
    before, value = (read_offset(entry.details.get(name)) for name in ("before", "value"))
    if before is None or value is None:
        return None
    return math.dist((before.x_mm, before.y_mm, before.z_mm), (value.x_mm, value.y_mm, value.z_mm))
