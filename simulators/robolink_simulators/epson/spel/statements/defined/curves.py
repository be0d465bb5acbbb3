"""Curve and CVMove: a free curve is stored, and travelled (docs/reference/spel.md 7.1).

``Curve "name", O | C, mode, axes, points``: open or closed; mode 2 keeps the tool along the curve.
Modes with an external control point are refused.
"""

import math
from typing import Final

from robolink_simulators.epson.arm.ways.curve import CurveLeg, plan_curve, through
from robolink_simulators.epson.definitions.curves import (
    AXES_OF_CURVES,
    TANGENTIAL,
    CurveSwitch,
    FreeCurve,
    Place,
)
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.refusals import OutOfReach, RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.defined.xy_limits import outside_limits_mm
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.values import as_text, out_of_range
from robolink_simulators.epson.spel.statements.legs import line_pace
from robolink_simulators.epson.spel.statements.through_points import worth_of
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

_KINDS: Final = {"o": False, "c": True}
_FEWEST: Final = 3
_MOST: Final = 1000
_SAME: Final = 0.01
"""Assumed: how near the first point, in mm and degrees, the tip has to stand for CVMove."""


def store_curve(evaluator: Evaluator, motion: MotionStatement) -> None:
    """Carry Curve out.

    Raises:
        Refusal: It is none, for other axes, or has too few or too many points.
    """
    machine = evaluator.session.machine
    if machine.model.six_axes:
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "Curve on six axes")
    if len(motion.targets) < 4 or motion.options.words or motion.options.meanwhile:
        raise SpelRefusal(RefusalKind.SYNTAX, "Curve takes a file, O or C, a mode, axes and points")
    name, kind, mode, axes, *rest = motion.targets
    closed = _is_closed(kind)
    chosen = worth_of(evaluator, mode)
    if chosen not in (0, TANGENTIAL):
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "A curve of another mode than 0 and 2")
    count = worth_of(evaluator, axes)
    if count not in AXES_OF_CURVES:
        raise out_of_range(f"A curve of {count} axes")
    points, switches = _listed(evaluator, rest)
    if not _FEWEST <= len(points) <= _MOST:
        raise out_of_range(f"A curve of {len(points)} points")
    places = [_place(machine, point) for point in points]
    if closed:
        places.append(places[0])
    through(places, closed=closed)
    tangential = chosen == TANGENTIAL
    curve = FreeCurve(int(count), tuple(places), switches, tangential=tangential)
    machine.kept.curves.store(_name(evaluator, name), curve)


def curve_leg(evaluator: Evaluator, motion: MotionStatement) -> CurveLeg:
    """Plan CVMove, and switch outputs on its way.

    Raises:
        Refusal: No such curve, the tip stands elsewhere than at its first point (what CVMove does
            then is not described), or the curve is out of reach.
    """
    session = evaluator.session
    machine = session.machine
    if len(motion.targets) != 1:
        raise SpelRefusal(RefusalKind.SYNTAX, "CVMove takes one file")
    axes, stored, switches, tangential = machine.kept.curves.get(
        _name(evaluator, motion.targets[0])
    )
    x, y, z, u, *_ = machine.tip().coordinates()
    here: Place = (x, y, z, u)
    closed = stored[0] == stored[-1]
    places = [_ruled(place, here, axes) for place in stored]
    if math.dist(places[0], here) > _SAME:
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "CVMove from elsewhere than its first point")
    curve = through(places, closed=closed)
    if tangential:
        curve = curve.along_itself()
    pace = line_pace(machine)
    leg = plan_curve(
        machine.model, machine.tip(), curve, pace, offset=machine.offset, near=machine.arm.joints
    )
    for point in range(len(places)):
        if outside_limits_mm(session, leg.flange_at(leg.when(curve.share_of(point)))):
            raise OutOfReach("A point of the curve lies outside the limits of XYLim")
    banks = [machine.memory if one.word.startswith("mem") else machine.outputs for one in switches]
    for switch, bank in zip(switches, banks, strict=True):
        bank.get(switch.number)
    for switch, bank in zip(switches, banks, strict=True):
        at_ns = machine.arm.now_ns + leg.when(curve.share_of(switch.point))
        machine.timed_bits.plan(at_ns, bank, switch.number, switch.word.endswith("on"))
    return leg


def _ruled(place: Place, here: Place, axes: int) -> Place:
    x, y, z, u = (*place[:axes], *here[axes:])
    return (x, y, z, u)


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
    pose = machine.pose_of(point)
    if pose.hand not in (None, machine.arm.hand):
        raise SpelRefusal(RefusalKind.OUT_OF_REACH, "A curve cannot change the hand")
    return (pose.x_mm, pose.y_mm, pose.z_mm, pose.u_deg)
