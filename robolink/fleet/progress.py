"""How a plan stands: its jobs, and why each one waits that waits."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Final

from robolink.fleet.corrections import TipCorrection
from robolink.fleet.halts import HaltRule
from robolink.fleet.outcome_codes import Treatment
from robolink.fleet.plans import Plan
from robolink.fleet.states import JobState, WaitReason
from robolink.journal import computer_key
from robolink.messages import tr

SILENT_S: Final = 60.0
"""How long an agent that gives a sign of life every ten seconds may be silent, in s."""


@dataclass(frozen=True, slots=True)
class CellJob:
    """One cell's job in a plan, as it is on record.

    Attributes:
        plan: Id of the plan.
        cell: Name of the cell.
        ring: Index of its ring, from 0.
        state: How it stands.
        attempt: How often it was begun.
        begun_at: When it was begun last, as a label: ISO 8601, UTC; empty for never.
        ended_at: When that attempt ended.
        code: Exit code of that attempt; ``None`` before one ended.
        error: Name of its error; empty for none.
        reason: Why the controller was not ready; empty where that was not the cause.
        what: What happened, one English sentence.
        change: Id of the change in the cell's journal; empty for none.
        treatment: What that end meant; empty before one ended.
        sequence: The order in which the jobs of the plan came to their last end; 0 before.
        proof: Number of the entry in the cell's journal of the later turn test that confirmed a
            value written without motion; 0 for none.
    """

    plan: str
    cell: str
    ring: int
    state: JobState
    attempt: int = 0
    begun_at: str = ""
    ended_at: str = ""
    code: int | None = None
    error: str = ""
    reason: str = ""
    what: str = ""
    change: str = ""
    treatment: Treatment | None = None
    sequence: int = 0
    proof: int = 0

    @property
    def order(self) -> str:
        """The id of its order."""
        return f"{self.plan}/{self.cell}"


@dataclass(frozen=True, slots=True)
class Halt:
    """Why a plan stands, or stood.

    Attributes:
        plan: Id of the plan.
        number: Its number in the plan, from 1.
        at: When, as a label.
        rule: Which rule; a pause after a ring is one too.
        cell: The cell whose end broke it; empty where a person halted it.
        numbers: What it was found by.
        by: Who halted it; empty for a rule.
        lifted_at: When a person lifted it; empty while it stands.
        lifted_by: Who.
        reason: Why.
    """

    plan: str
    number: int
    at: str
    rule: HaltRule
    cell: str = ""
    numbers: Mapping[str, object] = field(default_factory=dict, hash=False)
    by: str = ""
    lifted_at: str = ""
    lifted_by: str = ""
    reason: str = ""

    @property
    def stands(self) -> bool:
        """Whether nobody has lifted it."""
        return not self.lifted_at

    @property
    def before_the_start(self) -> bool:
        """Whether it only says that the plan was not started yet."""
        return self.rule is HaltRule.PAUSE and self.numbers.get("ring") == 0

    @property
    def sentence(self) -> str:
        """What a person is told of it."""
        told = {**self.numbers, "cell": self.cell, "by": self.by}
        axis = str(told.get("axis", "")).upper()
        match self.rule:
            case HaltRule.PERSON if reason := told.get("reason"):
                return tr("{by} halted it: {reason}", by=self.by, reason=reason)
            case HaltRule.PERSON:
                return tr("{by} halted it.", by=self.by)
            case HaltRule.PAUSE if self.before_the_start:
                return tr("It was not started yet: robolink fleet run {plan}", plan=self.plan)
            case HaltRule.PAUSE:
                return tr("Ring {ring} is finished; a person has to let the next begin.", **told)
            case HaltRule.UNSETTLED:
                return tr("{cell} is unsettled: run 'robolink recover' there.", cell=self.cell)
            case HaltRule.CAUSE:
                return tr(
                    "{cell}: the cause is the plan, a database or robolink itself.", cell=self.cell
                )
            case HaltRule.FIRST_RING:
                return tr(
                    "{cell}, of the first ring, did not do what it was asked.", cell=self.cell
                )
            case HaltRule.REFUSALS:
                return tr("{refused} of {cells} cells of this ring refused.", **told)
            case HaltRule.CELL_UNUSUAL:
                return tr(
                    "{cell}, tool {tool}, {axis}: {off_mm:+.3f} mm from its earlier values.",
                    **told | {"axis": axis},
                )
        return tr(
            "Tool {tool}, {axis}: {cells} cells moved alike, {shift_mm:+.3f} mm on average. Is the "
            "recipe right, or what they have in common?",
            **told | {"axis": axis},
        )


@dataclass(frozen=True, slots=True)
class Permit:
    """A person's permit for plans that change something.

    Attributes:
        number: Its number.
        plant: For which plant.
        person: Who answers for it.
        role: In which role.
        from_at: From when, as a label.
        until_at: Until when.
        group: For which group of permits; empty for any.
        plan: For which plan; empty for any.
        given_by: Who gave it.
        given_at: When.
        revoked_by: Who revoked it; empty while nobody has.
        revoked_at: When.
    """

    number: int
    plant: str
    person: str
    role: str
    from_at: str
    until_at: str
    group: str = ""
    plan: str = ""
    given_by: str = ""
    given_at: str = ""
    revoked_by: str = ""
    revoked_at: str = ""

    def holds(self, plan: Plan, now: str) -> bool:
        """Return whether it lets jobs of a plan begin.

        Args:
            plan: The plan.
            now: An instant, as a label: ISO 8601, UTC, whole seconds.
        """
        return (
            not self.revoked_at
            and self.plant == plan.plant
            and self.group in ("", plan.permit)
            and self.plan in ("", plan.id)
            and self.from_at <= now < self.until_at
        )


@dataclass(frozen=True, slots=True)
class WaitFacts:
    """What holds the jobs of a plan back now.

    Attributes:
        halt: The rule for which it stands, ``None`` where none does.
        ring: Index of the ring whose turn it is.
        window_open: Whether jobs may begin at this hour.
        permitted: Whether a permit holds, or none is needed.
        running: How many of its jobs are running.
        most: How many may be.
        busy: Cells at which a job of another plan runs.
        away: Cells whose job nobody carries out now: no agent is heard at their home, or, for
            whoever asks whether a job may begin, their home is another computer.
    """

    halt: HaltRule | None
    ring: int
    window_open: bool
    permitted: bool
    running: int
    most: int
    busy: frozenset[str] = frozenset()
    away: frozenset[str] = frozenset()

    @property
    def may_write(self) -> bool:
        """Whether a job that was begun before may still do what it has not done yet."""
        return self.halt is None and self.window_open and self.permitted

    def why(self, job: CellJob) -> WaitReason:
        """Return why a waiting job waits: the one place where that is decided."""
        if self.halt is not None:
            return WaitReason.PAUSE if self.halt is HaltRule.PAUSE else WaitReason.HALTED
        if job.ring != self.ring:
            return WaitReason.RING
        if not self.window_open:
            return WaitReason.WINDOW
        if not self.permitted:
            return WaitReason.PERMIT
        if job.cell in self.away:
            return WaitReason.HOME
        if job.cell in self.busy:
            return WaitReason.CELL_BUSY
        if self.running >= self.most:
            return WaitReason.BUDGET
        return WaitReason.TURN


@dataclass(frozen=True, slots=True)
class JobOutcome:
    """How one attempt of a job ended, as the agent reports it.

    Attributes:
        code: Exit code of the command, or that of the error of a library call.
        error: Name of the error, ``error.kind`` of its document; empty for none.
        reason: ``error.reason`` of its document; empty for none.
        what: What happened, one sentence.
        change: Id of the change in the cell's journal; empty for none.
        corrections: What was measured (:func:`robolink.fleet.corrections_of`).
    """

    code: int
    error: str = ""
    reason: str = ""
    what: str = ""
    change: str = ""
    corrections: tuple[TipCorrection, ...] = ()


@dataclass(frozen=True, slots=True)
class Turn:
    """Whether a job may run now.

    Attributes:
        job: The job as it is on record.
        why: Why it waits; ``None`` where it does not.
        may_write: For a job that was begun: whether it may do what it has not done yet. If not,
            because the plan was halted, its window closed or its permit ended since, only what
            became of its order is looked up.
    """

    job: CellJob
    why: WaitReason | None = None
    may_write: bool = True

    @property
    def begun(self) -> bool:
        """Whether it is to be carried out now: begun just now, or not ended when it was killed."""
        return self.job.state is JobState.RUNNING and self.why is None


@dataclass(frozen=True, slots=True)
class RecordedOutcome:
    """What became of a job by an outcome.

    Attributes:
        job: The job as it is on record now; it waits where it is tried again, after
            :func:`robolink.fleet.pause_s`.
        halt: The halt that this outcome caused; ``None`` for none.
        repeated: Whether it was on record already, so that nothing changed.
    """

    job: CellJob
    halt: Halt | None = None
    repeated: bool = False


@dataclass(frozen=True, slots=True)
class PlantHome:
    """A computer that is the home of cells of a plant.

    Attributes:
        plant: Id of the plant.
        home: Its name.
        heard_at: When its agent was heard last, as a label of its own clock; empty for never.
        agent: Which process that was.
    """

    plant: str
    home: str
    heard_at: str = ""
    agent: str = ""

    def is_heard(self, now: datetime) -> bool:
        """Return whether its agent was heard so lately that it counts as at work.

        Args:
            now: The time, with its zone.
        """
        if not self.heard_at:
            return False
        silent = now - datetime.fromisoformat(self.heard_at)
        return silent.total_seconds() < SILENT_S  # a clock that is ahead is heard, too


@dataclass(frozen=True, slots=True)
class PlanOverview:
    """A plan in one line.

    Attributes:
        plan: The plan.
        counts: How many jobs are in each state.
        standing: The halts that nobody has lifted.
        cancelled_at: When it was cancelled; empty where it was not.
    """

    plan: Plan
    counts: Mapping[JobState, int] = field(hash=False)
    standing: tuple[Halt, ...] = ()
    cancelled_at: str = ""

    @property
    def finished(self) -> bool:
        """Whether nothing more comes of it."""
        return all(state.final for state in self.counts)


@dataclass(frozen=True, slots=True)
class PlanProgress:
    """A plan and all its jobs.

    Attributes:
        plan: The plan.
        jobs: Its jobs, in the order of their turns.
        halts: Why it stands and stood, oldest first.
        facts: What holds its jobs back now.
        cancelled_at: When it was cancelled; empty where it was not.
        bound_to: The computer that carries it out, where its cells name no home and one has begun.
        homes: The homes of its cells, by their :func:`~robolink.journal.computer_key`.
        claimants: The keys of the computers one of which carries it out, where it has no home yet;
            empty for any.
    """

    plan: Plan
    jobs: tuple[CellJob, ...]
    halts: tuple[Halt, ...]
    facts: WaitFacts
    cancelled_at: str = ""
    bound_to: str = ""
    homes: Mapping[str, PlantHome] = field(default_factory=dict, hash=False)
    claimants: frozenset[str] = frozenset()

    def home_of(self, cell: str) -> PlantHome | None:
        """Return the home of a cell; ``None`` where its job may be carried out on any computer."""
        return self.homes.get(computer_key(self.plan.homes.get(cell) or self.bound_to))

    def is_at_home(self, cell: str, computer: str) -> bool:
        """Return whether the job of a cell is carried out by a computer, or may come to be.

        Args:
            cell: The cell.
            computer: Name of the computer.
        """
        home = self.home_of(cell)
        if home is not None:
            return computer_key(home.home) == computer_key(computer)
        return not self.claimants or computer_key(computer) in self.claimants

    def homes_left(self) -> tuple[PlantHome, ...]:
        """Return the homes at which a job of it waits or runs."""
        left = {
            home.home: home
            for job in self.jobs
            if not job.state.final and (home := self.home_of(job.cell)) is not None
        }
        return tuple(left.values())

    def why(self, job: CellJob) -> WaitReason | None:
        """Return why a job waits, ``None`` for one that does not."""
        if job.state is not JobState.WAITING:
            return None
        why = self.facts.why(job)
        if why is WaitReason.TURN and self.plan.kind.moves:
            return WaitReason.PERSON
        if why is WaitReason.TURN and job.treatment is not None and job.treatment.again:
            return WaitReason.CELL_OFF if job.treatment is Treatment.OFF else WaitReason.CELL_BUSY
        return why

    @property
    def finished(self) -> bool:
        """Whether nothing more comes of it."""
        return all(job.state.final for job in self.jobs)

    def waits(self) -> Counter[WaitReason]:
        """Return how many jobs wait, by the reason."""
        return Counter(why for job in self.jobs if (why := self.why(job)) is not None)

    @property
    def standing(self) -> tuple[Halt, ...]:
        """The halts that nobody has lifted."""
        return tuple(halt for halt in self.halts if halt.stands)

    def counts(self) -> Counter[JobState]:
        """Return how many jobs are in each state."""
        return Counter(job.state for job in self.jobs)

    def rings(self) -> Iterator[Counter[JobState]]:
        """Yield the same for each ring."""
        for ring in range(len(self.plan.rings)):
            yield Counter(job.state for job in self.jobs if job.ring == ring)
