"""The jobs that plans have for people at the cells of this computer, and how they ended.

Plans whose robots move are carried out at the cells, each by a person there (docs/fleet.md). What
became of such a job is in the record of its cell, in the transaction that kept its value: where
nobody could report it to the plant's database, it is reported from there later.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from robolink.drift import KINDS, measured_changes
from robolink.errors import ConfigError, JournalError, RobolinkError
from robolink.fleet import (
    CellJob,
    FleetStore,
    JobOutcome,
    JobState,
    Permit,
    Plan,
    PlanProgress,
    RecordedOutcome,
    Treatment,
    WaitReason,
    corrections_of,
    default_plant,
    treatment_of,
)
from robolink.fleet.errors import PlantError
from robolink.messages import in_english, tr
from robolink.timing import local_label
from robolink_cli.console.exit_codes import BUG, DONE, UNKNOWN, USAGE, exit_code
from robolink_cli.session.cell_recipes import recipes_at

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink.model import OutcomeLog
    from robolink.recipe import LoadedRecipe


@dataclass(frozen=True, slots=True)
class PlannedJob:
    """The job of a plan at a cell, where a person carries it out.

    Attributes:
        plan: The plan.
        job: How it stands there.
        why: Why it waits; ``None`` where it was begun and has not ended.
        may_write: Whether it may do what it has not done yet.
        permit: By which permit; ``None`` where none holds now.
    """

    plan: Plan
    job: CellJob
    why: WaitReason | None
    may_write: bool
    permit: Permit | None

    @property
    def is_due(self) -> bool:
        """Whether a person may carry it out now, or find out how it ended."""
        return self.why in (None, WaitReason.PERSON)

    def told(self) -> tuple[str, ...]:
        """Return what is to be read of it before anybody agrees to it."""
        plan = self.plan
        lines = [
            tr("plan {plan}, {kind}: {name}", plan=plan.id, kind=plan.kind, name=plan.name),
            tr("recipe {path}, SHA-256 {hash}", path=plan.recipe, hash=plan.recipe_hash[:12]),
            tr("ring {number} of {count}", number=self.job.ring + 1, count=len(plan.rings)),
        ]
        if self.permit is not None:
            until = local_label(self.permit.until_at)
            lines.append(tr("permit: {who}, until {until}", who=self.permit.person, until=until))
        if self.why is None:
            since = local_label(self.job.begun_at)
            lines.append(tr("begun on {when}; robolink does not know yet how it ended", when=since))
        return tuple(lines)


def jobs_at(store: FleetStore, plant: str, cell: str = "") -> tuple[PlannedJob, ...]:
    """Return the jobs for a person that have not ended: those that are due first, the oldest first.

    One whose home is another computer waits here, whatever it does there.

    Args:
        store: The plant's database.
        plant: Id of the plant: another one may have a cell of the same name.
        cell: Name of the cell; empty for all of them.

    Raises:
        PlantError: The database cannot be used.
    """
    found = []
    for plan in store.open_plans(plant, cell):
        progress = store.progress(plan)
        if progress.plan.kind.moves:
            permit = store.permit_for(progress.plan)
            for job in progress.jobs:
                if cell in ("", job.cell) and not job.state.final:
                    here = progress.is_at_home(job.cell, store.home)
                    why = progress.why(job) if here else WaitReason.HOME
                    may_write = progress.facts.may_write
                    found.append(PlannedJob(progress.plan, job, why, may_write, permit))
    return tuple(sorted(found, key=lambda one: not one.is_due))


def due_at_cells(plant: str) -> Mapping[str, PlannedJob]:
    """Return the first job that is due at each cell, by the cell's name; nothing without a plan.

    Args:
        plant: Id of the plant.

    Raises:
        RobolinkError: The plant's database cannot be used.
    """
    with FleetStore(default_plant()) as store:
        jobs = jobs_at(store, plant) if store.made else ()
    return {one.job.cell: one for one in reversed(jobs) if one.is_due}


def recipe_here(plan: Plan, cell: "Cell") -> "LoadedRecipe":
    """Return the recipe that was frozen: the file that the plan names, or another of this cell.

    Recipes are known by their hash, wherever their file lies on the cell's computer.

    Raises:
        ConfigError: No file here is that recipe.
    """
    from robolink.recipe import load_recipe

    try:
        found = plan.require_recipe()
    except ConfigError:
        for path in recipes_at(cell):
            with suppress(RobolinkError, OSError):
                loaded = load_recipe(path)
                if loaded.sha256 == plan.recipe_hash:
                    return loaded
        raise
    assert found is not None  # noqa: S101 - a plan that moves has one
    return found


def outcome_of(error: BaseException) -> JobOutcome:
    """Return what an error means for a job.

    What this computer refuses, as a full disk does, is the fault of no cell and no defect: the plan
    halts, and goes on with the same cells when a person resumes it.
    """
    if isinstance(error, OSError) and not isinstance(error, RobolinkError):
        code = exit_code(error)
        what = f"This computer cannot do its part: {error}."
        return JobOutcome(USAGE if code == BUG else code, error=PlantError.__name__, what=what)
    what = getattr(error, "what", "") or f"{type(error).__name__}: {error}"
    reason = getattr(error, "reason", None)
    return JobOutcome(
        exit_code(error),
        error=type(error).__name__,
        reason="" if reason is None else str(reason),
        what=in_english(what),
    )


def ends_order(error: BaseException) -> bool:
    """Return whether an error may be the last word of an order that a plan delivers.

    A defect is not, nor what this computer refuses: the plan halts, and the person who resumes it
    has the order delivered again.
    """
    if isinstance(error, (RobolinkError, KeyboardInterrupt)):
        return True
    outcome = outcome_of(error)
    return treatment_of(outcome.code, outcome.error) is Treatment.PERSON


def kept_before(kept: JobOutcome | None, error: BaseException) -> JobOutcome:
    """Return the outcome of a job that an error ended.

    Args:
        kept: Its outcome by the record, where its order was carried out before the error; what came
            then, such as a stop on the way to the safe pose, takes back nothing.
        error: What ended it. Where something is unproved, that goes before all else.
    """
    ended = outcome_of(error)
    if kept is None or ended.code == UNKNOWN:
        return ended
    return replace(kept, what=f"{kept.what} Then: {ended.what}")


def ordered_job(plan: Plan) -> dict[str, object]:
    """Return what the orders of a plan are for: the same at each delivery, whoever gives it."""
    return {"command": "fleet", "kind": str(plan.kind), "recipe": plan.recipe_hash}


def outcome_on_record(outcomes: "OutcomeLog", plan: Plan, cell: str) -> JobOutcome | None:
    """Return how a job ended, by the record of its cell; ``None`` where it has no end there.

    Args:
        outcomes: The record.
        plan: The plan.
        cell: Name of the cell.

    Raises:
        JournalError: The record cannot be read.
    """
    from robolink.transaction import order_on_record

    try:
        done = order_on_record(outcomes, plan.order(cell), ordered_job(plan))
    except JournalError:
        raise
    except RobolinkError as error:
        return outcome_of(error)
    if done is None:
        return None
    entries = sorted(outcomes.recorded(kinds=KINDS), key=lambda entry: entry.number)
    changes = measured_changes(entries, finds_pin=lambda _method: False)
    corrections = tuple(corrections_of(changes, done.change))
    return JobOutcome(DONE, what="Kept.", change=done.change, corrections=corrections)


def report_from_record(store: FleetStore, plan: Plan, cell: "Cell") -> RecordedOutcome | None:
    """Report a job whose end is on record here, and not in the plant's database yet.

    Returns:
        What became of it; ``None`` where there is nothing to report: it has no end on record,
        something is unfinished at the cell, or its record is on another computer.

    Raises:
        PlantError: The database cannot be used; nothing is lost.
    """
    with suppress(JournalError):
        log = _record_of(cell)
        if log is None or log.open_markers():
            return None
        outcome = outcome_on_record(log, plan, cell.name)
        if outcome is None:
            return None
        turn = store.begin(plan.id, cell.name)
        if turn.begun and turn.why is None:
            return store.record_outcome(plan.id, cell.name, turn.job.attempt, outcome)
    return None


def report_all_from_record(store: FleetStore, progress: PlanProgress) -> PlanProgress:
    """Report what :func:`report_from_record` can of a plan at the cells of this computer.

    Returns:
        How the plan stands then.

    Raises:
        PlantError: The database cannot be used.
    """
    running = [job.cell for job in progress.jobs if job.state is JobState.RUNNING]
    if not (progress.plan.kind.moves and running):
        return progress
    from robolink.config import load_cell_files, use_journals_of

    try:
        files = load_cell_files()
    except ConfigError:
        return progress  # how a plan stands shows without them
    use_journals_of(files.cells.values(), files.journal)
    here = [files.cells[cell] for cell in running if cell in files.cells]
    reported = [report_from_record(store, progress.plan, cell) for cell in here]
    return store.progress(progress.plan.id) if any(reported) else progress


def _record_of(cell: "Cell") -> "OutcomeLog | None":
    from robolink.journal import default_location, may_exist, open_journal
    from robolink.transport import parse_url

    address = parse_url(cell.url).address
    if cell.home.refusal() is not None or not may_exist(default_location(address)):
        return None
    return open_journal(address=address, read_only=True).log(address)
