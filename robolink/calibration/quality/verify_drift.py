"""Check of an offset: the tip stays in place while the tool turns about it."""

from collections.abc import Sequence

from robolink.calibration.core.dispersion import require_positive
from robolink.calibration.core.pose_checks import (
    MIN_ROTATION_DEG,
    WARN_ROTATION_DEG,
    angle_spread_deg,
    check_poses,
    refuses_by_name,
    require_poses,
)
from robolink.calibration.core.result import Drift, VerifyResult
from robolink.calibration.core.rotations import pose_arrays
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

PLACING_TOLERANCE_MM = 0.1
"""Largest drift for placing, in mm; 0.2 mm is enough for dispensing (docs/reference/calibration.md
3)."""

RECOMMENDED_ANGLES = 4


@refuses_by_name
def verify_drift(
    poses: Sequence[Pose],
    offset: ToolOffset,
    *,
    tolerance_mm: float = PLACING_TOLERANCE_MM,
    min_rotation_deg: float = MIN_ROTATION_DEG,
) -> VerifyResult:
    """Return how far ``offset`` puts the tip from one point in flange poses that touch it.

    Drift counts from the first pose: an error e of the offset then shows as 2 |e| half a turn
    later, which makes the test twice as sensitive (docs/reference/calibration.md 2.12). The poses
    must not be those that the offset was calculated from; they would prove nothing.

    Args:
        poses: Flange poses (Tool 0), mm and degrees, all with the tip on the same point.
        offset: The offset that is to be proved.
        tolerance_mm: Largest drift that passes.
        min_rotation_deg: Smallest arc over which the angles have to spread.

    Raises:
        CalibrationError: ``too_few_poses``, ``insufficient_rotation``, ``non_finite``,
            ``suspect_units``, ``mixed_hand``, ``mixed_local`` or ``mixed_tool``.
        ConfigError: ``tolerance_mm`` is not positive.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import carrying, verify_drift
        >>> true, pin_mm = ToolOffset(12.5, -3.25, -20), (300, 100, -80)
        >>> poses = [carrying(Pose(0, 0, 0, u_deg), true, pin_mm) for u_deg in (0, 90, 180)]
        >>> verify_drift(poses, true).passed
        True
        >>> verify_drift(poses, ToolOffset(12.4, -3.25, -20)).passed  # 0.1 mm off shows as 0.2 mm
        False
    """
    require_positive(tolerance_mm, "tolerance_mm")
    require_poses(len(poses), 2)
    warnings = check_poses(poses, allow_mixed_hand=False)
    spread_deg = max(angle_spread_deg(angles) for angles in _angles(poses))
    if spread_deg < min_rotation_deg:
        raise CalibrationError(
            "insufficient_rotation",
            tr("The tool turns over {spread:.1f} degrees only.", spread=spread_deg),
            remedy=tr(
                "Turn it by {minimum:.0f} degrees or more; with less, an error stays hidden.",
                minimum=min_rotation_deg,
            ),
        )
    if spread_deg < WARN_ROTATION_DEG:
        warnings = (*warnings, "small_rotation")
    if len(poses) < RECOMMENDED_ANGLES:
        warnings = (*warnings, "few_poses")
    return VerifyResult(_drifts(poses, offset), tolerance_mm, warnings)


def _angles(poses: Sequence[Pose]) -> tuple[list[float], list[float], list[float]]:
    return (
        [pose.u_deg for pose in poses],
        [pose.v_deg for pose in poses],
        [pose.w_deg for pose in poses],
    )


def _drifts(poses: Sequence[Pose], offset: ToolOffset) -> tuple[Drift, ...]:
    positions, turned = pose_arrays(poses)
    tips = positions + turned @ offset.components()[:3]
    # On four axes, the height gives no information about the offset.
    upright = not any(pose.v_deg or pose.w_deg for pose in poses)
    drifts = []
    for pose, (dx, dy, dz) in zip(poses, (tips - tips[0]).tolist(), strict=True):
        drifts.append(Drift(pose.u_deg, dx, dy, 0.0 if upright else dz))
    return tuple(drifts)
