"""One plan inside a transaction: what holds it back, how its jobs end, and when it halts."""

from collections.abc import Collection, Iterable
from datetime import datetime

from robolink.errors import BusyError
from robolink.fleet.errors import PlanError
from robolink.fleet.halts import (
    EndedJob,
    HaltFinding,
    HaltRule,
    RingTally,
    broken_rule,
    shift_accepted,
    stage_of,
)
from robolink.fleet.outcome_codes import MOST_TRIES, Treatment
from robolink.fleet.plans import Plan
from robolink.fleet.progress import (
    CellJob,
    Halt,
    JobOutcome,
    PlanProgress,
    RecordedOutcome,
    WaitFacts,
)
from robolink.fleet.states import JobState, PlanKind
from robolink.fleet.store import statements
from robolink.fleet.store.homes import (
    cells_away,
    claimants,
    homes_of_plan,
    require_all_cells,
)
from robolink.fleet.store.rows import (
    accepted_in,
    evidence_in,
    label_of,
    plan_in,
    read_halt,
    read_job,
    read_permit,
)
from robolink.fleet.windows import Window
from robolink.journal import computer_key
from robolink.journal.store.chain import canonical, storable
from robolink.journal.store.connection import DatabaseConnection
from robolink.messages import known_names, tr


class PlanCourse:
    """A plan whose lock a transaction has.

    Attributes:
        plan: The plan.
        now: The time, with its zone.
        label: The same as it is stored.
        cancelled: Whether the plan was cancelled.
        bound_to: The computer that carries it out, where its cells name no home and one has begun.

    Args:
        database: The connection, within the transaction.
        plan: The plan.
        now: The time.
        cancelled: Whether the plan was cancelled.
        bound_to: That computer; empty for none.
    """

    def __init__(
        self,
        database: DatabaseConnection,
        plan: Plan,
        now: datetime,
        cancelled: bool = False,
        bound_to: str = "",
    ) -> None:
        self._database, self.cancelled, self.bound_to = database, cancelled, bound_to
        self.plan, self.now, self.label = plan, now, label_of(now)

    def job(self, cell: str) -> CellJob:
        """Return a cell's job.

        Raises:
            PlanError: The plan has no such cell.
        """
        rows = self._database.rows(statements.JOB, {"plan": self.plan.id, "cell": cell})
        if rows:
            return read_job(rows[0])
        raise PlanError(
            tr("Plan {plan} has no cell {cell}.", plan=self.plan.id, cell=cell),
            remedy=known_names(self.plan.cells, cell),
        )

    def is_at_home(self, cell: str, computer: str) -> bool:
        """Return whether a computer carries out the job of a cell.

        Args:
            cell: The cell.
            computer: Name of the computer.
        """
        home = self.plan.homes.get(cell) or self.bound_to
        if home:
            return computer_key(home) == computer_key(computer)
        able = claimants(self._database, self.plan)
        return not able or computer_key(computer) in able

    def bind(self, computer: str, cells: Collection[str] | None = None) -> None:
        """Have a plan whose cells name no home carried out by one computer, the first that begins.

        Args:
            computer: Its name.
            cells: Names of its cells, of which the plan may have no others; any unless given.

        Raises:
            PlanError: The plan has others.
        """
        if not (self.plan.homes or self.bound_to):
            if cells is not None:
                require_all_cells(self.plan, cells)
            self._database.run(statements.BIND_PLAN, {"plan": self.plan.id, "home": computer})

    def require_begun(self, job: CellJob, attempt: int) -> None:
        """Refuse the outcome of an attempt that was never begun.

        Args:
            job: The job.
            attempt: Number of the attempt.

        Raises:
            PlanError: It was not.
        """
        if attempt < 1 or attempt > job.attempt:
            raise PlanError(
                tr(
                    "Attempt {attempt} of {order} was never begun.",
                    attempt=attempt,
                    order=job.order,
                ),
                remedy=tr("Begin a job before it is carried out."),
            )

    def facts(self, busy: frozenset[str], away: frozenset[str] = frozenset()) -> WaitFacts:
        """Return what holds the jobs back.

        Args:
            busy: Cells at which jobs of other plans run.
            away: Cells at whose home no agent is heard.
        """
        standing = self.standing()
        ((ring,),) = self._database.rows(statements.OPEN_RING, {"plan": self.plan.id})
        ((running,),) = self._database.rows(statements.RUNNING, {"plan": self.plan.id})
        permitted = not self.plan.needs_permit or any(
            read_permit(row).holds(self.plan, self.label)
            for row in self._database.rows(statements.PERMITS_OF, {"plant": self.plan.plant})
        )
        ring = len(self.plan.rings) if ring is None else int(ring)
        rules = [halt.rule for halt in standing]
        return WaitFacts(
            halt=next(
                (rule for rule in rules if rule is not HaltRule.PAUSE), rules[0] if rules else None
            ),
            ring=ring,
            window_open=self.plan.window_open(self.now.astimezone()),
            permitted=permitted,
            running=int(running),
            most=self.plan.most_at_once(ring),
            busy=busy,
            away=away,
        )

    def miss(self) -> None:
        """End the jobs whose window closed before their cells could be reached."""
        if not self.plan.window:
            return
        window, now = Window.parse(self.plan.window), self.now.astimezone()
        for row in self._database.rows(statements.VAIN_JOBS, {"plan": self.plan.id}):
            job = read_job(row)
            begun = datetime.fromisoformat(job.begun_at).astimezone(now.tzinfo)
            if now >= window.end_after(begun):
                said = JobOutcome(job.code or 0, job.error, job.reason, job.what)
                assert job.treatment is not None  # noqa: S101 - of a vain job
                self.end(job, JobState.MISSED, job.treatment, said)

    def end(
        self,
        job: CellJob,
        state: JobState,
        treatment: Treatment,
        outcome: JobOutcome,
    ) -> RecordedOutcome:
        """Store an end, free the cell, and check the rules.

        Args:
            job: The job.
            state: Its state from now on.
            treatment: What its end means.
            outcome: How it ended.
        """
        if self.cancelled and state is JobState.WAITING:
            state = JobState.CANCELLED  # it would wait for ever, and breaks no rule by that
        # One that the plan itself held back was not tried in vain: no closed window ends it.
        held_back = state is JobState.WAITING and outcome.error == BusyError.__name__
        held_back = held_back and not self.facts(frozenset()).may_write
        end = EndedJob(state, treatment, outcome.corrections)
        counts = state.final and state is not JobState.CANCELLED
        judged = state.answered and end.judged
        sequence = self.last_sequence() + 1 if counts else 0
        corrections = [one.as_json() for one in outcome.corrections]
        values = {
            "plan": self.plan.id,
            "cell": job.cell,
            "state": str(state),
            "at": self.label,
            "code": outcome.code,
            "error": outcome.error,
            "reason": outcome.reason,
            "what": storable(outcome.what),
            "change": outcome.change,
            "treatment": "" if held_back else str(treatment),
            "judged": int(judged),
            "corrections": canonical(corrections) if corrections else "",
            "sequence": sequence,
        }
        self._database.run(statements.END_JOB, values)
        cell = {"plant": self.plan.plant, "cell": job.cell, "order_id": self.plan.order(job.cell)}
        self._database.run(statements.FREE_CELL, cell)
        if state.final:
            self.tell_of(self.job(job.cell))
        halt = self._checked(job, end) if counts else None
        return RecordedOutcome(self.job(job.cell), halt)

    def prove(self, cell: str, entry: int) -> CellJob | None:
        """Store that a later turn test has confirmed what a job wrote without motion.

        Args:
            cell: The cell.
            entry: Number of the test's entry in the cell's journal.

        Returns:
            The job; ``None`` where it does not wait for that.
        """
        values = {"plan": self.plan.id, "cell": cell, "proof": entry}
        if not self._database.run(statements.PROVE_JOB, values):
            return None
        job = self.job(cell)
        self.tell_of(job)
        return job

    def tell_of(self, job: CellJob) -> None:
        """Add the end of a job to the events of the plant."""
        said = ("cell", "order", "attempt", "ended_at", "code", "error", "reason", "change")
        event = {name: getattr(job, name) for name in said}
        self._tell("outcome", **event, state=str(job.state), proof=job.proof or None)

    def _tell(self, event: str, **said: object) -> None:
        """Add to the events of the plant, with what they are about: durable together."""
        about = {"event": event, "plan": self.plan.id, "kind": str(self.plan.kind)}
        document = canonical({**about, "at": self.label, **said})
        self._database.run(statements.NEXT_EVENT)
        values = {"plant": self.plan.plant, "at": self.label, "document": document}
        self._database.run(statements.ADD_EVENT, values)

    def _checked(self, job: CellJob, end: EndedJob) -> Halt | None:
        """Halt the plan if an end breaks a rule, or pause it behind a ring."""
        accepted, until = accepted_in(self._database, self.plan.id)
        counts = self._database.rows(statements.COUNTS, {"plan": self.plan.id, "after": until})
        stage = stage_of(self.plan.sizes, job.ring)
        of_ring = {JobState(state): int(n) for ring, state, n, *_ in counts if ring == job.ring}
        # Of a cause that is no cell's, no cell has refused anything.
        caused = sum(int(n) for ring, *_, n in counts if ring == job.ring)
        answered = sum(n for state, n in of_ring.items() if state.answered)
        tally = RingTally(
            rings=self.plan.sizes,
            ring=job.ring,
            ended=sum(n for state, n in of_ring.items() if state.final),
            answered=answered,
            refused=of_ring.get(JobState.REFUSED, 0) - caused,
            stage_ended=sum(int(n) for ring, _, _, n, *_ in counts if ring in stage),
            expected_refusals=0.0 if self.plan.kind.reads else self.plan.expected_refusals,
        )
        where = {"plan": self.plan.id, "after": until, "first": stage[0], "last": stage[-1]}
        finding = broken_rule(end, tally, lambda: evidence_in(self._database, where), accepted)
        if (
            finding is None
            and tally.ended == self.plan.sizes[job.ring]
            and job.ring + 1 < len(self.plan.rings)
        ):
            known = sum(int(n) for ring, _, _, _, n, _ in counts if ring == job.ring)
            well = answered == tally.ended and (known == answered or self.plan.kind.reads)
            if not (self.plan.auto and well):
                finding = HaltFinding(HaltRule.PAUSE, {"ring": job.ring + 1, "cells": tally.ended})
        if finding is None:
            return None
        return self.add_halt(finding, cell=job.cell)

    def accepted_by(self, standing: Iterable[Halt]) -> tuple[str, int]:
        """Return what is accepted by who lifts halts: the shifts, and behind which end of a job.

        Args:
            standing: The halts.
        """
        if not any(halt.rule.of_corrections for halt in standing):
            return "", 0
        whole = {"plan": self.plan.id, "after": 0, "first": 0, "last": len(self.plan.rings)}
        shifts = shift_accepted(evidence_in(self._database, whole))
        return canonical([[*key, *shift] for key, shift in shifts.items()]), self.last_sequence()

    def add_halt(
        self,
        finding: HaltFinding,
        *,
        cell: str = "",
        by: str = "",
    ) -> Halt | None:
        """Halt the plan, unless the same rule, or the same person, has halted it already.

        Another one is kept beside the first: who lifts them has to know of both.

        Args:
            finding: The rule, and what it was found by.
            cell: The cell whose end broke it.
            by: Who halts it, where a person does.

        Returns:
            The new halt; ``None`` where it stands already.
        """
        if self._standing_of(finding.rule, by):
            return None
        values = {
            "plan": self.plan.id,
            "at": self.label,
            "rule": str(finding.rule),
            "cell": cell,
            "numbers": canonical(dict(finding.numbers)),
            "by_whom": storable(by),
        }
        self._database.run(statements.ADD_HALT, values)
        halt = self.standing()[-1]
        said = {"halt": halt.number, "rule": str(halt.rule), "cell": cell or None}
        self._tell("halt", **said, by=halt.by or None, numbers=dict(halt.numbers))
        return halt

    def lift(self, last: Halt, by: str, reason: str, accepted: tuple[str, int]) -> None:
        """Lift the halts up to one, and deliver again what they ended.

        Args:
            last: The last one.
            by: Who lifts them.
            reason: Why.
            accepted: What is accepted by that, as :meth:`accepted_by` says.
        """
        shifts, until = accepted
        who = {"by_whom": storable(by), "reason": storable(reason)}
        values = {"plan": self.plan.id, "at": self.label, **who, "accepted": shifts}
        self._database.run(statements.LIFT_HALTS, {**values, "until": until, "last": last.number})
        self._database.run(statements.DELIVER_AGAIN, {"plan": self.plan.id})
        self._tell("resumed", halt=last.number, by=storable(by), reason=storable(reason))

    def cancel(self, by: str) -> int:
        """Cancel the plan and its waiting jobs; return how many they were.

        Args:
            by: Who cancels it.
        """
        values = {"plan": self.plan.id, "at": self.label}
        self._database.run(statements.CANCEL_PLAN, values)
        count = self._database.run(statements.CANCEL_JOBS, values)
        self._tell("cancelled", by=storable(by), jobs=count)
        return count

    def halt_of(self, by: str, reason: str) -> Halt:
        """Halt the plan in a person's name, once; return that halt.

        Args:
            by: Who halts it.
            reason: Why.
        """
        finding = HaltFinding(HaltRule.PERSON, {"reason": reason} if reason else {})
        return self.add_halt(finding, by=by) or self._standing_of(HaltRule.PERSON, by)[-1]

    def _standing_of(self, rule: HaltRule, by: str) -> list[Halt]:
        return [one for one in self.standing() if (one.rule, one.by) == (rule, storable(by))]

    def to_lift(self, last: Halt | None) -> list[Halt]:
        """Return the halts that a person lifts.

        Args:
            last: The last one that the person saw; ``None`` for all.

        Raises:
            PlanError: There are none, or the plan was cancelled.
        """
        if self.cancelled:
            raise PlanError(
                tr("Plan {plan} was cancelled.", plan=self.plan.id),
                remedy=tr("Nothing was changed. Make a new plan for the cells that are left."),
            )
        found = self.standing(last)
        if not found:
            raise PlanError(
                tr("Plan {plan} is not halted.", plan=self.plan.id),
                remedy=tr("Nothing was changed."),
            )
        return found

    def standing(self, last: Halt | None = None) -> list[Halt]:
        """Return the halts that nobody has lifted, oldest first.

        Args:
            last: Leaves out those that came after this one.
        """
        rows = self._database.rows(statements.STANDING, {"plan": self.plan.id})
        return [halt for halt in map(read_halt, rows) if last is None or halt.number <= last.number]

    def last_sequence(self) -> int:
        """Return the number of the last end of a job."""
        ((last,),) = self._database.rows(statements.LAST_SEQUENCE, {"plan": self.plan.id})
        return int(last)


