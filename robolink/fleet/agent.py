"""The agent of a home: hands out the jobs whose turn it is, and records what became of each.

It decides nothing about a job. Whose turn it is says the store, of which
:meth:`~robolink.fleet.FleetStore.begin` is asked once more before each delivery; how an end counts
says its table of outcomes; what waits, runs and is begun again after a kill is the engine's work.
So an agent that is killed anywhere loses nothing: a job is on record as begun before it is carried
out, its outcome before it counts as ended, and what is delivered again has the same order.

A plant has an agent at each home, which carries out the jobs of the cells at home there. They know
nothing of each other: rings, halts and how many cells are at work are counted by the store.
"""

from collections.abc import Callable, Collection
from contextlib import AbstractContextManager, ExitStack, nullcontext, suppress
from datetime import datetime
from typing import Final, TypeVar

from robolink import runtime
from robolink.errors import ConfigError, LeaseHeldError
from robolink.fleet.agent_lock import AgentLock, agent_name, own_name
from robolink.fleet.engine import Engine, JobEndedError
from robolink.fleet.errors import PlanError, PlantError, PlantVersionError
from robolink.fleet.outcome_codes import pause_s
from robolink.fleet.plans import Plan
from robolink.fleet.progress import CellJob, JobOutcome, Permit, PlanProgress
from robolink.fleet.silence import LOOK_S, CellLine, SilentJobs
from robolink.fleet.states import JobState, PlanKind, WaitReason
from robolink.fleet.store.homes import require_all_cells
from robolink.fleet.store.store import FleetStore
from robolink.fleet.watchdog import notify
from robolink.journal._places import place_of
from robolink.messages import tr
from robolink.timing import wall_time

__all__ = ["Act", "Agent", "UNATTENDED"]

Act = Callable[[Plan, str, Permit | None], JobOutcome]
"""Carries out the job of a plan at a cell under its order, by a permit where the plan needs
one; without that it only looks up what became of the order. It raises nothing."""

UNATTENDED: Final = frozenset({PlanKind.BACKUP, PlanKind.CHECK, PlanKind.DRIFT, PlanKind.OFFSET})
"""The kinds that an agent carries out. The others move a robot, and wait for a yes at the cell."""

WORKERS: Final = 16
"""How many cells are at work at once, whatever their plans allow."""

END_S: Final = 60.0
"""How long an agent that is ended waits for its running jobs, in s."""

_TURN_S: Final = 1.0
_GATHER_S: Final = 0.1
"""After a job has ended, others that end in so many seconds are answered together."""

_LOOK_S: Final = 10.0
"""How often what the engine holds is compared with what was handed out, in s."""

_AGAIN_S: Final = 1.0
"""Pause before the plant's database is tried again, in s."""

_OF_A_CELL: Final = (WaitReason.CELL_OFF, WaitReason.CELL_BUSY)

T = TypeVar("T")


