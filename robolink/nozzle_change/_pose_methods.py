"""How poses that exist already are solved, one class for each method."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, Protocol

from robolink.calibration import CalibrationResult, solve_two_pose, two_of
from robolink.errors import CalibrationError
from robolink.messages import tr
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


@dataclass(frozen=True, slots=True)
class TwoTouches:
    """Two touches of one pin.

    Attributes:
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ()

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
    needs: ClassVar[tuple[str, ...]] = ()

    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve three poses and more; see :class:`PoseMethod`."""
        from robolink.calibration import solve_n_angle  # numpy, which a look does without

        return solve_n_angle(flange, stored=stored, sigma_mm=self.sigma_mm)


@dataclass(frozen=True, slots=True)
class PivotTouches:
    """Touches of one pin with six axes, the tool tilted and turned.

    Attributes:
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = False
    needs: ClassVar[tuple[str, ...]] = ("z_mm", "v_deg", "w_deg")

    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve three poses and more; see :class:`PoseMethod`."""
        from robolink.calibration import solve_pivot  # numpy, which a look does without

        return solve_pivot(flange, stored=stored, sigma_mm=self.sigma_mm)


@dataclass(frozen=True, slots=True)
class SixPoints:
    """Touches of one pin, then a way along the tool's X and one along its Z, or in its XZ plane.

    Attributes:
        second_is: What the last pose shows: ``z`` the tool's +Z, ``xz`` its XZ plane.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = False
    needs: ClassVar[tuple[str, ...]] = ("z_mm", "v_deg", "w_deg")

    second_is: Literal["z", "xz"] = "z"
    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve five poses and more, the last two away from the pin; see :class:`PoseMethod`."""
        from robolink.calibration import solve_six_point  # numpy, which a look does without

        if len(flange) < LEAST_OF_SIX_POINTS:
            raise CalibrationError(
                "too_few_poses",
                tr("{count} poses were given; the method needs five.", count=len(flange)),
                remedy=tr(
                    "Give three or more on the pin, better four and more, then one along X and one "
                    "along Z."
                ),
            )
        *pivot, along_x, second = flange
        return solve_six_point(
            pivot,
            along_x,
            second,
            second_is=self.second_is,
            stored=stored,
            sigma_mm=self.sigma_mm,
        )


LEAST_OF_SIX_POINTS = 5
