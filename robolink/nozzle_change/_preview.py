"""The nozzle change on paper: every step with its target, before anything moves."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from robolink.calibration import Ask, Move, two_pose
from robolink.errors import LimitError
from robolink.model import Controller, MotionProfile, Pose, ToolOffset, rotate_xy
from robolink.nozzle_change._plan import ChangePlan


@dataclass(frozen=True, slots=True)
class PlannedStep:
    """One step of the measurement as it is foreseen.

    Attributes:
        text: What is done.
        target: Where the flange goes, ``None`` for a step of the person.
        profile: How it goes there.
        refusal: Why the limits forbid it, empty when they do not.
    """

    text: str
    target: Pose | None = None
    profile: MotionProfile | None = None
    refusal: str = ""


def preview(controller: Controller, plan: ChangePlan) -> tuple[PlannedStep, ...]:
    """Return the steps of the measurement from where the robot stands now.

    Reads only. The person's part is foreseen as no movement at all.
    """
    stored = controller.tools.read(plan.tool)
    here = controller.groups[0].pose()
    selected = controller.tools.read(here.tool) if here.tool else None
    flange = flange_pose(here, selected or ToolOffset())
    return tuple(_foresee(plan, flange, stored))


def flange_pose(tip: Pose, offset: ToolOffset) -> Pose:
    """Return where the flange is when a four-axis robot's tool tip is at ``tip``.

    ``tip = flange + Rz(U) t`` and the tip's U is the flange's U plus the tool's
    (epson.md 3.1).
    """
    u_deg = tip.u_deg - offset.u_deg
    dx, dy = rotate_xy(offset.x_mm, offset.y_mm, u_deg)
    return replace(
        tip,
        x_mm=tip.x_mm - dx,
        y_mm=tip.y_mm - dy,
        z_mm=tip.z_mm - offset.z_mm,
        u_deg=u_deg,
        tool=0,
    )


def _foresee(plan: ChangePlan, start: Pose, stored: ToolOffset | None) -> Iterator[PlannedStep]:
    settings = plan.settings(start, None)
    procedure = two_pose(plan.touch, stored=stored)
    pose, step = start, next(procedure)
    while True:
        if isinstance(step, Ask):
            yield PlannedStep(step.instruction)
        elif isinstance(step, Move):
            pose = step.target
            profile = MotionProfile(step.path, settings.speed_percent, settings.speed_mm_s)
            try:
                settings.box.check(pose)
                refusal = ""
            except LimitError as error:
                refusal = str(error)
            yield PlannedStep(step.purpose, pose, profile, refusal)
        try:
            step = procedure.send(pose)
        except StopIteration:
            return
