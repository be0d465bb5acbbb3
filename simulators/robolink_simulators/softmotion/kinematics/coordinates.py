"""Coordinate systems, and positions as the blocks exchange them."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Self

from robolink_simulators.cell.frames import ORIGIN, Frame, zyz, zyz_angles
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind


class CoordSystem(IntEnum):
    """``SMC_COORD_SYSTEM``: members documented, numbers those of docs/mailbox.md.

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
