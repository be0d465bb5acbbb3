"""How poses that exist already are solved."""

from collections.abc import Sequence
from typing import ClassVar, Protocol

from robolink.calibration import CalibrationResult
from robolink.model import Pose, ToolOffset


class PoseMethod(Protocol):
    """Solves flange poses that touch a pin.

    Attributes:
        upright: Whether the tool stands upright in all of them, so that only X and Y follow.
        needs: Coordinates that a pose must state besides x_mm, y_mm and u_deg.
    """

    upright: ClassVar[bool]
    needs: ClassVar[tuple[str, ...]]

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Return the offset; what is not measured is kept from ``stored``.

        Raises:
            CalibrationError: The poses give no trustworthy result; its code says why.
            ConfigError: Too many poses for the method.
        """
