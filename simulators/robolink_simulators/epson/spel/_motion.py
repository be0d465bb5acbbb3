"""Go, Move, Jump and their relatives (spel.md 7.1)."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from robolink.model import Pose, rotate_xy
from robolink_simulators.epson.kinematics import Joints
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.parameters import LIMZ_MARGIN_MM, Phase
from robolink_simulators.epson.points import Coordinates, Point
from robolink_simulators.epson.refusals import Refusal, RefusalKind
from robolink_simulators.epson.spel._evaluate import Evaluator
from robolink_simulators.epson.spel._tree import Motion
from robolink_simulators.epson.spel._values import out_of_range
from robolink_simulators.epson.trajectory import JointLeg, Leg, plan_go

_SAME_MM = 0.001
_SAME_DEG = 0.001

# CP blends into the next motion; here every motion ends at rest (assumed simplification).
# LJM leaves a SCARA's point unchanged (documented). C0 to C7 all rise to LimZ, as C7 does.
_UNTIL_WORDS: Final = frozenset({"till", "find"})
_LINE_WORDS: Final = frozenset({"cp", "rot"}) | _UNTIL_WORDS
_WORDS: Final = {
    "go": frozenset({"cp", "ljm"}) | _UNTIL_WORDS,
    "tgo": frozenset({"cp"}) | _UNTIL_WORDS,
    "bgo": frozenset({"cp"}) | _UNTIL_WORDS,
    "move": _LINE_WORDS,
    "tmove": _LINE_WORDS,
    "bmove": _LINE_WORDS,
    "jump": frozenset({"cp", "limz", *(f"c{arch}" for arch in range(8))}) | _UNTIL_WORDS,
}


def plan(evaluator: Evaluator, motion: Motion) -> list[Leg]:
    """Return the legs of a motion; nothing moves yet.

    Targets are for the selected tool's tip.

    Raises:
        Refusal: Motors off, a target out of reach, a wrong option ...
    """
    machine = evaluator.session.machine
    wrong = motion.options.words - _WORDS[motion.verb]
    if wrong:
        raise Refusal(RefusalKind.SYNTAX, f"{motion.verb} knows no {', '.join(sorted(wrong))}")
    if motion.options.words >= _UNTIL_WORDS:
        raise Refusal(RefusalKind.SYNTAX, "A motion takes one of Till and Find")
    point = evaluator.point(motion.target)
    if not machine.motors_on:
        raise Refusal(RefusalKind.MOTORS_OFF, "Motors are off")
    limz = motion.options.limz
    if motion.verb == "jump":
        return _jump(machine, point, None if limz is None else float(evaluator.number(limz)))
    target = _TARGETS[motion.verb](machine, point)
    if motion.verb.endswith("move"):
        return [_line(machine, target, rot="rot" in motion.options.words)]
    return [_go(machine, machine.arm.joints, machine.joints_for(target))]


def _absolute(_: Machine, point: Point) -> Point:
    return point


def _in_tool(machine: Machine, point: Point) -> Point:
    """Shift along the axes of the selected tool; the hand stays (documented)."""
    tip = Point.at(machine.tip())
    dx_mm, dy_mm = rotate_xy(*point.coordinates[:2], tip.coordinates[3])
    x, y, z, u, v, w = tip.coordinates
    _, _, dz_mm, du_deg, _, _ = point.coordinates
    moved: Coordinates = (x + dx_mm, y + dy_mm, z + dz_mm, u + du_deg, v, w)
    return replace(tip, coordinates=moved)


def _in_local(machine: Machine, point: Point) -> Point:
    """Shift along the axes of the local named in the point, 0 for the base (documented)."""
    return machine.locals.convert(Point.at(machine.tip()), point.local).plus(point)


_TARGETS: Final[dict[str, Callable[[Machine, Point], Point]]] = {
    "go": _absolute,
    "move": _absolute,
    "tgo": _in_tool,
    "tmove": _in_tool,
    "bgo": _in_local,
    "bmove": _in_local,
}


def _go(machine: Machine, start: Joints, end: Joints, *, phase: Phase = Phase.TRAVEL) -> JointLeg:
    pace = machine.parameters.joint_pace(power_high=machine.power_high, phase=phase)
    offset = machine.offset
    radius_mm = 0.0 if offset is None else math.hypot(offset.x_mm, offset.y_mm)
    return plan_go(machine.model, start, end, pace, radius_mm=radius_mm)


def _line(machine: Machine, target: Point, *, rot: bool) -> Leg:
    """Plan a straight motion.

    Raises:
        Refusal: Only the orientation changes and ROT is missing, or ROT stands and nothing
            turns over a distance (both documented, spel.md 7.1; their numbers are not).
    """
    base = machine.locals.to_base(target)
    x, y, z, u, _, _ = base.coordinates
    tip = machine.tip()
    end = Pose(x, y, z, u, hand=base.hand)
    travels = math.dist(end.coordinates()[:3], tip.coordinates()[:3]) > _SAME_MM
    turns = abs(u - tip.u_deg) > _SAME_DEG
    if turns and not travels and not rot:
        raise out_of_range("The motion only turns the tool: ROT is needed")
    if rot and travels and not turns:
        raise out_of_range("ROT, but the tool does not turn")
    pace = machine.parameters.line_pace(power_high=machine.power_high)
    return machine.arm.plan_move(end, pace, offset=machine.offset)


def _jump(machine: Machine, point: Point, limz_mm: float | None) -> list[Leg]:
    """Plan a gate motion: up to LimZ, across, down (documented as C7, the default).

    LimZ is compared with joint 3, not with the tip (assumed: its default of 0 would else be
    out of reach under every tool that hangs down). The modifier's height counts in the
    target's local (documented).

    Raises:
        Refusal: Start or target lie above LimZ; the start's number is documented (4005).
    """
    height_mm = machine.parameters.limz_mm
    if limz_mm is not None:
        height_mm = limz_mm + machine.locals.get(point.local).z_mm
    start, end = machine.arm.joints, machine.joints_for(point)
    for joints, what in ((start, "The motion starts"), (end, "The target lies")):
        if joints.j3_mm > height_mm + LIMZ_MARGIN_MM:
            raise Refusal(RefusalKind.ABOVE_LIMZ, f"{what} above LimZ")
    up = replace(start, j3_mm=max(start.j3_mm, height_mm))
    across = replace(end, j3_mm=max(end.j3_mm, height_mm))
    return [
        _go(machine, start, up, phase=Phase.DEPART),
        _go(machine, up, across),
        _go(machine, across, end, phase=Phase.APPROACH),
    ]
