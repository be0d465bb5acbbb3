"""Tool offset from one look of a calibrated, fixed, up-looking camera (EPSON's CalcTool).

The camera tells where the tip is in the base, the controller where the flange is:
``t = Rz(-U) (tip - flange)``. In this form there is no Atan2(0, 0) and no order of its
arguments to get wrong (docs/reference/calibration.md 1.2).
"""

from dataclasses import dataclass

from robolink.calibration.core.dispersion import Dispersion
from robolink.calibration.core.pose_checks import check_poses, keep_unmeasured, require_finite
from robolink.calibration.core.result import CalibrationResult
from robolink.model import Pose, ToolOffset, rotate_xy


@dataclass(frozen=True, slots=True)
class Sighting:
    """Something on the tool, seen by a camera while the flange stood still.

    Attributes:
        flange: Actual flange pose (Tool 0) at the picture, mm and degrees.
        x_mm, y_mm: Where it was seen, in the base.
    """

    flange: Pose
    x_mm: float
    y_mm: float

    def in_flange_mm(self) -> tuple[float, float]:
        """Return where it is in the flange's axes."""
        return rotate_xy(
            self.x_mm - self.flange.x_mm, self.y_mm - self.flange.y_mm, -self.flange.u_deg
        )


def solve_up_camera(
    sighting: Sighting, *, stored: ToolOffset | None = None, sigma_mm: float | None = None
) -> CalibrationResult:
    """Return the offset of a tip that a calibrated camera saw once.

    Args:
        sighting: The tip, and the flange pose at that moment.
        stored: The offset stored now; Z, U, V and W are kept from it, or 0 without one.
        sigma_mm: Standard deviation of one coordinate of one sighting, robot and camera
            together. Without it the result has no interval: one look leaves no residual.

    An error of the camera's own calibration goes into the offset in full and shows in no
    residual. Several looks at different U tell it (:func:`solve_n_angle`).

    Raises:
        CalibrationError: ``non_finite``, ``suspect_units`` or ``implausible_offset``.
        ConfigError: ``sigma_mm`` is not positive.
    """
    check_sightings((sighting,))
    x_mm, y_mm = sighting.in_flange_mm()
    scatter = Dispersion.of(0.0, 0, sigma_mm)
    covariance = ((scatter.sigma_mm**2, 0.0), (0.0, scatter.sigma_mm**2)) if scatter else ()
    return CalibrationResult(
        method="camera",
        offset=keep_unmeasured(stored, x_mm=x_mm, y_mm=y_mm),
        measured=("x_mm", "y_mm"),
        kept=("z_mm", "u_deg", "v_deg", "w_deg"),
        reference_point_mm=(sighting.x_mm, sighting.y_mm),
        sigma_gain=1.0,
        warnings=(),
        inputs=(sighting.flange,),
        covariance=covariance,
        half_width95=scatter.half_widths(covariance) if scatter else (),
        sigma_mm=sigma_mm,
        sigma_stated=scatter is not None,
        rank=2,
        dof=0,
        unobservable=("z_mm", "u_deg", "v_deg", "w_deg"),
    )


def check_sightings(
    sightings: tuple[Sighting, ...], *, allow_mixed_hand: bool = False
) -> tuple[str, ...]:
    """Refuse sightings that are no numbers or do not belong together.

    Raises:
        CalibrationError: ``non_finite``, ``suspect_units``, ``mixed_hand``, ``mixed_local``
            or ``mixed_tool``.
    """
    for number, sighting in enumerate(sightings, start=1):
        require_finite(
            **{f"x_mm of sighting {number}": sighting.x_mm},
            **{f"y_mm of sighting {number}": sighting.y_mm},
        )
    return check_poses([s.flange for s in sightings], allow_mixed_hand=allow_mixed_hand)
