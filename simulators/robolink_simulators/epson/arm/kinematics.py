"""Forward and inverse kinematics of a SCARA, and where a tool's tip is.

Conventions: joint 1 at 0 has the arm along the robot's +X, counter-clockwise is positive
(documented, docs/reference/epson.md 4). With all joints at 0 the flange axes are parallel to the
robot axes and turn with joint 4 (documented, docs/reference/epson.md 3.1), hence ``U = J1 + J2 +
J4``; that U is printed and taken literally, not brought into -180..180, is assumed (a SCARA has no
flag that could tell 270 from -90). Z is joint 3's travel, 0 at the top, negative downwards
(documented). Righty is the solution whose joint 2 is not negative (assumed: the elbow lies to
the right of the line from base to flange, as a person's right elbow does).
"""

import math
from dataclasses import dataclass, replace

from robolink.model import Hand, Pose, ToolOffset, rotate_xy
from robolink_simulators.epson.arm.robots import ScaraModel
from robolink_simulators.epson.refusals import OutOfReach

_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Joints:
    """Joint values of a SCARA."""

    j1_deg: float
    j2_deg: float
    j3_mm: float
    j4_deg: float

    def values(self) -> tuple[float, float, float, float]:
        """Return the four in order: degrees, degrees, mm, degrees."""
        return (self.j1_deg, self.j2_deg, self.j3_mm, self.j4_deg)

    @property
    def hand(self) -> Hand:
        """The configuration; a stretched arm counts as right."""
        return Hand.RIGHT if self.j2_deg >= 0 else Hand.LEFT


def forward(model: ScaraModel, joints: Joints) -> Pose:
    """Return the pose of the flange (Tool 0) in the robot's base frame."""
    inner = math.radians(joints.j1_deg)
    outer = math.radians(joints.j1_deg + joints.j2_deg)
    return Pose(
        x_mm=model.a1_mm * math.cos(inner) + model.a2_mm * math.cos(outer),
        y_mm=model.a1_mm * math.sin(inner) + model.a2_mm * math.sin(outer),
        z_mm=joints.j3_mm,
        u_deg=joints.j1_deg + joints.j2_deg + joints.j4_deg,
        hand=joints.hand,
        tool=0,
    )


def solve(model: ScaraModel, flange: Pose, hand: Hand) -> Joints:
    """Return the joints that put the flange at ``flange``, whatever their ranges.

    Joint 1 is taken within half a turn of the middle of its range.

    Raises:
        OutOfReach: The position is too far out or too far in for the two links.
    """
    distance_sq = flange.x_mm * flange.x_mm + flange.y_mm * flange.y_mm
    cosine = (distance_sq - model.a1_mm**2 - model.a2_mm**2) / (2 * model.a1_mm * model.a2_mm)
    if not abs(cosine) <= 1 + _ROUNDING:
        raise OutOfReach(
            f"Point outside the arm's reach: {math.sqrt(distance_sq):.3f} mm from joint 1"
        )
    bend = math.acos(max(-1.0, min(1.0, cosine)))
    if hand is Hand.LEFT:
        bend = -bend
    across = model.a2_mm * math.sin(bend)
    along = model.a1_mm + model.a2_mm * math.cos(bend)
    j1_deg = math.degrees(math.atan2(flange.y_mm, flange.x_mm) - math.atan2(across, along))
    low, high = model.ranges[0]
    middle = (low + high) / 2
    j1_deg = middle + math.remainder(j1_deg - middle, 360.0)
    j2_deg = math.degrees(bend)
    return Joints(j1_deg, j2_deg, flange.z_mm, flange.u_deg - j1_deg - j2_deg)


def check_ranges(model: ScaraModel, joints: Joints) -> None:
    """Refuse joint values outside the model's ranges.

    Raises:
        OutOfReach: Names the joint, the value and the range.
    """
    pairs = zip(joints.values(), model.ranges, strict=True)
    for number, (value, travel) in enumerate(pairs, start=1):
        if not travel.holds(value):
            raise OutOfReach(
                f"Joint {number} outside its range: {value:.3f}, "
                f"allowed {travel.low:.3f} to {travel.high:.3f}"
            )


def inverse(model: ScaraModel, flange: Pose, hand: Hand) -> Joints:
    """Return the joints for a flange pose, inside their ranges.

    Raises:
        OutOfReach: The links or a joint's range do not allow it.
    """
    joints = solve(model, flange, hand)
    check_ranges(model, joints)
    return joints


def tip_of(flange: Pose, offset: ToolOffset | None, *, tool: int = 0) -> Pose:
    """Return the pose of a tool's tip: flange + Rz(U) (tx, ty), reported U = U + tu.

    Seen in a client that computes the flange back the same way (docs/reference/epson.md 3.1). V and
    W of the offset cannot be reached by a SCARA and are not part of its pose (assumed).
    """
    if offset is None:
        return replace(flange, tool=tool)
    dx_mm, dy_mm = rotate_xy(offset.x_mm, offset.y_mm, flange.u_deg)
    return _carried(
        flange,
        flange.x_mm + dx_mm,
        flange.y_mm + dy_mm,
        flange.z_mm + offset.z_mm,
        flange.u_deg + offset.u_deg,
        tool=tool,
    )


def flange_of(tip: Pose, offset: ToolOffset | None) -> Pose:
    """Return the flange pose that puts the tool's tip at ``tip``; undoes :func:`tip_of`."""
    if offset is None:
        return replace(tip, tool=0)
    u_deg = tip.u_deg - offset.u_deg
    dx_mm, dy_mm = rotate_xy(offset.x_mm, offset.y_mm, u_deg)
    return _carried(tip, tip.x_mm - dx_mm, tip.y_mm - dy_mm, tip.z_mm - offset.z_mm, u_deg, tool=0)


def _carried(pose: Pose, x_mm: float, y_mm: float, z_mm: float, u_deg: float, *, tool: int) -> Pose:
    """Return ``pose`` elsewhere; asked each millisecond of a search, where ``replace`` is slow."""
    return Pose(x_mm, y_mm, z_mm, u_deg, pose.v_deg, pose.w_deg, pose.hand, pose.local, tool)
