"""Camera and tool offset together, from the pixels of a camera whose place is unknown.

Every picture says ``M px + b = p + Rz(U) t``: linear in the matrix M, the origin b and the
offset t, eight unknowns in all (docs/reference/calibration.md 2.5). Moving without turning shows M,
turning shows t; without turning, t and b cannot be told apart. A flange that leans or hangs upside
down has ``A t + c t_z`` in place of Rz(U) t (docs/reference/evidence.md 3).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robolink.calibration.camera.camera_model import (
    USUAL_CAMERA,
    CameraLimits,
    CameraModel,
    require_same_camera,
)
from robolink.calibration.core.accuracy import ErrorSource
from robolink.calibration.core.least_squares import Floats, LinearFit, linear_fit
from robolink.calibration.core.pose_checks import (
    check_poses,
    components,
    refuses_by_name,
    require_finite,
    require_poses,
)
from robolink.calibration.core.result import CalibrationResult, offset_sigma_mm
from robolink.calibration.flange_plane import (
    TipHeight,
    height_of,
    known_z_mm,
    require_flange_in_base,
    solvable_planes,
    with_height_error,
)
from robolink.calibration.quality.doubts import PLANAR_TOLERANCE, Tolerance
from robolink.calibration.quality.fit_quality import judged
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, json_fields

UNKNOWNS = 8

MAX_CONDITION = 100.0

LEAST_SPREAD_PX = 5.0
"""Smallest rms spread of the sightings over the image, in every direction, in pixels: even for a
stationary spot the finder's scatter alone spreads, and yields a false scale and shear."""


@dataclass(frozen=True, slots=True)
class PixelSighting:
    """The tip in a picture: its pixel, and the flange pose (Tool 0) at that moment."""

    flange: Pose
    px: float
    py: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraCalibration(CalibrationResult):
    """A tool offset and the camera that measured it.

    Attributes:
        camera: The map from pixels to the base.
        rms_px: Root mean square of the residual distances in pixels, ``None`` without a
            degree of freedom.
    """

    camera: CameraModel
    rms_px: float | None = None

    def details(self) -> dict[str, object]:
        """Return the camera."""
        shown = ("mm_per_px", "origin_mm", "scale_mm_per_px", "turn_deg", "shear_deg", "mirrored")
        return {"camera": {**json_fields(self.camera, *shown), "rms_px": self.rms_px}}


