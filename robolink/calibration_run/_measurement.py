"""The first half of a nozzle change: from a mounted nozzle to a recorded proposal.

Of the errors that no measurement shows by itself, what the plan states goes before what the record
tells, and that before the default (docs/reference/evidence.md 19).
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from robolink.accuracy import CellRecord, LooksAlike, facts_at
from robolink.calibration import AccuracyFacts, CalibrationResult, ErrorSource, assessed, turn_claim
from robolink.calibration_run._length import told_by_first_touch
from robolink.calibration_run._plan import ToolPlan, journey
from robolink.calibration_run._proposal import Listener, Moment, Proposal
from robolink.calibration_run._records import calibration_entry, decision_entry, refusal_entry
from robolink.calibration_run._repeatability import seating_of
from robolink.errors import CalibrationError, ConfigError, RobolinkError
from robolink.messages import tr
from robolink.methods import find_method
from robolink.model import (
    Controller,
    NewEntry,
    Pose,
    TipSensor,
    ToolOffset,
    says_it_is_simulated,
)
from robolink.procedures import MeasurementContext, touches_of
from robolink.procedures.source import touching_further
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.runner import (
    AGAIN,
    BACK,
    MORE,
    Ask,
    Look,
    RobotTime,
    Runner,
    Seek,
    StepDone,
    TouchedAt,
)
from robolink.stations import stations_on_record


def accuracy_facts(
    controller: Controller, plan: ToolPlan, result: CalibrationResult
) -> AccuracyFacts:
    """Return what this cell knows about the rows of a result's budget.

    Args:
        controller: Whose record is looked at.
        plan: How it was measured, and what is stated.
        result: What was measured.

    Example:
        >>> import robolink
        >>> from robolink.calibration import solve_two_pose
        >>> from robolink.model import Pose
        >>> from robolink.calibration_run import ToolPlan, accuracy_facts
        >>> found = solve_two_pose(Pose(298, 99, -60, 0), Pose(322, 91, -60, 180), sigma_mm=0.02)
        >>> with robolink.connect("epson+sim://accuracy-example") as controller:
        ...     facts = accuracy_facts(controller, ToolPlan(1), found)
        >>> facts.of("touch_mm").half_width, facts.of("touch_mm").basis
        (0.05, 'default')
    """
    touches = [pose for pose in result.inputs if isinstance(pose, TouchedAt)]
    outcomes = controller.outcomes
    station = plan.at or plan.station or plan.pin or outcomes.signature.station
    return facts_at(
        CellRecord(outcomes.recorded),
        station=station,
        stated=plan.rows,
        alike=LooksAlike(
            station,
            result.method,
            by_contact=bool(touches) and all(touch.contact for touch in touches),
            change=outcomes.change,
        ),
        learnt=bool(plan.station or plan.pin),
        inputs_per_look=result.inputs_per_look,
    )


def assessed_in_cell(
    controller: Controller, plan: ToolPlan, result: CalibrationResult
) -> tuple[CalibrationResult, AccuracyFacts]:
    """Return a result with what it is accurate to in this cell, and the basis of that.

    Args:
        controller: Whose record is looked at.
        plan: How it was measured, and what is stated.
        result: What was measured.

    Example:
        >>> import robolink
        >>> from robolink.calibration import solve_two_pose
        >>> from robolink.model import Pose
        >>> from robolink.calibration_run import ToolPlan, assessed_in_cell
        >>> found = solve_two_pose(Pose(298, 99, -60, 0), Pose(322, 91, -60, 180), sigma_mm=0.02)
        >>> with robolink.connect("epson+sim://accuracy-example") as controller:
        ...     result, _ = assessed_in_cell(controller, ToolPlan(1), found)
        >>> round(result.accurate_to_mm, 3)
        0.079
    """
    result = with_sources(plan, result)
    facts = accuracy_facts(controller, plan, result)
    return assessed(result, facts), facts


def with_sources(plan: ToolPlan, result: CalibrationResult) -> CalibrationResult:
    """Return a result that names the errors its scatter does not show.

    A method that does not say so itself has those of what it declares to need: a person who sees
    contact, a station whose place it relies on.
    """
    if result.sources is not None or not plan.method:
        return result
    needs = find_method(plan.method).needs
    count = sum(name.endswith("_mm") for name in result.measured)
    sources = []
    if not needs.by_sensor:
        sources.append(ErrorSource.of_lengths("touch_mm", count))
    if not needs.finds_pin:
        sources.append(ErrorSource.of_lengths("place_mm", count, turning="in_base"))
    # Without a confidence interval the scatter is unknown, and no sources are assumed.
    return replace(result, sources=tuple(sources)) if result.half_width95 else result


MOST_ANEW: Final = 5
"""How often a person may restart the touches of one tool."""


MOST_FURTHER: Final = 3
"""How often a person may return to the touches from one proposal: repeating them until they fit
would prove nothing."""


_INSTRUMENT: Final = frozenset(
    {
        *("no_edge", "sensor_failed", "tip_not_seen", "fiducial_not_seen", "tip_cut"),
        *("out_of_focus", "camera_gone", "camera_taken", "camera_refused", "packets_lost"),
        *("picture_late", "picture_unreadable", "stale_picture", "picture_dark"),
        "picture_overexposed",
    }
)
"""Codes of measurements that ended because a sensor or camera detected nothing."""


class TimedContext(MeasurementContext):
    """A context whose runners all count for one robot time.

    Attributes:
        robot_time: It; ``None`` where nobody wants to know.
    """

    robot_time: RobotTime | None = None

    def runner(
        self,
        tip: ToolOffset | None = None,
        camera: TipSensor | None = None,
        *,
        tool: int | None = None,
    ) -> Runner:
        """Return a runner that counts for it; see the context."""
        runner = super().runner(tip, camera, tool=tool)
        runner.robot_time = self.robot_time or runner.robot_time
        return runner


class Measuring:
    """Measures the tools of one change.

    Args:
        context: What the sources work with.
        listener: Told of steps and refusals.
        robot_time: Counts how long the robot takes.

    Attributes:
        simulated: Whether the controller says that nothing real moves.
    """

    def __init__(
        self, context: MeasurementContext, listener: Listener, robot_time: RobotTime
    ) -> None:
        self._context = context
        self._listener = listener
        self._time = robot_time
        self._facts = context.controller.facts()
        self.simulated = says_it_is_simulated(context.controller, self._facts)

    def propose(self, plan: ToolPlan) -> Proposal:
        """Measure one tool, again where the plan allows it, and record it.

        Raises:
            CalibrationError: The last measurement is not trusted either; it is on record.
            RobolinkError: Anything else that ended it.
        """
        left, anew = plan.attempts - 1, MOST_ANEW
        while True:
            try:
                return self._attempt(plan, partial(plan.source.measure, self._context, plan.tool))
            except CalibrationError as error:
                self._time.unusual()
                # A restart by a person does not count as one of the plan's attempts.
                by_hand = error.code == AGAIN and anew > 0
                self._listener.refused(plan.tool, error, again=by_hand or left > 0)
                if not by_hand and not left:
                    _name_another_way(error)
                    raise
                anew, left = (anew - 1, left) if by_hand else (anew, left - 1)

    def further(self, plan: ToolPlan, proposal: Proposal, *, again: int | None) -> Proposal:
        """Add touches to a measurement, and record the new result.

        Args:
            plan: What is measured.
            proposal: What they said so far.
            again: Index of the touch that is made again, ``None`` for one more.

        Raises:
            CalibrationError: They are not trusted any more.
        """
        source = touching_further(plan.source)
        assert source is not None  # noqa: S101 - further touches were offered
        self._time.unusual()
        what = tr("one more touch") if again is None else tr("touch {k} again", k=again + 1)
        self._context.controller.outcomes.append(decision_entry(what, tool=plan.tool))

        def measure(before: ToolOffset | None) -> CalibrationResult:
            return source.further(self._context, before, proposal.result, again)

        return self._attempt(plan, measure)

    def go_to(self, pose: Pose | None, purpose: str, *, turn: bool = True) -> None:
        """Drive the flange to ``pose``: up, over, down; nowhere without one.

        Args:
            pose: Where to.
            purpose: What for.
            turn: Whether it takes the U of that pose, too; else it keeps its own.
        """
        if pose is None:
            return
        controller = self._context.controller
        controller.tools.select(0)
        here = controller.groups[0].pose()
        goal = pose if turn else replace(pose, u_deg=here.u_deg)
        self._time.stands = here
        with self._time.journey_to(pose):
            self._context.run(journey(goal, purpose, here))

    def _attempt(
        self, plan: ToolPlan, measure: Callable[[ToolOffset | None], CalibrationResult]
    ) -> Proposal:
        context, tool = self._context, plan.tool
        self.go_to(plan.approach, tr("Moving to the station for tool {tool}.", tool=tool))
        self._listener.moment(Moment.BEFORE_MEASURE, context, tool)
        before = context.controller.tools.read(tool)
        with self._watched(plan, before):
            result, notes = told_of_typed(plan.named(measure(before)))
            result, facts = assessed_in_cell(context.controller, plan, result)
            plan.criteria.judge_fit(result)
            rests_on = self._station_record(plan.station)
            fresh = Proposal(
                tool,
                before,
                result,
                notes=notes,
                record=rests_on,
                kept_record=rests_on,
                seating=seating_of(context.controller),
            )
            adjusted = self._listener.adjusted(fresh, context)
            claim = turn_claim(result, facts)
            if claim is not None and not claim.finds_place and _by_difference(adjusted):
                # An error in the place cancels in a difference, but appears in its turn test.
                claim = None
            proposal = replace(adjusted, claim=claim)
        entry = calibration_entry(
            proposal,
            plan.criteria,
            source=plan.source.sentence,
            facts=self._facts,
            simulated=self.simulated,
            gauge=plan.gauge,
        )
        context.controller.outcomes.append(entry)
        self._listener.moment(Moment.AFTER_MEASURE, context, tool)
        self.go_to(plan.retreat, tr("Leaving the station of tool {tool}.", tool=tool))
        return proposal

    def _station_record(self, name: str) -> dict[str, object]:
        """Return the journal entry with the station's place, so that results compare.

        Tools that were measured by one entry share its error, and differ by their touches alone
        (docs/reference/evidence.md 12).
        """
        if not name:
            return {}
        known = stations_on_record(self._context.controller).get(name)
        if known is None or not known.learnt:
            return {}
        return {"station_record": {"station": name, "entry": known.entry, "at": known.found_at}}

    @contextmanager
    def _watched(self, plan: ToolPlan, before: ToolOffset | None) -> Iterator[None]:
        """Report each step; if the measurement ends early, record its poses."""
        poses: list[Pose] = []

        def on_step(done: StepDone) -> None:
            if done.pose is not None and isinstance(done.step, (Ask, Seek, Look)):
                poses.append(done.pose)
            self._listener.step(plan.tool, done)
            if told := told_by_first_touch(self._context.controller, plan, before, done):
                self._context.operator.tell(told)

        with self._context.telling(on_step, tool=plan.tool):
            try:
                yield
            except BaseException as error:
                self._record_end(refusal_entry(plan.tool, plan.criteria, error, poses=poses))
                raise

    def _record_end(self, entry: NewEntry) -> None:
        # The error being raised matters more than a failure to record it.
        with suppress(ConfigError, RobolinkError):
            self._context.controller.outcomes.append(entry)


def _by_difference(proposal: Proposal) -> bool:
    """Whether X and Y are earlier ones plus a difference, and not measured directly."""
    measured, offset = proposal.measured, proposal.offset
    return measured is not None and (measured.x_mm, measured.y_mm) != (offset.x_mm, offset.y_mm)


def told_of_typed(result: CalibrationResult) -> tuple[CalibrationResult, tuple[str, ...]]:
    """Return a result that names which of its touches were only typed, in words too."""
    typed = [n for n, touch in enumerate(touches_of(result), start=1) if touch.typed]
    if not typed:
        return result, ()
    told = tr(
        "Typed, not touched: touch {numbers}. Only the turn test can confirm it.",
        numbers=", ".join(map(str, typed)),
    )
    return replace(result, notes=(*result.notes, "touches_not_witnessed")), (told,)


@dataclass(frozen=True, slots=True)
class FurtherTouch:
    """A further touch that a person wants before anything is written.

    Attributes:
        again: Index of the one that is made again, ``None`` for one more.
    """

    again: int | None


@dataclass(frozen=True, slots=True)
class FurtherOffer:
    """What can be done with the touches of a finished measurement.

    Attributes:
        worst: Index of the one that fits worst; the last where nothing tells.
        adds: Whether one more can be made.
    """

    worst: int
    adds: bool

    @property
    def words(self) -> tuple[str, ...]:
        """The words that choose it."""
        return (BACK, MORE) if self.adds else (BACK,)

    def meant_by(self, word: str) -> FurtherTouch:
        """Return the choice that a word names."""
        return FurtherTouch(None if word == MORE else self.worst)


def offer_of(measured: Sequence[tuple[ToolPlan, Proposal]]) -> FurtherOffer | None:
    """Return what can be done, ``None`` for several tools or without touches of a person."""
    if len(measured) != 1:
        return None
    ((plan, proposal),) = measured
    source, result = touching_further(plan.source), proposal.result
    if source is None or not touches_of(result):
        return None
    adds = source.can_add_touch
    if adds is None:
        return None
    distances = result.residual_distances_mm if result.dof else ()
    last = len(result.inputs) - 1
    worst = max(range(len(distances)), key=distances.__getitem__) if distances else last
    return FurtherOffer(worst, adds)


def _name_another_way(error: CalibrationError) -> None:
    """Add to the remedy how to measure a tool after an instrument has failed for good."""
    if error.code not in _INSTRUMENT:
        return
    error.advise(
        tr(
            "Or measure by touch: 'robolink calibrate two-pose', {poses} to type poses.",
            poses=remedy_word(RemedyWord.GIVEN_POSES),
        )
    )
