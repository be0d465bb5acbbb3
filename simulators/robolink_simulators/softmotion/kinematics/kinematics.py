"""What every kinematics offers. Lengths are millimetres, angles degrees."""

import math
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Final, Protocol, Self

from robolink.model import AxisKind, OrientationImage, OrientationSpace
from robolink_simulators.cell.frames import ORIGIN, Frame, Matrix, Vector, zyz, zyz_angles
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind


class CoordSystem(IntEnum):
    """``SMC_COORD_SYSTEM``: members documented, numbers those of docs/reference/mailbox.md.

    Source: docs/reference/softmotion.md 2.6.
    """

    ACS = 0
    MCS = 1
    WCS = 2
    PCS_1 = 3
    PCS_2 = 4
    TCS = 5


@dataclass(frozen=True, slots=True)
class CoordRef:
    """``MC_COORD_REF``: shift in mm, A, B, C in degrees.

    Source: docs/reference/softmotion.md 1.3 (documented).

    The user unit of a simulated group is the millimetre.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    z_mm: float = 0.0
    a_deg: float = 0.0
    b_deg: float = 0.0
    c_deg: float = 0.0

    @classmethod
    def of(cls, frame: Frame) -> Self:
        """Return a frame as the blocks exchange it, B in 0..180."""
        return cls(*frame.shift_mm, *zyz_angles(frame.rotation))

    def frame(self) -> Frame:
        """Return the frame that is meant."""
        shift = (self.x_mm, self.y_mm, self.z_mm)
        return Frame(shift, zyz(self.a_deg, self.b_deg, self.c_deg))

    def components(self) -> tuple[float, float, float, float, float, float]:
        """Return x, y, z in mm and A, B, C in degrees."""
        return (self.x_mm, self.y_mm, self.z_mm, self.a_deg, self.b_deg, self.c_deg)


class CoordinateTransforms:
    """Where MCS, PCS_1 and PCS_2 stand in WCS, all there at first (documented for MCS).

    ``MC_SetCoordinateTransform`` and ``MC_ReadCoordinateTransform``; targets are resolved
    when a movement is commanded, so a change counts for new movements only.
    """

    def __init__(self) -> None:
        self._in_wcs = dict.fromkeys(
            (CoordSystem.MCS, CoordSystem.PCS_1, CoordSystem.PCS_2), ORIGIN
        )

    def place(self, system: CoordSystem, in_wcs: Frame) -> None:
        """Put a coordinate system somewhere.

        Raises:
            Refused: It is not MCS, PCS_1 or PCS_2.
        """
        self._require_placed(system)
        self._in_wcs[system] = in_wcs

    def placed(self, system: CoordSystem) -> Frame:
        """Return where a coordinate system stands in WCS.

        Raises:
            Refused: It is not MCS, PCS_1 or PCS_2.
        """
        self._require_placed(system)
        return self._in_wcs[system]

    def in_mcs(self, system: CoordSystem, tcp: Frame) -> Frame:
        """Return where a Cartesian coordinate system stands in MCS.

        Args:
            system: Which one.
            tcp: The TCP in MCS, where TCS stands.

        Raises:
            Refused: ACS is no Cartesian system.
        """
        match system:
            case CoordSystem.MCS:
                return ORIGIN
            case CoordSystem.TCS:
                return tcp
            case CoordSystem.ACS:
                raise BlockRefused(ErrorKind.PARAMETER, "ACS is no Cartesian coordinate system")
            case CoordSystem.WCS:
                return self._in_wcs[CoordSystem.MCS].inverse()
            case CoordSystem.PCS_1 | CoordSystem.PCS_2:
                return self._in_wcs[CoordSystem.MCS].inverse() @ self._in_wcs[system]

    def _require_placed(self, system: CoordSystem) -> None:
        if system not in self._in_wcs:
            raise BlockRefused(ErrorKind.PARAMETER, f"{system.name} has no place of its own")


AxisValues = tuple[float, ...]
"""One value per axis, a0 first: degrees for a rotary axis, mm for a linear one."""


@dataclass(frozen=True, slots=True)
class Configuration:
    """Which of several axis positions for one flange pose is meant.

    A member is ``None`` where the kinematics has no such choice, or nothing is said about it.

    Attributes:
        elbow_right: ``xElbowRight`` of the SCARA kinematics.
        arm_backwards: Whether an arm that turns about Z points away from where its wrist is
            (``Kin_Pos_RRR_Arm_State``, ``bBackwards``).
        elbow_low: Whether the elbow lies below the line from shoulder to wrist
            (``Kin_Pos_RRR_Elbow_State``, ``bElbowLow``).
        hand_down: Whether the second axis of a wrist is positive (``Kin_Wrist3_Hand_State``).
    """

    elbow_right: bool | None = None
    arm_backwards: bool | None = None
    elbow_low: bool | None = None
    hand_down: bool | None = None

    def completed(self, other: "Configuration") -> "Configuration":
        """Return this one with what it does not say taken from another."""
        return Configuration(*(o if m is None else m for m, o in self._pairs(other)))

    def contradicts(self, other: "Configuration") -> bool:
        """Return whether both state one choice, and differently."""
        return any(None not in pair and pair[0] is not pair[1] for pair in self._pairs(other))

    def _pairs(self, other: "Configuration") -> list[tuple[bool | None, bool | None]]:
        names = [it.name for it in fields(self)]
        return [(getattr(self, name), getattr(other, name)) for name in names]


ANY_CONFIGURATION: Final = Configuration()
"""An unspecified configuration: the only one of a kinematics without a choice, otherwise the
current one.
"""


class KinematicsModel(Protocol):
    """Axes to flange and back. Implementations hold parameters only."""

    @property
    def name(self) -> str:
        """Name of the function block, parts of a coupling joined with ``+``."""

    @property
    def kinds(self) -> tuple[AxisKind, ...]:
        """The axes, a0 first."""

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is in the machine coordinate system.

        Raises:
            Refused: The axes cannot stand so, as rods that are too short.
        """

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


class OrientationModel(Protocol):
    """Axes that turn a flange on the flange of a position kinematics."""

    @property
    def name(self) -> str:
        """Name of the function block."""

    @property
    def kinds(self) -> tuple[AxisKind, ...]:
        """Its axes."""

    def flange(self, axes: AxisValues) -> Frame:
        """Return where its flange is on the one that carries it."""

    def configuration(self, axes: AxisValues) -> Configuration:
        """Return the configuration of an axis position."""

    def axes_for(
        self, rotation: Matrix, configuration: Configuration, near: AxisValues
    ) -> AxisValues:
        """Return the axes that give an orientation, seen from the flange that carries it.

        Raises:
            Refused: It cannot be taken up.
        """

    def image(self, wanted: Matrix, base: OrientationSpace) -> OrientationImage:
        """Return which orientations it gives (``GetOrientationImage2``).

        Raises:
            NotReachable: None is closest to this one.
        """

    def carried_at(self, flange: Frame, base: OrientationSpace) -> Vector:
        """Return where the flange must be that carries it (``GetPositionFromOrientation``)."""


def near_turn(angle_deg: float, near_deg: float) -> float:
    """Return the angle, whole turns added, that lies within half a turn of another."""
    return near_deg + math.remainder(angle_deg - near_deg, 360.0)