class Agent:
    """Carries out the plans of one plant at the cells of this computer until it is ended.

    Attributes:
        turned_s: When it had its last turn at which the plant's database answered, seconds since
            1970; 0 before the first.

    Args:
        location: The plant's database: path of a file, or URL of PostgreSQL.
        plant: Id of the plant.
        act: Carries out one job.
        line: The connections of the jobs to their cells, where ``act`` has any.
        cells: Returns the names of this computer's cells; all that plans name unless given.
        meanwhile: Entered while the agent holds its lock: what one process of a home alone may do.
        tell: Receives sentences for people.
        clock: Returns the time, with its zone.

    Attributes:
        home: Name of this computer.
        hung: Orders of jobs that hung when it had ended: their threads end with the process.

    Example:
        >>> from robolink.fleet import FleetStore, JobOutcome, plan_of
        >>> from robolink.fleet.agent import Agent
        >>> table = {"schema": "robolink/fleet-plan/1", "kind": "check", "name": "nightly"}
        >>> plan = plan_of({**table, "cells": ["a"]}, cells=["a"])
        >>> with FleetStore("agent-example.db") as store:
        ...     store.add_plan(plan)
        ...     agent = Agent("agent-example.db", "plant", lambda *_: JobOutcome(0))
        ...     agent.run_until_still()
        ...     store.progress(plan.id).finished
        True
    """

    def __init__(
        self,
        location: str,
        plant: str,
        act: Act,
        *,
        line: CellLine | None = None,
        cells: Callable[[], Collection[str]] | None = None,
        meanwhile: Callable[[], AbstractContextManager[None]] = nullcontext,
        tell: Callable[[str], None] = lambda _sentence: None,
        clock: Callable[[], datetime] = wall_time,
    ) -> None:
        self._plant, self._act, self._tell, self._clock = plant, act, tell, clock
        self._cells = cells
        self._store = FleetStore(location, clock=clock)
        self.home = self._store.home
        self._lock = AgentLock(location, plant, self.home)
        self._ending = False  # no lock: it is set where a signal comes
        self._held: set[str] = set()
        self._silent, self._meanwhile = SilentJobs(line), meanwhile
        self.hung: frozenset[str] = frozenset()
        self._looked_s = -_LOOK_S
        self._trouble = ""
        self.turned_s = 0.0
        place = place_of(location)
        self._shared = bool(place.url)
        self._jobs_url = place.url or f"sqlite:///{place.path}.jobs"
        self._executor = agent_name(plant, self.home) if place.url else plant

    def end(self) -> None:
        """Have it end: no job begins any more, and those that run come to their end.

        A handler of a signal may call it.
        """
        self._ending = True

    def run(self) -> None:
        """Carry out what there is to do until :meth:`end`.

        Raises:
            LeaseHeldError: Another agent of this plant lives at this home.
            PlantError: The plant's database cannot be used, at the start.
            PlantVersionError: Its tables are those of another version of robolink.
        """
        self._run(lambda _still: False)

    def run_until_still(self) -> None:
        """Carry out what there is to do, until all plans are finished or wait for a person.

        Raises:
            LeaseHeldError, PlantError: As :meth:`run`.
        """
        self._run(lambda still: still)

    def _run(self, enough: Callable[[bool], bool]) -> None:
        with ExitStack() as stack:
            stack.enter_context(self._lock)
            stack.enter_context(self._store)
            stack.enter_context(self._meanwhile())
            engine = Engine(self._jobs_url, self._executor, self._carry_out, workers=WORKERS)
            engine.start()
            stack.callback(runtime.regularly(LOOK_S, self._silent.look, "silent jobs"))
            stack.callback(self._stop, engine)
            notify("READY=1")
            while not self._ending:
                notify("WATCHDOG=1")
                if enough(self._turn(engine)) or len(self._silent.given_up()) == WORKERS:
                    return  # if all its workers hang, a new process is of more use
                engine.wait_for_news(_TURN_S)
                runtime.sleep(_GATHER_S)

    def _stop(self, engine: Engine) -> None:
        notify("STOPPING=1")
        self._ending = True
        self.hung = engine.stop(END_S, self._silent.given_up)
        with suppress(
            PlantError
        ):  # what is not recorded now shows when the order is delivered again
            self._record_cut()

    # ---- One turn

    def _turn(self, engine: Engine) -> bool:
        """Hand out what is due; return whether nothing runs and nothing waits for its turn."""
        still, troubles = True, list[str]()
        try:
            self._keep_lock()
            self._compare(engine)
            self._record_cut()
            for plan in self._store.open_plans(self._plant):
                try:
                    progress = self._store.progress(plan)
                    if not progress.facts.window_open and any(map(_is_tried, progress.jobs)):
                        progress = self._store.end_vain(plan)
                    self._require_cells(progress)
                except PlanError as error:  # of this plan alone: the others go on
                    troubles.append(str(error))
                    continue
                if progress.plan.kind in UNATTENDED:
                    still = self._advance(engine, progress) and still
        except PlantVersionError:
            raise  # its tables have another meaning now: nothing more may begin here
        except PlantError as error:
            still = False
            troubles.append(str(error))
        else:
            self.turned_s = runtime.wall_s()
        self._say("\n".join(troubles))
        return still

    def _keep_lock(self) -> None:
        """Take the lock anew where the server has forgotten it.

        Raises:
            LeaseHeldError: Another agent was faster.
            PlantError: The server has not noticed yet that the connection was lost.
        """
        if self._lock.is_held():
            return
        try:
            self._lock.take()
        except LeaseHeldError as held:
            if held.holder != own_name():
                raise
            raise PlantError(
                tr("The server still keeps this agent's lock for a connection that was lost."),
                remedy=tr("It ends that within seconds, and the agent goes on. Check the network."),
            ) from held

    def _require_cells(self, progress: PlanProgress) -> None:
        """Refuse a plan that belongs to no computer yet, and has cells that this one has not.

        Who begins the first job carries out all of them.

        Raises:
            PlanError: It has, or a cell file is wrong.
        """
        plan = progress.plan
        if not self._shared or plan.homes or progress.bound_to or plan.kind not in UNATTENDED:
            return
        try:
            if self._cells is not None:
                require_all_cells(plan, self._cells())
        except ConfigError as error:
            raise PlanError(error.what, remedy=error.remedy) from error

    def _record_cut(self) -> None:
        """Record how jobs ended that were cut off, and name their cells.

        Raises:
            PlantError: The plant's database cannot be used.
        """
        for order, job in self._silent.cut().items():
            if job.recorded or job.outcome is None:
                continue
            plan, _, cell = order.partition("/")
            ended = self._store.record_outcome(plan, cell, job.attempt, job.outcome)
            job.recorded = True
            if not ended.repeated:
                self._tell(tr("{cell}: {what}", cell=cell, what=job.outcome.what))

    def _compare(self, engine: Engine) -> None:
        """Give a sign of life, and see what the engine holds; every ten seconds."""
        now_s = runtime.monotonic_ns() / 1e9
        if now_s - self._looked_s < _LOOK_S:
            return
        if self.home:
            self._store.hear_home(self._plant)
        engine.drop_stranded()
        self._held = set(engine.held())
        self._looked_s = now_s

    def _advance(self, engine: Engine, progress: PlanProgress) -> bool:
        """Hand out the due jobs of a plan; return whether nothing of it runs or will be due."""
        held = {order for order in self._held.copy() if order.startswith(f"{progress.plan.id}/")}
        held -= self._silent.given_up()
        if progress.facts.halt is not None:
            # What was begun goes on, and is looked up where it was lost: all that is unsettled
            # shows at once.
            begun = {job.order for job in progress.jobs if job.state is JobState.RUNNING}
            unbegun = held - begun - engine.running()
            if unbegun:
                engine.withdraw(unbegun)
                self._held -= unbegun
                held -= unbegun
        due, later = self._due(progress, len(held))
        # Noted first: a job may have ended before the call returns.
        self._held |= due.keys()
        handed = engine.hand_out(due) if due else ()
        self._held -= due.keys() - set(handed)
        return not (held or due or later or self._waits_for_others(progress))

    def _waits_for_others(self, progress: PlanProgress) -> bool:
        """Whether jobs of this home wait for those of homes whose agents are at work."""
        facts = progress.facts
        if not facts.may_write:
            return False
        waits = others = False
        for job in progress.jobs:
            if progress.is_at_home(job.cell, self.home):
                waits = waits or progress.why(job) in (WaitReason.RING, WaitReason.BUDGET)
            elif job.ring == facts.ring and not job.state.final:
                others = others or job.cell not in facts.away
        return waits and others

    def _due(self, progress: PlanProgress, held: int) -> tuple[dict[str, str], bool]:
        """Return the jobs of a plan to hand out, their cells by their orders, and what is later.

        Those that are on record as running and nobody carries out were lost with an engine. Of a
        plan that lets as many cells work as the agent does, all whose turn it is are handed out
        together, and the engine keeps to that number; of any other, so many as may begin now.

        Returns:
            The jobs, and whether one is to be tried again later.
        """
        most = progress.facts.most
        room = len(progress.jobs) if most >= WORKERS else max(0, most - held)
        lost, turns, later = dict[str, str](), list[CellJob](), False
        hanging = self._silent.given_up()
        for job in progress.jobs:
            if job.order in self._held or job.order in hanging:
                continue
            if not progress.is_at_home(job.cell, self.home):
                continue
            why = progress.why(job)
            if job.state is JobState.RUNNING:
                lost[job.order] = job.cell
            elif why is WaitReason.TURN or (_is_tried(job) and why in _OF_A_CELL):
                if self._is_due(job):
                    turns.append(job)
                else:
                    later = True
        return lost | {job.order: job.cell for job in turns[:room]}, later

    def _is_due(self, job: CellJob) -> bool:
        """Whether the pause after an attempt in vain is over."""
        if not _is_tried(job):
            return True
        waited = self._clock() - datetime.fromisoformat(job.ended_at)
        # Less than nothing where the clock was set back: that must not prolong the pause.
        return not 0 <= waited.total_seconds() < pause_s(job.attempt)

    def _say(self, trouble: str) -> None:
        """Tell once what keeps the agent from its work."""
        if trouble and trouble != self._trouble:
            self._tell(trouble)
        self._trouble = trouble

    # ---- One job, in a thread of the engine

    def _carry_out(self, order: str) -> None:
        """Carry out the job of an order.

        Raises:
            JobEndedError: It did not do what it was for; its outcome is on record.
        """
        plan_id, _, cell = order.partition("/")
        try:
            turn = self._insist(lambda: self._store.begin(plan_id, cell))
            if not turn.begun:
                raise JobEndedError(str(turn.why or turn.job.state))
            attempt = turn.job.attempt
            plan = self._insist(lambda: self._store.plan(plan_id))
            permit = None
            if turn.may_write:
                permit = self._insist(lambda: self._store.permit_for(plan))
            if turn.may_write or plan.needs_permit:
                writes = not plan.kind.reads
                with self._silent.watching(order, attempt, writes=writes) as watched:
                    outcome = watched.ended(self._act(plan, cell, permit))
                if watched.recorded and outcome is watched.outcome:
                    raise JobEndedError(outcome.what)  # a person may have resumed the plan since
            else:
                outcome = JobOutcome(5, "BusyError", what="The plan may not begin anything now.")
            ended = self._insist(
                lambda: self._store.record_outcome(plan_id, cell, attempt, outcome)
            )
            if not ended.job.state.answered:
                raise JobEndedError(f"{ended.job.state}: {outcome.what}")
        except PlanError as error:  # its plan is gone from the database: there is nothing to record
            raise JobEndedError(str(error)) from error
        finally:
            self._held.discard(order)

    def _insist(self, ask: Callable[[], T]) -> T:
        """Ask the plant's database until it answers.

        Raises:
            JobEndedError: The agent is ended meanwhile: the job is delivered again.
        """
        while True:
            try:
                return ask()
            except PlantError as error:
                if self._ending:
                    raise JobEndedError(str(error)) from error
                runtime.sleep(_AGAIN_S)


def _is_tried(job: CellJob) -> bool:
    """Whether a waiting job was begun before, in vain."""
    tried = job.treatment is not None and job.treatment.again
    return tried and job.state is JobState.WAITING
