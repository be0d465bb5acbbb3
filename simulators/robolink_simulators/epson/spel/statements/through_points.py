"""Arc and Arc3 in all their forms, and Pass: motions through points (docs/reference/spel.md 7.1).

Two points alone are the mid point and the end. A number behind one point is an angle; with two more
behind it, a radius, ARC_SHORT or ARC_LONG, ARC_PLUS or ARC_MINUS. ARC_SHORT or ARC_LONG behind two
points says that they are the end and the centre.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import accumulate, pairwise
from typing import Final

from robolink.model import Pose
from robolink_simulators.epson.arm.arc import (
    MeasuredWay,
    level_about,
    level_by_angle,
    level_by_radius,
    level_through,
    space_about,
    space_through,
)
from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.definitions.local_frames import frame_at
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.values import Number
from robolink_simulators.epson.spel.legs import go_leg, held_leg, seen_from, way_leg
from robolink_simulators.epson.spel.tree import (
    LabelledPoint,
    Literal,
    MotionStatement,
    Name,
    PointExpression,
    PointRange,
    SwitchOnTheWay,
    Target,
)

ARC_VERBS: Final = frozenset({"arc", "arc3"})

_LONG: Final = 1
_PLUS: Final = 1


def arc(evaluator: Evaluator, motion: MotionStatement) -> Leg:
    """Plan an arc; which form it has is told by what its targets are worth.

    Raises:
        Refusal: They are no form of it, make no arc, or it leaves the envelope.
    """
    machine = evaluator.session.machine
    given = [worth_of(evaluator, target) for target in motion.targets]
    points = [machine.pose_of(one) for one in given if isinstance(one, Point)]
    numbers = [one for one in given if not isinstance(one, Point)]
    in_order = all(isinstance(one, Point) for one in given[: len(points)])
    start, space = machine.tip(), motion.verb == "arc3"
    held = "ecp" in motion.options.words
    match (len(points), len(numbers), space):
        case (2, 0, _) if in_order:
            mid, end = points
            _require_the_hand(mid, end)
            if held:
                return held_leg(machine, end, space_through(*_seen(machine, start, mid, end)))
            through = space_through if space else _level(machine, level_through)
            return way_leg(machine, end, through(start, mid, end))
        case (2, 1, _) if in_order:
            end, centre = points
            long = numbers[0] == _LONG
            if held:
                way = space_about(*_seen(machine, start, end, centre), long=long)
                return held_leg(machine, end, way)
            about = partial(space_about if space else level_about, long=long)
            level = about if space else _level(machine, about)
            return way_leg(machine, end, level(start, end, centre))
        case (1, 1, False) if in_order:
            (end,) = points
            by_angle = _level(machine, lambda a, b: level_by_angle(a, b, float(numbers[0])))
            return way_leg(machine, end, by_angle(start, end))
        case (1, 3, False) if in_order:
            return _of_radius(evaluator, points[0], numbers)
    raise SpelRefusal(RefusalKind.SYNTAX, f"{motion.verb} does not take these")


def _level(machine: Machine, made: Callable[..., MeasuredWay]) -> Callable[..., MeasuredWay]:
    """Return what makes a level arc: level is the XY plane of the base (documented)."""
    base = machine.kept.base
    if not base.leans:
        return made

    def in_the_base(*tips: Pose) -> MeasuredWay:
        seen = (Pose(*base.seen(tip.coordinates()), tip.hand) for tip in tips)
        way, length_mm = made(*seen)
        frame = frame_at(base.coordinates)
        return lambda share: frame.point(way(share)), length_mm

    return in_the_base


def _seen(machine: Machine, *tips: Pose) -> tuple[Pose, Pose, Pose]:
    """Return where a held workpiece sees the external control point from three places.

    That how it is turned at the mid point or the centre counts for that is assumed.
    """
    first, second, third = (seen_from(machine, tip) for tip in tips)
    return first, second, third


def _of_radius(evaluator: Evaluator, end: Pose, numbers: Sequence[Number]) -> Leg:
    machine = evaluator.session.machine
    radius_mm, path, sense = numbers
    long, positive = path == _LONG, sense == _PLUS

    def made(start: Pose, there: Pose) -> MeasuredWay:
        return level_by_radius(start, there, float(radius_mm), long=long, positive=positive)

    return way_leg(machine, end, _level(machine, made)(machine.tip(), end))


def worth_of(evaluator: Evaluator, target: Target) -> Point | Number:
    """Return a point, or the number that a literal, a constant or a variable stands for.

    Raises:
        Refusal: It is neither.
    """
    match target:
        case Literal(int() | float() as number):
            return number
        case PointExpression(LabelledPoint(name), 0, None, ()):
            value = evaluator.value(Name(name))
            if isinstance(value, (int, float)):
                return value
    if not isinstance(target, PointExpression):
        raise SpelRefusal(RefusalKind.SYNTAX, "An arc takes points and numbers")
    return evaluator.point(target)


def _require_the_hand(mid: Pose, end: Pose) -> None:
    if None not in (mid.hand, end.hand) and mid.hand is not end.hand:
        raise SpelRefusal(RefusalKind.OUT_OF_REACH, "An arc cannot change the hand")


def passing(evaluator: Evaluator, motion: MotionStatement, points: Sequence[Point]) -> list[Leg]:
    """Plan a Pass; each point is stood at for an instant here (assumed simplification).

    An output switches when the arm is at the point that stands before it.

    Raises:
        Refusal: A point is out of reach.
    """
    machine = evaluator.session.machine
    joints = [machine.arm.joints, *(machine.joints_for(point) for point in points)]
    legs: list[Leg] = [go_leg(machine, a, b) for a, b in pairwise(joints)]
    ends_ns = [0, *accumulate(leg.duration_ns for leg in legs)]
    passed = 0
    for target in motion.targets:
        if isinstance(target, SwitchOnTheWay):
            bank = machine.memory if target.word.startswith("mem") else machine.outputs
            number, at_ns = evaluator.integer(target.number), machine.arm.now_ns + ends_ns[passed]
            bank.get(number)
            machine.timed_bits.plan(at_ns, bank, number, target.word.endswith("on"))
        elif isinstance(target, PointRange):
            first, last = evaluator.integer(target.first), evaluator.integer(target.last)
            passed += max(0, last - first + 1)
        else:
            passed += 1
    return legs
