"""How poses that exist already are solved, one class for each method."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

from robolink.calibration import CalibrationResult, solve_two_pose, two_of
from robolink.model import Pose, ToolOffset


class PoseMethod(Protocol):
    """Solves flange poses that touch a pin.

    Attributes:
        upright: Whether the tool stands upright in all of them, so that only X and Y follow.
    """

    upright: ClassVar[bool]

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Return the offset; what is not measured is kept from ``stored``.

        Raises:
            CalibrationError: The poses give no trustworthy result; its code says why.
            ConfigError: Too many poses for the method.
        """


@dataclass(frozen=True, slots=True)
class TwoTouches:
    """Two touches of one pin.

    Attributes:
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = True

    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve exactly two poses; see :class:`PoseMethod`."""
        return solve_two_pose(*two_of(flange), stored=stored, sigma_mm=self.sigma_mm)


@dataclass(frozen=True, slots=True)
class ManyTouches:
    """Touches of one pin at several angles of U, each checked by the others.

    Attributes:
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = True

    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve three poses and more; see :class:`PoseMethod`."""
        from robolink.calibration import solve_n_angle  # numpy, which a look does without

        return solve_n_angle(flange, stored=stored, sigma_mm=self.sigma_mm)
