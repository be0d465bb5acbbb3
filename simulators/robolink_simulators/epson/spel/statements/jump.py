"""Jump and Jump3: up, across, down (docs/reference/spel.md 7.1)."""

from robolink.model import Pose
from robolink_simulators.epson.arm.joints import Joints
from robolink_simulators.epson.arm.kinematics import flange_of, solve
from robolink_simulators.epson.arm.motion_parameters import MotionPhase
from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.arm.ways.arch import arched
from robolink_simulators.epson.definitions.arches import Arch
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.legs import go_leg, line_leg

DESCENT = 2
"""Which leg of a Jump is the descent; Sense is looked at just before it (documented)."""


def jump(
    machine: Machine,
    point: Point,
    limz_mm: float | None,
    *,
    arch: Arch | None = None,
    looks: bool = False,
) -> list[Leg]:
    """Plan a motion up to LimZ, across, down; ``arch`` rounds it, without one it is a gate (C7).

    LimZ is compared with joint 3, not with the tip (assumed: its default of 0 would else be
    out of reach under every tool that hangs down). The modifier's height counts in the
    target's local (documented). ``looks`` is whether Sense is looked at before the descent.

    Raises:
        Refusal: Start or target lie above LimZ; the start's number is documented (4005).
    """
    if machine.model.six_axes:
        raise SpelRefusal(RefusalKind.OTHER_ROBOT, "Jump is not for six axes; Jump3 is")
    height_mm = machine.parameters.limz_mm
    if limz_mm is not None:
        local, base = machine.locals.get(point.local), machine.kept.base
        height_mm = limz_mm + local.z_mm + base.coordinates[2]
    start, end = machine.arm.joints, machine.joints_for(point)
    for joints, what in ((start, "The motion starts"), (end, "The target lies")):
        if joints.j3_mm > height_mm + machine.robot.drives.get("limzmargin")[0]:
            raise SpelRefusal(RefusalKind.ABOVE_LIMZ, f"{what} above LimZ")
    up = start.at_height(max(start.j3_mm, height_mm))
    across = end.at_height(max(end.j3_mm, height_mm))
    gate = [
        go_leg(machine, start, up, phase=MotionPhase.DEPART),
        go_leg(machine, up, across),
        go_leg(machine, across, end, phase=MotionPhase.APPROACH),
    ]
    rounded = None if arch is None else arched(gate, arch, looks=looks)
    return [*(rounded or gate)]


def jump3(machine: Machine, points: tuple[Point, Point, Point]) -> list[Leg]:
    """Plan Jump3: straight to the first point, point to point to the second, straight on.

    LimZ has no bearing on it (documented).

    Raises:
        Refusal: A point is out of reach.
    """
    depart, approach, end = (machine.pose_of(point) for point in points)
    there = _joints(machine, approach)
    first = line_leg(machine, machine.tip(), depart, near=machine.arm.joints)
    return [
        first,
        go_leg(machine, first.joints_at(first.duration_ns), there),
        line_leg(machine, approach, end, near=there),
    ]


def _joints(machine: Machine, tip: Pose) -> Joints:
    flange = flange_of(machine.model, tip, machine.offset)
    return solve(machine.model, flange, tip.hand or machine.robot.hand, tip.posture)
