"""Poses in a robot's base frame.

Lengths are millimetres, angles degrees. Orientation follows EPSON: U turns about Z, V about
Y, W about X, and ``R = Rz(U) Ry(V) Rx(W)`` (docs/reference/epson.md 3.1;
docs/reference/calibration.md 1.4).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

_NUMBERS: Final = frozenset({float, int})


def require_numbers(value: object, *names: str) -> None:
    """Refuse a frozen value that holds no numbers; those of other libraries become Python's own.

    Args:
        value: The value that is being made.
        names: Its fields.

    Raises:
        ConfigError: One holds no number.
    """
    for name in names:
        if type(getattr(value, name)) not in _NUMBERS:  # rare; loads nothing before
            from robolink.model._arguments import required_number

            required_number(value, name)


class Hand(StrEnum):
    """Arm configuration: which way a SCARA's elbow points, or a six-axis arm reaches.

    Of six axes the right hand has its wrist before the axis of joint 1, the left hand reaches
    over backwards (docs/reference/epson-robots.md, "Flags").
    """

    RIGHT = "right"
    LEFT = "left"


class Elbow(StrEnum):
    """Whether a six-axis arm bends above or below the line from joint 2 to its wrist."""

    ABOVE = "above"
    BELOW = "below"


class Wrist(StrEnum):
    """To which side joint 5 of a six-axis arm is bent."""

    NO_FLIP = "no_flip"
    FLIP = "flip"


@dataclass(frozen=True, slots=True)
class Posture:
    """What distinguishes, besides the hand, the ways in which an arm reaches one pose.

    Elbow and wrist are a six-axis arm's; the joint flags say in which turn a joint stands
    (docs/reference/epson-robots.md, "Flags"). Robots without such a joint have 0.

    Attributes:
        elbow: Above or below.
        wrist: Flipped or not.
        j1_flag: 0, or 1 beyond the first turn of joint 1.
        j2_flag: The same of joint 2, of an arm that folds under itself.
        j4_flag: 1 where joint 4 stands beyond half a turn.
        j6_flag: How many half turns joint 6 stands beyond the first.
        j1_angle_deg: Where joint 1 stands in a singular place that leaves it free: an RS arm with
            its flange on the axis of joint 1. ``None`` where none was told.
        j4_angle_deg: The same of joint 4, of an N robot.
    """

    elbow: Elbow = Elbow.ABOVE
    wrist: Wrist = Wrist.NO_FLIP
    j1_flag: int = 0
    j2_flag: int = 0
    j4_flag: int = 0
    j6_flag: int = 0
    j1_angle_deg: float | None = None
    j4_angle_deg: float | None = None


@dataclass(frozen=True, slots=True, init=False)
class Pose:
    """Where a frame carried by the robot is, seen from the base.

    ``tool`` says which frame: 0 is the flange, 1 to 15 a tool's tip, ``None`` unknown. ``posture``
    is ``None`` where the controller tells none, as of a SCARA. Numbers of other libraries, such as
    numpy's, become Python's own.

    Raises:
        ConfigError: A coordinate is not a number.
    """

    x_mm: float
    y_mm: float
    z_mm: float
    u_deg: float
    v_deg: float = 0.0
    w_deg: float = 0.0
    hand: Hand | None = None
    local: int = 0
    tool: int | None = None
    posture: Posture | None = None

    def __init__(
        self,
        x_mm: float,
        y_mm: float,
        z_mm: float,
        u_deg: float,
        v_deg: float = 0.0,
        w_deg: float = 0.0,
        hand: Hand | None = None,
        local: int = 0,
        tool: int | None = None,
        posture: Posture | None = None,
    ) -> None:
        # Written out, since each movement makes a dozen poses, and each cycle of a simulated search
        # one: by itself a frozen dataclass looks up for each field how it is stored.
        _put_x(self, x_mm)
        _put_y(self, y_mm)
        _put_z(self, z_mm)
        _put_u(self, u_deg)
        _put_v(self, v_deg)
        _put_w(self, w_deg)
        _put_hand(self, hand)
        _put_local(self, local)
        _put_tool(self, tool)
        _put_posture(self, posture)
        self.__post_init__()  # that of a subclass, as a dataclass calls it

    def __post_init__(self) -> None:
        x, y, z, u, v, w = self.x_mm, self.y_mm, self.z_mm, self.u_deg, self.v_deg, self.w_deg
        if float is type(x) is type(y) is type(z) is type(u) is type(v) is type(w):
            return  # nearly every pose
        if not _NUMBERS.issuperset(map(type, (x, y, z, u, v, w))):
            require_numbers(self, "x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")

    def coordinates(self) -> tuple[float, float, float, float, float, float]:
        """Return x, y, z in mm and u, v, w in degrees."""
        return (self.x_mm, self.y_mm, self.z_mm, self.u_deg, self.v_deg, self.w_deg)


_PUTS: Final = [vars(Pose)[name].__set__ for name in Pose.__slots__]
_put_x, _put_y, _put_z, _put_u, _put_v, _put_w = _PUTS[:6]
_put_hand, _put_local, _put_tool, _put_posture = _PUTS[6:]


def described(coordinates: Sequence[float]) -> str:
    """Return x, y, z in mm and u, v, w in degrees as a person reads them; V and W where not 0."""
    # Adding 0.0 turns a negative zero into zero.
    named = zip("XYZUVW", coordinates, strict=True)
    shown = [(name, round(value, 3) + 0.0) for name, value in named]
    return " ".join(f"{name} {value:.3f}" for name, value in shown if name not in "VW" or value)


def describe_pose(pose: Pose) -> str:
    """Return a pose as a person reads it, mm and degrees; V and W only where they are not 0.

    Example:
        >>> from robolink import Pose
        >>> from robolink.model import describe_pose
        >>> describe_pose(Pose(250, 200, -83, 90))
        'X 250.000 Y 200.000 Z -83.000 U 90.000'
        >>> describe_pose(Pose(250, 200, 83, 90, 0, 165))
        'X 250.000 Y 200.000 Z 83.000 U 90.000 W 165.000'
    """
    if not isinstance(pose, Pose):
        from robolink.model._arguments import not_of_class

        raise not_of_class("pose", pose, Pose)
    return described(pose.coordinates())


def angle_difference_deg(a_deg: float, b_deg: float) -> float:
    """Return ``a_deg - b_deg`` as an angle in [-180, 180)."""
    return (a_deg - b_deg + 180.0) % 360.0 - 180.0


def rotate_xy(x: float, y: float, angle_deg: float) -> tuple[float, float]:
    """Turn the vector (x, y) by ``angle_deg``, counter-clockwise seen from +Z.

    Args:
        x: X of the vector; in any unit.
        y: Y of the vector.
        angle_deg: How far it is turned.

    Example:
        >>> from robolink.model import rotate_xy
        >>> [round(value, 6) + 0.0 for value in rotate_xy(12, -3.5, 90)]
        [3.5, 12.0]
    """
    angle = math.radians(angle_deg)
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y
