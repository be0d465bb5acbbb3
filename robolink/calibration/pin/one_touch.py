"""A new tip from a single touch of a pin whose place is known.

A full calibration learns where the pin is: at the touch, p + R t. Any later tip on the same
pin has ``t = R' (pin - p)``. With the pin as the last touch and the last offset place it,
the difference between two tips is what is measured, and an error of the full calibration
stays as it was (docs/reference/calibration.md 2.9).
"""

import math
from dataclasses import dataclass

import numpy as np

from robolink.calibration.core.accuracy import ErrorSource
from robolink.calibration.core.dispersion import Dispersion, interval_of
from robolink.calibration.core.pose_checks import (
    check_poses,
    components,
    refuses_by_name,
    require_finite,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.rotations import rotation_of
from robolink.calibration.flange_plane import require_flange_in_base
from robolink.calibration.quality.station import StationPart, with_station
from robolink.messages import tr
from robolink.model import Pose, ToolOffset


@dataclass(frozen=True, slots=True)
class Pin:
    """Where the end of a reference pin is, base, mm.

    Attributes:
        x_mm, y_mm, z_mm: The place.
        sigma_mm: Standard deviation of each of them.
        covariance_mm2: Of all three, base, where more is known than one standard deviation.
        dof: Degrees of freedom of both; ``None`` where they were stated.
    """

    x_mm: float
    y_mm: float
    z_mm: float
    sigma_mm: float = 0.0
    covariance_mm2: tuple[tuple[float, ...], ...] = ()
    dof: float | None = None

    def part(self, flange: Pose) -> StationPart:
        """Return the uncertainty that the pin adds to a tip touching it in a flange pose."""
        base = np.array(self.covariance_mm2 or np.eye(3) * self.sigma_mm**2)
        turn = rotation_of(flange)
        return StationPart(
            tr("place of the pin"),
            (turn.T @ base @ turn).tolist(),
            dof=math.inf if self.dof is None else self.dof,
            origin=tr("record of the station"),
        )


def pin_touched(flange: Pose, offset: ToolOffset, *, sigma_mm: float = 0.0) -> Pin:
    """Return where the pin is when ``offset`` is right and touched it in this flange pose.

    Args:
        flange: Flange pose (Tool 0) at the touch.
        offset: The offset of the tip that touched.
        sigma_mm: Standard deviation of one coordinate of that touch.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import pin_touched
        >>> pin = pin_touched(Pose(300, 100, -60, 90), ToolOffset(12, -3.5, -20))
        >>> [round(value, 3) for value in (pin.x_mm, pin.y_mm, pin.z_mm)]
        [303.5, 112.0, -80.0]
    """
    x, y, z = (rotation_of(flange) @ offset.components()[:3]).tolist()
    return Pin(flange.x_mm + x, flange.y_mm + y, flange.z_mm + z, sigma_mm)


def one_touch_sources(count: int) -> tuple[ErrorSource, ...]:
    """Return the errors of one touch of a pin whose place is taken as known.

    Args:
        count: How many lengths are measured.
    """
    return (
        ErrorSource.of_lengths("touch_mm", count),
        ErrorSource.of_lengths("place_mm", count, turning="in_base"),
    )


@refuses_by_name
def solve_one_touch(
    flange: Pose,
    pin: Pin,
    *,
    stored: ToolOffset | None = None,
    sigma_mm: float | None = None,
) -> CalibrationResult:
    """Return X, Y and Z of a tip that touches ``pin`` in one flange pose.

    Args:
        flange: Flange pose (Tool 0) at the touch.
        pin: Where the pin is; :func:`pin_touched` makes it from the last touch.
        stored: The offset stored now; U, V and W are kept from it, or 0 without one.
        sigma_mm: Standard deviation of one coordinate of one touch. Without it the result has
            no interval: one touch leaves no residual.

    The pin counts in full: u^2 = u_pin^2 + s^2 (docs/reference/evidence.md 12).

    A pin that was moved puts all tools wrong by the same amount, and no touch can tell.

    Raises:
        CalibrationError: ``non_finite``, ``suspect_units``, ``tool_pose``, ``local_pose`` or
            ``implausible_offset``.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import pin_touched, solve_one_touch
        >>> pin = pin_touched(Pose(300, 100, -60, 0), ToolOffset(12, -3.5, -20))  # the last touch
        >>> found = solve_one_touch(Pose(299.7, 100.2, -60.1, 0), pin)
        >>> [round(value, 3) for value in (found.offset.x_mm, found.offset.y_mm, found.offset.z_mm)]
        [12.3, -3.7, -19.9]
    """
    check_poses((flange,), allow_mixed_hand=False)
    require_flange_in_base((flange,))
    require_finite(x_mm=pin.x_mm, y_mm=pin.y_mm, z_mm=pin.z_mm, sigma_mm=pin.sigma_mm)
    away = np.array([pin.x_mm - flange.x_mm, pin.y_mm - flange.y_mm, pin.z_mm - flange.z_mm])
    x, y, z = (rotation_of(flange).T @ away).tolist()
    scatter = Dispersion.of(0.0, 0, sigma_mm)
    variance = scatter.sigma_mm**2 if scatter else 0.0
    result = CalibrationResult(
        method="one-touch",
        **components(stored, x_mm=x, y_mm=y, z_mm=z),
        reference_point_mm=(pin.x_mm, pin.y_mm, pin.z_mm),
        sigma_gain=1.0,
        warnings=(),
        inputs=(flange,),
        **interval_of(scatter, (variance,) * 3, 3),
        sigma_mm=sigma_mm,
        sigma_stated=scatter is not None,
        rank=3,
        dof=0,
        sources=one_touch_sources(3),
    )
    return with_station(result, pin.part(flange))
