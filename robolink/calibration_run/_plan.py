"""What a nozzle change will do, and within which limits."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

from robolink.calibration import CalibrationResult, RowFact
from robolink.calibration_run._acceptance import AcceptanceCriteria
from robolink.calibration_run._proposal import Proposal
from robolink.calibration_run._records import next_steps, require_pin_in_base, touch_details
from robolink.calibration_run._repeatability import touching_as_recorded
from robolink.errors import ConfigError, RejectedError
from robolink.messages import listed, tr
from robolink.methods import LengthRule, TwoPoseSource, find_method
from robolink.model import (
    AnsweredBy,
    Controller,
    KinematicToolTable,
    Pose,
    ToolOffset,
    WorkBox,
    plain_offset,
)
from robolink.procedures import (
    MovingSource,
    RequiresMotion,
    RequiresSensor,
    StopsAbovePin,
    TipSource,
    TouchesPin,
    TouchPlan,
    approach_path,
)
from robolink.runner import Procedure, RunSettings, inputs_of
from robolink.stations import Gauge, Station


def usual_box(sideways_mm: float = 150.0) -> WorkBox:
    """Return how far targets may lie from the start if no limits down and up are given."""
    return WorkBox.reaching(sideways_mm, down_mm=30.0, up_mm=50.0)


@dataclass(frozen=True, slots=True)
class Limits:
    """Where and how fast the robot may go.

    Attributes:
        box: How far targets may lie from where the flange is at the start.
        speed_percent, speed_mm_s: Speeds, in low power.
    """

    box: WorkBox = field(default_factory=usual_box)
    speed_percent: int = 5
    speed_mm_s: float = 20.0

    def settings(self, start: Pose, offset: ToolOffset | None) -> RunSettings:
        """Return limits and speeds for the flange, or for a tip at ``offset`` from it.

        Args:
            start: Flange pose at the start; the box lies about it.
            offset: The tip that moves, ``None`` for the flange.
        """
        shift_z, aside = _tip_about(start, offset) if offset else (0.0, 0.0)
        above = replace(start, z_mm=start.z_mm + shift_z)
        box = self.box.larger(sideways_mm=aside).about(above)
        return RunSettings(box, speed_percent=self.speed_percent, speed_mm_s=self.speed_mm_s)


@dataclass(frozen=True, slots=True)
class ToolPlan:
    """The plan for one tool.

    Attributes:
        tool: Number of the tool whose nozzle was changed.
        source: Where its measurement comes from.
        criteria: Acceptance limits of a measurement.
        verify: Whether to turn about the new tip after the write, where the source can.
        attempts: How often it is measured before a refusal ends the change.
        approach: Flange pose from which it is measured, ``None`` for wherever the robot is.
        retreat: Flange pose to which the robot goes afterwards.
        pin: Name of the station where a pin is touched; empty for none, or none that is kept.
        length: What is done where the heights of the touches show that the tip is longer or
            shorter: ``ask``, write Z by ``difference``, or ``keep`` it.
        stated_pin: The pin as the cell file has it, ``None`` where it says nothing.
        gauge: The gauge that is measured against; ``None`` for none, or none that is known.
        method: Name of the calibration method, for the record; empty for what the result says.
        station: Name of the station on whose record the measurement rests; empty where it rests on
            none, because it finds the station itself or is told where it is.
        at: Name of the station where it is measured, whether its place is on record or not.
        rows: What is stated of the rows of the budget, by their keys
            (``robolink.calibration.ACCURACY_ROWS``).
    """

    tool: int
    source: TipSource = field(default_factory=TwoPoseSource)
    criteria: AcceptanceCriteria = field(default_factory=AcceptanceCriteria)
    verify: bool = True
    attempts: int = 1
    approach: Pose | None = None
    retreat: Pose | None = None
    pin: str = ""
    stated_pin: Station | None = None
    gauge: Gauge | None = None
    length: LengthRule = "ask"
    method: str = ""
    station: str = ""
    at: str = ""
    rows: Mapping[str, RowFact] = field(default_factory=dict, hash=False)

    def named(self, result: CalibrationResult) -> CalibrationResult:
        """Return a result under the method's name, whichever solver it uses.

        Raises:
            CalibrationError: ``local_pose``: the pin that is to be kept was not found in the base.
        """
        require_pin_in_base(self.pin, result)
        return replace(result, method=self.method) if self.method else result

    def details(self, proposal: Proposal) -> dict[str, object]:
        """Return what the journal stores besides the value, plain JSON."""
        own = {
            "tip": plain_offset(proposal.tip),
            "method": proposal.result.method,
            "z_from": "measured" if "z_mm" in proposal.result.measured else proposal.z_from,
        }
        touch = {"touch": touch_details(self.pin, proposal)} if self.pin else {}
        told = proposal.length
        length = {"length": asdict(told)} if told is not None and told.changed else {}
        if told is not None and not told.changed:
            length = {"length_checked": asdict(told)}
        steps = [step.as_json() for step in next_steps(proposal.result, self.tool)]
        following = {"next_steps": steps} if steps else {}
        return {**own, **touch, **length, **following, **proposal.kept_record}

    def as_recorded(self, controller: Controller) -> "ToolPlan":
        """Return the same with the touches' unstated values taken from the record."""
        source = self.source
        if not isinstance(source, TouchesPin):
            return self
        touch = touching_as_recorded(controller, source.touch, self.pin)
        return replace(self, source=source.with_touch(touch))

    @property
    def moving(self) -> MovingSource | None:
        """The source, where it moves the robot."""
        return self.source if isinstance(self.source, MovingSource) else None


