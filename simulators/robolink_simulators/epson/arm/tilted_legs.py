"""Legs of a tool that can be tilted, and those of any robot about an external control point.

The tip goes its way while the tool turns evenly about one axis from the first orientation to the
last (assumed). Hand, elbow and wrist stay, every joint turns on from where it was, and the turns
that the flags of the target name are not looked at (assumed).

Near a singularity the joints would have to be faster than they can. A controller that avoids it
leaves the way and comes back (documented, docs/reference/epson-robots.md, "Singularities"): here
from joint to joint, between where the way enters the neighbourhood and where it leaves it (how it
goes is assumed). One that does not avoid it stops with the error for joint speed, here before
anything moves (assumed).
"""

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Protocol

from robolink.model import Pose, ToolOffset
from robolink_simulators.cell.frames import (
    Frame,
    Matrix,
    Vector,
    about,
    axis_and_angle,
    product,
    transposed,
)
from robolink_simulators.epson.arm.arc import MeasuredWay, Way, plan_level_way
from robolink_simulators.epson.arm.kinematics import (
    continued_frame,
    forward,
    frame_of,
    hand_of,
    pose_of_frame,
    posture_of,
    tool_frame,
)
from robolink_simulators.epson.arm.robot_settings import SingularSurroundings
from robolink_simulators.epson.arm.robots import Joints, RobotModel
from robolink_simulators.epson.arm.six_axes import singular_stretches
from robolink_simulators.epson.arm.trajectory import (
    Leg,
    LinePace,
    Ramp,
    RampedLeg,
    plan_move,
)
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

_STILL = 1e-9
_USUAL = SingularSurroundings()
_CHECK_EVERY_MM = 2.0
_CHECK_EVERY_DEG = 2.0
_MOST_CHECKS = 2000


class TiltedCourse(Protocol):
    """Where the flange goes, by the share of its path.

    Attributes:
        model: The robot.
        first: Where its tip begins.
        angle_deg: How far the tool turns altogether.
    """

    @property
    def model(self) -> RobotModel: ...  # noqa: D102
    @property
    def first(self) -> Pose: ...  # noqa: D102
    @property
    def angle_deg(self) -> float: ...  # noqa: D102

    def flange(self, share: float) -> Frame:
        """Return the frame of the flange after a share of the path."""
        ...


@dataclass(frozen=True, slots=True)
class _Course:
    """The tip's path and the turn of the tool along it, for the flange that carries it."""

    model: RobotModel
    way: Way
    first: Pose
    start: Matrix
    axis: Vector
    angle_deg: float
    to_flange: Frame

    def flange(self, share: float) -> Frame:
        """Return the frame of the flange after a share of the path."""
        turn = about(self.axis, self.angle_deg * share)
        return Frame(self.way(share), product(turn, self.start)) @ self.to_flange


@dataclass(frozen=True, slots=True)
class _HeldCourse:
    """The path of an external control point, as a held workpiece sees it.

    The tip goes otherwise then. That the orientation of the point runs evenly is assumed.
    """

    model: RobotModel
    point: Frame
    first: Pose
    way: Way
    start: Matrix
    axis: Vector
    angle_deg: float
    to_flange: Frame

    def flange(self, share: float) -> Frame:
        """Return the frame of the flange after a share of the path."""
        turn = about(self.axis, self.angle_deg * share)
        seen = Frame(self.way(share), product(turn, self.start))
        return self.point @ seen.inverse() @ self.to_flange


@dataclass(frozen=True, slots=True)
class TiltedLeg(RampedLeg):
    """A leg along a course.

    Attributes:
        course: Where the flange goes.
        knots: The joints at even shares of it, both ends included.
        detours: Numbers of the knots between which it goes from joint to joint instead.
    """

    course: TiltedCourse
    knots: tuple[Joints, ...]
    detours: tuple[tuple[int, int], ...] = ()

    def joints_at(self, elapsed_ns: int) -> Joints:
        """Return the joints that long after the start."""
        share = self._share_at(elapsed_ns)
        if share >= 1:
            return self.knots[-1]
        at = share * (len(self.knots) - 1)
        near = self.knots[int(at)]
        if self._off_course(at):
            following = zip(near, self.knots[int(at) + 1], strict=True)
            return Joints(*(a + (b - a) * (at - int(at)) for a, b in following))
        return continued_frame(self.course.model, self.course.flange(share), near)

    def flange_at(self, elapsed_ns: int) -> Pose:
        """Return the pose of the flange that long after the start."""
        course, share = self.course, self._share_at(elapsed_ns)
        if not course.model.six_axes or self._off_course(share * (len(self.knots) - 1)):
            return forward(course.model, self.joints_at(elapsed_ns))
        return pose_of_frame(course.flange(share), course.first, tool=0)

    def _off_course(self, at: float) -> bool:
        return any(first <= at < last for first, last in self.detours)


