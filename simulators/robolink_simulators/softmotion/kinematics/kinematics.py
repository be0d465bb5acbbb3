"""What every kinematics offers. Lengths are millimetres, angles degrees."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Protocol

from robolink_simulators.cell.frames import Frame, Matrix
from robolink_simulators.softmotion.kinematics.orientation import OrientationSpace

AxisValues = tuple[float, ...]
"""One value an axis, a0 first: degrees of a rotary axis, mm of a linear one."""


class AxisKind(StrEnum):
    """How an axis moves."""

    ROTARY = "rotary"
    LINEAR = "linear"


@dataclass(frozen=True, slots=True)
class Configuration:
    """Which of several axis positions for one flange pose is meant.

    Attributes:
        elbow_right: ``xElbowRight`` of the SCARA kinematics; ``None`` where there is no elbow.
    """

    elbow_right: bool | None = None


ANY_CONFIGURATION: Final = Configuration()
"""Says nothing: the only one of a kinematics without an elbow, or the present one."""


class KinematicsModel(Protocol):
    """Axes to flange and back. Implementations hold parameters only."""

    @property
    def name(self) -> str:
        """Name of the function block, parts of a coupling joined with ``+``."""

    @property
    def kinds(self) -> tuple[AxisKind, ...]:
        """The axes, a0 first."""

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is in the machine coordinate system."""

    def configuration(self, axes: AxisValues) -> Configuration:
        """Return the configuration of an axis position."""

    def axes_for(self, flange: Frame, configuration: Configuration, near: AxisValues) -> AxisValues:
        """Return the axes for a flange pose whose orientation can be taken up.

        Args:
            flange: As :meth:`orientation_image` left its rotation.
            configuration: Which of the solutions; a missing member means that of ``near``.
            near: Rotary axes are taken within half a turn of these.

        Raises:
            Refused: The position is out of reach.
        """

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:
        """Return what becomes of a programmed flange orientation.

        ``GetFlangeOrientationImage`` (documented, docs/reference/softmotion.md 3.1); ``None`` when
        the kinematics does not implement the interface.

        Raises:
            Refused: No orientation is closest to this one.
        """


def near_turn(angle_deg: float, near_deg: float) -> float:
    """Return the angle, whole turns added, that lies within half a turn of another."""
    return near_deg + math.remainder(angle_deg - near_deg, 360.0)
