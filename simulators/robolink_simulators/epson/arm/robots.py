"""The EPSON robots that can be simulated, with the evidence for each row, and their joint values.

The rows stand in ``robots.csv`` beside this module; docs/reference/epson-robots.md, "Families"
says where they come from.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache
from importlib.resources import files
from typing import Final, NamedTuple, Self

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink_simulators.epson.condition import OutOfReach


class Evidence(StrEnum):
    """How far the geometry of a row can be trusted."""

    VENDOR = "vendor file"
    SECOND_HAND = "second-hand"


class Mechanism(StrEnum):
    """How the joints of a robot follow each other."""

    SCARA = "scara"
    FOLDED_SCARA = "folded_scara"
    SIX_AXIS = "six_axis"


_SIX_AXIS: Final = Mechanism.SIX_AXIS  # before Python 3.12 a member is found slowly


class Mount(StrEnum):
    """What a robot is fixed to; MULTIPLE is a bracket for wall or ceiling."""

    TABLE = "table"
    CEILING = "ceiling"
    MULTIPLE = "multiple"


_ROBOT_TYPES: Final = {Mechanism.SCARA: 3, Mechanism.SIX_AXIS: 5, Mechanism.FOLDED_SCARA: 6}
_NARROW_BELOW: Final = {"GX8-C453S": (-270.0, 145.0), "GX8-C453C": (-240.0, 137.5)}
"""By model: the height in mm below which joint 2 has a smaller range, and that range in degrees
(manufacturer's manual of the GX8).
"""

_TURN: Final = 360.0
_ON_A_WALL: Final = "w"


class Range(NamedTuple):
    """Travel of one joint, ends included: degrees, mm for joint 3 of a SCARA."""

    low: float
    high: float

    def holds(self, value: float) -> bool:
        """Return whether ``value`` lies inside; 1e-9 absorbs the arithmetic of a round trip."""
        return self.low - 1e-9 <= value <= self.high + 1e-9


class ArmOffsets(NamedTuple):
    """How an added arm of a SCARA sits beside its own (docs/reference/spel.md 6.2).

    Attributes:
        j2_deg: From the line of the own second arm to that of the added one.
        z_mm: From the own axis of U to the added one, upwards.
        u_deg: From the own zero of U to the added one.
    """

    j2_deg: float = 0.0
    z_mm: float = 0.0
    u_deg: float = 0.0


OWN_ARM: Final = ArmOffsets()


@dataclass(frozen=True, slots=True)
class RobotModel:
    """Geometry and drives of one robot (docs/reference/epson-robots.md, "Families").

    Attributes:
        name: As on the type plate.
        mechanism: How its joints follow each other.
        mount: What it is fixed to.
        lengths_mm: Both arms of a SCARA; of six axes the six lengths of ArmSet: base to joint 2
            upwards, joint 1 to joint 2 forwards, joint 2 to 3, joint 3 to 5 upwards, joint 3 to 5
            forwards, joint 5 to the flange.
        ranges: Travel of each joint.
        pulses_per_unit: Encoder pulses per degree, or per mm.
        top_speed: Joint speeds at Speed 100, in degrees/s, or mm/s.
        payload_kg: Heaviest load.
        source: Where the row comes from, by the keys of docs/reference/epson-robots.md, "Sources".
        assumed: What in the row no source gives.
        offsets: Those of an added arm, all 0 of its own.
    """

    name: str
    mechanism: Mechanism
    mount: Mount
    lengths_mm: tuple[float, ...]
    ranges: tuple[Range, ...]
    pulses_per_unit: tuple[float, ...]
    top_speed: tuple[float, ...]
    payload_kg: float
    source: str
    assumed: str
    offsets: ArmOffsets = OWN_ARM

    @property
    def evidence(self) -> Evidence:
        """Whether the lengths are the vendor's."""
        return Evidence.VENDOR if self.source.startswith("ROS2") else Evidence.SECOND_HAND

    @property
    def narrow_below(self) -> tuple[float, float] | None:
        """Below which height in mm joint 2 is limited to how many degrees, ``None`` for nowhere."""
        return _NARROW_BELOW.get(self.name)

    @property
    def axes(self) -> int:
        """How many joints it has."""
        return len(self.ranges)

    @property
    def six_axes(self) -> bool:
        """Whether it can tilt its tool."""
        return self.mechanism is _SIX_AXIS

    @property
    def hangs(self) -> bool:
        """Whether the base of a six-axis robot is turned over."""
        return self.six_axes and self.mount is Mount.CEILING

    @property
    def linear_joints(self) -> tuple[int, ...]:
        """Numbers of the joints that count mm."""
        return () if self.six_axes else (3,)

    @property
    def robot_type(self) -> int:
        """What RobotType gives (docs/reference/spel.md 9)."""
        return _ROBOT_TYPES[self.mechanism]

    @property
    def arm_values(self) -> tuple[float, ...]:
        """What ArmSet lists of arm 0, mm and degrees (docs/reference/spel.md 6.2).

        Of a SCARA the length of arm 2, two offsets, the length of arm 1, an offset: each offset
        is 0. Of six axes the six lengths; that the other six are 0 is assumed.
        """
        if self.six_axes:
            return (*self.lengths_mm, *(0.0,) * 6)
        a1_mm, a2_mm = self.lengths_mm
        return (a2_mm, 0.0, 0.0, a1_mm, 0.0)

    def with_arm(self, values: Sequence[float]) -> "RobotModel":
        """Return a SCARA as it moves with an added arm selected; ``values`` as ArmSet takes them.

        The lengths count from the axis of joint 2 and from that of joint 1 (documented).
        """
        a2_mm, j2_deg, z_mm, a1_mm, u_deg = values
        offsets = ArmOffsets(j2_deg, z_mm, u_deg)
        return replace(self, lengths_mm=(a1_mm, a2_mm), offsets=offsets)

    @property
    def reach_mm(self) -> float:
        """No flange comes farther from the axis of joint 2, or of joint 1 of a SCARA."""
        return sum(self.lengths_mm[2:] if self.six_axes else self.lengths_mm)


def _model(row: dict[str, str]) -> RobotModel:
    mechanism = Mechanism(row["kind"])
    ends = [travel.split("..") for travel in row["ranges"].split()]
    pulses = [float(count) for count in row["pulses"].split()]
    linear = () if mechanism is Mechanism.SIX_AXIS else (2,)
    return RobotModel(
        name=row["name"],
        mechanism=mechanism,
        mount=Mount(row["mount"]),
        lengths_mm=tuple(map(float, row["lengths_mm"].split())),
        ranges=tuple(Range(float(low), float(high)) for low, high in ends),
        pulses_per_unit=tuple(n if i in linear else n / _TURN for i, n in enumerate(pulses)),
        top_speed=tuple(map(float, row["top_speed"].split())),
        payload_kg=float(row["payload_kg"]),
        source=row["source"],
        assumed=row["assumed"],
    )


@cache
def robots() -> tuple[RobotModel, ...]:
    """Return every model: the vendor's rows first, then those with second-hand lengths."""
    text = files(__package__).joinpath("robots.csv").read_text(encoding="utf-8")
    return tuple(_model(row) for row in csv.DictReader(text.splitlines()))


def robot_names() -> tuple[str, ...]:
    """Return the names of all models."""
    return tuple(model.name for model in robots())


def find_robot(name: str) -> RobotModel:
    """Return the model called ``name``, in any case.

    Raises:
        ConfigError: There is no such row, or it would be a six-axis robot on a wall, whose Tool 0
            no readable source defines (docs/reference/epson-robots.md, "Frames").
    """
    wanted = name.casefold()
    by_name = {model.name.casefold(): model for model in robots()}
    if wanted in by_name:
        return by_name[wanted]
    upright = by_name.get(wanted.removesuffix(_ON_A_WALL))
    if upright is not None and upright.six_axes:
        raise ConfigError(
            tr("A six-axis robot on a wall cannot be simulated: {name!r}.", name=name),
            remedy=tr(
                "It is not known which way its Tool 0 points. Choose {name}, on a "
                "table, or a robot on a ceiling.",
                name=upright.name,
            ),
        )
    raise ConfigError(
        tr("There is no simulated robot {name!r}.", name=name),
        remedy=known_names(robot_names(), name),
    )


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
    """Refuse targets where a model limits its joint 2 more, because the shaft is low.

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
    """Return the angle, whole turns away, nearest to the middle of a range."""
    middle = (low + high) / 2
    turned = (angle_deg - middle) % 360.0
    return middle + (turned - 360.0 if turned > 180.0 else turned)


def wrapped(angle_deg: float) -> float:
    """Return the angle brought into (-180, 180]."""
    turned = angle_deg % 360.0
    return turned - 360.0 if turned > 180.0 else turned


def nearest_turn(angle_deg: float, near_deg: float) -> float:
    """Return the angle, whole turns away, nearest to another."""
    return angle_deg + 360.0 * round((near_deg - angle_deg) / 360.0)
