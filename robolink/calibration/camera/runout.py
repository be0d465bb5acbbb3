"""How a tip moves when the tool turns on the spot: offset, and what is no offset.

With z = exp(iU), what a camera sees of the tip about the flange is

    c + t z + e conj(z) + s z^2

c is where the camera believes the axis to be off; t is the constant offset that a tool holds,
and for a tip on the axis its runout; e makes the circle an ellipse (camera scale, or a tilted
view), and s comes from a bearing or a bent shaft. Only t belongs into a tool
(docs/reference/calibration.md 2.8).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robolink.calibration.camera.up_camera import Sighting, check_sightings
from robolink.calibration.core.dispersion import Dispersion
from robolink.calibration.core.least_squares import LinearFit, linear_fit
from robolink.calibration.core.planar_checks import check_planar
from robolink.calibration.pin.planar import Complexes

HARMONICS_FROM = 8
"""Sightings from which on ellipse and second harmonic are looked for."""

SIGNIFICANT = 3.0

_BENT_ARC_DEG = 180.0


@dataclass(frozen=True, slots=True)
class RunoutReport:
    """What turning on the spot shows, mm.

    Attributes:
        tip_mm: The constant offset (first harmonic), x and y in the flange's axes.
        half_width95_mm: Half its 95 % interval, ``None`` when nothing tells the scatter.
        centre_mm: By how much the camera's place for the axis is off, base axes.
        ellipse_mm: Amplitude of the ellipse, ``None`` with too few sightings.
        second_mm: Amplitude of the second harmonic, likewise.
        rms_mm: Of what the constant offset leaves.
        peak_mm: The largest of it.
        rms_after_mm: Of what all harmonics together leave.
        harmonics_matter: Whether they explain what the offset leaves, beyond the noise.
        warnings: Named doubts.
    """

    tip_mm: tuple[float, float]
    half_width95_mm: float | None
    centre_mm: tuple[float, float]
    ellipse_mm: float | None
    second_mm: float | None
    rms_mm: float
    peak_mm: float
    rms_after_mm: float | None
    harmonics_matter: bool
    warnings: tuple[str, ...]

    @property
    def runout_mm(self) -> float:
        """Distance of the tip from the axis."""
        return math.hypot(*self.tip_mm)


def runout_report(sightings: Sequence[Sighting], *, sigma_mm: float | None = None) -> RunoutReport:
    """Return offset and wobble of a tip that was seen at several angles.

    Args:
        sightings: At least four, over half a turn or more; the flange may stand anywhere.
        sigma_mm: Standard deviation of one coordinate of one sighting, when it is known.

    Raises:
        CalibrationError: ``too_few_poses``, ``insufficient_rotation``, ``degenerate_angles``
            and those of ``pose_checks.check_poses``.
        ConfigError: ``sigma_mm`` is not positive.
    """
    flanges = [sighting.flange for sighting in sightings]
    warnings = check_planar(
        flanges, minimum=4, min_rotation_deg=_BENT_ARC_DEG, allow_mixed_hand=False
    )
    check_sightings(tuple(sightings))
    seen = np.array([complex(s.x_mm - s.flange.x_mm, s.y_mm - s.flange.y_mm) for s in sightings])
    z = np.exp(1j * np.radians([flange.u_deg for flange in flanges]))
    plain = _harmonics(seen, [np.ones_like(z), z])
    left = plain.residuals.reshape(2, -1)
    total, dof = float((left**2).sum()), 2 * len(seen) - 4
    full = None
    if len(seen) >= HARMONICS_FROM:
        full = _harmonics(seen, [np.ones_like(z), z, z.conj(), z**2])
        noise, spare = float(full.residuals @ full.residuals), 2 * len(seen) - 8
    else:
        noise, spare = total, dof
    scatter = Dispersion.of(noise, spare, sigma_mm)
    best = full or plain
    amplitudes = [math.hypot(*best.x[k : k + 2].tolist()) for k in range(4, len(best.x), 2)]
    matters = bool(
        amplitudes
        and scatter
        and max(amplitudes) > SIGNIFICANT * scatter.sigma_mm * math.sqrt(best.unit_covariance[4, 4])
    )
    gain = math.sqrt(float(best.unit_covariance[2, 2]))
    return RunoutReport(
        tip_mm=(float(best.x[2]), float(best.x[3])),
        half_width95_mm=scatter.factor95 * scatter.sigma_mm * gain if scatter else None,
        centre_mm=(float(best.x[0]), float(best.x[1])),
        ellipse_mm=amplitudes[0] if amplitudes else None,
        second_mm=amplitudes[1] if amplitudes else None,
        rms_mm=math.sqrt(total / len(seen)),
        peak_mm=float(np.hypot(*left).max()),
        rms_after_mm=math.sqrt(noise / len(seen)) if full else None,
        harmonics_matter=matters,
        warnings=(*warnings, "wobble") if matters else warnings,
    )


def _harmonics(seen: Complexes, terms: Sequence[Complexes]) -> LinearFit:
    """Fit complex amplitudes; unknowns alternate real and imaginary part, rows are x then y."""
    a = np.hstack(
        [
            np.vstack((np.column_stack((t.real, -t.imag)), np.column_stack((t.imag, t.real))))
            for t in terms
        ]
    )
    return linear_fit(a, np.concatenate((seen.real, seen.imag)))