def journey(target: Pose | None, purpose: str, here: Pose) -> Procedure[None]:
    """Return the flange's path to a planned pose, up, over and down; none without one.

    Args:
        target: That pose.
        purpose: What the way is for.
        here: Where the flange is; the arm keeps its hand.
    """
    if target is not None:
        there = Pose(*target.coordinates(), tool=0, local=here.local)
        goal = replace(there, hand=here.hand, posture=here.posture)
        yield from approach_path(goal, here=here, purpose=purpose)


Proposals = Sequence[tuple[ToolPlan, Proposal]]
"""Each tool of a plan, with its proposal."""


@dataclass(frozen=True, slots=True)
class ChangePlan:
    """The plan for one tool, or for several on one head: all of them or none.

    Attributes:
        tools: The tools, in the order in which they are measured.
        limits: Where and how fast the robot may go.
        ask_before_write: Whether a person accepts the proposals before anything is written, and
            is asked about what a measurement offers, such as a pose to be taken again.
        safe: Flange pose to which the robot goes first and last.
        turn_back: Whether it turns back to the U of that pose at the end; else it keeps its own.
        attended: Whether a person may be asked what a measurement leaves open; ``None`` for where
            the write is asked too.
        agreed_by: How the write was agreed to in advance, for the record, where it is not asked;
            ``None`` where the listener asks, and so has the answer on record.
    """

    tools: tuple[ToolPlan, ...]
    limits: Limits = field(default_factory=Limits)
    ask_before_write: bool = True
    safe: Pose | None = None
    turn_back: bool = True
    attended: bool | None = None
    agreed_by: AnsweredBy | None = AnsweredBy.PROGRAM

    @property
    def asks(self) -> bool:
        """Whether a person may be asked about what a measurement leaves open."""
        return self.ask_before_write if self.attended is None else self.attended

    @property
    def start(self) -> Pose | None:
        """The first pose to which the robot goes; ``None`` where it begins where it is."""
        return self.safe or self.tools[0].approach

    @property
    def moves(self) -> bool:
        """Whether the robot moves."""
        return any(plan.moving for plan in self.tools)


