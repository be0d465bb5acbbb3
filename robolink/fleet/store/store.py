"""The store of a plant: what is recorded of its plans.

Every call is one transaction, and durable before it returns. What is asked of one plan takes the
lock of that plan first, then that of the cell, so that two agents, or two workers of one, count
each other's outcomes: a rule is checked in the transaction of the outcome that breaks it.
"""

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime

from robolink.fleet.errors import PlanError
from robolink.fleet.halts import HaltFinding, HaltRule
from robolink.fleet.outcome_codes import Treatment, treatment_of
from robolink.fleet.plans import Plan
from robolink.fleet.progress import (
    Halt,
    JobOutcome,
    Permit,
    PlanOverview,
    PlanProgress,
    RecordedOutcome,
    Turn,
)
from robolink.fleet.states import JobState, WaitReason
from robolink.fleet.store import statements
from robolink.fleet.store.course import PlanCourse, state_after
from robolink.fleet.store.database import FleetDatabase
from robolink.fleet.store.rows import (
    label_of,
    permit_values,
    read_halt,
    read_job,
    read_permit,
    read_plan,
)
from robolink.journal.store.chain import canonical, storable
from robolink.journal.store.connection import DatabaseConnection
from robolink.messages import known_names, tr
from robolink.timing import wall_time


