"""The preview of a nozzle change: every step with its target, before anything moves."""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Final, cast

from robolink.calibration import flange_of, tip_pose
from robolink.calibration_run._plan import (
    ChangePlan,
    Proposals,
    ToolPlan,
    journey,
    require_clearance,
    require_inputs,
    require_measurable,
    require_motion,
)
from robolink.errors import CalibrationError, ConfigError, ConnectError, LimitError
from robolink.messages import joined, tr
from robolink.model import (
    Controller,
    InputEdge,
    MotionGroup,
    MotionProfile,
    Path,
    Pose,
    ToolOffset,
)
from robolink.procedures import (
    KeepsProof,
    KeptProof,
    LookSource,
    MeasurementContext,
    MovingSource,
)
from robolink.procedures.source_bases import InputSource
from robolink.runner import (
    ArmAhead,
    Ask,
    ForeseenStep,
    Look,
    Move,
    Operator,
    Procedure,
    Rehearsal,
    RehearsedStep,
    RunSettings,
    Seek,
    TeachPrompt,
    foreseen_steps,
    nothing_in_the_way,
)

Foreseen = Generator[ForeseenStep, None, tuple[Pose, bool]]


@dataclass(frozen=True, slots=True)
class PlannedStep:
    """One planned step of the measurement.

    Attributes:
        text: What is done.
        target: Where the flange goes, ``None`` for a step that moves nothing.
        profile: How it goes there.
        edge: The input that ends the step on the way, ``None`` for none.
        refusal: Why the limits forbid it, empty when they do not.
        shown: What a person has to show, ``None`` where nobody is asked.
        start: Where the flange is before a movement; behind a touch, where that is expected.
    """

    json_version: ClassVar[int] = 2
    text: str
    target: Pose | None = None
    profile: MotionProfile | None = None
    edge: InputEdge | None = None
    refusal: str = ""
    shown: TeachPrompt | None = None
    start: Pose | None = None

    def target_is(self, place: Pose) -> bool:
        """Return whether it ends at a place."""
        return self.target is not None and self.target.coordinates() == place.coordinates()

    def requests(self, group: MotionGroup) -> tuple[str, ...]:
        """Return the requests of the step besides its reads, as sent on the wire."""
        if self.target is None or self.profile is None:
            return ()
        if self.edge is None:
            return group.requests_for(self.target, self.profile)
        return group.requests_until(self.target, self.edge, speed_mm_s=self.profile.speed_mm_s)


def preview(controller: Controller, plan: ChangePlan) -> tuple[PlannedStep, ...]:
    """Return the steps of the measurements from where the robot is now.

    Reads only. The person's part is foreseen as no movement at all, but where the step says
    about where it leads. Where the robot stops beside a pin is drawn in the run: the limits are
    looked at all around. Where the places are known, the arm is asked whether it gets there, and
    past its singular places.

    Raises:
        ConfigError: A clearance is below the largest change that is believed, or an input is to
            show contact where there are none.
        RejectedError: The machine's kinematics could not be told what would be measured.
        CalibrationError: The robot moves too fast for what is measured.
    """
    require_clearance(plan)
    require_inputs(controller, plan)
    require_measurable(controller, plan)
    if not plan.moves:
        return ()
    require_motion(controller, plan)
    return tuple(_foresee(controller, plan, flange_now(controller)))


def foresee(
    procedure: Procedure[object], *, here: Pose, settings: RunSettings, arm: ArmAhead | None = None
) -> tuple[PlannedStep, ...]:
    """Return the steps of one procedure that starts with the flange at ``here``.

    Args:
        procedure: What is foreseen; it is used up.
        here: Where the flange is.
        settings: The limits.
        arm: Is asked about movements; ``None`` for asking nobody.

    Example:
        >>> from robolink.methods import measure_two_pose
        >>> from robolink.model import Pose, ToolOffset, WorkBox
        >>> from robolink.calibration_run import foresee
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.runner import RunSettings
        >>> course = measure_two_pose(TouchPlan(nominal=True), stored=ToolOffset(12, -4, -20))
        >>> settings = RunSettings(WorkBox(z_max_mm=-12))  # 8 mm above the touch; it lifts by 10
        >>> steps = foresee(course, here=Pose(298, 99, -20, 0), settings=settings)
        >>> [bool(step.refusal) for step in steps]
        [False, True, True, False, False, True]
    """
    steps = foreseen_steps(procedure, here, consider=arm.considered if arm else nothing_in_the_way)
    return tuple(_planned_steps(steps, settings, arm))


