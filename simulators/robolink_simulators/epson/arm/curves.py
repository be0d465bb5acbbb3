"""Free curves that Curve stores and CVMove travels (docs/reference/spel.md 7.1).

A smooth way through many places, and a SCARA's tip on it (docs/reference/spel.md 7.1).

How the curve runs between its points is not described. Assumed: a cubic from point to point over
the length of the chords, whose direction at a point is that of the parabola through the point and
its neighbours; C. de Boor, A Practical Guide to Splines, "piecewise cubic Bessel interpolation".

A smooth way on which more than U turns: of six axes, or past an external control point.

Places have the position, in mm, and the orientation of the tip: U in degrees on four axes, U, V and
W on six. With an external control point the position is that of the point as the workpiece sees it.
Each number runs by cubics of its own (documented; docs/reference/spel.md 7.1), from point to point
by the nearest turn (assumed).
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import accumulate, pairwise
from typing import Final, NamedTuple

from robolink.model import Pose, ToolOffset
from robolink.timing import NS_PER_S
from robolink_simulators.cell.frames import (
    Z_AXIS,
    Frame,
    Matrix,
    Vector,
    about,
    axis_and_angle,
    product,
    subtract,
    transposed,
    turned,
    zyx,
)
from robolink_simulators.epson.arm.arc import WayLeg, plan_level_way
from robolink_simulators.epson.arm.kinematics import flange_of, frame_of
from robolink_simulators.epson.arm.robot_settings import SingularSurroundings
from robolink_simulators.epson.arm.robots import (
    Joints,
    RobotModel,
    check_depth,
    check_ranges,
    nearest_turn,
)
from robolink_simulators.epson.arm.tilted_legs import TiltedLeg, carried_by, plan_course
from robolink_simulators.epson.arm.trajectory import LinePace, RampedLeg
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

Place = tuple[float, ...]
"""X, Y, Z in mm and U in degrees, with six axes also V and W, in the robot's coordinates."""

AXES_OF_CURVES: Final = (2, 3, 4)
"""Allowed numbers of coordinates, out of X, Y, Z, U, that a curve of four axes controls; the others
stay as they are (assumed).
"""

SIX_AXES: Final = 6
"""Number of coordinates that a curve of a six-axis robot controls."""

TANGENTIAL: Final = 2
"""Mode of a curve in which U follows the direction of the curve in the plane (documented)."""


class CurveSwitch(NamedTuple):
    """A bit that switches as the tip passes a point; ``word`` is On, Off, MemOn or MemOff."""

    point: int
    word: str
    number: int


class FreeCurve(NamedTuple):
    """What one Curve stored; ``places`` of a closed one end where they begin.

    ``tangential``: U follows the direction of the way instead of the points. ``control_point``: the
    number of the external control point that the workpiece is led past, 0 for none.
    """

    axes: int
    places: tuple[Place, ...]
    switches: tuple[CurveSwitch, ...] = ()
    tangential: bool = False
    control_point: int = 0


