"""Go, Move, Jump, Arc and their relatives (docs/reference/spel.md 7.1)."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from robolink.model import rotate_xy
from robolink_simulators.cell.frames import Frame, add, product
from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.definitions.arches import GATE, Arch
from robolink_simulators.epson.definitions.local_frames import (
    Coordinates,
    coordinates_of_frame,
    frame_at,
)
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.defined.orientations import (
    LEAST_TURN_DEG,
    turn_deg,
)
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.joint_functions import least_motion
from robolink_simulators.epson.spel.expressions.values import out_of_range
from robolink_simulators.epson.spel.legs import go_leg, held_leg, line_leg
from robolink_simulators.epson.spel.statements.defined.curves import curve_leg
from robolink_simulators.epson.spel.statements.defined.xy_limits import require_within_limits
from robolink_simulators.epson.spel.statements.jump import jump, jump3
from robolink_simulators.epson.spel.statements.through_points import ARC_VERBS, arc, passing
from robolink_simulators.epson.spel.tree import (
    MotionStatement,
    PointExpression,
    PointRange,
    SwitchOnTheWay,
)

_SAME_MM = 0.001

# LJM leaves a SCARA's point unchanged (documented); TGo and BGo move six axes
# the least. An arch rounds Jump; Jump3 comes to rest at its corners under each (assumed).
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
                return [held_leg(machine, machine.pose_of(target))]
            if verb.endswith("move"):
                return [_line(machine, target, rot="rot" in motion.options.words)]
            ljm_holds = "ljm" in motion.options.words or machine.robot.drives.is_on("autoljm")
            least = machine.model.six_axes and (verb != "go" or ljm_holds)
            if not least:
                return [go_leg(machine, machine.arm.joints, machine.joints_for(target))]
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
    """Hold a motion back that the drives would not carry out.

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
    tip = machine.here()
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
    here = machine.locals.convert(machine.here(), point.local)
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
    end, tip = machine.pose_of(target), machine.tip()
    travels = math.dist(end.coordinates()[:3], tip.coordinates()[:3]) > _SAME_MM
    turns = turn_deg(machine, tip, end) > LEAST_TURN_DEG
    if turns and not travels and not rot:
        raise out_of_range("The motion only turns the tool: ROT is needed")
    if rot and travels and not turns:
        raise out_of_range("ROT, but the tool does not turn")
    return line_leg(machine, tip, end, near=machine.arm.joints)
