"""A smooth way on which more than U turns: of six axes, or past an external control point.

Places have the position, in mm, and the orientation of the tip: U in degrees on four axes, U, V and
W on six. With an external control point the position is that of the point as the workpiece sees it.
Each number runs by cubics of its own (documented; docs/reference/spel.md 7.1), from point to point
by the nearest turn (assumed).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

from robolink.model import Pose, ToolOffset
from robolink_simulators.cell.frames import (
    Z_AXIS,
    Frame,
    Matrix,
    about,
    axis_and_angle,
    product,
    subtract,
    transposed,
    turned,
    zyx,
)
from robolink_simulators.epson.arm.joints import Joints, nearest_turn
from robolink_simulators.epson.arm.kinematics import frame_of
from robolink_simulators.epson.arm.robot_settings import SingularSurroundings
from robolink_simulators.epson.arm.robots import RobotModel
from robolink_simulators.epson.arm.tilted_legs import TiltedLeg, carried_by, plan_course
from robolink_simulators.epson.arm.trajectory import LinePace
from robolink_simulators.epson.arm.ways.curve import SmoothWay, through
from robolink_simulators.epson.definitions.curves import Place


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
    return (*shift, tip.u_deg, tip.v_deg, tip.w_deg)


def _turned_on(before: Place, place: Place) -> Place:
    """Return a place whose angles are those nearest to another's."""
    angles = (nearest_turn(new, old) for old, new in zip(before[3:], place[3:], strict=True))
    return (*place[:3], *angles)


def _rotation(orientation: Sequence[float]) -> Matrix:
    if len(orientation) == 1:
        return about(Z_AXIS, orientation[0])
    return zyx(*orientation)
