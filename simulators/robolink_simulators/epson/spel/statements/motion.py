"""Go, Move, Jump and their relatives; CP and SyncRobots.

CP: the statement behind a motion begins as soon as the motion slows down.

Source: docs/reference/spel.md 7.1. The way itself is not rounded: the next motion begins when
this one has ended (assumed simplification), what stands between them does not wait.

SyncRobots: robots whose motions were reserved with SYNC start at one instant.

Source: docs/reference/spel.md 7.1.

Jump and Jump3: up, across, down (docs/reference/spel.md 7.1).

Go, Move, Jump, Arc and their relatives (docs/reference/spel.md 7.1).
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from robolink.model import Pose, rotate_xy
from robolink_simulators.cell.frames import Frame, add, product
from robolink_simulators.epson.arm.arch import GATE, Arch, ArchedLeg, arched
from robolink_simulators.epson.arm.coordinate_systems import (
    Coordinates,
    coordinates_of_frame,
    frame_at,
)
from robolink_simulators.epson.arm.kinematics import flange_of, solve
from robolink_simulators.epson.arm.motion_parameters import MotionPhase
from robolink_simulators.epson.arm.robots import Joints
from robolink_simulators.epson.arm.trajectory import JointLeg, Leg
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.joint_functions import least_motion
from robolink_simulators.epson.spel.expressions.motion_functions import (
    LEAST_TURN_DEG,
    turn_deg,
)
from robolink_simulators.epson.spel.expressions.values import out_of_range
from robolink_simulators.epson.spel.legs import go_leg, held_leg, line_leg
from robolink_simulators.epson.spel.statements.areas import require_within_limits
from robolink_simulators.epson.spel.statements.curves import ARC_VERBS, arc, curve_leg, passing
from robolink_simulators.epson.spel.tree import (
    KeywordStatement,
    MotionStatement,
    Name,
    PointExpression,
    PointRange,
    SwitchOnTheWay,
)

_SAME_NS = 1000


def blends(machine: Machine, motion: MotionStatement) -> bool:
    """Return whether the next statement need not wait for the end of a motion."""
    if motion.options.until is not None:
        return False
    return "cp" in motion.options.words or machine.settings.continuous_path


def fall_ns(leg: Leg) -> int:
    """Return how long the deceleration at the end of a leg takes.

    Whoever brakes during the deceleration comes to rest when the leg ends; whoever brakes
    before comes to rest sooner.
    """
    low, high = 0, leg.duration_ns
    while high - low > _SAME_NS:
        middle = (low + high) // 2
        if leg.braked(middle).duration_ns + _SAME_NS < leg.duration_ns:
            low = middle
        else:
            high = middle
    return leg.duration_ns - high


def rest_of_way(machine: Machine, leg: Leg) -> Leg:
    """Return the path from where the arm is to where a leg was to end."""
    end = leg.joints_at(leg.duration_ns)
    if isinstance(leg, JointLeg | ArchedLeg):
        return go_leg(machine, machine.arm.joints, end)
    return line_leg(machine, machine.tip(), machine.robot.tip_at(end), near=machine.arm.joints)


def _sync(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Start the reserved motions of some robots, or of all that have one; wait for none (assumed).

    That All starts nothing where none is reserved is assumed; of a robot that is named the error is
    documented, its number is not.
    """
    machine, arguments = evaluator.session.machine, command.arguments
    if not arguments:
        raise SpelRefusal(RefusalKind.SYNTAX, "SyncRobots needs robots, or All")
    waiting = [n for n, robot in enumerate(machine.robots, start=1) if robot.reserved is not None]
    if arguments != (Name("all"),):
        asked = [evaluator.integer(argument) for argument in arguments]
        for number in asked:
            machine.numbered(number)
            if number not in waiting:
                text = f"No motion of robot {number} is reserved"
                raise SpelRefusal(RefusalKind.NOT_RESERVED, text)
        waiting = sorted(set(asked))
    now_ns, chosen = machine.arm.now_ns, machine.robot_number
    try:
        for machine.robot_number in waiting:
            motion, machine.robot.reservation = machine.robot.reserved, None
            if motion is not None:
                motion.start_reserved(now_ns)
    finally:
        machine.robot_number = chosen
    return ""


SYNC_STATEMENTS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "syncrobots": _sync
}
"""Statement handlers by keyword."""


DESCENT = 2
"""Index of the leg of a Jump that is the descent. Sense is checked just before it (documented)."""


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
    start, end = machine.arm.joints, machine.robot.joints_for(point)
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
    depart, approach, end = (machine.robot.pose_of(point) for point in points)
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


