"""The store of a plant: what is recorded of its plans.

Every call is one transaction, and durable before it returns. What is asked of one plan takes the
lock of that plan first, then that of the cell, so that two agents, or two workers of one, count
each other's outcomes: a rule is checked in the transaction of the outcome that breaks it.
"""

from collections.abc import Callable, Collection
from dataclasses import replace
from datetime import datetime

from robolink.fleet.outcome_codes import Treatment, treatment_of
from robolink.fleet.plans import Plan
from robolink.fleet.progress import (
    Halt,
    JobOutcome,
    Permit,
    PlanOverview,
    PlanProgress,
    PlantHome,
    RecordedOutcome,
    Turn,
)
from robolink.fleet.states import JobState, WaitReason
from robolink.fleet.store import statements
from robolink.fleet.store.course import PlanCourse, added_plan, progress_in, state_after
from robolink.fleet.store.database import FleetDatabase
from robolink.fleet.store.homes import (
    hear_home,
    homes_in,
    require_one_computer,
)
from robolink.fleet.store.migrations import require_version
from robolink.fleet.store.permits import add_permit, revoke_permit
from robolink.fleet.store.rows import (
    label_of,
    plan_in,
    read_permit,
    read_plan,
    unknown_plan,
)
from robolink.interrupts import ClosedAtExit
from robolink.journal import this_computer
from robolink.journal.store.connection import DatabaseConnection
from robolink.timing import wall_time


