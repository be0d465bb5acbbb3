"""What a plant's report says: drift, corrections by recipe, cells for a person, plans of a period.

Made from what is on record alone: no controller and no cell is asked.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from statistics import median
from typing import Final

from robolink.drift import DriftFinding, MeasuredChange, drift_of
from robolink.drift.history import slope_of
from robolink.fleet.plant_view.cell_states import CellState, distance_mm
from robolink.fleet.plant_view.copies import CopiedJournal, age_days
from robolink.fleet.plant_view.notes import PlanSummary, PlantLook
from robolink.methods import all_methods
from robolink.model import EntryKind, Recorded

NORMAL_MAD: Final = 1.4826
"""Standard deviation of normal values in units of their median absolute deviation."""

OUTLIER: Final = 5.0
"""From how many robust standard deviations on a correction stands out. Distances of normal errors
have a longer tail than the errors themselves: one in 3,000 is as far out by chance."""

LEAST_FOR_OUTLIERS: Final = 10
"""Fewest corrections of a recipe among which one can stand out."""

LEAST_FOR_SLOPE: Final = 3
"""Fewest changes of a tool for a slope."""

HEARD_WITHIN_DAYS: Final = 1.0
"""Within which its home notes how a cell stands, even where nothing happened, in days."""


@dataclass(frozen=True, slots=True)
class ToolTrend:
    """How one coordinate of a tool's measured tip went from change to change.

    Attributes:
        cell: Name of the cell, or identity of its controller where no cell is known.
        tool: Number of the tool.
        axis: ``x``, ``y`` or ``z``.
        count: How many changes.
        slope_mm: Slope of the line through them, mm a change.
        steepness: The same in its own standard deviations.
        last_mm: The last value, mm.
        nozzle: Id of the nozzle of the last change; empty when nobody gave one.
    """

    cell: str
    tool: int
    axis: str
    count: int
    slope_mm: float
    steepness: float
    last_mm: float
    nozzle: str


@dataclass(frozen=True, slots=True)
class CellFinding:
    """What the charts of a cell show.

    Attributes:
        cell: Name of the cell, or identity of its controller.
        finding: It.
    """

    cell: str
    finding: DriftFinding


@dataclass(frozen=True, slots=True)
class RecipeCorrections:
    """By how much changes by one recipe moved the stored tip.

    Attributes:
        name: Its name.
        hash: SHA-256 of its file.
        count: How many changes.
        median_mm: Their median, mm.
        spread_mm: Their robust standard deviation, mm.
        outliers: Cells and mm of those that stand out, the largest first.
    """

    name: str
    hash: str
    count: int
    median_mm: float
    spread_mm: float
    outliers: tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class RecipeCells:
    """Which cells run a recipe.

    Attributes:
        name: Its name.
        hash: SHA-256 of its file.
        since: Label of the first kept change by it at one of these cells.
        cells: Their names.
    """

    name: str
    hash: str
    since: str
    cells: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class PlantReport:
    """A plant in a period.

    Attributes:
        plant: Id of the plant.
        since: Label from which on changes and plans count.
        made_at: When it was made, as a label.
        cell_count: How many cells are noted.
        change_count: How many measured changes were read.
        unsettled: Cells with a job that is not proved finished, and since when.
        unheard: Cells whose home has not noted them for a day, and for how many; ``None`` for
            never.
        behind: Cells whose newest kept change the plant has no copy of, and how many days old the
            last copy is; ``None`` where there is none.
        attention: Cells whose last check found something, and what.
        overdue: Cells without a check for too long, and for how many days; ``None`` for never.
        findings: What the charts show.
        trends: Every coordinate of every tool with enough changes, the steepest first.
        corrections: By recipe, the one with most changes first.
        recipes: Which cells run which recipe.
        plans: The plans of the period, newest first.
        simulated: Whether a change that was read was simulated.
    """

    plant: str
    since: str
    made_at: str
    cell_count: int
    change_count: int
    unsettled: Mapping[str, str] = field(hash=False)
    unheard: Mapping[str, float | None] = field(hash=False)
    behind: Mapping[str, float | None] = field(hash=False)
    attention: Mapping[str, str] = field(hash=False)
    overdue: Mapping[str, float | None] = field(hash=False)
    findings: tuple[CellFinding, ...]
    trends: tuple[ToolTrend, ...]
    corrections: tuple[RecipeCorrections, ...]
    recipes: tuple[RecipeCells, ...]
    plans: tuple[PlanSummary, ...]
    simulated: bool = False

    @property
    def in_order(self) -> bool:
        """Whether no cell and no plan needs a person."""
        found = (self.unsettled, self.unheard, self.behind, self.attention, self.overdue)
        plans = any(plan.standing or plan.left_count for plan in self.plans)
        return not (plans or any((*found, self.findings)))


def report_of(
    look: PlantLook,
    journals: Iterable[CopiedJournal],
    *,
    plant: str,
    since: str,
    now: datetime,
    check_days: float,
) -> PlantReport:
    """Return the report of a plant.

    Args:
        look: What is on record of its cells and plans.
        journals: The entries of its cells.
        plant: Id of the plant.
        since: Label from which on changes and plans count; the charts rest on what came before,
            too.
        now: When it is made.
        check_days: After how many days a check is overdue.

    Example:
        >>> from robolink.fleet import PlantLook, report_of
        >>> from robolink.timing import wall_time
        >>> nothing = PlantLook({}, ())
        >>> report = report_of(
        ...     nothing, [], plant="plant", since="2026-11", now=wall_time(), check_days=7
        ... )
        >>> report.in_order, report.cell_count
        (True, 0)
    """
    gathered = _Gathered(look.cells, since, now)
    for journal in journals:
        gathered.add(journal)
    cells = look.cells
    return PlantReport(
        plant=plant,
        since=since,
        made_at=now.isoformat(timespec="seconds"),
        cell_count=len(cells),
        change_count=gathered.change_count,
        unsettled={one: at for one, state in cells.items() if (at := state.unsettled_since)},
        unheard={
            one: age
            for one, state in cells.items()
            if (age := age_days(state.noted_at, now)) > HEARD_WITHIN_DAYS
        }
        | dict.fromkeys(look.unnoted),
        behind=gathered.behind(),
        attention={one: state.verdict for one, state in cells.items() if state.well is False},
        overdue=dict(_overdue(cells, now, check_days)),
        findings=tuple(gathered.findings),
        trends=tuple(sorted(gathered.trends, key=lambda one: -abs(one.steepness))),
        corrections=_corrections(gathered.corrections),
        recipes=_recipes(cells),
        plans=tuple(plan for plan in look.plans if plan.made_at >= since or not plan.finished),
        simulated=gathered.simulated,
    )


class _Gathered:
    """What the entries of all journals come to; each journal is let go before the next."""

    def __init__(self, cells: Mapping[str, CellState], since: str, now: datetime) -> None:
        self._cells, self._since, self._now = cells, since, now
        self._names = {(one.journal, one.controller): name for name, one in cells.items()}
        self._homes = {one.controller: one.journal for one in cells.values()}
        methods = {method.name for method in all_methods() if method.needs.finds_pin}
        self._finds_pin = methods.__contains__
        self.change_count = 0
        self.simulated = False
        self._copied_at: dict[str, str] = {}
        self.findings: list[CellFinding] = []
        self.trends: list[ToolTrend] = []
        self.corrections: dict[str, tuple[str, list[tuple[str, float]]]] = {}

    def add(self, journal: CopiedJournal) -> None:
        """Add the entries of a journal; a controller whose record is elsewhere now is left out."""
        of_controllers: dict[str, list[Recorded]] = {}
        for entry in journal.entries:
            if self._homes.get(entry.controller, journal.home) == journal.home:
                of_controllers.setdefault(entry.controller, []).append(entry)
        for controller, entries in of_controllers.items():
            cell = self._names.get((journal.home, controller), controller)
            self._add_drift(cell, controller, entries)
            self._add_corrections(cell, entries)
        newest = max(journal.copied_at, self._copied_at.get(journal.home, ""))
        self._copied_at[journal.home] = newest

    def behind(self) -> dict[str, float | None]:
        """Return the cells whose newest change is in no copy; of own journals that is none."""
        copied = self._copied_at
        if copied and not any(copied.values()):
            return {}
        found: dict[str, float | None] = {}
        for cell, state in self._cells.items():
            at = copied.get(state.journal, "")
            if state.changed_at > at:
                found[cell] = age_days(at, self._now) if at else None
        return found

    def _add_drift(self, cell: str, controller: str, entries: list[Recorded]) -> None:
        drift = drift_of(controller, entries, finds_pin=self._finds_pin)
        self.simulated = self.simulated or (bool(drift.changes) and drift.simulated)
        recent = [change for change in drift.changes if change.at >= self._since]
        self.change_count += len(recent)
        if not recent:
            return
        self.findings += [CellFinding(cell, one) for one in drift.findings]
        of_tools: dict[int, list[MeasuredChange]] = {}
        for change in recent:
            of_tools.setdefault(change.tool, []).append(change)
        for tool, changes in of_tools.items():
            for axis in ("x", "y", "z"):
                values = [one.tip_mm[axis] for one in changes if axis in one.tip_mm]
                if len(values) >= LEAST_FOR_SLOPE:
                    slope, steepness = slope_of(values)
                    nozzle = changes[-1].nozzle
                    self.trends.append(
                        ToolTrend(
                            cell, tool, axis, len(values), slope, steepness, values[-1], nozzle
                        )
                    )

    def _add_corrections(self, cell: str, entries: list[Recorded]) -> None:
        for entry in entries:
            signature = entry.signature
            if entry.kind is not EntryKind.DONE or not signature.recipe_hash:
                continue
            moved = distance_mm(entry)
            if moved is not None and entry.at >= self._since:
                _, found = self.corrections.setdefault(
                    signature.recipe_hash, (signature.recipe, [])
                )
                found.append((cell, moved))


def _corrections(
    found: Mapping[str, tuple[str, list[tuple[str, float]]]],
) -> tuple[RecipeCorrections, ...]:
    rows = []
    for its_hash, (name, values) in found.items():
        numbers = [value for _, value in values]
        middle = median(numbers)
        spread = NORMAL_MAD * median(abs(value - middle) for value in numbers)
        far = [one for one in values if abs(one[1] - middle) > OUTLIER * max(spread, 0.001)]
        far.sort(key=lambda one: -one[1])
        enough = len(values) >= LEAST_FOR_OUTLIERS
        rows.append(
            RecipeCorrections(
                name, its_hash, len(values), middle, spread, tuple(far) if enough else ()
            )
        )
    return tuple(sorted(rows, key=lambda row: -row.count))


def _recipes(cells: Mapping[str, CellState]) -> tuple[RecipeCells, ...]:
    found: dict[str, list[tuple[str, str, str]]] = {}
    for cell, state in cells.items():
        if state.recipe is not None:
            one = state.recipe
            found.setdefault(one.hash, []).append((one.since, one.name, cell))
    rows = [
        RecipeCells(
            max(group)[1],
            its_hash,
            min(since for since, _, _ in group),
            tuple(cell for _, _, cell in group),
        )
        for its_hash, group in found.items()
    ]
    return tuple(sorted(rows, key=lambda row: -len(row.cells)))


def _overdue(
    cells: Mapping[str, CellState], now: datetime, check_days: float
) -> Iterable[tuple[str, float | None]]:
    for cell, state in cells.items():
        if not state.checked_at:
            yield cell, None
        elif (age := age_days(state.checked_at, now)) > check_days:
            yield cell, age