def plan_line(
    model: RobotModel,
    ends: tuple[Pose, Pose],
    pace: LinePace,
    *,
    offset: ToolOffset | None,
    near: Joints,
    avoiding: SingularSurroundings | None = _USUAL,
) -> Leg:
    """Plan a straight leg of the tip between two tip poses, of whichever robot.

    Args:
        model: The robot.
        ends: Where the tip is and where it goes.
        pace: How fast it may be.
        offset: The selected tool.
        near: The joints at the start.
        avoiding: The surroundings of singular places that are left; ``None`` for staying.

    Raises:
        Refusal: The line leaves the envelope, hand, elbow or wrist would have to change, or a
            joint would be too fast.
    """
    if not model.six_axes:
        return plan_move(model, ends, pace, offset=offset, near=near)
    start, end = (pose.coordinates()[:3] for pose in ends)
    way, length_mm = _straight(start, end)
    require_same_posture(model, near, ends[1])
    course = _course(model, way, ends, offset)
    return plan_course(course, length_mm, pace, near=near, avoiding=avoiding)


def plan_about_point(
    model: RobotModel,
    ends: tuple[Pose, Pose],
    pace: LinePace,
    *,
    point: Frame,
    way: MeasuredWay | None = None,
    offset: ToolOffset | None,
    near: Joints,
    avoiding: SingularSurroundings | None = _USUAL,
) -> Leg:
    """Plan a leg in which an external control point runs over the held workpiece.

    Args:
        model: The robot.
        ends: Where the tip is and where it goes.
        pace: How fast the point may be on the workpiece.
        point: The external control point, in the base.
        way: Its way as the tip sees it, and the length; ``None`` for a straight one.
        offset: The selected tool.
        near: The joints at the start.
        avoiding: The surroundings of singular places that are left; ``None`` for staying.

    Raises:
        Refusal: As :func:`plan_line`.
    """
    require_same_posture(model, near, ends[1])
    start, end = (frame_of(pose).inverse() @ point for pose in ends)
    course, length_mm = way or _straight(start.shift_mm, end.shift_mm)
    # The workpiece turns, so the point turns the opposite way.
    axis, angle_deg = _turn(model, ends[::-1], product(end.rotation, transposed(start.rotation)))
    to_flange = carried_by(model, offset).inverse()
    held = _HeldCourse(model, point, ends[0], course, start.rotation, axis, angle_deg, to_flange)
    return plan_course(held, length_mm, pace, near=near, avoiding=avoiding)


def _straight(start: Vector, end: Vector) -> MeasuredWay:
    def way(share: float) -> Vector:
        x, y, z = (a + (b - a) * share for a, b in zip(start, end, strict=True))
        return (x, y, z)

    return way, math.dist(start, end)


def _turn(model: RobotModel, ends: tuple[Pose, ...], turn: Matrix) -> tuple[Vector, float]:
    """Return the axis and angle of a turn; U of a SCARA is taken literally, whole turns too."""
    if model.six_axes:
        return axis_and_angle(turn)
    by_deg = ends[1].u_deg - ends[0].u_deg
    return (0.0, 0.0, math.copysign(1.0, by_deg)), abs(by_deg)


def carried_by(model: RobotModel, offset: ToolOffset | None) -> Frame:
    """Return the frame of a tool on the flange; a SCARA ignores V and W."""
    if offset is None or model.six_axes:
        return tool_frame(offset)
    return tool_frame(replace(offset, v_deg=0.0, w_deg=0.0))