class FleetStore(ClosedAtExit):
    """Keeps plans and their outcomes in a file or on a server.

    One connection is kept and given to one thread at a time; after any error it is dropped, and
    the next call makes a new one.

    Args:
        location: Path of a file, or URL of a PostgreSQL database.
        clock: Returns the time, with its zone: it decides windows, permits and labels.
        home: Name of the computer whose cells jobs are begun for; of this one unless given.

    Attributes:
        home: The same.

    Raises:
        PlantError: The location is none.

    Example:
        >>> from robolink.fleet import FleetStore, JobOutcome, plan_of
        >>> table = {"schema": "robolink/fleet-plan/1", "kind": "check", "name": "nightly"}
        >>> plan = plan_of({**table, "cells": ["a", "b"]}, cells=["a", "b"])
        >>> with FleetStore("plant.db") as store:
        ...     store.add_plan(plan)
        ...     turn = store.begin(plan.id, "a")
        ...     ended = store.record_outcome(plan.id, "a", turn.job.attempt, JobOutcome(0))
        ...     ended.job.state, store.begin(plan.id, "a").begun
        (<JobState.KEPT: 'kept'>, False)
    """

    def __init__(
        self,
        location: str,
        *,
        clock: Callable[[], datetime] = wall_time,
        home: str | None = None,
    ) -> None:
        self.home = this_computer() if home is None else home
        self._database = FleetDatabase(location)
        self._clock = clock
        self._plans: dict[str, Plan] = {}

    @property
    def name(self) -> str:
        """Where it is, as a person is told: no password."""
        return self._database.name

    @property
    def made(self) -> bool:
        """Whether it may hold anything: files are looked for, servers are not."""
        return self._database.made

    def close(self) -> None:
        """Close the connection; the next call makes a new one."""
        self._database.close()

    # ---- Plans

    def add_plan(self, plan: Plan, *, starts: bool = True) -> None:
        """Keep a plan and the jobs of its cells; one that is there already stays as it is.

        Args:
            plan: The plan.
            starts: Whether it starts with that, and need not be resumed first.

        Raises:
            PlanError: Its cells have several homes, and the database is a file.
            PlantError: The database cannot be used; nothing was kept.
        """
        if not self._database.shared:
            require_one_computer(plan, self.home, self.name)
        with self._database.transaction() as database:
            added_plan(database, plan, self._clock(), starts=starts)

    def plan(self, plan: str) -> Plan:
        """Return a plan.

        Raises:
            PlanError: There is none of that id, or it was changed.
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            return plan_in(database, plan).plan

    def plans(self) -> tuple[Plan, ...]:
        """Return all plans, newest first.

        Raises:
            PlanError: One was changed after it was made.
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            return tuple(read_plan(said) for said, _ in database.rows(statements.PLANS))

    def open_plans(self, plant: str = "", cell: str = "") -> tuple[str, ...]:
        """Return the ids of the plans of which a job has not ended, oldest first.

        Args:
            plant: Only those of this plant.
            cell: Only those of which the job of this cell has not ended.

        Raises:
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            rows = database.rows(statements.OPEN_PLANS, {"plant": plant, "cell": cell})
        return tuple(plan for (plan,) in rows)

    def overviews(self, most: int = 20) -> tuple[PlanOverview, ...]:
        """Return the newest plans with what became of them.

        Args:
            most: How many at most.

        Raises:
            PlanError: One was changed after it was made.
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            found = []
            for document, cancelled_at in database.rows(statements.NEWEST_PLANS, {"most": most}):
                plan = read_plan(document)
                rows = database.rows(statements.STATES, {"plan": plan.id})
                counts = {JobState(state): int(count) for state, count in rows}
                standing = tuple(PlanCourse(database, plan, self._clock()).standing())
                found.append(PlanOverview(plan, counts, standing, cancelled_at))
        return tuple(found)

    def progress(self, plan: str) -> PlanProgress:
        """Return how a plan stands.

        Raises:
            PlanError: There is none of that id.
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            return progress_in(database, plan, self._clock())

    # ---- Homes

    def hear_home(self, plant: str) -> None:
        """Note that the agent of this computer lives; others show since when it does not.

        Raises:
            PlantVersionError: Another version of robolink has changed the tables meanwhile.
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            ((version,),) = database.rows(statements.VERSION)
            require_version(int(version), self.name)
            hear_home(database, plant, self.home, label_of(self._clock()))

    def homes(self) -> tuple[PlantHome, ...]:
        """Return the computers whose agents were ever heard.

        Raises:
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            return homes_in(database)

    # ---- Jobs

    def end_vain(self, plan: str) -> PlanProgress:
        """End as missed what could not be done before the window closed; return how it stands.

        Raises:
            PlanError, PlantError: As :meth:`progress`.
        """
        with self._database.transaction() as database:
            self._course(database, plan).miss()
        return self.progress(plan)

    def begin(self, plan: str, cell: str, *, cells: Collection[str] | None = None) -> Turn:
        """Begin a job if it is its turn; the one gate that every delivery of it passes.

        A job that was begun and has not ended is handed out again, as the same attempt: its order
        is carried out once, however often it is delivered. What it has not done yet it does only
        if :attr:`Turn.may_write` says so. One that has ended is not begun again. On another
        computer than the home of the cell none is begun, and none handed out.

        Args:
            plan: Id of the plan.
            cell: Name of the cell.
            cells: Names of this computer's cells: where no cell names a home, it makes a plan its
                own only if it has all of them. Not asked unless given.

        Example:
            >>> from robolink.fleet import FleetStore, plan_of
            >>> table = {"schema": "robolink/fleet-plan/1", "kind": "check", "name": "n"}
            >>> plan = plan_of({**table, "cells": ["a", "b"]}, cells=["a", "b"])
            >>> store = FleetStore("begin.db")
            >>> store.add_plan(plan)
            >>> str(store.begin(plan.id, "a", cells=["a", "b"]).job.state)
            'running'
            >>> store.close()

        Raises:
            PlanError: There is no such plan, or it has no such cell; or this computer would make a
                plan its own whose cells it has not all.
            PlantError: The database cannot be used; the job was not begun.
        """
        with self._database.transaction() as database:
            course = self._course(database, plan)
            where = {"plant": course.plan.plant, "cell": cell}
            # The cell before the events, to which miss() adds, as the end of a job takes them.
            at_work = database.rows(statements.AT_WORK + database.row_lock, where)
            course.miss()
            job = course.job(cell)
            elsewhere = not course.is_at_home(cell, self.home)
            if elsewhere and not job.state.final:
                return Turn(job, WaitReason.HOME)
            if job.state is not JobState.WAITING:
                return Turn(job, may_write=course.facts(frozenset()).may_write)
            ((order,),) = at_work
            busy = frozenset([cell] if order not in ("", course.plan.order(cell)) else [])
            why = course.facts(busy).why(job)
            if why is not WaitReason.TURN:
                return Turn(job, why)
            database.run(statements.SET_AT_WORK, {**where, "order_id": course.plan.order(cell)})
            if self._database.shared:
                course.bind(self.home, cells)
            database.run(statements.BEGIN_JOB, {"plan": plan, "cell": cell, "at": course.label})
            return Turn(course.job(cell))

    def record_outcome(
        self, plan: str, cell: str, attempt: int, outcome: JobOutcome
    ) -> RecordedOutcome:
        """Record how an attempt ended, durably, and halt the plan if that breaks a rule.

        The first outcome of an attempt counts, and the same call again changes nothing; only that
        something is unsettled is believed later, too.

        Args:
            plan: Id of the plan.
            cell: Name of the cell.
            attempt: Which attempt, as :meth:`begin` handed it out.
            outcome: How it ended.

        Example:
            >>> from robolink.fleet import FleetStore, JobOutcome, plan_of
            >>> table = {"schema": "robolink/fleet-plan/1", "kind": "check", "name": "n"}
            >>> plan = plan_of({**table, "cells": ["a", "b"]}, cells=["a", "b"])
            >>> store = FleetStore("record.db")
            >>> store.add_plan(plan)
            >>> attempt = store.begin(plan.id, "a").job.attempt
            >>> store.record_outcome(plan.id, "a", attempt, JobOutcome(3, "ConnectError")).job.state
            <JobState.WAITING: 'waiting'>
            >>> store.close()

        Raises:
            PlanError: That attempt was never begun.
            PlantError: The database cannot be used; nothing was recorded.
        """
        treatment = treatment_of(outcome.code, outcome.error, outcome.reason)
        with self._database.transaction() as database:
            course = self._course(database, plan)
            job = course.job(cell)
            course.require_begun(job, attempt)
            worse = treatment is Treatment.UNSETTLED and job.state is not JobState.UNSETTLED
            open_now = job.state is JobState.RUNNING and attempt == job.attempt
            if not (open_now or worse):
                return RecordedOutcome(job, repeated=True)
            state = state_after(course.plan.kind, treatment, attempt)
            return course.end(job, state, treatment, outcome)

    # ---- Halts

    def halt(
        self,
        plan: str,
        by: str,
        reason: str = "",
        *,
        confirm: Callable[[], None] = lambda: None,
    ) -> Halt:
        """Halt a plan: nothing of it begins until it is resumed; what runs comes to its end.

        A plan that this person has halted already stays so, by the same halt.

        Args:
            plan: Its id.
            by: Who halts it.
            reason: Why.
            confirm: Called as the last thing before it is kept: what it raises, undoes all.

        Example:
            >>> from robolink.fleet import FleetStore, JobOutcome, plan_of
            >>> table = {"schema": "robolink/fleet-plan/1", "kind": "check", "name": "n"}
            >>> plan = plan_of({**table, "cells": ["a", "b"]}, cells=["a", "b"])
            >>> store = FleetStore("halt.db")
            >>> store.add_plan(plan)
            >>> store.halt(plan.id, "Li", "the line stands").rule
            <HaltRule.PERSON: 'person'>
            >>> str(store.begin(plan.id, "a").why)
            'halted'
            >>> store.close()

        Raises:
            PlanError: There is no such plan.
            PlantError: The database cannot be used; the plan was not halted.
        """
        with self._database.transaction() as database:
            halt = self._course(database, plan).halt_of(by, reason)
            confirm()
            return halt

    def resume(
        self,
        plan: str,
        by: str,
        reason: str,
        *,
        seen: Halt | None = None,
        confirm: Callable[[], None] = lambda: None,
    ) -> tuple[Halt, ...]:
        """Let a halted plan, or the next ring after a pause, go on.

        If cells had moved alike, their shift is accepted: the next cells are compared with it. The
        order of a cell that is unsettled is delivered again: after ``recover`` there, which says
        whether it was carried out; before that it ends unsettled again. A cell that was busy, or
        interrupted and held back by the halt, is tried again at once.

        Args:
            plan: Its id.
            by: Who resumes it.
            reason: Why that is right.
            seen: The last halt that the person saw; a later one stands. All are lifted unless
                given.
            confirm: Called as the last thing before it is kept: what it raises, undoes all.

        Returns:
            The halts that were lifted.

        Example:
            >>> from robolink.fleet import FleetStore, JobOutcome, plan_of
            >>> table = {"schema": "robolink/fleet-plan/1", "kind": "check", "name": "n"}
            >>> plan = plan_of({**table, "cells": ["a", "b"]}, cells=["a", "b"])
            >>> store = FleetStore("resume.db")
            >>> store.add_plan(plan)
            >>> _ = store.halt(plan.id, "Li", "the line stands")
            >>> [halt.lifted_by for halt in store.resume(plan.id, "Chen", "the line runs")]
            ['Chen']
            >>> store.close()

        Raises:
            PlanError: There is no such plan, it is not halted, or it was cancelled.
            PlantError: The database cannot be used; the plan is halted still.
        """
        with self._database.transaction() as database:
            course = self._course(database, plan)
            standing = course.to_lift(seen)
            course.lift(standing[-1], by, reason, course.accepted_by(standing))
            confirm()
            return tuple(
                replace(halt, lifted_at=course.label, lifted_by=by, reason=reason)
                for halt in standing
            )

    def cancel(self, plan: str, by: str, reason: str = "") -> int:
        """Halt a plan for good: its waiting jobs are cancelled, what runs comes to its end.

        Args:
            plan: Its id.
            by: Who cancels it.
            reason: Why.

        Returns:
            How many jobs were cancelled.

        Example:
            >>> from robolink.fleet import FleetStore, JobOutcome, plan_of
            >>> table = {"schema": "robolink/fleet-plan/1", "kind": "check", "name": "n"}
            >>> plan = plan_of({**table, "cells": ["a", "b"]}, cells=["a", "b"])
            >>> store = FleetStore("cancel.db")
            >>> store.add_plan(plan)
            >>> store.cancel(plan.id, "Li", "no needles left")
            2
            >>> store.close()

        Raises:
            PlanError: There is no such plan.
            PlantError: The database cannot be used; nothing was cancelled.
        """
        with self._database.transaction() as database:
            course = self._course(database, plan)
            course.halt_of(by, reason)
            return course.cancel(by)

    # ---- Permits

    def give_permit(self, permit: Permit) -> Permit:
        """Keep a permit; its number and the time at which it was given are made here.

        Raises:
            PlanError: It is for a plant or a plan that nothing is known of, or ends before it
                begins.
            PlantError: The database cannot be used; it was not given.
        """
        with self._database.transaction() as database:
            return add_permit(database, permit, label_of(self._clock()))

    def revoke_permit(self, number: int, by: str) -> Permit:
        """Revoke a permit: no job begins by it any more. One that is revoked already stays so.

        Raises:
            PlanError: There is none of that number.
            PlantError: The database cannot be used; it holds still.
        """
        with self._database.transaction() as database:
            return revoke_permit(database, number, by, label_of(self._clock()))

    def permit_for(self, plan: Plan) -> Permit | None:
        """Return the permit by which the jobs of a plan may begin now, the oldest of several.

        Raises:
            PlantError: The database cannot be used.
        """
        now = label_of(self._clock())
        with self._database.transaction() as database:
            permits = map(read_permit, database.rows(statements.PERMITS_OF, {"plant": plan.plant}))
            return next((permit for permit in permits if permit.holds(plan, now)), None)

    def permits(self) -> tuple[Permit, ...]:
        """Return all permits, oldest first.

        Raises:
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            return tuple(map(read_permit, database.rows(statements.PERMITS)))

    # ---- Inside a transaction

    def _course(self, database: DatabaseConnection, plan: str) -> PlanCourse:
        """Take the lock of a plan."""
        rows = database.rows(statements.LOCK_PLAN + database.row_lock, {"plan": plan})
        if not rows:
            raise unknown_plan(database, plan)
        ((cancelled_at, bound_to),) = rows
        if plan not in self._plans:  # frozen, and 40 kB for 2,000 cells
            self._plans[plan] = plan_in(database, plan).plan
        now = self._clock()
        return PlanCourse(database, self._plans[plan], now, bool(cancelled_at), bound_to)
