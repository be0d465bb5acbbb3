"""Circular motions of the tip: ``Arc mid, end``, and the circle of ``Arc3``.

Source: docs/reference/spel.md 7.1.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from robolink.model import Hand, Pose, Posture, ToolOffset
from robolink.timing import NS_PER_S
from robolink_simulators.cell.frames import Vector, add, cross, dot, scale, subtract
from robolink_simulators.epson.arm.joints import Joints, check_ranges
from robolink_simulators.epson.arm.kinematics import flange_of, hand_of, posture_of, solve
from robolink_simulators.epson.arm.ramps import BrakedRamp, Ramp, TimeLaw
from robolink_simulators.epson.arm.robots import RobotModel
from robolink_simulators.epson.arm.trajectory import LinePace
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

_STRAIGHT = 1e-6
_CHECKS = 90


@dataclass(frozen=True, slots=True)
class ArcLeg:
    """The tip on a circle in X and Y; Z and U run evenly, the mid point's do not count."""

    model: RobotModel
    start: Pose
    end: Pose
    centre: complex
    sweep_rad: float
    offset: ToolOffset | None
    hand: Hand
    posture: Posture | None
    ramp: TimeLaw

    @property
    def duration_ns(self) -> int:
        """How long it takes."""
        return math.ceil(self.ramp.duration_s * NS_PER_S)

    def joints_at(self, elapsed_ns: int) -> Joints:
        """Return the joints that long after the start."""
        return self.joints_after(self._share_at(elapsed_ns))

    def flange_at(self, elapsed_ns: int) -> Pose:
        """Return the pose of the flange that long after the start."""
        return self._flange_after(self._share_at(elapsed_ns))

    def braked(self, elapsed_ns: int) -> "ArcLeg":
        """Return the same leg, left to come to rest."""
        if not isinstance(self.ramp, Ramp):
            return self
        return replace(self, ramp=BrakedRamp(self.ramp, elapsed_ns / NS_PER_S))

    def joints_after(self, share: float) -> Joints:
        """Return the joints after a share of the arc."""
        return solve(self.model, self._flange_after(share), self.hand, self.posture)

    def _share_at(self, elapsed_ns: int) -> float:
        return self.ramp.share_at(min(elapsed_ns, self.duration_ns) / NS_PER_S)

    def _flange_after(self, share: float) -> Pose:
        a, b = self.start, self.end
        spoke = complex(a.x_mm, a.y_mm) - self.centre
        at = self.centre + spoke * cmath.exp(1j * self.sweep_rad * share)
        z_mm = a.z_mm + (b.z_mm - a.z_mm) * share
        tip = Pose(at.real, at.imag, z_mm, a.u_deg + (b.u_deg - a.u_deg) * share)
        return flange_of(self.model, b if share >= 1 else tip, self.offset)


def plan_arc(
    model: RobotModel,
    points: tuple[Pose, Pose, Pose],
    pace: LinePace,
    *,
    offset: ToolOffset | None,
    near: Joints,
) -> ArcLeg:
    """Plan an arc of a SCARA's tip from the first pose through the second to the third.

    Raises:
        Refusal: The three stand in a line, or the hand would have to change (documented,
            docs/reference/spel.md 7.1; the numbers are not).
        OutOfReach: The arc leaves the envelope.
    """
    start, mid, end = points
    hand = hand_of(model, near)
    if any(pose.hand not in (None, hand) for pose in (mid, end)):
        raise SpelRefusal(RefusalKind.OUT_OF_REACH, "An arc cannot change the hand")
    a, b, c = (complex(pose.x_mm, pose.y_mm) for pose in points)
    centre, sweep_rad = circle_through(a, b, c)
    length_mm = math.hypot(abs(sweep_rad) * abs(a - centre), end.z_mm - start.z_mm)
    rate = pace.speed_mm_s / length_mm
    ramp = Ramp.fastest(rate, pace.accel_mm_s2 / length_mm, pace.decel_mm_s2 / length_mm)
    posture = posture_of(model, near)
    leg = ArcLeg(model, start, end, centre, sweep_rad, offset, hand, posture, ramp)
    for step in range(1, _CHECKS + 1):
        check_ranges(model, leg.joints_after(step / _CHECKS))
    return leg


def circle_in_space(a: Vector, b: Vector, c: Vector) -> tuple[Callable[[float], Vector], float]:
    """Return the circle from ``a`` through ``b`` to ``c``: where it is by its share; its length.

    Raises:
        Refusal: The three stand in a line.
    """
    to_mid, to_end = subtract(b, a), subtract(c, a)
    normal = cross(to_mid, to_end)
    if math.hypot(*normal) < _STRAIGHT:
        raise _in_a_line()
    ahead = scale(to_mid, 1 / math.hypot(*to_mid))
    aside = cross(scale(normal, 1 / math.hypot(*normal)), ahead)
    mid, end = (complex(dot(to, ahead), dot(to, aside)) for to in (to_mid, to_end))
    centre, sweep_rad = circle_through(0j, mid, end)

    def way(share: float) -> Vector:
        at = centre - centre * cmath.exp(1j * sweep_rad * share)
        return add(a, add(scale(ahead, at.real), scale(aside, at.imag)))

    return way, abs(sweep_rad) * abs(centre)


def _in_a_line() -> SpelRefusal:
    return SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "The points of the arc stand in a line")


def circle_through(a: complex, b: complex, c: complex) -> tuple[complex, float]:
    """Return the centre of the circle and the angle in radians from ``a`` through ``b`` to ``c``.

    Raises:
        Refusal: The three stand in a line.
    """
    bent = ((b - a) * (c - a).conjugate()).imag
    if abs(bent) < _STRAIGHT:
        raise _in_a_line()
    centre = _centre(a, b, c)
    sweep_rad = cmath.phase((c - centre) / (a - centre))
    through = cmath.phase((b - centre) / (a - centre))
    if sweep_rad * through <= 0 or abs(through) > abs(sweep_rad):
        sweep_rad -= math.copysign(2 * math.pi, sweep_rad)
    return centre, sweep_rad


def _centre(a: complex, b: complex, c: complex) -> complex:
    """Return the centre of the circle through three points."""
    w = (c - a) / (b - a)
    return a + (b - a) * (w - abs(w) ** 2) / (2j * w.imag)