def rehearse(
    controller: Controller,
    plan: ChangePlan,
    *,
    here: Pose,
    stored: Mapping[int, ToolOffset | None],
    writes: bool = True,
) -> Rehearsal | None:
    """Go through a whole run as it will be if each tip is where its stored offset puts it.

    Reads what the procedures want to know of the controller; nothing moves.

    Args:
        controller: The controller.
        plan: The plan.
        here: Where the flange is.
        stored: The stored offset of each tool.
        writes: Whether the tools are written, and their turn tests made.

    Returns:
        ``None`` where a procedure needs answers that nobody can expect.
    """
    rehearsal = Rehearsal(here)
    context = MeasurementContext(
        controller, cast(Operator, None), start=here, settings=plan.limits.settings
    )
    try:
        rehearsal.run(journey(plan.safe, tr("Moving to the safe pose."), here))
        proofs = [
            proof
            for one in plan.tools
            if one.moving is not None
            for proof in _rehearsed(rehearsal, context, one, one.moving, stored.get(one.tool))
        ]
        if writes:
            for proof in proofs:
                if not _prove(rehearsal, proof):
                    return None
        _back_to_flange(rehearsal)
        if plan.safe is not None:
            u_deg = plan.safe.u_deg if plan.turn_back else rehearsal.here.u_deg
            goal = replace(plan.safe, u_deg=u_deg)
            rehearsal.run(journey(goal, tr("Moving to the safe pose."), rehearsal.here))
    except _NOTHING_MADE_OF_IT:
        return None
    return rehearsal


_NOTHING_MADE_OF_IT: Final = (
    CalibrationError,
    LimitError,
    ConfigError,
    ConnectError,
    ArithmeticError,
    TypeError,
    ValueError,
)
"""What a procedure, perhaps of another package, may raise at answers that only are expected; the
run itself does not depend on them."""


def _rehearsed(
    rehearsal: Rehearsal,
    context: MeasurementContext,
    plan: ToolPlan,
    source: MovingSource,
    stored: ToolOffset | None,
) -> Iterator[KeptProof]:
    """Go through the measurement of one tool, and yield its turn test."""
    there = tr("Moving to the station for tool {tool}.", tool=plan.tool)
    rehearsal.run(journey(plan.approach, there, rehearsal.here))
    told = source.told_by(context) if isinstance(source, InputSource) else source
    result = rehearsal.run(told.procedure(stored, rehearsal.here))
    if isinstance(source, LookSource):
        with source.opened() as camera:
            rehearsal.settle_s = camera.settle_s
    context.stands = rehearsal.here
    away = tr("Leaving the station of tool {tool}.", tool=plan.tool)
    rehearsal.run(journey(plan.retreat, away, rehearsal.here))
    if plan.verify and isinstance(source, KeepsProof):
        yield source.proof(
            context,
            plan.tool,
            result,
            tip=result.offset,
            tolerance_mm=plan.criteria.drift_tolerance_mm,
        )


def _prove(rehearsal: Rehearsal, proof: KeptProof) -> bool:
    """Go through a turn test, in the frame of the written tool; false if its steps are unknown."""
    _back_to_flange(rehearsal)
    frame = proof.written
    rehearsal.select(tip_pose(rehearsal.here, frame, tool=proof.tool), frame)
    steps = proof.foreseen(rehearsal.here)
    if steps is not None:
        rehearsal.run(steps)
    return steps is not None


