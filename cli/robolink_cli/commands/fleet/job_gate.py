"""Lets the job of a plan begin at its cell once a person has agreed, and reports how it ended."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from robolink.config import load_cell_files
from robolink.errors import BusyError, OutcomeUnknownError, RobolinkError
from robolink.fleet import (
    CellJob,
    JobOutcome,
    RecordedOutcome,
    Turn,
    state_in_words,
    wait_in_words,
)
from robolink.messages import tr
from robolink.model import AnsweredBy
from robolink.transaction import Order, carrying_out
from robolink_cli.console.exit_codes import DONE
from robolink_cli.console.render import note
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.prompts.questions import keep_answer
from robolink_cli.session.cell_plans import (
    PlannedJob,
    ends_order,
    kept_before,
    ordered_job,
    outcome_on_record,
)

if TYPE_CHECKING:
    from robolink.fleet import FleetStore
    from robolink.model import Controller, OutcomeLog


def tell_at_the_end(text: str) -> None:
    """Show a sentence when the job has ended: on its last screen, or as a line."""
    desk = current_desk()
    if desk is None:
        note(text)
        return
    from robolink_cli.wizard.happenings import SaidAtTheEnd

    desk.regard(SaidAtTheEnd(text))


def tell_state(job: CellJob) -> None:
    """Show at the end how a job stands then."""
    state = state_in_words(job.state)
    tell_at_the_end(tr("Plan {plan}, {cell}: {state}", plan=job.plan, cell=job.cell, state=state))


class JobGate:
    """One delivery of a job, from the look at its order to the report of its end.

    The store is asked after the last question to the person and before the first movement: a plan
    that was halted meanwhile, a window that closed or a permit that ended hold the job back there,
    and a no to any question before leaves it waiting.

    Attributes:
        turn: The job as it was begun; ``None`` before.

    Args:
        store: The plant's database.
        planned: The job, as it was shown.
    """

    def __init__(self, store: "FleetStore", planned: PlannedJob) -> None:
        self._store, self._planned = store, planned
        self._looked_up = False
        self._kept: JobOutcome | None = None
        self.turn: Turn | None = None

    @contextmanager
    def carrying_out(self, controller: "Controller") -> Iterator[Order]:
        """Keep the lease and look the order up; of one that was done before, take note.

        Raises:
            RobolinkError: As :func:`robolink.transaction.carrying_out`.
            BusyError: It was begun before, has no end, and may not go on now.
        """
        plan, cell = self._planned.plan, self._planned.job.cell
        self._looked_up = True
        with carrying_out(
            controller,
            plan.order(cell),
            ordered_job(plan),
            ends=lambda error: self.turn is not None and ends_order(error),
        ) as order:
            if order.done is not None:
                turn = self._store.begin(plan.id, cell)
                self.turn = turn if turn.begun else None
            elif not (self._planned.why or self._planned.may_write):
                self._take_turn()
                self.turn = None  # it stays interrupted, as it was
                raise self._held_back(tr("it was resumed meanwhile, and nobody here has agreed"))
            try:
                yield order
            finally:  # a stop on the way to the safe pose, too, comes after the value is kept
                with controller.uninterrupted():
                    self._look(controller.outcomes)

    def _look(self, outcomes: "OutcomeLog") -> None:
        """Take note of an order that is carried out by now."""
        plan, cell = self._planned.plan, self._planned.job.cell
        try:
            found = outcome_on_record(outcomes, plan, cell)
        except RobolinkError as error:  # what it measured cannot be judged
            note(error.what)
            return
        if found is not None and found.code == DONE:
            self._kept = found

    def begin(self) -> None:
        """Begin the job, in the name of the plan and by the permit that was shown.

        Raises:
            BusyError: It is not its turn any more.
            PlanError: No home is named, and this computer has not all cells of the plan.
            PlantError: The database cannot be used; nothing was begun.
        """
        planned, plan = self._planned, self._planned.plan
        permit = self._store.permit_for(plan)
        shown = planned.permit
        if shown is not None and (permit is None or permit.number != shown.number):
            raise self._held_back(tr("the permit of {who} has ended", who=shown.person))
        self._take_turn()
        keep_answer(
            tr(
                "Carry out the job of plan {plan} ({name}), by the permit of {who}?",
                plan=plan.id,
                name=plan.name,
                who="" if permit is None else permit.person,
            ),
            True,
            AnsweredBy.PERSON,
        )

    def _take_turn(self) -> None:
        planned, cells = self._planned, load_cell_files().cells
        turn = self._store.begin(planned.plan.id, planned.job.cell, cells=cells)
        if turn.why is not None:
            raise self._held_back(wait_in_words(turn.why))
        if not turn.begun:
            raise self._held_back(tr("its job here has ended"))
        self.turn = turn
        if not turn.may_write:
            raise self._held_back(tr("the plan may not begin anything now"))

    def _held_back(self, why: str) -> BusyError:
        return BusyError(
            tr("Nothing was begun for plan {plan}: {why}.", plan=self._planned.plan.id, why=why),
            remedy=tr(
                "Nothing moved. How it stands: robolink fleet status {plan} --why {cell}",
                plan=self._planned.plan.id,
                cell=self._planned.job.cell,
            ),
        )

    def end(self, error: BaseException | None = None) -> RecordedOutcome | None:
        """Report how it ended; return what became of it, ``None`` where nothing was begun.

        Where the database cannot be used, the person is told what to type later: nothing is lost,
        because the cell's record has the end of the order.

        Args:
            error: What ended it; ``None`` where it was carried out.
        """
        planned = self._planned
        unsettled = isinstance(error, OutcomeUnknownError) and planned.why is None
        if self.turn is None and not (unsettled and self._looked_up):
            return None
        job = planned.job if self.turn is None else self.turn.job
        if error is None:
            outcome = self._kept or JobOutcome(DONE, what="Kept.")
        else:
            outcome = kept_before(self._kept, error)
        try:
            if self.turn is None:
                turn = self._store.begin(job.plan, job.cell)
                if not turn.begun:  # at another computer, say: what is unsettled here is not its
                    return None
                job = turn.job
            ended = self._store.record_outcome(job.plan, job.cell, job.attempt, outcome)
        except RobolinkError as away:  # it changes nothing of how the job ended
            tell_at_the_end(away.what)
            tell_at_the_end(
                tr(
                    "The plant was not told how this job ended. To report it later: robolink "
                    "-c {cell} fleet next {plan}",
                    cell=job.cell,
                    plan=job.plan,
                )
            )
            return None
        tell_state(ended.job)
        if ended.halt is not None:
            tell_at_the_end(ended.halt.sentence)
        return ended
