"""What all sources with a camera have in common."""

from collections.abc import Sequence

from robolink.calibration import CalibrationResult, toward_zero

_HALF_A_TURN_DEG = 180.0


def angles_between(measured_deg: Sequence[float]) -> tuple[float, ...]:
    """Return angles for a proof, inside the arc of the measured ones and equal to none of them.

    Half a turn on from a single one, where an error shows twofold.
    """
    low, high = min(measured_deg), max(measured_deg)
    if low == high:
        return (toward_zero(low, _HALF_A_TURN_DEG),)
    return low + (high - low) / 6, high - (high - low) / 6


def camera_error_of(result: CalibrationResult) -> tuple[float, float]:
    """Return what a measurement found its camera to be off by, base X and Y in mm."""
    from robolink.calibration import CameraRound  # numpy, which a look does without

    error_mm = result.camera_error_mm if isinstance(result, CameraRound) else None
    return error_mm or (0.0, 0.0)
