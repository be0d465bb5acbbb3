"""What the pages show of plans, in the language that is spoken; states have one table."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final
from urllib.parse import quote, urlencode

from robolink.fleet import (
    CellJob,
    Halt,
    JobState,
    PlanOverview,
    PlanProgress,
    WaitReason,
    kind_in_words,
    state_in_words,
    wait_in_words,
)
from robolink.messages import tr
from robolink.timing import local_label
from robolink_cli.panel.plant.plan_watch import PlantSight

CELLS_A_PAGE: Final = 60
"""Cells of a plan on one page."""

FOR_A_PERSON: Final = "person"
"""The choice of all jobs that somebody has to see to."""

_OF_A_PERSON: Final = (JobState.UNSETTLED, JobState.REFUSED, JobState.MISSED)
_MARKS: Final = {
    JobState.RUNNING: "look",
    JobState.KEPT: "ok",
    JobState.UNPROVED: "look",
    JobState.REFUSED: "bad",
    JobState.UNSETTLED: "bad",
    JobState.MISSED: "bad",
}


@dataclass(frozen=True, slots=True)
class StateCount:
    """How many jobs are in a state.

    Attributes:
        state: Its name; empty for all jobs.
        mark: What is drawn before it; empty for nothing.
        text: The state in words.
        count: How many.
    """

    state: str
    mark: str
    text: str
    count: int


@dataclass(frozen=True, slots=True)
class Hearing:
    """When the plant's database was heard.

    Attributes:
        heard: When last, local time; empty for never.
        lost: Since when it is not reached, local time; empty where it is.
        why: Why not.
    """

    heard: str
    lost: str = ""
    why: str = ""


@dataclass(frozen=True, slots=True)
class PlanRow:
    """A plan in a line.

    Attributes:
        id: Its id.
        name: What people call it.
        kind: What its cells do, in words.
        made: When, local time.
        author: Who made it.
        counts: How many jobs are in each state.
        standing: Why it stands, or that it has ended; a sentence each.
        mark: ``ok``, ``look`` or ``bad``; empty while it goes on.
    """

    id: str
    name: str
    kind: str
    made: str
    author: str
    counts: tuple[StateCount, ...]
    standing: tuple[str, ...]
    mark: str


@dataclass(frozen=True, slots=True)
class PlansSight:
    """The page of plans.

    Attributes:
        hearing: When they were heard.
        rows: The plans, newest first.
    """

    hearing: Hearing
    rows: tuple[PlanRow, ...]


@dataclass(frozen=True, slots=True)
class PlanCell:
    """A cell of a plan.

    Attributes:
        cell: Its name.
        ring: The number of its ring, from 1.
        mark: What is drawn before the state; empty for nothing.
        state: The state in words.
        why: What it waits for, or how it ended.
        when: When it began or ended, local time; empty for never.
    """

    cell: str
    ring: int
    mark: str
    state: str
    why: str
    when: str


@dataclass(frozen=True, slots=True)
class PlanChoice:
    """Which cells of a plan are shown.

    Attributes:
        plan: Its id.
        state: A state, or :data:`FOR_A_PERSON`; empty for all.
        page: The number of the page, from 1.
    """

    plan: str
    state: str = ""
    page: int = 1

    @property
    def query(self) -> str:
        """What the stream of its page is asked for."""
        return urlencode({"plan": self.plan, "state": self.state, "page": self.page})

    def link(self, **changed: object) -> str:
        """Return the address of another choice; with the first page, unless that is changed.

        Args:
            changed: The attributes that differ.
        """
        said = replace(self, **{"page": 1, **changed})  # type: ignore[arg-type]
        asked = {"state": said.state, "page": "" if said.page == 1 else str(said.page)}
        query = urlencode({name: value for name, value in asked.items() if value})
        return f"/plan/{quote(said.plan)}{'?' if query else ''}{query}"

    @classmethod
    def of(cls, plan: str, said: Mapping[str, str]) -> "PlanChoice":
        """Return what an address asks for; what is none of it counts as nothing.

        Args:
            plan: Id of the plan.
            said: The parameters.
        """
        state, page = said.get("state", ""), said.get("page", "")
        known = state == FOR_A_PERSON or state in list(JobState)
        number = int(page) if page.isascii() and page.isdigit() and len(page) < 6 else 1
        return cls(plan[:40], state if known else "", max(number, 1))


@dataclass(frozen=True, slots=True)
class PlanSight:
    """The page of one plan.

    Attributes:
        hearing: When it was heard.
        row: The plan in a line.
        choice: Which cells are shown.
        waits: How many jobs wait for what; a sentence each.
        rings: How many jobs of each ring are in each state.
        ways: The states that can be chosen.
        cells: The cells of this page.
        found: How many are chosen.
        pages: How many pages these are.
        past: Halts that were lifted, a sentence each, the latest first.
        last_halt: The number of the last halt that is shown; 0 for none.
        may_halt: Whether it can be halted.
        may_resume: Whether it can be resumed.
    """

    hearing: Hearing
    row: PlanRow
    choice: PlanChoice
    waits: tuple[str, ...]
    rings: tuple[tuple[StateCount, ...], ...]
    ways: tuple[StateCount, ...]
    cells: tuple[PlanCell, ...]
    found: int
    pages: int
    past: tuple[str, ...]
    last_halt: int
    may_halt: bool
    may_resume: bool


def plans_sight(sight: PlantSight) -> PlansSight:
    """Return what the page of plans shows."""
    return PlansSight(_hearing(sight), tuple(map(_row, sight.plans)))


def plan_sight(sight: PlantSight, progress: PlanProgress, choice: PlanChoice) -> PlanSight:
    """Return what the page of one plan shows.

    Args:
        sight: What was heard of the plans.
        progress: The plan.
        choice: Which of its cells.
    """
    counts = progress.counts()
    overview = PlanOverview(progress.plan, counts, progress.standing, progress.cancelled_at)
    chosen = [job for job in progress.jobs if _is_chosen(job, choice.state)]
    pages = max(1, -(-len(chosen) // CELLS_A_PAGE))
    page = min(choice.page, pages)
    waits = progress.waits()
    over = bool(progress.cancelled_at) or progress.finished
    return PlanSight(
        _hearing(sight),
        _row(overview),
        replace(choice, page=page),
        tuple(
            tr("{count} waiting: {why}", count=waits[why], why=wait_in_words(why))
            for why in WaitReason
            if waits[why]
        ),
        tuple(_counted(ring) for ring in progress.rings()),
        _ways(counts),
        tuple(
            _cell(progress, job) for job in chosen[(page - 1) * CELLS_A_PAGE : page * CELLS_A_PAGE]
        ),
        len(chosen),
        pages,
        tuple(_lifted(halt) for halt in reversed(progress.halts) if not halt.stands)[:10],
        max((halt.number for halt in progress.standing), default=0),
        may_halt=not over,
        may_resume=bool(progress.standing) and not progress.cancelled_at,
    )


def halt_in_words(halt: Halt) -> str:
    """Return why a plan stands. Where a terminal would name a command, a page has a button."""
    return tr("It was not started yet.") if halt.before_the_start else halt.sentence


def _hearing(sight: PlantSight) -> Hearing:
    heard = local_label(sight.heard_at) if sight.heard_at else ""
    lost = local_label(sight.failed_at) if sight.failed_at else ""
    return Hearing(heard, lost, sight.failed)


def _row(one: PlanOverview) -> PlanRow:
    standing: tuple[str, ...] = ()
    mark = ""
    if one.cancelled_at:
        standing, mark = (tr("cancelled"),), "unknown"
    elif one.standing:
        standing, mark = tuple(map(halt_in_words, one.standing)), "look"
    elif one.finished:
        left = any(one.counts.get(state) for state in _OF_A_PERSON)
        standing, mark = (tr("finished"),), "bad" if left else "ok"
    return PlanRow(
        one.plan.id,
        one.plan.name,
        kind_in_words(one.plan.kind),
        local_label(one.plan.made_at),
        one.plan.author,
        _counted(one.counts),
        standing,
        mark,
    )


def _counted(counts: Mapping[JobState, int]) -> tuple[StateCount, ...]:
    return tuple(
        StateCount(str(state), _MARKS.get(state, ""), state_in_words(state), counts[state])
        for state in JobState
        if counts.get(state)
    )


def _ways(counts: Counter[JobState]) -> tuple[StateCount, ...]:
    ways = [StateCount("", "", tr("All"), counts.total())]
    if left := sum(counts[state] for state in _OF_A_PERSON):
        ways.append(StateCount(FOR_A_PERSON, "bad", tr("for a person"), left))
    return (*ways, *_counted(counts))


def _is_chosen(job: CellJob, state: str) -> bool:
    return not state or job.state == state or (state == FOR_A_PERSON and job.state in _OF_A_PERSON)


def _cell(progress: PlanProgress, job: CellJob) -> PlanCell:
    why = progress.why(job)
    told = wait_in_words(why) if why is not None else " ".join(filter(None, (job.error, job.what)))
    at = job.begun_at if job.state is JobState.RUNNING else job.ended_at
    return PlanCell(
        job.cell,
        job.ring + 1,
        _MARKS.get(job.state, ""),
        state_in_words(job.state),
        told,
        local_label(at) if at else "",
    )


def _lifted(halt: Halt) -> str:
    return tr(
        "{why} Lifted by {who}, {when}: {reason}",
        why=halt_in_words(halt),
        who=halt.lifted_by,
        when=local_label(halt.lifted_at),
        reason=halt.reason,
    )