def plan_way(
    model: RobotModel,
    ends: tuple[Pose, Pose],
    way: MeasuredWay,
    pace: LinePace,
    *,
    offset: ToolOffset | None,
    near: Joints,
    avoiding: SingularSurroundings | None = _USUAL,
) -> Leg:
    """Plan a path of the tip from where it is to its target.

    The orientation runs evenly, that of places between the ends does not count (documented,
    docs/reference/spel.md 7.1). ``way`` is the way and its length in mm; the other arguments are
    those of :func:`plan_line`.

    Raises:
        Refusal: As :func:`plan_line`.
    """
    if not model.six_axes:
        return plan_level_way(model, ends, way, pace, offset=offset, near=near)
    require_same_posture(model, near, ends[1])
    course, length_mm = way
    return plan_course(
        _course(model, course, ends, offset), length_mm, pace, near=near, avoiding=avoiding
    )


def require_same_posture(model: RobotModel, near: Joints, end: Pose) -> None:
    """Refuse a place on the path for which hand, elbow or wrist would have to change.

    Raises:
        Refusal: It has others than the arm.
    """
    now, wanted = posture_of(model, near), end.posture
    changed = end.hand is not None and end.hand is not hand_of(model, near)
    if now is not None and wanted is not None:
        changed |= (now.elbow, now.wrist) != (wanted.elbow, wanted.wrist)
    if changed:
        raise SpelRefusal(
            RefusalKind.OUT_OF_REACH, "A straight motion cannot change hand, elbow or wrist"
        )


def _course(
    model: RobotModel, way: Way, ends: tuple[Pose, Pose], offset: ToolOffset | None
) -> _Course:
    start, end = (frame_of(pose).rotation for pose in ends)
    axis, angle_deg = axis_and_angle(product(end, transposed(start)))
    return _Course(model, way, ends[0], start, axis, angle_deg, tool_frame(offset).inverse())


def plan_course(
    course: TiltedCourse,
    length_mm: float,
    pace: LinePace,
    *,
    near: Joints,
    avoiding: SingularSurroundings | None,
) -> TiltedLeg:
    """Plan a leg along a course of a length; the other arguments are those of :func:`plan_line`.

    The whole way is looked at before anything moves, as for a SCARA (assumed).

    Raises:
        Refusal: It leaves the envelope, or a joint would be too fast.
    """
    model, angle_deg = course.model, course.angle_deg
    steps = math.ceil(min(length_mm / _CHECK_EVERY_MM + angle_deg / _CHECK_EVERY_DEG, _MOST_CHECKS))
    knots = [near]
    for step in range(1, steps + 1):
        knots.append(continued_frame(model, course.flange(step / steps), knots[-1]))
    if length_mm > _STILL:
        rate, accel = pace.speed_mm_s / length_mm, pace.accel_mm_s2 / length_mm
        decel = pace.decel_mm_s2 / length_mm
    elif angle_deg > _STILL:
        rate, accel = pace.turn_deg_s / angle_deg, pace.turn_deg_s2 / angle_deg
        decel = accel
    else:
        return TiltedLeg(None, course, (near,))
    detours = (
        singular_stretches(model, knots, rate, avoiding) if avoiding and model.six_axes else ()
    )
    for first, last in detours:
        knots[first : last + 1] = _from_joint_to_joint(knots[first], knots[last], last - first)
    fastest = _fastest(model, knots)
    if rate > fastest and model.six_axes and not avoiding:
        raise SpelRefusal(
            RefusalKind.JOINT_TOO_FAST, "A joint would be too fast near a singularity"
        )
    ramp = Ramp.fastest(min(rate, fastest), accel, decel)
    return TiltedLeg(ramp, course, tuple(knots), detours)


def _from_joint_to_joint(first: Joints, last: Joints, steps: int) -> list[Joints]:
    shares = (step / steps for step in range(steps + 1))
    return [
        Joints(*(a + (b - a) * share for a, b in zip(first, last, strict=True))) for share in shares
    ]


def _fastest(model: RobotModel, knots: list[Joints]) -> float:
    """Return how much of the path a second may cover, for the most limiting joint."""
    steps = len(knots) - 1
    hardest = max(
        abs(b - a) / top
        for before, after in pairwise(knots)
        for a, b, top in zip(before, after, model.top_speed, strict=True)
    )
    return 1 / max(hardest * steps, _STILL)