class FleetStore:
    """Keeps plans and their outcomes in a file or on a server.

    One connection is kept and given to one thread at a time; after any error it is dropped, and
    the next call makes a new one.

    Args:
        location: Path of a file, or URL of a PostgreSQL database.
        clock: Returns the time, with its zone: it decides windows, permits and labels.

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

    def __init__(self, location: str, *, clock: Callable[[], datetime] = wall_time) -> None:
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

    def __enter__(self) -> "FleetStore":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

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
            PlantError: The database cannot be used; nothing was kept.
        """
        now = label_of(self._clock())
        document = canonical(plan.document())
        places = ((ring, cell) for ring, cells in enumerate(plan.rings) for cell in cells)
        rows = [
            {"plan": plan.id, "cell": cell, "ring": ring, "place": place}
            for place, (ring, cell) in enumerate(places)
        ]
        with self._database.transaction() as database:
            added = database.run(
                statements.ADD_PLAN,
                {"plan": plan.id, "plant": plan.plant, "at": plan.made_at, "document": document},
            )
            if added:
                database.run(statements.ADD_PLANT, {"plant": plan.plant, "at": now})
                cells = [{"plant": plan.plant, "cell": cell} for cell in plan.cells]
                database.run_many(statements.ADD_CELL, cells)
                database.run_many(statements.ADD_JOB, rows)
                if not starts:
                    numbers = {"ring": 0, "cells": 0, "moves": plan.kind.moves}
                    pause = HaltFinding(HaltRule.PAUSE, numbers)
                    self._course(database, plan.id).add_halt(pause)

    def plan(self, plan: str) -> Plan:
        """Return a plan.

        Raises:
            PlanError: There is none of that id, or it was changed.
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            return self._plan(database, plan)[0]

    def plans(self) -> tuple[Plan, ...]:
        """Return all plans, newest first.

        Raises:
            PlanError: One was changed after it was made.
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            rows = database.rows(statements.PLANS)
        return tuple(read_plan(document) for document, _ in rows)

    def open_plans(self, plant: str) -> tuple[str, ...]:
        """Return the ids of the plans of a plant of which a job has not ended, oldest first.

        Raises:
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            rows = database.rows(statements.OPEN_PLANS, {"plant": plant})
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
            found, cancelled_at = self._plan(database, plan)
            rows = database.rows(statements.JOBS, {"plan": plan})
            halts = database.rows(statements.HALTS, {"plan": plan})
            at_work = database.rows(statements.ALL_AT_WORK, {"plant": found.plant})
            busy = frozenset(cell for cell, order in at_work if order != found.order(cell))
            facts = PlanCourse(database, found, self._clock()).facts(busy)
        return PlanProgress(
            found, tuple(map(read_job, rows)), tuple(map(read_halt, halts)), facts, cancelled_at
        )

    # ---- Jobs

    def end_vain(self, plan: str) -> PlanProgress:
        """End as missed what could not be done before the window closed; return how it stands.

        Raises:
            PlanError, PlantError: As :meth:`progress`.
        """
        with self._database.transaction() as database:
            self._course(database, plan).miss()
        return self.progress(plan)

    def begin(self, plan: str, cell: str) -> Turn:
        """Begin a job if it is its turn; the one gate that every delivery of it passes.

        A job that was begun and has not ended is handed out again, as the same attempt: its order
        is carried out once, however often it is delivered. What it has not done yet it does only
        if :attr:`Turn.may_write` says so. One that has ended is not begun again.

        Raises:
            PlanError: There is no such plan, or it has no such cell.
            PlantError: The database cannot be used; the job was not begun.
        """
        with self._database.transaction() as database:
            course = self._course(database, plan)
            course.miss()
            job = course.job(cell)
            if job.state is not JobState.WAITING:
                return Turn(job, may_write=course.facts(frozenset()).may_write)
            where = {"plant": course.plan.plant, "cell": cell}
            (order,) = database.rows(statements.AT_WORK + database.row_lock, where)[0]
            busy = frozenset([cell] if order not in ("", course.plan.order(cell)) else [])
            why = course.facts(busy).why(job)
            if why is not WaitReason.TURN:
                return Turn(job, why)
            database.run(statements.SET_AT_WORK, {**where, "order_id": course.plan.order(cell)})
            begun = {"plan": plan, "cell": cell, "at": course.label}
            database.run(statements.BEGIN_JOB, begun)
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
            if attempt < 1 or attempt > job.attempt:
                raise PlanError(
                    tr(
                        "Attempt {attempt} of {order} was never begun.",
                        attempt=attempt,
                        order=job.order,
                    ),
                    remedy=tr("Begin a job before it is carried out."),
                )
            worse = treatment is Treatment.UNSETTLED and job.state is not JobState.UNSETTLED
            open_now = job.state is JobState.RUNNING and attempt == job.attempt
            if not (open_now or worse):
                return RecordedOutcome(job, repeated=True)
            state = state_after(course.plan.kind, treatment, attempt)
            return course.end(job, state, treatment, outcome)

    # ---- Halts

    def halt(self, plan: str, by: str, reason: str = "") -> Halt:
        """Halt a plan: nothing of it begins until it is resumed; what runs comes to its end.

        A plan that this person has halted already stays so, by the same halt.

        Args:
            plan: Its id.
            by: Who halts it.
            reason: Why.

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
            return self._course(database, plan).halt_of(by, reason)

    def resume(
        self, plan: str, by: str, reason: str, *, seen: Halt | None = None
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
            accepted, until = course.accepted_by(standing)
            values = {
                "plan": plan,
                "at": course.label,
                "by_whom": storable(by),
                "reason": storable(reason),
                "accepted": accepted,
                "until": until,
                "last": standing[-1].number,
            }
            database.run(statements.LIFT_HALTS, values)
            database.run(statements.DELIVER_AGAIN, {"plan": plan})
            return tuple(
                replace(halt, lifted_at=str(values["at"]), lifted_by=by, reason=reason)
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
            values = {"plan": plan, "at": course.label}
            database.run(statements.CANCEL_PLAN, values)
            return database.run(statements.CANCEL_JOBS, values)

    # ---- Permits

    def give_permit(self, permit: Permit) -> Permit:
        """Keep a permit; its number and the time at which it was given are made here.

        Raises:
            PlanError: It is for a plant or a plan that nothing is known of, or ends before it
                begins.
            PlantError: The database cannot be used; it was not given.
        """
        with self._database.transaction() as database:
            self._require_known(database, permit)
            values = permit_values(permit, label_of(self._clock()))
            while True:  # another may take the number meanwhile
                ((number,),) = database.rows(statements.NEXT_PERMIT)
                if database.run(statements.ADD_PERMIT, {"number": number, **values}):
                    return read_permit(database.rows(statements.PERMIT, {"number": number})[0])

    def revoke_permit(self, number: int, by: str) -> Permit:
        """Revoke a permit: no job begins by it any more. One that is revoked already stays so.

        Raises:
            PlanError: There is none of that number.
            PlantError: The database cannot be used; it holds still.
        """
        with self._database.transaction() as database:
            values = {"number": number, "by_whom": storable(by), "at": label_of(self._clock())}
            database.run(statements.REVOKE_PERMIT, values)
            rows = database.rows(statements.PERMIT, {"number": number})
        if not rows:
            raise PlanError(
                tr("There is no permit {number}.", number=number), remedy=tr("Nothing was changed.")
            )
        return read_permit(rows[0])

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

    def _plan(self, database: DatabaseConnection, plan: str) -> tuple[Plan, str]:
        rows = database.rows(statements.PLAN, {"plan": plan})
        if not rows:
            raise self._unknown(database, plan)
        document, cancelled_at = rows[0]
        return read_plan(document), cancelled_at

    def _course(self, database: DatabaseConnection, plan: str) -> PlanCourse:
        """Take the lock of a plan."""
        rows = database.rows(statements.LOCK_PLAN + database.row_lock, {"plan": plan})
        if not rows:
            raise self._unknown(database, plan)
        ((cancelled_at,),) = rows
        if plan not in self._plans:  # frozen, and 40 kB for 2,000 cells
            self._plans[plan] = self._plan(database, plan)[0]
        return PlanCourse(database, self._plans[plan], self._clock(), bool(cancelled_at))

    def _unknown(self, database: DatabaseConnection, plan: str) -> PlanError:
        ids = [read_plan(document).id for document, _ in database.rows(statements.PLANS)]
        return PlanError(
            tr("There is no plan {plan}.", plan=plan),
            remedy=known_names(ids, plan) if ids else tr("Make a plan first."),
        )

    def _require_known(self, database: DatabaseConnection, permit: Permit) -> None:
        plants = [name for (name,) in database.rows(statements.PLANTS)]
        if permit.plant not in plants:
            raise PlanError(
                tr("No plan of plant {plant} is known.", plant=permit.plant),
                remedy=known_names(plants, permit.plant) if plants else tr("Make a plan first."),
            )
        if permit.plan and self._plan(database, permit.plan)[0].plant != permit.plant:
            raise PlanError(
                tr("Plan {plan} is not of plant {plant}.", plan=permit.plan, plant=permit.plant),
                remedy=tr("Name the plant of the plan."),
            )
        if permit.until_at <= permit.from_at:
            raise PlanError(
                tr("The permit would end before it begins."),
                remedy=tr("Give a later end."),
            )