class CurveFiles:
    """The curve files of one robot, by name in any case."""

    def __init__(self) -> None:
        self._files: dict[str, FreeCurve] = {}

    def store(self, name: str, curve: FreeCurve) -> None:
        """Store a curve; one of the same name is replaced."""
        self._files[name.lower()] = curve

    def get(self, name: str) -> FreeCurve:
        """Return a curve.

        Raises:
            Refusal: There is no such file.
        """
        curve = self._files.get(name.lower())
        if curve is None:
            raise SpelRefusal(RefusalKind.NO_SUCH_FILE, f"There is no curve {name}")
        return curve

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        return dict(self._files)

    def restore(self, state: object) -> None:
        """Restore what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        if not isinstance(state, Mapping):
            raise TypeError("not the curves of a robot")
        self._files = {str(name): _restored(*parts) for name, parts in state.items()}


def _restored(
    axes: int,
    places: list[list[float]],
    switches: list[list[object]],
    tangential: object = False,  # older files have none
    control_point: int = 0,
) -> FreeCurve:
    read = tuple(tuple(map(float, place)) for place in places)
    if len({len(place) for place in read} - {4, 6}) or len({len(place) for place in read}) > 1:
        raise ValueError("places of a curve have four numbers, or six")
    bits = tuple(CurveSwitch(int(str(at)), str(word), int(str(n))) for at, word, n in switches)
    number = int(control_point)
    return FreeCurve(int(axes), read, bits, tangential=bool(tangential), control_point=number)


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
        ends = zip(self.places[index - 1], self.places[index], strict=True)
        return tuple(a + (b - a) * part for a, b in ends)

    def along_itself(self) -> "SmoothWay":
        """Return the same path with U turning as its direction in the plane does.

        U begins at that of the first place (documented). Where the way stands still in the plane
        its direction stays (assumed).
        """
        first_deg = self.places[0][3]
        pairs = zip(self.places, self.turns_deg(), strict=True)
        return replace(
            self, places=tuple((*at[:3], first_deg + turn, *at[4:]) for at, turn in pairs)
        )

    def turns_deg(self) -> list[float]:
        """Return how far the direction in the plane has turned at each place, whole turns too."""
        turns, last = [0.0], None
        for a, b in pairwise(self.places):
            turn, along, across = turns[-1], b[0] - a[0], b[1] - a[1]
            if math.hypot(along, across) > _SAME:
                heading = math.degrees(math.atan2(across, along))
                turn += 0.0 if last is None else nearest_turn(heading - last, 0.0)
                last = heading
            turns.append(turn)
        return turns

    def share_of(self, point: int) -> float:
        """Return the share of the length at one of the points, counted from 0."""
        return self.shares[point * _STEPS_A_SPAN]


def through(places: Sequence[Place], *, closed: bool) -> SmoothWay:
    """Return the curve through places, of three coordinates in mm and whatever turns with them.

    Raises:
        Refusal: Two neighbours are one place.
    """
    chords = [math.dist(a[:3], b[:3]) for a, b in pairwise(places)]
    if min(chords) < _SAME:
        raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "Two neighbours of a curve are one place")
    slopes = _slopes(places, closed=closed)
    fine = [places[0]]
    for index, chord in enumerate(chords):
        for step in range(1, _STEPS_A_SPAN + 1):
            fine.append(_between(places, slopes, index, chord, step / _STEPS_A_SPAN))
    lengths = [0.0, *accumulate(math.dist(a[:3], b[:3]) for a, b in pairwise(fine))]
    shares = tuple(length / lengths[-1] for length in lengths)
    return SmoothWay(shares, tuple(fine), lengths[-1])


def _on_by(place: Place, around: Sequence[float], rounds: int) -> Place:
    """Return a place of a closed curve as it is met a round later, or before."""
    return tuple(value + rounds * on for value, on in zip(place, around, strict=True))


def _slopes(places: Sequence[Place], *, closed: bool) -> list[Place]:
    line = list(places)
    around = [last - first for first, last in zip(places[0], places[-1], strict=True)]
    if closed:
        line = [_on_by(places[-2], around, -1), *places, _on_by(places[1], around, 1)]
    chords = [math.dist(a[:3], b[:3]) for a, b in pairwise(line)]
    rises = [
        tuple((b - a) / chord for a, b in zip(p, q, strict=True))
        for (p, q), chord in zip(pairwise(line), chords, strict=True)
    ]
    slopes = list[Place]()
    for (first, second), (before_mm, after_mm) in zip(
        pairwise(rises), pairwise(chords), strict=True
    ):
        weight = after_mm / (before_mm + after_mm)
        pairs = zip(first, second, strict=True)
        slopes.append(tuple(a * weight + b * (1 - weight) for a, b in pairs))
    # A parabola through only the last two points ends along their chord.
    return slopes if closed else [rises[0], *slopes, rises[-1]]


def _between(
    places: Sequence[Place], slopes: Sequence[Place], index: int, chord: float, t: float
) -> Place:
    """Return the cubic of a span whose ends and slopes are given, after a part of its chord."""
    quads = zip(places[index], places[index + 1], slopes[index], slopes[index + 1], strict=True)
    return tuple(
        (1 + 2 * t) * (1 - t) ** 2 * a
        + t * t * (3 - 2 * t) * b
        + t * (1 - t) * chord * ((1 - t) * m - t * n)
        for a, b, m, n in quads
    )


@dataclass(frozen=True, slots=True)
class CurveLeg(WayLeg):
    """The tip on a curve that rules U as well."""

    turn: Callable[[float], float]

    def _flange_after(self, share: float) -> Pose:
        tip = Pose(*self.way(share), self.turn(share))
        return flange_of(self.model, self.end if share >= 1 else tip, self.offset)


def when(leg: RampedLeg, share: float) -> int:
    """Return how many ns after the start of a leg a share of its path is covered."""
    low_ns, high_ns = 0, leg.duration_ns
    while leg.ramp is not None and high_ns - low_ns > 1:
        middle_ns = (low_ns + high_ns) // 2
        if leg.ramp.share_at(middle_ns / NS_PER_S) < share:
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
    """Plan a curve of a SCARA's tip from where it is.

    Raises:
        OutOfReach: The curve leaves the envelope.
    """
    x, y, z, u = curve.places[-1]
    end = replace(start, x_mm=x, y_mm=y, z_mm=z, u_deg=u)

    def way(share: float) -> Vector:
        x, y, z, *_ = curve.at(share)
        return (x, y, z)

    ends, measured = (start, end), (way, curve.length_mm)
    plain = plan_level_way(model, ends, measured, pace, offset=offset, near=near)
    own = {field.name: getattr(plain, field.name) for field in fields(plain)}
    leg = CurveLeg(**own, turn=lambda share: curve.at(share)[3])
    for share in curve.shares[1:]:
        joints = leg.joints_after(share)
        check_ranges(model, joints)
        check_depth(model, joints)
    return leg


@dataclass(frozen=True, slots=True)
class SmoothCourse:
    """The flange on a smooth path of the tip, or of a control point over the workpiece.

    Attributes:
        model: The robot.
        curve: The way.
        point: The external control point in the base, ``None`` for a way of the tip.
        first: Where the tip begins.
        to_flange: The flange as the tip sees it.
        angle_deg: How far the tool turns altogether.
    """

    model: RobotModel
    curve: SmoothWay
    point: Frame | None
    first: Pose
    to_flange: Frame
    angle_deg: float

    def flange(self, share: float) -> Frame:
        """Return the frame of the flange after a share of the path."""
        x, y, z, *orientation = self.curve.at(share)
        rotation, shift = _rotation(orientation), (x, y, z)
        if self.point is not None:
            shift = subtract(self.point.shift_mm, turned(rotation, shift))
        return Frame(shift, rotation) @ self.to_flange


def smooth_course_through(
    model: RobotModel, tips: Sequence[Pose], *, point: Frame | None, closed: bool
) -> SmoothWay:
    """Return the path through places of the tip; ``point`` as in :class:`SmoothCourse`.

    Raises:
        Refusal: Two neighbours are one place, of the tip or of the point over the workpiece.
    """
    places = [_place(model, tip, point) for tip in tips]
    if model.six_axes:
        places = list(accumulate(places, _turned_on))
    return through(places, closed=closed)


def plan_turned_curve(
    model: RobotModel,
    start: Pose,
    curve: SmoothWay,
    pace: LinePace,
    *,
    point: Frame | None,
    offset: ToolOffset | None,
    near: Joints,
    avoiding: SingularSurroundings | None,
) -> TiltedLeg:
    """Plan the path from where the tip is; the other arguments are those of ``plan_line``.

    Raises:
        Refusal: It leaves the envelope, or a joint would be too fast.
    """
    looks = len(curve.places) - 1
    shares = (look / looks for look in range(looks + 1))
    turns = [_rotation(curve.at(share)[3:]) for share in shares]
    angle_deg = sum(axis_and_angle(product(b, transposed(a)))[1] for a, b in pairwise(turns))
    to_flange = carried_by(model, offset).inverse()
    course = SmoothCourse(model, curve, point, start, to_flange, angle_deg)
    return plan_course(course, curve.length_mm, pace, near=near, avoiding=avoiding)


def _place(model: RobotModel, tip: Pose, point: Frame | None) -> Place:
    frame = frame_of(tip)
    shift = frame.shift_mm if point is None else (frame.inverse() @ point).shift_mm
    if not model.six_axes:
        return (*shift, tip.u_deg)
    return (*shift, tip.u_deg, tip.v_deg, tip.w_deg)


def _turned_on(before: Place, place: Place) -> Place:
    """Return a place whose angles are those nearest to another's."""
    angles = (nearest_turn(new, old) for old, new in zip(before[3:], place[3:], strict=True))
    return (*place[:3], *angles)


def _rotation(orientation: Sequence[float]) -> Matrix:
    if len(orientation) == 1:
        return about(Z_AXIS, orientation[0])
    return zyx(*orientation)