def _back_to_flange(rehearsal: Rehearsal) -> None:
    if rehearsal.frame != ToolOffset():
        rehearsal.select(flange_of(rehearsal.here, rehearsal.frame), ToolOffset())


def flange_now(controller: Controller) -> Pose:
    """Read where the flange is, whichever tool is selected."""
    here = controller.groups[0].pose()
    selected = controller.tools.read(here.tool) if here.tool else None
    return flange_of(here, selected or ToolOffset())


def require_inside(controller: Controller, steps: Sequence[PlannedStep]) -> None:
    """Refuse steps whose targets lie outside the limits.

    Raises:
        LimitError: Names the first of them.
    """
    for step in steps:
        if step.refusal:
            what = tr("{step} {refusal}", step=step.text, refusal=step.refusal)
            raise _refused(controller, what)


def _refused(controller: Controller, what: str) -> LimitError:
    return LimitError(
        what,
        remedy=tr(
            "Jog the tip closer to the station, or widen the allowed area. If the arm "
            "cannot reach: move the station."
        ),
        controller=controller.identity,
    )


def require_turn_test(controller: Controller, plan: ChangePlan, rehearsal: Rehearsal) -> None:
    """Refuse a turn test that could be made with no tip that this change may find; only reads.

    The new tip is not where the stored offset puts it, but not farther from there than the largest
    change that is believed. So what the arm does not reach with the stored offset is asked for
    other tips on that circle too, and a place outside the box must be outside by more than that.

    Args:
        controller: The controller.
        plan: The plan.
        rehearsal: The run, gone through with each tip where it is expected.

    Raises:
        LimitError: Names the step; nothing moved.
    """
    slack_mm = max(one.criteria.max_change_mm for one in plan.tools)
    _require_made(controller, plan, rehearsal, slack_mm, tr("Nothing moved."))


def require_proofs(
    controller: Controller, plan: ChangePlan, context: MeasurementContext, proposals: Proposals
) -> None:
    """Refuse to write what the turn test could not prove, now that the tips are known; only reads.

    Args:
        controller: The controller.
        plan: The plan.
        context: What the sources work with.
        proposals: What would be written.

    Raises:
        LimitError: Names the step; nothing was written.
    """
    rehearsal = Rehearsal(flange_now(controller))
    try:
        for one, proposal in proposals:
            source, tolerance_mm = one.source, one.criteria.drift_tolerance_mm
            if not one.verify or not isinstance(source, KeepsProof):
                continue
            result, tip = proposal.result, proposal.tip
            proof = source.proof(context, one.tool, result, tip=tip, tolerance_mm=tolerance_mm)
            if not _prove(rehearsal, proof):
                return
    except _NOTHING_MADE_OF_IT:
        return  # the test itself decides
    rehearsal.began = context.start or rehearsal.began
    _require_made(controller, plan, rehearsal, 0.0, tr("Nothing was written."))


def _require_made(
    controller: Controller, plan: ChangePlan, rehearsal: Rehearsal, slack_mm: float, stands: str
) -> None:
    """Refuse turn tests that cannot be made with the tips so far beside their places."""
    for step in rehearsal.turning:
        if refusal := _outside(plan, rehearsal.began, step, slack_mm):
            raise _refused(controller, _turn_test(step, refusal))
    far = rehearsal.beyond_reach(controller, slack_mm)
    if far is not None:
        refusal = tr("The robot cannot reach that place with its tool turned that way.")
        remedy = tr(
            "Let the turn test turn the tool another way, or move the station to where the arm has "
            "room to turn it."
        )
        raise LimitError(
            _turn_test(far, refusal),
            remedy=joined(" ", (stands, remedy)),
            controller=controller.identity,
        )


def _turn_test(step: RehearsedStep, refusal: str) -> str:
    return tr("Turn test: {step} {refusal}", step=step.purpose, refusal=refusal)