_SAME_MM = 0.001

# LJM leaves a SCARA's point unchanged (documented); TGo and BGo move six axes
# the least. An arch rounds Jump; Jump3 stops at its corners with any arch (assumed).
_UNTIL_WORDS: Final = frozenset({"till", "find"})
_JOINT_WORDS: Final = frozenset({"cp", "sync"}) | _UNTIL_WORDS
_LINE_WORDS: Final = frozenset({"rot"}) | _JOINT_WORDS
_ARCH_WORDS: Final = frozenset(f"c{n}" for n in range(GATE + 1))
_GATE_WORDS: Final = frozenset({"sense", "c"}) | _ARCH_WORDS | _JOINT_WORDS
_WORDS: Final = {
    "go": frozenset({"ljm"}) | _JOINT_WORDS,
    "tgo": _JOINT_WORDS,
    "bgo": _JOINT_WORDS,
    "pass": frozenset({"cp", "ljm"}),
    "cvmove": _JOINT_WORDS,
    "move": _LINE_WORDS | {"ecp"},
    "tmove": _LINE_WORDS,
    "bmove": _LINE_WORDS,
    "arc": _LINE_WORDS,
    "arc3": _LINE_WORDS | {"ecp"},
    "jump": frozenset({"limz"}) | _GATE_WORDS,
    "jump3": frozenset({"ljm"}) | _GATE_WORDS,
    "jump3cp": frozenset({"ljm", "rot"}) | _GATE_WORDS,
}
_WAYPOINTS: Final = {"jump3": 3, "jump3cp": 3}


def plan(evaluator: Evaluator, motion: MotionStatement) -> list[Leg]:
    """Return the legs of a motion; nothing moves yet.

    Targets are for the selected tool's tip.

    Raises:
        Refusal: Motors off, a free joint, a target out of reach, a wrong option ...
    """
    legs = _planned(evaluator, motion)
    # Only the last leg of a Jump ends at a target.
    targets = legs[-1:] if motion.verb == "jump" else legs
    require_within_limits(evaluator.session, legs, targets)
    return legs


def _planned(evaluator: Evaluator, motion: MotionStatement) -> list[Leg]:
    machine = evaluator.session.machine
    wrong = motion.options.words - _WORDS[motion.verb]
    if wrong:
        raise SpelRefusal(RefusalKind.SYNTAX, f"{motion.verb} knows no {', '.join(sorted(wrong))}")
    if len(motion.options.words & {*_UNTIL_WORDS, "sense"}) > 1:
        raise SpelRefusal(RefusalKind.SYNTAX, "A motion takes one of Till, Find and Sense")
    arch = _arch(evaluator, motion)
    if motion.verb in ARC_VERBS:
        require_drives(machine)
        return [arc(evaluator, motion)]
    if motion.verb == "cvmove":
        require_drives(machine)
        return [curve_leg(evaluator, motion)]
    points = _points(evaluator, motion)
    if motion.verb != "pass" and len(points) != _WAYPOINTS.get(motion.verb, 1):
        raise SpelRefusal(RefusalKind.SYNTAX, f"{motion.verb} does not take {len(points)} points")
    require_drives(machine)
    limz = motion.options.limz
    match motion.verb:
        case "jump":
            height_mm = None if limz is None else float(evaluator.number(limz))
            looks = "sense" in motion.options.words
            return jump(machine, points[0], height_mm, arch=arch, looks=looks)
        case "jump3" | "jump3cp":
            return jump3(machine, (points[0], points[1], points[2]))
        case "pass":
            return passing(evaluator, motion, points)
        case verb:
            target = _TARGETS[verb](machine, points[0])
            if "ecp" in motion.options.words:
                return [held_leg(machine, machine.robot.pose_of(target))]
            if verb.endswith("move"):
                return [_line(machine, target, rot="rot" in motion.options.words)]
            ljm_holds = "ljm" in motion.options.words or machine.robot.drives.is_on("autoljm")
            least = machine.model.six_axes and (verb != "go" or ljm_holds)
            if not least:
                return [go_leg(machine, machine.arm.joints, machine.robot.joints_for(target))]
            ljm = motion.options.ljm
            flag = 1 if ljm is None else evaluator.integer(ljm)
            return [go_leg(machine, machine.arm.joints, least_motion(machine, target, flag))]