def _tip_about(flange: Pose, offset: ToolOffset) -> tuple[float, float]:
    """Return how far above a flange a tip is, and how far beside it at most, at any U."""
    x_mm, y_mm, z_mm = offset.components()[:3]
    v, w = math.radians(flange.v_deg), math.radians(flange.w_deg)
    above_mm = -math.sin(v) * x_mm + math.cos(v) * (math.sin(w) * y_mm + math.cos(w) * z_mm)
    beside_mm2 = x_mm**2 + y_mm**2 + z_mm**2 - above_mm**2
    return above_mm, math.sqrt(max(0.0, beside_mm2))


def clearance_too_small(clearance_mm: float, limit_mm: float) -> str:
    """Return why a clearance below the largest believed change is refused."""
    return tr(
        "The robot would stop {clearance:g} mm from contact, but a new tip may be "
        "{limit:g} mm longer.",
        clearance=clearance_mm,
        limit=limit_mm,
    )


def require_clearance(plan: ChangePlan) -> None:
    """Refuse a plan in which a new tip could hit the pin before the person takes over.

    A jump that an engineer accepts was seen before, and is the engineer's to answer for.

    Raises:
        ConfigError: A clearance is below the largest change that is believed.
    """
    for one in plan.tools:
        source = one.source
        clearance_mm = source.clearance_mm if isinstance(source, StopsAbovePin) else None
        if clearance_mm is None or clearance_mm >= one.criteria.max_change_mm:
            continue
        raise ConfigError(
            clearance_too_small(clearance_mm, one.criteria.max_change_mm),
            remedy=tr(
                "Nothing moved. Use a clearance of {limit:g} mm or more, or allow less change.",
                limit=one.criteria.max_change_mm,
            ),
        )


def require_inputs(controller: Controller, plan: ChangePlan) -> None:
    """Refuse a plan that needs a contact input where there are no inputs; asks nothing.

    Raises:
        ConfigError: The controller has no inputs.
    """
    for one in plan.tools:
        if isinstance(one.source, TouchesPin) and one.source.touch.contact is not None:
            inputs_of(controller)


def require_measurable(controller: Controller, plan: ChangePlan) -> None:
    """Refuse to measure what the machine's kinematics cannot accept; only reads.

    Raises:
        RejectedError: Names the components, and why.
    """
    tools = controller.tools
    if not isinstance(tools, KinematicToolTable):
        return
    for one in plan.tools:
        if one.method:
            tools.require_measurable(find_method(one.method).measures)


def require_motion(controller: Controller, plan: ChangePlan) -> None:
    """Refuse a plan in which the robot moves too fast for the measurement; only reads.

    Raises:
        CalibrationError: As :meth:`RequiresMotion.require_able`.
    """
    for one in plan.tools:
        if isinstance(one.source, RequiresMotion):
            one.source.require_able(controller.groups[0], one.criteria.max_change_mm)


def require_contact_input(controller: Controller, touch: TouchPlan) -> None:
    """Read the contact input, so that a missing one is known at once.

    Raises:
        ConfigError: The controller has no inputs, or refuses to read this one.
    """
    if touch.contact is None:
        return
    inputs = inputs_of(controller)
    try:
        inputs.read_input(touch.contact.number)
    except (ConfigError, RejectedError) as error:
        raise ConfigError(
            listed(
                tr("The contact input {number} cannot be read:", number=touch.contact.number),
                [error.what],
            ),
            remedy=tr("Nothing moved. Give the number of an input that the controller has."),
        ) from error


def require_contacts(controller: Controller, plan: ChangePlan) -> None:
    """Read all contact inputs of a plan; see :func:`require_contact_input`."""
    for one in plan.tools:
        if isinstance(one.source, TouchesPin):
            require_contact_input(controller, one.source.touch)


def require_ready(controller: Controller, plan: ChangePlan) -> None:
    """Check that the cameras and contact inputs of a plan are there, before anything moves.

    Raises:
        CalibrationError, ConfigError, ConnectError: As :meth:`RequiresSensor.require_ready` and
            :func:`require_contact_input`.
    """
    require_contacts(controller, plan)
    for one in plan.tools:
        if isinstance(one.source, RequiresSensor):
            one.source.require_ready()