def _outside(plan: ChangePlan, start: Pose, step: RehearsedStep, slack_mm: float) -> str:
    """Return why the box forbids a step of the turn test, empty if it does not."""
    box = plan.limits.settings(start, step.frame).box.larger(sideways_mm=slack_mm, up_mm=slack_mm)
    try:
        replace(box, z_min_mm=box.z_min_mm - slack_mm).check(step.farthest)
    except LimitError as error:
        return error.what
    return ""


def _foresee(controller: Controller, plan: ChangePlan, start: Pose) -> Iterator[PlannedStep]:
    settings = plan.limits.settings(start, None)
    here, known, arm = start, True, ArmAhead.of(controller)
    for goal, procedure in _procedures(controller, plan):
        steps = foreseen_steps(procedure(here), here, known=known, consider=arm.considered)
        here, known = yield from _planned_steps(steps, settings, arm, goal)


def _procedures(
    controller: Controller, plan: ChangePlan
) -> Iterator[tuple[Pose | None, Callable[[Pose], Procedure[object]]]]:
    """Yield the procedures before the write, each from where the one before ends.

    The pose is where it ends, of one that does so wherever it begins.
    """
    yield plan.safe, partial(journey, plan.safe, tr("Moving to the safe pose."))
    for one in plan.tools:
        tool, source = one.tool, one.moving
        if source is None:
            continue
        stored = controller.tools.read(tool)
        there = tr("Moving to the station for tool {tool}.", tool=tool)
        yield one.approach, partial(journey, one.approach, there)
        yield None, partial(_measurement, source, stored)
        away = tr("Leaving the station of tool {tool}.", tool=tool)
        yield one.retreat, partial(journey, one.retreat, away)


def _measurement(source: MovingSource, stored: ToolOffset | None, here: Pose) -> Procedure[object]:
    return (yield from source.procedure(stored, here))


def _planned_steps(
    steps: Foreseen, settings: RunSettings, arm: ArmAhead | None, goal: Pose | None = None
) -> Generator[PlannedStep, None, tuple[Pose, bool]]:
    """Yield steps with what forbids them, and return where they lead.

    Args:
        steps: As they are foreseen.
        settings: The limits.
        arm: Is asked about movements whose places are known.
        goal: Where they end, wherever they begin; ``None`` where that is not so.

    Raises:
        CalibrationError: They are refused before the first of them.
        LimitError: There is no way.
    """
    while True:
        try:
            one = next(steps)
        except StopIteration as ended:
            end: tuple[Pose, bool] = ended.value
            return end
        step, move = one.step, one.move
        if isinstance(step, Ask):
            refusal = _refusal(step.foreseen, settings) if step.foreseen else ""
            yield PlannedStep(step.instruction, refusal=refusal, shown=step.shown)
        elif isinstance(step, Look):
            yield PlannedStep(step.purpose)
        else:
            planned = replace(_planned(step, settings), start=one.start)
            arrives = goal is not None and planned.target_is(goal)
            if arm and move and not planned.refusal and (one.known or arrives):
                start = one.start if one.known else None
                planned = replace(planned, refusal=arm.obstacle(move, start))
            yield planned


def _planned(step: Move | Seek, settings: RunSettings) -> PlannedStep:
    if isinstance(step, Move):
        profile = MotionProfile(step.path, settings.speed_percent, settings.speed_mm_s)
        edge = None
    else:
        profile, edge = MotionProfile(Path.STRAIGHT, speed_mm_s=step.speed_mm_s), step.edge
    aside_mm = step.aside_mm if isinstance(step, Move) else 0.0
    refusal = _refusal(step.target, settings, aside_mm=aside_mm)
    return PlannedStep(step.purpose, step.target, profile, edge, refusal)


def _refusal(target: Pose, settings: RunSettings, *, aside_mm: float = 0.0) -> str:
    """Return why the limits forbid a target, or one so far beside it; empty if they do not."""
    try:
        for dx_mm, dy_mm in ((aside_mm, aside_mm), (-aside_mm, -aside_mm)):
            beside = replace(target, x_mm=target.x_mm + dx_mm, y_mm=target.y_mm + dy_mm)
            settings.box.check(beside)
    except LimitError as error:
        return error.what
    return ""
