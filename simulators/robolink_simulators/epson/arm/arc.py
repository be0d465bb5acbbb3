"""A motion of a SCARA's tip on a path that is not straight: Arc, Arc3, CVMove.

Which sense of an angle is positive, the reference's readable pages do not say: counter-clockwise
seen from above here (assumed).

Source: docs/reference/spel.md 7.1.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass

from robolink.model import Hand, Pose, Posture, ToolOffset
from robolink_simulators.cell.frames import Vector, add, cross, dot, scale, subtract
from robolink_simulators.epson.arm.kinematics import flange_of, hand_of, posture_of, solve
from robolink_simulators.epson.arm.robots import Joints, RobotModel, check_ranges
from robolink_simulators.epson.arm.trajectory import LinePace, Ramp, RampedLeg
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

_CHECKS = 90
_STRAIGHT = 1e-6
_ON_THE_CIRCLE_MM = 0.01
"""Largest difference in mm between the distances of the two ends from the centre (assumed)."""

Way = Callable[[float], Vector]
"""Returns the position of the tip after a share of the path."""

MeasuredWay = tuple[Way, float]
"""A path and its length in mm."""


@dataclass(frozen=True, slots=True)
class WayLeg(RampedLeg):
    """The tip on a path of its own; U runs evenly along it."""

    model: RobotModel
    start: Pose
    end: Pose
    way: Way
    offset: ToolOffset | None
    hand: Hand
    posture: Posture | None

    def joints_at(self, elapsed_ns: int) -> Joints:
        """Return the joints that long after the start."""
        return self.joints_after(self._share_at(elapsed_ns))

    def flange_at(self, elapsed_ns: int) -> Pose:
        """Return the pose of the flange that long after the start."""
        return self._flange_after(self._share_at(elapsed_ns))

    def joints_after(self, share: float) -> Joints:
        """Return the joints after a share of the path."""
        return solve(self.model, self._flange_after(share), self.hand, self.posture)

    def _flange_after(self, share: float) -> Pose:
        a, b = self.start, self.end
        tip = Pose(*self.way(share), a.u_deg + (b.u_deg - a.u_deg) * share)
        return flange_of(self.model, b if share >= 1 else tip, self.offset)


def plan_level_way(
    model: RobotModel,
    ends: tuple[Pose, Pose],
    way: MeasuredWay,
    pace: LinePace,
    *,
    offset: ToolOffset | None,
    near: Joints,
) -> WayLeg:
    """Plan a path of a SCARA's tip.

    Args:
        model: The robot.
        ends: Where the tip is, and where it comes to.
        way: The way and its length in mm.
        pace: How fast it may be.
        offset: The selected tool.
        near: The joints at the start.

    Raises:
        Refusal: The hand would have to change (documented, docs/reference/spel.md 7.1; the number
            is not).
        OutOfReach: The way leaves the envelope.
    """
    start, end = ends
    hand = hand_of(model, near)
    if end.hand not in (None, hand):
        raise SpelRefusal(RefusalKind.OUT_OF_REACH, "An arc cannot change the hand")
    course, length_mm = way
    rate = pace.speed_mm_s / length_mm
    ramp = Ramp.fastest(rate, pace.accel_mm_s2 / length_mm, pace.decel_mm_s2 / length_mm)
    posture = posture_of(model, near)
    leg = WayLeg(ramp, model, start, end, course, offset, hand, posture)
    for step in range(1, _CHECKS + 1):
        check_ranges(model, leg.joints_after(step / _CHECKS))
    return leg


def level_through(start: Pose, mid: Pose, end: Pose) -> MeasuredWay:
    """Return the arc through a place; Z runs evenly, the mid point's does not count.

    Raises:
        Refusal: The three stand in a line.
    """
    a, b, c = (complex(pose.x_mm, pose.y_mm) for pose in (start, mid, end))
    return _level(start, end, *_circle_through(a, b, c))


def level_by_angle(start: Pose, end: Pose, angle_deg: float) -> MeasuredWay:
    """Return the arc that turns by an angle along its path.

    Raises:
        Refusal: The angle is 0, or 360 degrees and more (both documented), or the ends coincide.
    """
    if not 0 < abs(angle_deg) < 360:
        raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"An arc of {angle_deg:g} degrees")
    a, c = complex(start.x_mm, start.y_mm), complex(end.x_mm, end.y_mm)
    if abs(c - a) < _STRAIGHT:
        raise _straight()
    sweep_rad = math.radians(angle_deg)
    turn = cmath.exp(1j * sweep_rad)
    return _level(start, end, (c - turn * a) / (1 - turn), sweep_rad)


def level_by_radius(
    start: Pose, end: Pose, radius_mm: float, *, long: bool, positive: bool
) -> MeasuredWay:
    """Return the arc of a radius, the shorter or the longer one, in one sense or the other.

    Raises:
        Refusal: The radius is smaller than half of the chord (documented).
    """
    chord_mm = math.hypot(end.x_mm - start.x_mm, end.y_mm - start.y_mm)
    if chord_mm < _STRAIGHT or 2 * radius_mm < chord_mm:
        raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"No arc has the radius {radius_mm:g}")
    short_deg = math.degrees(2 * math.asin(min(1.0, chord_mm / (2 * radius_mm))))
    angle_deg = 360 - short_deg if long else short_deg
    return level_by_angle(start, end, angle_deg if positive else -angle_deg)


def level_about(start: Pose, end: Pose, centre: Pose, *, long: bool) -> MeasuredWay:
    """Return the arc about a centre, the shorter or the longer one.

    Raises:
        Refusal: The ends are not equally far from it, or opposite each other.
    """
    middle = complex(centre.x_mm, centre.y_mm)
    from_start = complex(start.x_mm, start.y_mm) - middle
    to_end = complex(end.x_mm, end.y_mm) - middle
    _require_a_circle(abs(from_start), abs(to_end))
    sweep_rad = cmath.phase(to_end / from_start)
    if abs(sweep_rad) < _STRAIGHT or math.pi - abs(sweep_rad) < _STRAIGHT:
        raise _straight()
    if long:
        sweep_rad -= math.copysign(2 * math.pi, sweep_rad)
    return _level(start, end, middle, sweep_rad)


def space_through(start: Pose, mid: Pose, end: Pose) -> MeasuredWay:
    """Return the arc in space through a place.

    Raises:
        Refusal: The three stand in a line.
    """
    a, b, c = (pose.coordinates()[:3] for pose in (start, mid, end))
    across = cross(subtract(b, a), subtract(c, a))
    axis = _unit(across)
    first = _unit(subtract(b, a))
    second = cross(axis, first)

    def in_plane(place: Vector) -> complex:
        beside = subtract(place, a)
        return complex(dot(beside, first), dot(beside, second))

    centre, sweep_rad = _circle_through(in_plane(a), in_plane(b), in_plane(c))
    middle = add(a, add(scale(first, centre.real), scale(second, centre.imag)))
    return _in_space(subtract(a, middle), middle, axis, sweep_rad)


def space_about(start: Pose, end: Pose, centre: Pose, *, long: bool) -> MeasuredWay:
    """Return the arc in space about a centre, the shorter or the longer one.

    Raises:
        Refusal: The ends are not equally far from it, or opposite each other.
    """
    a, c, middle = (pose.coordinates()[:3] for pose in (start, end, centre))
    spoke, other = subtract(a, middle), subtract(c, middle)
    _require_a_circle(math.hypot(*spoke), math.hypot(*other))
    across = cross(spoke, other)
    axis = _unit(across)
    sweep_rad = math.atan2(math.hypot(*across), dot(spoke, other))
    return _in_space(spoke, middle, axis, sweep_rad - 2 * math.pi if long else sweep_rad)


def _level(start: Pose, end: Pose, centre: complex, sweep_rad: float) -> MeasuredWay:
    spoke = complex(start.x_mm, start.y_mm) - centre
    rise_mm = end.z_mm - start.z_mm

    def way(share: float) -> Vector:
        at = centre + spoke * cmath.exp(1j * sweep_rad * share)
        return at.real, at.imag, start.z_mm + rise_mm * share

    return way, math.hypot(abs(sweep_rad) * abs(spoke), rise_mm)


def _in_space(spoke: Vector, middle: Vector, axis: Vector, sweep_rad: float) -> MeasuredWay:
    beside = cross(axis, spoke)

    def way(share: float) -> Vector:
        turned = sweep_rad * share
        along = scale(spoke, math.cos(turned))
        return add(middle, add(along, scale(beside, math.sin(turned))))

    return way, abs(sweep_rad) * math.hypot(*spoke)


def _require_a_circle(first_mm: float, last_mm: float) -> None:
    if first_mm < _STRAIGHT or abs(first_mm - last_mm) > _ON_THE_CIRCLE_MM:
        raise SpelRefusal(
            RefusalKind.VALUE_OUT_OF_RANGE,
            "The ends of an arc are equally far from its centre",
        )


def _unit(vector: Vector) -> Vector:
    length = math.hypot(*vector)
    if length < _STRAIGHT:
        raise _straight()
    return scale(vector, 1 / length)


def _circle_through(a: complex, b: complex, c: complex) -> tuple[complex, float]:
    """Return the centre of the circle and the angle in radians from ``a`` through ``b`` to ``c``.

    Raises:
        Refusal: The three stand in a line.
    """
    bent = ((b - a) * (c - a).conjugate()).imag
    if abs(bent) < _STRAIGHT:
        raise _straight()
    w = (c - a) / (b - a)
    centre = a + (b - a) * (w - abs(w) ** 2) / (2j * w.imag)
    sweep_rad = cmath.phase((c - centre) / (a - centre))
    through = cmath.phase((b - centre) / (a - centre))
    if sweep_rad * through <= 0 or abs(through) > abs(sweep_rad):
        sweep_rad -= math.copysign(2 * math.pi, sweep_rad)
    return centre, sweep_rad


def _straight() -> SpelRefusal:
    return SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "The points of the arc stand in a line")
