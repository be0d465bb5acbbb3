"""Motions through points: Arc, Arc3, Pass, Curve and CVMove.

Arc and Arc3 in all their forms, and Pass: motions through points (docs/reference/spel.md 7.1).

Two points alone are the mid point and the end. A number behind one point is an angle; with two more
behind it, a radius, ARC_SHORT or ARC_LONG, ARC_PLUS or ARC_MINUS. ARC_SHORT or ARC_LONG behind two
points says that they are the end and the centre.

Curve and CVMove: a free curve is stored, and travelled (docs/reference/spel.md 7.1).

``Curve "name", O | C, mode, axes, points``: open or closed; mode 2 keeps the tool along the curve,
the upper four bits of a mode name an external control point. Both at once are not described and
refused.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import accumulate, pairwise
from typing import Final

from robolink.model import Pose
from robolink_simulators.cell.frames import Frame, axis_and_angle, product, transposed
from robolink_simulators.epson.arm.arc import (
    MeasuredWay,
    level_about,
    level_by_angle,
    level_by_radius,
    level_through,
    space_about,
    space_through,
)
from robolink_simulators.epson.arm.coordinate_systems import frame_at
from robolink_simulators.epson.arm.curves import (
    AXES_OF_CURVES,
    SIX_AXES,
    TANGENTIAL,
    CurveLeg,
    CurveSwitch,
    FreeCurve,
    Place,
    SmoothWay,
    plan_curve,
    plan_turned_curve,
    smooth_course_through,
    through,
    when,
)
from robolink_simulators.epson.arm.kinematics import frame_of
from robolink_simulators.epson.arm.tilted_legs import TiltedLeg, require_same_posture
from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.condition import OutOfReach, RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.setting_functions import outside_limits_mm
from robolink_simulators.epson.spel.expressions.values import Number, as_text, out_of_range
from robolink_simulators.epson.spel.legs import go_leg, held_leg, line_pace, seen_from, way_leg
from robolink_simulators.epson.spel.session import Session
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
    points = [machine.robot.pose_of(one) for one in given if isinstance(one, Point)]
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
    if not base.tilted:
        return made

    def in_the_base(*tips: Pose) -> MeasuredWay:
        in_base = (Pose(*base.to_base(tip.coordinates()), tip.hand) for tip in tips)
        way, length_mm = made(*in_base)
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
    joints = [machine.arm.joints, *(machine.robot.joints_for(point) for point in points)]
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


_KINDS: Final = {"o": False, "c": True}
_FEWEST: Final = 3
_MOST: Final = 1000
_MODES: Final = 256
_LOW_MODES: Final = 16
_SAME: Final = 0.01
"""Largest distance of the tip from the first point at which CVMove can start, in mm and degrees
(assumed).
"""


def store_curve(evaluator: Evaluator, motion: MotionStatement) -> None:
    """Carry Curve out.

    Raises:
        Refusal: It is none, for other axes, or has too few or too many points.
    """
    machine = evaluator.session.machine
    if len(motion.targets) < 4 or motion.options.words or motion.options.meanwhile:
        raise SpelRefusal(RefusalKind.SYNTAX, "Curve takes a file, O or C, a mode, axes and points")
    name, kind, mode, axes, *rest = motion.targets
    closed = _is_closed(kind)
    control_point, tangential = _mode(evaluator, mode)
    count = _axes(machine, _whole(worth_of(evaluator, axes)))
    points, switches = _listed(evaluator, rest)
    if not _FEWEST <= len(points) <= _MOST:
        raise out_of_range(f"A curve of {len(points)} points")
    places = [_place(machine, point) for point in points]
    if closed:
        places.append(places[0])
    curve = FreeCurve(count, tuple(places), switches, tangential, control_point)
    _smooth_way(machine, curve)
    machine.kept.curves.store(_name(evaluator, name), curve)


def _mode(evaluator: Evaluator, target: Target) -> tuple[int, bool]:
    """Return the external control point of a mode, 0 for none, and whether the tool follows."""
    machine = evaluator.session.machine
    chosen = _whole(worth_of(evaluator, target))
    if not 0 <= chosen < _MODES:
        raise out_of_range(f"A curve of mode {chosen}")
    control_point, low = divmod(chosen, _LOW_MODES)
    if low not in (0, TANGENTIAL):
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "A curve of another mode than 0 and 2")
    if low and control_point:
        # Not documented: does the tangent lie in the plane of the point or of the workpiece?
        text = "A tool that follows a curve past an external control point"
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, text)
    if control_point:
        machine.control_points.get(control_point)
    return control_point, bool(low)


def _whole(worth: Point | Number) -> int:
    if isinstance(worth, Point) or worth != int(worth):
        raise out_of_range("A curve takes whole numbers")
    return int(worth)


def _axes(machine: Machine, count: int) -> int:
    """Return how many axes a curve rules: 2, 3 and 4 are not for six axes (documented).

    Raises:
        Refusal: There is no such curve of this robot.
    """
    usual = (SIX_AXES,) if machine.model.six_axes else AXES_OF_CURVES
    if count not in usual:
        raise out_of_range(f"A curve of {count} axes")
    return count


def _control_point(machine: Machine, curve: FreeCurve) -> Frame | None:
    if not curve.control_point:
        return None
    return machine.robot.control_point(curve.control_point)


def _smooth_way(machine: Machine, curve: FreeCurve) -> SmoothWay:
    """Return the path of the tip, or of the control point over the workpiece."""
    closed, point = curve.places[0] == curve.places[-1], _control_point(machine, curve)
    if not machine.model.six_axes and point is None:
        way = through(curve.places, closed=closed)
        return way.along_itself() if curve.tangential else way
    tips = [_pose(place) for place in curve.places]
    way = smooth_course_through(machine.model, tips, point=point, closed=closed)
    return way.along_itself() if curve.tangential else way


def curve_leg(evaluator: Evaluator, motion: MotionStatement) -> Leg:
    """Plan CVMove, and switch outputs along it.

    Raises:
        Refusal: No such curve, the tip stands elsewhere than at its first point (what CVMove does
            then is not described), or the curve is out of reach.
    """
    session = evaluator.session
    machine = session.machine
    if len(motion.targets) != 1:
        raise SpelRefusal(RefusalKind.SYNTAX, "CVMove takes one file")
    stored = machine.kept.curves.get(_name(evaluator, motion.targets[0]))
    if (stored.axes == SIX_AXES) != machine.model.six_axes:
        raise SpelRefusal(RefusalKind.OTHER_ROBOT, "The curve is one of another robot")
    ruled = tuple(_ruled(place, machine.tip(), stored.axes) for place in stored.places)
    if _is_off(machine.tip(), ruled[0]):
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "CVMove from elsewhere than its first point")
    curve = stored._replace(places=ruled)
    way = _smooth_way(machine, curve)
    leg = _leg(machine, curve, way)
    _require_inside(session, leg, [when(leg, way.share_of(n)) for n in range(len(ruled))])
    switches = stored.switches
    banks = [machine.memory if one.word.startswith("mem") else machine.outputs for one in switches]
    for switch, bank in zip(switches, banks, strict=True):
        bank.get(switch.number)
    for switch, bank in zip(switches, banks, strict=True):
        at_ns = machine.arm.now_ns + when(leg, way.share_of(switch.point))
        machine.timed_bits.plan(at_ns, bank, switch.number, switch.word.endswith("on"))
    return leg


def _leg(machine: Machine, curve: FreeCurve, way: SmoothWay) -> CurveLeg | TiltedLeg:
    pace, tip, near = line_pace(machine), machine.tip(), machine.arm.joints
    point = _control_point(machine, curve)
    if not machine.model.six_axes and point is None:
        return plan_curve(machine.model, tip, way, pace, offset=machine.offset, near=near)
    return plan_turned_curve(
        machine.model,
        tip,
        way,
        pace,
        point=point,
        offset=machine.offset,
        near=near,
        avoiding=machine.settings.avoided,
    )


def _require_inside(session: Session, leg: Leg, instants_ns: list[int]) -> None:
    for instant_ns in instants_ns:
        if outside_limits_mm(session, leg.flange_at(instant_ns)):
            raise OutOfReach("A point of the curve lies outside the limits of XYLim")


def _ruled(place: Place, tip: Pose, axes: int) -> Place:
    return (*place[:axes], *tip.coordinates()[axes : len(place)])


def _pose(place: Place) -> Pose:
    x, y, z, u, *leaning = place
    v, w = leaning or (0.0, 0.0)
    return Pose(x, y, z, u, v, w)


def _is_off(tip: Pose, place: Place) -> bool:
    """Return whether the tip is elsewhere than at a place, or turned differently."""
    here = tip.coordinates()
    if len(place) < SIX_AXES:
        return math.dist(place, here[: len(place)]) > _SAME
    turn = product(frame_of(tip).rotation, transposed(frame_of(_pose(place)).rotation))
    return max(math.dist(place[:3], here[:3]), axis_and_angle(turn)[1]) > _SAME


def _is_closed(kind: Target) -> bool:
    match kind:
        case PointExpression(LabelledPoint(word), 0, None, ()) if word in _KINDS:
            return _KINDS[word]
    raise SpelRefusal(RefusalKind.SYNTAX, "A curve is open, O, or closed, C")


def _name(evaluator: Evaluator, target: Target) -> str:
    match target:
        case Literal(str() as name):
            return name
        case PointExpression(LabelledPoint(name), 0, None, ()):
            return as_text(evaluator.value(Name(name)))
    raise SpelRefusal(RefusalKind.SYNTAX, "The name of a curve is a text")


def _listed(
    evaluator: Evaluator, targets: list[Target]
) -> tuple[list[Point], tuple[CurveSwitch, ...]]:
    """Return the points and what switches at which of them."""
    table = evaluator.session.machine.points
    points, switches = list[Point](), list[CurveSwitch]()
    for target in targets:
        match target:
            case PointExpression():
                points.append(evaluator.point(target))
            case PointRange(first, last):
                ends = evaluator.integer(first), evaluator.integer(last)
                points += [table.get(number) for number in range(ends[0], ends[1] + 1)]
            case SwitchOnTheWay(word, number):
                at = max(0, len(points) - 1)
                switches.append(CurveSwitch(at, word, evaluator.integer(number)))
            case _:
                raise SpelRefusal(RefusalKind.SYNTAX, "A curve takes points")
    return points, tuple(switches)


def _place(machine: Machine, point: Point) -> Place:
    pose = machine.robot.pose_of(point)
    require_same_posture(machine.model, machine.arm.joints, pose)
    return pose.coordinates() if machine.model.six_axes else pose.coordinates()[:4]