def _arch(evaluator: Evaluator, motion: MotionStatement) -> Arch | None:
    """Return the arch that a motion names, ``None`` for a gate.

    Raises:
        Refusal: There is no such arch, or it names two.
    """
    numbers = [int(word[1]) for word in motion.options.words if word in _ARCH_WORDS]
    if motion.options.arch is not None:
        numbers.append(evaluator.integer(motion.options.arch))
    if len(numbers) > 1:
        raise SpelRefusal(RefusalKind.SYNTAX, "A motion takes one arch")
    return evaluator.session.machine.kept.arches.get(numbers[0] if numbers else GATE)


def _points(evaluator: Evaluator, motion: MotionStatement) -> list[Point]:
    """Return the points of a motion.

    Raises:
        Refusal: Something else stands among its targets, or cannot be evaluated.
    """
    points = list[Point]()
    for target in motion.targets:
        match target:
            case PointExpression():
                points.append(evaluator.point(target))
            case PointRange(first, last):
                table = evaluator.session.machine.points
                ends = evaluator.integer(first), evaluator.integer(last)
                points += [table.get(number) for number in range(ends[0], ends[1] + 1)]
            case SwitchOnTheWay():
                if motion.verb != "pass":
                    raise SpelRefusal(RefusalKind.SYNTAX, f"{motion.verb} switches nothing")
            case _:
                raise SpelRefusal(RefusalKind.SYNTAX, f"{motion.verb} needs a point")
    return points


def require_drives(machine: Machine) -> None:
    """Refuse a motion that the drives would not carry out.

    Raises:
        Refusal: The motors are off, a joint is free (documented for SFree, but not its number), or
            a motion of the robot waits for SyncRobots (assumed).
    """
    if machine.robot.reserved is not None:
        raise SpelRefusal(RefusalKind.ROBOT_IN_USE, "A motion of the robot is reserved")
    if not machine.motors_on:
        raise SpelRefusal(RefusalKind.MOTORS_OFF, "Motors are off")
    if machine.settings.free_joints:
        free = ", ".join(map(str, sorted(machine.settings.free_joints)))
        raise SpelRefusal(RefusalKind.JOINT_FREE, f"Joint {free} is free")


def _absolute(_: Machine, point: Point) -> Point:
    return point


def _in_tool(machine: Machine, point: Point) -> Point:
    """Shift along the axes of the selected tool; the hand stays (documented)."""
    tip = machine.robot.here()
    if machine.model.six_axes:
        there = frame_at(tip.coordinates) @ frame_at(point.coordinates)
        return replace(tip, coordinates=coordinates_of_frame(there))
    dx_mm, dy_mm = rotate_xy(*point.coordinates[:2], tip.coordinates[3])
    x, y, z, u, v, w = tip.coordinates
    _, _, dz_mm, du_deg, _, _ = point.coordinates
    moved: Coordinates = (x + dx_mm, y + dy_mm, z + dz_mm, u + du_deg, v, w)
    return replace(tip, coordinates=moved)


def _in_local(machine: Machine, point: Point) -> Point:
    """Shift along the axes of the local named in the point, 0 for the base (documented).

    That six axes turn about the axes of that local is assumed.
    """
    here = machine.locals.convert(machine.robot.here(), point.local)
    if not machine.model.six_axes:
        return here.plus(point)
    seen, by = frame_at(here.coordinates), frame_at(point.coordinates)
    moved = Frame(add(seen.shift_mm, by.shift_mm), product(by.rotation, seen.rotation))
    return replace(here, coordinates=coordinates_of_frame(moved))


_TARGETS: Final[dict[str, Callable[[Machine, Point], Point]]] = {
    "go": _absolute,
    "move": _absolute,
    "tgo": _in_tool,
    "tmove": _in_tool,
    "bgo": _in_local,
    "bmove": _in_local,
}


def _line(machine: Machine, target: Point, *, rot: bool) -> Leg:
    """Plan a straight motion.

    Raises:
        Refusal: Only the orientation changes and ROT is missing, or ROT stands and nothing
            turns over a distance (both documented, docs/reference/spel.md 7.1; their numbers are
            not).
    """
    end, tip = machine.robot.pose_of(target), machine.tip()
    travels = math.dist(end.coordinates()[:3], tip.coordinates()[:3]) > _SAME_MM
    turns = turn_deg(machine, tip, end) > LEAST_TURN_DEG
    if turns and not travels and not rot:
        raise out_of_range("The motion only turns the tool: ROT is needed")
    if rot and travels and not turns:
        raise out_of_range("ROT, but the tool does not turn")
    return line_leg(machine, tip, end, near=machine.arm.joints)