def progress_in(database: DatabaseConnection, plan: str, now: datetime) -> PlanProgress:
    """Return how a plan stands.

    Args:
        database: The connection, within a transaction.
        plan: Id of the plan.
        now: The time, with its zone.

    Raises:
        PlanError: There is none of that id.
    """
    found, cancelled_at, bound_to = plan_in(database, plan)
    jobs = tuple(map(read_job, database.rows(statements.JOBS, {"plan": plan})))
    halts = tuple(map(read_halt, database.rows(statements.HALTS, {"plan": plan})))
    at_work = database.rows(statements.ALL_AT_WORK, {"plant": found.plant})
    busy = frozenset(cell for cell, order in at_work if order != found.order(cell))
    homes = homes_of_plan(database, found, bound_to)
    facts = PlanCourse(database, found, now).facts(busy, cells_away(found, homes, now))
    able = frozenset() if found.homes or bound_to else claimants(database, found)
    return PlanProgress(found, jobs, halts, facts, cancelled_at, bound_to, homes, able)


def added_plan(
    database: DatabaseConnection, plan: Plan, now: datetime, *, starts: bool = True
) -> bool:
    """Keep a plan and the jobs of its cells; return whether it was not there before.

    Args:
        database: The connection, within the transaction.
        plan: The plan.
        now: The time.
        starts: Whether it starts with that, and need not be resumed first.
    """
    document = canonical(plan.document())
    said = {"plan": plan.id, "plant": plan.plant, "at": plan.made_at, "document": document}
    if not database.run(statements.ADD_PLAN, said):
        return False
    database.run(statements.ADD_PLANT, {"plant": plan.plant, "at": label_of(now)})
    cells = [{"plant": plan.plant, "cell": cell} for cell in plan.cells]
    database.run_many(statements.ADD_CELL, cells)
    places = ((ring, cell) for ring, cells in enumerate(plan.rings) for cell in cells)
    rows = [
        {"plan": plan.id, "cell": cell, "ring": ring, "place": place}
        for place, (ring, cell) in enumerate(places)
    ]
    database.run_many(statements.ADD_JOB, rows)
    if not starts:
        pause = HaltFinding(HaltRule.PAUSE, {"ring": 0, "cells": 0})
        PlanCourse(database, plan, now).add_halt(pause)
    return True


def state_after(kind: PlanKind, treatment: Treatment, attempt: int) -> JobState:
    """Return the state of a job whose attempt ended.

    Args:
        kind: What it does.
        treatment: What the end means.
        attempt: The number of the attempt.
    """
    if treatment.again:
        return JobState.WAITING if attempt < MOST_TRIES else JobState.MISSED
    match treatment:
        case Treatment.DONE:
            return JobState.UNPROVED if kind is PlanKind.OFFSET else JobState.KEPT
        case Treatment.UNSETTLED:
            return JobState.UNSETTLED
    return JobState.REFUSED