@refuses_by_name
def solve_camera_affine(
    sightings: Sequence[PixelSighting],
    *,
    stored: ToolOffset | None = None,
    height: TipHeight | None = None,
    sigma_mm: float | None = None,
    before: CameraModel | None = None,
    limits: CameraLimits = USUAL_CAMERA,
    tolerance: Tolerance = PLANAR_TOLERANCE,
) -> CameraCalibration:
    """Return offset and camera from pictures of one tip in several flange poses.

    Args:
        sightings: At least four: three places that are not in line at one U, and other U.
        stored: The offset stored now; Z, U, V and W are kept from it, or 0 without one.
        height: Z of the tip, for a flange that leans; without it that of ``stored`` counts.
        sigma_mm: Standard deviation of one coordinate of one sighting, in mm, when known.
        before: The camera at its last calibration; a changed one is refused.
        limits: What is a good and what the same camera.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: ``too_few_poses``, ``rank_deficient``, ``insufficient_rotation``,
            ``camera_implausible``, ``camera_changed``, ``large_pixel_residual``,
            ``large_interval``, ``implausible_offset``, ``tool_pose``, ``local_pose``,
            ``tilted_pose``, and those of ``pose_checks.check_poses``.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import PixelSighting, solve_camera_affine
        >>> from robolink.model import rotate_xy
        >>> def seen(x_mm, y_mm, u_deg):  # 0.02 mm a pixel, pixel (0, 0) at 290, 80
        ...     dx_mm, dy_mm = rotate_xy(12.3, -3.7, u_deg)
        ...     px, py = (x_mm + dx_mm - 290) / 0.02, (y_mm + dy_mm - 80) / 0.02
        ...     return PixelSighting(Pose(x_mm, y_mm, -60, u_deg), px, py)
        >>> places = [(300, 100, 0), (303, 100, 0), (300, 103, 0), (300, 100, 90), (300, 100, 180)]
        >>> found = solve_camera_affine([seen(*place) for place in places])
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.3, -3.7)
        >>> [round(scale, 4) for scale in found.camera.scale_mm_per_px]
        [0.02, 0.02]
    """
    require_poses(len(sightings), UNKNOWNS // 2)
    for number, sighting in enumerate(sightings, start=1):
        require_finite(**{f"px of {number}": sighting.px, f"py of {number}": sighting.py})
    poses = [sighting.flange for sighting in sightings]
    warnings = check_poses(poses, allow_mixed_hand=False)
    require_flange_in_base(poses)
    height = height_of(stored, height)
    pixels = np.array([(sighting.px, sighting.py) for sighting in sightings], dtype=float)
    _require_spread(pixels)
    a, b, per_height = _system(poses, pixels, height)
    fit = linear_fit(a, b)
    _require_observable(fit)
    camera = _camera(fit.x, pixels.mean(axis=0))
    limits.require_camera(camera)
    if before is not None:
        require_same_camera(camera, before, limits)
    residuals = fit.residuals.reshape(-1, 2)
    result = CameraCalibration(
        method="camera-affine",
        **components(stored, x_mm=float(fit.x[6]), y_mm=float(fit.x[7])),
        reference_point_mm=camera.origin_mm,
        sigma_gain=math.sqrt(float(fit.unit_covariance.diagonal()[6:].max())),
        warnings=warnings,
        inputs=tuple(poses),
        residuals_mm=tuple(map(tuple, residuals.tolist())),
        condition_number=fit.condition_number,
        rank=fit.rank,
        # The fit also finds the camera's place, turn and scale, so none of them adds an error.
        sources=(ErrorSource.of_lengths("tip_image_px", 2, gain=camera.largest_mm_per_px),),
        camera=camera,
    )
    result = judged(
        result,
        residuals,
        fit.unit_covariance[6:, 6:],
        unknowns=UNKNOWNS,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
    )
    by_height = linear_fit(a, per_height).x[6:].tolist()
    result = with_height_error(result, (by_height[0], by_height[1]), height)
    rms_px = _rms_px(camera, residuals) if result.dof else None
    limits.require_fit(rms_px, max(result.half_width95, default=None))
    doubts = (*result.warnings, *limits.exceeded(camera, rms_px))
    known = _with_spread(camera, fit, offset_sigma_mm(result), pixels.mean(axis=0).tolist())
    return replace(result, rms_px=rms_px, warnings=doubts, camera=known)


def _with_spread(
    camera: CameraModel, fit: LinearFit, offset_mm: float | None, mean_pixel: Sequence[float]
) -> CameraModel:
    """Return the camera with the uncertainty of place and scale; unchanged without a scatter."""
    if offset_mm is None:
        return camera
    variances = fit.unit_covariance.diagonal()
    # Scatter of one look, widened by the same factor for few degrees of freedom as the interval.
    sigma_mm = offset_mm / math.sqrt(float(variances[6:].max()))
    px, py = mean_pixel
    return replace(
        camera,
        centre_mm=camera.base_mm(px, py),
        place_sigma_mm=sigma_mm * math.sqrt(float(variances[4:6].max())),
        scale_sigma=sigma_mm * math.sqrt(float(variances[:4].max())) / min(camera.scale_mm_per_px),
    )


def _system(
    poses: Sequence[Pose], pixels: Floats, height: TipHeight | None
) -> tuple[Floats, Floats, Floats]:
    """Return the 2N x 8 system in M (by rows), b at the mean pixel, and t.

    The last is by how much its right side changes for 1 mm of the tip's height.
    """
    planes = solvable_planes(poses, height)
    a = np.zeros((len(poses), 2, UNKNOWNS))
    # Centring on the mean pixel nearly decouples M and b.
    centred = pixels - pixels.mean(axis=0)
    a[:, 0, 0:2] = a[:, 1, 2:4] = centred
    a[:, 0, 4] = a[:, 1, 5] = 1.0
    a[:, :, 6:] = -np.array([plane.columns for plane in planes]).transpose(0, 2, 1)
    per_height = np.array([plane.axis for plane in planes])
    places = np.array([(pose.x_mm, pose.y_mm) for pose in poses], dtype=float)
    right = places + per_height * known_z_mm(height)
    return a.reshape(-1, UNKNOWNS), right.ravel(), per_height.ravel()


def _camera(x: Floats, mean_pixel: Floats) -> CameraModel:
    m = x[:4].reshape(2, 2)
    ox, oy = (x[4:6] - m @ mean_pixel).tolist()
    (a, b), (c, d) = m.tolist()
    return CameraModel(((a, b), (c, d)), (ox, oy))


def _rms_px(camera: CameraModel, residuals_mm: Floats) -> float:
    in_pixels = residuals_mm @ np.linalg.inv(np.array(camera.mm_per_px)).T
    return math.sqrt(float((in_pixels**2).sum()) / len(in_pixels))


def _require_spread(pixels: Floats) -> None:
    """Refuse pixels that all lie at one point or on one line, within the finder's scatter."""
    spread = np.linalg.svd(pixels - pixels.mean(axis=0), compute_uv=False)
    rms_px = float(spread[-1]) / math.sqrt(len(pixels))
    if rms_px >= LEAST_SPREAD_PX:
        return
    raise CalibrationError(
        "rank_deficient",
        tr(
            "The spots spread only {found:.1f} pixels in one direction, limit {limit:g}.",
            found=rms_px,
            limit=LEAST_SPREAD_PX,
        ),
        remedy=tr("Check that the spot moves with the tip. Move the tip further, both ways."),
    )


def _require_observable(fit: LinearFit) -> None:
    if fit.rank == UNKNOWNS and fit.condition_number <= MAX_CONDITION:
        return
    matrix_part, offset_part = np.abs(fit.weakest[:4]).max(), np.abs(fit.weakest[6:]).max()
    if offset_part > matrix_part:
        what = tr("The tool turned too little to separate its offset from the place of the camera.")
        remedy = tr("Add pictures at other angles of U, best over a full turn.")
    else:
        what = tr("The tip moved too little over the image: its scale and turn are unknown.")
        remedy = tr("Add pictures at three places or more that are not in line, at one U.")
    code = "rank_deficient" if fit.rank < UNKNOWNS else "insufficient_rotation"
    raise CalibrationError(code, what, remedy=remedy)
