"""A smooth way on which more than U turns: of six axes, or past an external control point.

Places have the position, in mm, and the orientation of the tip: U in degrees on four axes, a unit
quaternion on six. With an external control point the position is that of the point as the workpiece
sees it. How position and orientation run between the points is assumed: each number by the cubics
of :func:`curve.through`, the quaternion brought back to length 1
(docs/reference/spel.md 7.1).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from typing import Final

from robolink.model import Pose, ToolOffset
from robolink_simulators.cell.frames import (
    Z_AXIS,
    Frame,
    Matrix,
    about,
    axis_and_angle,
    product,
    scale,
    subtract,
    transposed,
    turned,
)
from robolink_simulators.epson.arm.joints import Joints
from robolink_simulators.epson.arm.kinematics import frame_of
from robolink_simulators.epson.arm.robot_settings import SingularSurroundings
from robolink_simulators.epson.arm.robots import RobotModel
from robolink_simulators.epson.arm.tilted_legs import TiltedLeg, carried_by, plan_course
from robolink_simulators.epson.arm.trajectory import LinePace
from robolink_simulators.epson.arm.ways.curve import SmoothWay, same_sign, through
from robolink_simulators.epson.definitions.curves import Place

_STILL: Final = 1e-12


@dataclass(frozen=True, slots=True)
class SmoothCourse:
    """The flange on a smooth way of the tip, or of a control point over the workpiece.

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
        """Return the frame of the flange after a share of the way."""
        x, y, z, *orientation = self.curve.at(share)
        rotation, shift = _rotation(orientation), (x, y, z)
        if self.point is not None:
            shift = subtract(self.point.shift_mm, turned(rotation, shift))
        return Frame(shift, rotation) @ self.to_flange


def smooth_course_through(
    model: RobotModel, tips: Sequence[Pose], *, point: Frame | None, closed: bool
) -> SmoothWay:
    """Return the way through places of the tip; ``point`` as in :class:`SmoothCourse`.

    Raises:
        Refusal: Two neighbours are one place, of the tip or of the point over the workpiece.
    """
    places = [_place(model, tip, point) for tip in tips]
    return through(list(accumulate(places, lambda a, b: same_sign(b, a))), closed=closed)


def following(way: SmoothWay) -> SmoothWay:
    """Return a way of six axes on which the tool turns about the base's Z with the way's direction.

    Tangential correction keeps the tool along the curve in the XY plane (documented). The
    quaternions of ``way`` are those of the points with the U of the first.
    """
    places = list[Place]()
    for at, turn_deg in zip(way.places, way.turns_deg(), strict=True):
        half_rad = math.radians(turn_deg) / 2
        cos, sin = math.cos(half_rad), math.sin(half_rad)
        real, x, y, z = at[3:]
        turned_about_z = (
            cos * real - sin * z,
            cos * x - sin * y,
            cos * y + sin * x,
            cos * z + sin * real,
        )
        places.append((*at[:3], *turned_about_z))
    return replace(way, places=tuple(places))


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
    """Plan the way from where the tip stands; the other arguments are those of ``plan_line``.

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
    axis, angle_deg = axis_and_angle(frame.rotation)
    half_rad = math.radians(angle_deg) / 2
    return (*shift, math.cos(half_rad), *scale(axis, math.sin(half_rad)))


def _rotation(orientation: Sequence[float]) -> Matrix:
    if len(orientation) == 1:
        return about(Z_AXIS, orientation[0])
    real, x, y, z = orientation
    across = math.hypot(x, y, z)
    if across < _STILL:
        return about(Z_AXIS, 0.0)
    axis = (x / across, y / across, z / across)
    return about(axis, math.degrees(2 * math.atan2(across, real)))
