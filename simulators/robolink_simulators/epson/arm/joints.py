"""The joint values of a robot, and the ranges that hold them."""

from typing import Self

from robolink_simulators.epson.arm.robots import RobotModel
from robolink_simulators.epson.refusals import OutOfReach


class Joints(tuple[float, ...]):
    """Joint values in order, four or six of them: degrees, mm for joint 3 of a SCARA."""

    __slots__ = ()

    def __new__(cls, *values: float) -> Self:
        """Return the joints of these values."""
        return super().__new__(cls, values)

    @property
    def j3_mm(self) -> float:
        """The height of a SCARA's joint 3."""
        return self[2]

    def at_height(self, j3_mm: float) -> "Joints":
        """Return a SCARA's joints with its joint 3 elsewhere."""
        return Joints(*self[:2], j3_mm, *self[3:])


def check_ranges(model: RobotModel, joints: Joints) -> None:
    """Refuse joint values outside the model's ranges.

    Raises:
        OutOfReach: Names the joint, the value and the range.
    """
    for index, (low, high) in enumerate(model.ranges):
        if not low - 1e-9 <= joints[index] <= high + 1e-9:
            raise OutOfReach(
                f"Joint {index + 1} outside its range: {joints[index]:.3f}, "
                f"allowed {low:.3f} to {high:.3f}"
            )


def check_depth(model: RobotModel, joints: Joints) -> None:
    """Refuse to go where a model holds its joint 2 to less, the shaft being low.

    Raises:
        OutOfReach: Names the joint and the range there.
    """
    if model.narrow_below is None:
        return
    below_mm, most_deg = model.narrow_below
    if joints.j3_mm < below_mm - 1e-9 and abs(joints[1]) > most_deg + 1e-9:
        raise OutOfReach(
            f"Joint 2 outside its range below Z {below_mm:.0f}: {joints[1]:.3f}, "
            f"allowed {-most_deg:.3f} to {most_deg:.3f}"
        )


def within(low: float, high: float, angle_deg: float) -> float:
    """Return the angle, whole turns away, that lies next to the middle of a range."""
    middle = (low + high) / 2
    turned = (angle_deg - middle) % 360.0
    return middle + (turned - 360.0 if turned > 180.0 else turned)


def wrapped(angle_deg: float) -> float:
    """Return the angle brought into (-180, 180]."""
    turned = angle_deg % 360.0
    return turned - 360.0 if turned > 180.0 else turned


def nearest_turn(angle_deg: float, near_deg: float) -> float:
    """Return the angle, whole turns away, that is nearest to another."""
    return angle_deg + 360.0 * round((near_deg - angle_deg) / 360.0)
