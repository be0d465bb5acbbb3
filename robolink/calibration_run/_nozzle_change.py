"""The nozzle change: measure the new tips, write and test their offsets, or undo all.

Order (docs/reference/rules.md 4, 6): read the old values; measure, in Tool 0 where the robot moves;
judge; propose; on a yes write with compare-and-set and read back; turn about the new tips;
keep, or write the old values back once. Several tools are all measured before the first is
written. Whatever happens, the tool, power mode and speed as before are restored at the end.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import replace

from robolink.calibration import VerifyResult
from robolink.calibration_run._length import settle_lengths
from robolink.calibration_run._measurement import (
    MOST_FURTHER,
    FurtherOffer,
    FurtherTouch,
    Measuring,
    TimedContext,
    offer_of,
)
from robolink.calibration_run._open_turn_test import marked_turn_tests
from robolink.calibration_run._plan import (
    ChangePlan,
    Proposals,
    ToolPlan,
    require_clearance,
    require_contacts,
    require_inputs,
    require_measurable,
    require_motion,
)
from robolink.calibration_run._proposal import (
    ChangeReport,
    Listener,
    Moment,
    Proposal,
    ToolReport,
    WriteSubject,
)
from robolink.calibration_run._records import decision_entry, refusal_entry
from robolink.calibration_run._station_check import check_stations, found_with, stations_found
from robolink.calibration_run._turn_test import (
    Attended,
    conclude_turn_test,
    relearning_commands,
    touches_counting,
)
from robolink.errors import CalibrationError, DeclinedError, StoppedError
from robolink.messages import tr
from robolink.methods import find_method
from robolink.model import (
    Controller,
    ToolReceipt,
    answer_entry,
    new_operation,
)
from robolink.procedures import KeepsProof, MeasurementContext
from robolink.runner import Operator, RobotTime, regard
from robolink.timing import NS_PER_S
from robolink.transaction import Order, ToolChange, Wanted, plain_result

Earlier = Callable[[int], Sequence[float]]
"""Returns the lengths, in the plane, of a tool's corrections since its nozzle was mounted, oldest
first."""

DescribeReport = Callable[[ChangeReport], Mapping[str, object]]
"""Returns the result of an order, plain JSON, for a repeated delivery of that order."""


class NozzleChange:
    """One nozzle change on one controller, of one tool or of several on one head.

    Args:
        controller: A connected controller.
        plan: What to do, within which limits.
        operator: Who is asked, and brings the tip onto the pin.
        listener: Told of everything that happens.
        earlier: Where the corrections of before are found, for the refusal of growing ones.
        order: The order that it carries out (:func:`robolink.transaction.carrying_out`).
        describe: Makes the result of the order, plain JSON, from what the change did.
        robot_time: Counts how long the robot takes.
        before_write: Looks, and refuses if need be, when everything is measured and agreed to.

    Example:
        >>> from robolink.methods import PointsSource
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
        >>> from robolink.controllers import SimpleController, SimpleMachine
        >>> class Nobody:  # implements robolink.Operator
        ...     def tell(self, text): ...
        >>> touches = [Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)]
        >>> tool = ToolPlan(1, source=PointsSource(lambda: touches), verify=False)
        >>> plan = ChangePlan((tool,), ask_before_write=False)
        >>> machine = SimpleMachine({1: ToolOffset(12, -3.5, -20)})
        >>> with SimpleController(machine) as controller:
        ...     report = NozzleChange(controller, plan, operator=Nobody()).run()
        >>> round(machine.read(1).y_mm, 3)
        -4.0
    """

    def __init__(
        self,
        controller: Controller,
        plan: ChangePlan,
        *,
        operator: Operator,
        listener: Listener | None = None,
        earlier: Earlier = lambda _tool: (),
        order: Order | None = None,
        describe: DescribeReport | None = None,
        robot_time: RobotTime | None = None,
        before_write: Callable[[MeasurementContext, Proposals], None] | None = None,
    ) -> None:
        self._controller = controller
        self._before_write = before_write
        self._time = robot_time or RobotTime(controller)
        limits = controller.change_guard.limits
        tools = (replace(one, criteria=one.criteria.within(limits)) for one in plan.tools)
        self._plan = replace(plan, tools=tuple(tools))
        self._operator = operator
        self._listener = Listener() if listener is None else listener
        self._earlier = earlier
        self._order, self._describe = order, describe
        self._written: ToolChange | None = None
        self._accepted = ExitStack()
        self._began_ns = 0

    def run(self, *, write: bool = True) -> ChangeReport:
        """Run it. Ctrl-C before the last turn test has passed restores the old values.

        Args:
            write: Whether the proposals are written; a reference for later is not.

        Raises:
            CalibrationError: A measurement is not trusted; nothing was written.
            ConfigError: A clearance is below the largest change that is believed, or an input is
                to show contact where there are none.
            DeclinedError: The person said no; nothing was written.
            StoppedError: A stop came; what was written was restored, unless it was kept already.
            VerifyError: A tip drifts too far, or its touches were not made; the old values were
                restored.
            RobolinkError: Anything else that ended it, with the state it left.
        """
        require_clearance(self._plan)
        require_inputs(self._controller, self._plan)
        with self._controller.procedure(self._request), self._begun():
            self._require_possible(write=write)
            context = self._context(write=write)
            measuring = Measuring(context, self._listener, self._time)
            self._simulated = measuring.simulated
            measuring.go_to(self._plan.safe, tr("Moving to the safe pose."))
            self._listener.moment(Moment.START, context)
            measured = [(one, measuring.propose(one)) for one in self._plan.tools]
            proposals = self._agreed(context, measuring, measured, write=write)
            reports = self._write(context, proposals) if write else _unwritten(proposals)
            turn_back = self._plan.turn_back
            measuring.go_to(self._plan.safe, tr("Moving to the safe pose."), turn=turn_back)
            self._listener.moment(Moment.END, context)
            return self._report(reports)

    @contextmanager
    def _begun(self) -> Iterator[None]:
        """Guard the change; restore tool, power mode and speed whatever ends it."""
        reason, controller = self._request, self._controller
        controller.outcomes.change = new_operation()
        self._began_ns = controller.clock.now_ns()
        self._plan = replace(
            self._plan, tools=tuple(one.as_recorded(controller) for one in self._plan.tools)
        )
        try:
            with (
                controller.latch.watching(reason),
                controller.preserved(reason) if self._plan.moves else nullcontext(),
            ):
                yield
        except (KeyboardInterrupt, StoppedError):
            if self._written is not None and self._written.kept:
                self._tell(tr("Tool {tool} keeps the new value.", tool=self._numbers))
            raise
        finally:
            self._accepted.close()
            controller.outcomes.change = ""

    @property
    def _numbers(self) -> str:
        return ", ".join(str(plan.tool) for plan in self._plan.tools)

    @property
    def _request(self) -> str:
        return tr("calibrate tool {tool}", tool=self._numbers)

    def _require_possible(self, *, write: bool) -> None:
        """Refuse an impossible write before a person has measured anything."""
        if write:
            for one in self._plan.tools:
                self._controller.tools.require_writable(one.tool)
            require_measurable(self._controller, self._plan)
        require_contacts(self._controller, self._plan)
        require_motion(self._controller, self._plan)

    def _report(self, tools: tuple[ToolReport, ...]) -> ChangeReport:
        outcomes = self._controller.outcomes
        return ChangeReport(outcomes.change, tools, outcomes.signature.role, self._simulated)

    def _agreed(
        self,
        context: MeasurementContext,
        measuring: Measuring,
        measured: Proposals,
        *,
        write: bool,
    ) -> Proposals:
        """Return what to write of the measured values; a person may go back to touches."""
        for left in reversed(range(MOST_FURTHER + 1)):
            proposals = self._checked(context, measured, write=write)
            self._listener.proposed([proposal for _, proposal in proposals])
            self._judge(proposals)
            if not write:
                break
            for plan, proposal in proposals:
                self._require_accurate(context, plan, proposal)
            if left == MOST_FURTHER:
                self._listener.moment(Moment.BEFORE_WRITE, context)
            further = self._ask(context, proposals, offer_of(measured) if left else None)
            if further is None:
                break
            ((plan, before),) = measured
            measured = [(plan, measuring.further(plan, before, again=further.again))]
        return proposals

    def _context(self, *, write: bool) -> MeasurementContext:
        start = None
        if self._plan.moves:
            self._controller.tools.select(0)
            start = self._controller.groups[0].pose()
        settings = self._plan.limits.settings
        context = TimedContext(
            self._controller,
            self._operator,
            start=start,
            settings=settings,
            offers=self._plan.ask_before_write,
            attended=self._plan.asks,
            types=write and all(one.verify and one.moving for one in self._plan.tools),
        )
        context.robot_time = self._time
        return context

    def _checked(
        self, context: MeasurementContext, proposals: Proposals, *, write: bool
    ) -> Proposals:
        """Return the proposals with what stations and heights show; record a refusal."""
        try:
            checked = check_stations(self._controller, proposals)
            if not write:
                return checked
            return settle_lengths(context, checked, attended=self._plan.asks)
        except CalibrationError as error:
            for plan, _ in proposals:
                self._controller.outcomes.append(refusal_entry(plan.tool, plan.criteria, error))
            raise

    def _judge(self, proposals: Proposals) -> None:
        for plan, proposal in proposals:
            try:
                plan.criteria.judge_change(
                    proposal, earlier_mm=self._earlier(plan.tool), remedy=plan.source.remedy
                )
            except BaseException as error:
                self._controller.outcomes.append(refusal_entry(plan.tool, plan.criteria, error))
                raise
            jump, guard = proposal.jump, self._controller.change_guard
            if jump is not None and (
                plan.criteria.jumps(proposal) or guard.limits.exceeded_by(jump)
            ):
                self._accepted.enter_context(guard.accepting(plan.tool, jump))

    def _require_accurate(
        self, context: MeasurementContext, plan: ToolPlan, proposal: Proposal
    ) -> None:
        """Ask a person about a statement that exceeds the limit only because of defaults.

        Raises:
            CalibrationError: ``large_interval``: nobody may be asked.
            DeclinedError: The person said no.
        """
        criteria, outcomes = plan.criteria, self._controller.outcomes
        refusal = criteria.over_by_defaults(
            proposal.result,
            station=plan.station or plan.pin,
            kind=find_method(plan.method).needs.station if plan.method else None,
            tool=plan.tool,
        )
        if refusal is None:
            return
        if not self._plan.asks:
            outcomes.append(refusal_entry(plan.tool, criteria, refusal))
            raise refusal
        question = tr("{found} Continue anyway?", found=refusal.what)
        accepted = context.runner().confirm(question)
        entry = decision_entry(
            tr("accepted") if accepted else tr("declined"),
            accepted=accepted,
            question=question,
            code=refusal.code,
            accurate_to_mm=proposal.result.accurate_to_mm,
        )
        outcomes.append(replace(entry, tool=plan.tool))
        if not accepted:
            raise DeclinedError(
                tr("You did not accept the statement."), remedy=tr("Nothing was written.")
            )

    def _ask(
        self, context: MeasurementContext, proposals: Proposals, offer: FurtherOffer | None
    ) -> FurtherTouch | None:
        """Ask for the proposals to be accepted; return the touch to make before that."""
        numbers = ", ".join(str(plan.tool) for plan in self._plan.tools)
        question = tr("Write these values to tool {tool}? 'robolink undo' undoes it.", tool=numbers)
        if not self._plan.ask_before_write:
            if self._plan.agreed_by is not None:
                entry = answer_entry(question, True, self._plan.agreed_by, accepted=True)
                self._controller.outcomes.append(replace(entry, verdict=tr("accepted in advance")))
            return None
        judged = [(one, plan.criteria.verdicts(one)) for plan, one in proposals]
        shown, verdicts = zip(*judged, strict=True)
        subject = WriteSubject(
            shown,
            verdicts,
            again=None if offer is None else offer.worst + 1,
            can_add_touch=offer is not None and offer.adds,
            stations=found_with(self._controller, [one.tool for one in shown]),
        )
        regard(self._operator, [subject])
        said = context.runner().confirm_or(
            question, also=() if offer is None else offer.words, decides="accepted"
        )
        if offer is not None and isinstance(said, str):
            return offer.meant_by(said)
        if said is not True:
            raise DeclinedError(
                tr("You did not accept the new value."), remedy=tr("Nothing was written.")
            )
        return None

    def _write(self, context: MeasurementContext, proposals: Proposals) -> tuple[ToolReport, ...]:
        """Write all, test each, keep all; an error on the way restores all."""
        if self._before_write is not None:
            self._before_write(context, proposals)
        verify = any(plan.verify and plan.moving for plan, _ in proposals)
        known = [dict(plan.details(proposal)) for plan, proposal in proposals]
        wanted = [
            Wanted(proposal.tool, proposal.offset, proposal.before, details)
            for (_, proposal), details in zip(proposals, known, strict=True)
        ]
        drifts: dict[int, VerifyResult | None] = {}

        def reports(receipts: Sequence[ToolReceipt]) -> tuple[ToolReport, ...]:
            return tuple(
                ToolReport(
                    proposal, receipt, drifts.get(receipt.tool), plan.criteria.verdicts(proposal)
                )
                for (plan, proposal), receipt in zip(proposals, receipts, strict=True)
            )

        def describe(receipts: Sequence[ToolReceipt]) -> Mapping[str, object]:
            if self._describe is None:
                return plain_result(receipts)
            return self._describe(self._report(reports(receipts)))

        self._written = ToolChange(
            self._controller,
            wanted,
            verify=verify,
            marked=marked_turn_tests(context, self._plan.limits, proposals),
            tell=self._tell,
            order=self._order,
            describe=describe,
        )
        with self._written as change:
            receipts = change.write()
            for receipt in receipts:
                self._listener.wrote(receipt)
            for (plan, proposal), receipt, details in zip(proposals, receipts, known, strict=True):
                proof = self._verify(context, plan, proposal, receipt)
                drifts[receipt.tool] = proof
                details["accurate_to_mm"] = (
                    proposal.result.accurate_to_mm if proof is None else proof.accurate_to_mm
                )
            took_s = round((self._controller.clock.now_ns() - self._began_ns) / NS_PER_S, 1)
            for details in known:
                details["took_s"] = took_s
            change.keep(tr("verified") if verify else tr("not verified"))
        self._controller.outcomes.append(*stations_found(self._controller, proposals))
        return reports(receipts)

    def _verify(
        self, context: MeasurementContext, plan: ToolPlan, proposal: Proposal, receipt: ToolReceipt
    ) -> VerifyResult | None:
        source = plan.moving
        if source is None or not plan.verify:
            return None
        tool, criteria = receipt.tool, plan.criteria

        def refused(error: CalibrationError) -> None:
            self._controller.outcomes.append(refusal_entry(tool, criteria, error))

        def turned() -> VerifyResult:
            self._time.now_in(tool, proposal.offset)
            with (
                context.telling(lambda done: self._listener.step(tool, done), tool=tool),
                touches_counting(
                    self._controller,
                    lambda error: self._controller.outcomes.append(
                        refusal_entry(tool, criteria, error)
                    ),
                ),
            ):
                return source.verify(
                    context,
                    tool,
                    proposal.result,
                    tip=proposal.tip,
                    tolerance_mm=criteria.drift_tolerance_mm,
                )

        def turned_again() -> VerifyResult:
            self._time.unusual()
            return turned()

        attended = None
        if self._plan.asks:
            person = context.runner(tool=tool)
            attended = Attended(
                person.choose,
                person.confirm,
                # A proof that uses plain values can be repeated from where it ended.
                turned_again if isinstance(source, KeepsProof) else None,
                relearning_commands(self._controller, plan, proposal.result),
            )
        return conclude_turn_test(
            self._controller,
            tool,
            turned(),
            claim=proposal.claim,
            interval_mm=criteria.interval_mm,
            attended=attended,
            tell=lambda proof: self._listener.verified(tool, proof),
        )

    def _tell(self, sentence: str) -> None:
        self._operator.tell(sentence)
        self._listener.told(sentence)


def _unwritten(proposals: Proposals) -> tuple[ToolReport, ...]:
    return tuple(
        ToolReport(proposal, None, None, plan.criteria.verdicts(proposal))
        for plan, proposal in proposals
    )
