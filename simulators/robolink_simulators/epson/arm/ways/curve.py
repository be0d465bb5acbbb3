"""A smooth way of a SCARA's tip through many places (docs/reference/spel.md 7.1).

How the curve runs between its points is not described. Assumed: a cubic from point to point over
the length of the chords, whose direction at a point is that of the parabola through the point and
its neighbours; C. de Boor, A Practical Guide to Splines, "piecewise cubic Bessel interpolation".
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from itertools import accumulate, pairwise
from typing import Final

from robolink.model import Pose, ToolOffset
from robolink_simulators.epson.arm.arc import WayLeg, plan_level_way
from robolink_simulators.epson.arm.joints import Joints, check_depth, check_ranges, nearest_turn
from robolink_simulators.epson.arm.kinematics import flange_of
from robolink_simulators.epson.arm.robots import RobotModel
from robolink_simulators.epson.arm.trajectory import LinePace
from robolink_simulators.epson.definitions.curves import Place
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

_STEPS_A_SPAN: Final = 20
_SAME: Final = 1e-9


@dataclass(frozen=True, slots=True)
class SmoothWay:
    """A curve by the share of its length.

    Attributes:
        shares: The share of the length at each even step of each span.
        places: The place there; between two of them the way is straight.
    """

    shares: tuple[float, ...]
    places: tuple[Place, ...]
    length_mm: float

    def at(self, share: float) -> Place:
        """Return the place after a share of the length."""
        index = min(max(bisect_right(self.shares, share), 1), len(self.shares) - 1)
        low, high = self.shares[index - 1], self.shares[index]
        part = min(max((share - low) / (high - low), 0.0), 1.0)
        x, y, z, u = (
            a + (b - a) * part
            for a, b in zip(self.places[index - 1], self.places[index], strict=True)
        )
        return (x, y, z, u)

    def along_itself(self) -> "SmoothWay":
        """Return the same way with U turning as its direction in the plane does.

        U begins at that of the first place (documented). Where the way stands still in the plane
        its direction stays (assumed).
        """
        turned, last = [self.places[0]], None
        for a, b in pairwise(self.places):
            x, y, z, _ = b
            u = turned[-1][3]
            if math.hypot(x - a[0], y - a[1]) > _SAME:
                heading = math.degrees(math.atan2(y - a[1], x - a[0]))
                u += 0.0 if last is None else nearest_turn(heading - last, 0.0)
                last = heading
            turned.append((x, y, z, u))
        return replace(self, places=tuple(turned))

    def share_of(self, point: int) -> float:
        """Return the share of the length at one of the points, counted from 0."""
        return self.shares[point * _STEPS_A_SPAN]


def through(places: Sequence[Place], *, closed: bool) -> SmoothWay:
    """Return the curve through places.

    Raises:
        Refusal: Two neighbours are one place.
    """
    chords = [math.dist(a[:3], b[:3]) for a, b in pairwise(places)]
    if min(chords) < _SAME:
        raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "Two neighbours of a curve are one place")
    slopes = _slopes(places, chords, closed=closed)
    fine = [places[0]]
    for index, chord in enumerate(chords):
        for step in range(1, _STEPS_A_SPAN + 1):
            fine.append(_between(places, slopes, index, chord, step / _STEPS_A_SPAN))
    lengths = [0.0, *accumulate(math.dist(a[:3], b[:3]) for a, b in pairwise(fine))]
    shares = tuple(length / lengths[-1] for length in lengths)
    return SmoothWay(shares, tuple(fine), lengths[-1])


def _slopes(places: Sequence[Place], chords: Sequence[float], *, closed: bool) -> list[Place]:
    rises = [
        tuple((b - a) / chord for a, b in zip(p, q, strict=True))
        for (p, q), chord in zip(pairwise(places), chords, strict=True)
    ]
    last = len(places) - 1
    slopes = list[Place]()
    for index in range(len(places)):
        before, after = index - 1, index
        if index in (0, last):
            if not closed:
                # The end of a parabola through the last two points alone is their chord.
                before = after = min(index, last - 1)
            else:
                before, after = last - 1, 0
        weight = chords[after] / (chords[before] + chords[after])
        pairs = zip(rises[before], rises[after], strict=True)
        x, y, z, u = (a * weight + b * (1 - weight) for a, b in pairs)
        slopes.append((x, y, z, u))
    return slopes


def _between(
    places: Sequence[Place], slopes: Sequence[Place], index: int, chord: float, t: float
) -> Place:
    """Return the cubic of a span whose ends and slopes are given, after a part of its chord."""
    quads = zip(places[index], places[index + 1], slopes[index], slopes[index + 1], strict=True)
    x, y, z, u = (
        (1 + 2 * t) * (1 - t) ** 2 * a
        + t * t * (3 - 2 * t) * b
        + t * (1 - t) * chord * ((1 - t) * m - t * n)
        for a, b, m, n in quads
    )
    return (x, y, z, u)


@dataclass(frozen=True, slots=True)
class CurveLeg(WayLeg):
    """The tip on a curve that rules U as well."""

    turn: Callable[[float], float]

    def _flange_after(self, share: float) -> Pose:
        tip = Pose(*self.way(share), self.turn(share))
        return flange_of(self.model, self.end if share >= 1 else tip, self.offset)

    def when(self, share: float) -> int:
        """Return how many ns after the start a share of the way is behind."""
        low_ns, high_ns = 0, self.duration_ns
        while high_ns - low_ns > 1:
            middle_ns = (low_ns + high_ns) // 2
            if self._share_at(middle_ns) < share:
                low_ns = middle_ns
            else:
                high_ns = middle_ns
        return high_ns if share > 0 else 0


def plan_curve(
    model: RobotModel,
    start: Pose,
    curve: SmoothWay,
    pace: LinePace,
    *,
    offset: ToolOffset | None,
    near: Joints,
) -> CurveLeg:
    """Plan a curve of a SCARA's tip from where it stands.

    Raises:
        OutOfReach: The curve leaves the envelope.
    """
    x, y, z, u = curve.places[-1]
    end = replace(start, x_mm=x, y_mm=y, z_mm=z, u_deg=u)

    def way(share: float) -> tuple[float, float, float]:
        return curve.at(share)[:3]

    ends, measured = (start, end), (way, curve.length_mm)
    plain = plan_level_way(model, ends, measured, pace, offset=offset, near=near)
    own = {field.name: getattr(plain, field.name) for field in fields(plain)}
    leg = CurveLeg(**own, turn=lambda share: curve.at(share)[3])
    for share in curve.shares[1:]:
        joints = leg.joints_after(share)
        check_ranges(model, joints)
        check_depth(model, joints)
    return leg
