"""What a calibration proposes, and how much of it was measured."""

from dataclasses import dataclass

from robolink.model import Pose, ToolOffset

COMPONENTS = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """A proposal for a tool offset. Nothing has been written.

    Attributes:
        method: How it was measured, for example ``two_pose``.
        offset: The proposed offset: measured components, and the others as they were kept.
        measured: Names of the components that the measurement determines.
        kept: Names of the components that were not measured and are proposed unchanged.
        reference_point_mm: Where the reference point lies in the base, (x, y).
        sigma_gain: Standard deviation of each measured length as a multiple of the standard
            deviation of one placement (calibration.md 1.1).
        warnings: Named doubts that do not forbid the result.
        inputs: The poses that went in.
    """

    method: str
    offset: ToolOffset
    measured: tuple[str, ...]
    kept: tuple[str, ...]
    reference_point_mm: tuple[float, float]
    sigma_gain: float
    warnings: tuple[str, ...]
    inputs: tuple[Pose, ...]


@dataclass(frozen=True, slots=True)
class Drift:
    """How far the tip left the reference point when the tool stood at ``u_deg``."""

    u_deg: float
    dx_mm: float
    dy_mm: float

    @property
    def distance_mm(self) -> float:
        """Length of the drift in the plane."""
        return float((self.dx_mm**2 + self.dy_mm**2) ** 0.5)


@dataclass(frozen=True, slots=True)
class VerifyResult:
    """Drift of the tip about the reference point, one entry per angle."""

    drifts: tuple[Drift, ...]
    tolerance_mm: float

    @property
    def max_drift_mm(self) -> float:
        """The largest drift."""
        return max(drift.distance_mm for drift in self.drifts)

    @property
    def passed(self) -> bool:
        """Whether every drift is inside the tolerance."""
        return self.max_drift_mm <= self.tolerance_mm
