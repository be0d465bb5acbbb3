"""How a tip moves when the tool turns on the spot: offset, and what is no offset.

With z = exp(iU), what a camera sees of the tip about the flange is

    c + t z + e conj(z) + s z^2

c is where the camera believes the axis to be off; t is the constant offset that a tool holds,
and for a tip on the axis its runout; e makes the circle an ellipse (camera scale, or a tilted
view), and s comes from a bearing or a bent shaft. Only t belongs into a tool
(docs/reference/calibration.md 2.8).

Few angles cannot tell them apart: at 0 and 180 degrees conj(z) is z. The offset is then that of
a round circle, and the report says that a wobble would not show (docs/reference/evidence.md 9).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robolink.calibration.camera.sighting import Sighting, check_sightings
from robolink.calibration.core.dispersion import Dispersion
from robolink.calibration.core.least_squares import LinearFit, linear_fit
from robolink.calibration.core.pose_checks import MIN_ROTATION_DEG, check_planar
from robolink.calibration.core.robust import Floats
from robolink.calibration.core.statistics import f_quantile
from robolink.calibration.flange_plane import FlangePlane, standing_upright
from robolink.calibration.pin.planar import Complexes

WOBBLE_QUANTILE = 0.995
"""Of F, for each of two amplitudes: a round circle is said to wobble in 1 % of the cases."""

_HARMONICS = 4

_RANK_BELOW = 1e-6

_BADLY_TOLD_APART = 100.0
"""Condition above which angles are too near each other, so that errors come out as wobble."""

_SAME_ANGLE_DEG = 0.01

_ROUNDING_MM = 1e-9


@dataclass(frozen=True, slots=True)
class RunoutReport:
    """What turning on the spot shows, mm.

    Attributes:
        tip_mm: The constant offset (first harmonic), x and y in the flange's axes.
        half_width95_mm: Half its 95 % interval, ``None`` when nothing tells the scatter.
        centre_mm: By how much the camera's place for the axis is off, base axes.
        ellipse_mm: Amplitude of the ellipse, ``None`` with too few sightings or angles.
        second_mm: Amplitude of the second harmonic, likewise.
        amplitude_limit_mm: An amplitude beyond this is no noise, ``None`` without a test.
        rms_mm: Of what the constant offset leaves.
        peak_mm: The largest of it.
        rms_after_mm: Of what all harmonics together leave.
        residuals_mm: What they leave of each sighting, base axes.
        noise_mm2: The sum of the squares of that.
        dof: Degrees of freedom behind it.
        gains: By how much X and Y of the tip change with X and Y of each sighting.
        sigma_gain: Standard deviation of X or Y of the tip as a multiple of a sighting's.
        harmonics_matter: Whether they explain what the offset leaves, beyond the noise.
        distinct_angles: How many angles there are, modulo 360.
        rank: How many of the four terms they tell apart.
        warnings: Named doubts: ``wobble``, ``wobble_not_identifiable``, ``small_rotation``.
    """

    tip_mm: tuple[float, float]
    half_width95_mm: float | None
    centre_mm: tuple[float, float]
    ellipse_mm: float | None
    second_mm: float | None
    amplitude_limit_mm: float | None
    rms_mm: float
    peak_mm: float
    rms_after_mm: float | None
    residuals_mm: tuple[tuple[float, ...], ...]
    noise_mm2: float
    dof: int
    gains: tuple[tuple[float, ...], ...]
    sigma_gain: float
    harmonics_matter: bool
    distinct_angles: int
    rank: int
    warnings: tuple[str, ...]

    @property
    def runout_mm(self) -> float:
        """Distance of the tip from the axis."""
        return math.hypot(*self.tip_mm)


def runout_report(sightings: Sequence[Sighting], *, sigma_mm: float | None = None) -> RunoutReport:
    """Return offset and wobble of a tip that was seen at several angles.

    Args:
        sightings: At least four; the flange may stand anywhere, upright
            or upside down.
        sigma_mm: Standard deviation of one coordinate of one sighting, when it is known.

    Raises:
        CalibrationError: ``too_few_poses``, ``insufficient_rotation``, ``degenerate_angles``,
            ``tilted_pose``, ``tool_pose``, ``local_pose`` and those of ``pose_checks.check_poses``.
        ConfigError: ``sigma_mm`` is not positive.
    """
    check_sightings(tuple(sightings))
    flanges = standing_upright([sighting.flange for sighting in sightings])
    warnings = check_planar(
        flanges, minimum=4, min_rotation_deg=MIN_ROTATION_DEG, allow_mixed_hand=False
    )
    seen = np.array([complex(s.x_mm - s.flange.x_mm, s.y_mm - s.flange.y_mm) for s in sightings])
    angles_deg = [flange.u_deg for flange in flanges]
    z = np.exp(1j * np.radians(angles_deg))
    distinct = _distinct(angles_deg)
    rank, told_apart = _told_apart(distinct)
    if not told_apart:
        warnings = (*warnings, "wobble_not_identifiable")
    design = _terms([np.ones_like(z), z])
    plain = _harmonics(seen, design)
    full = None
    # With four sightings everything fits, and nothing is left to tell a wobble from noise.
    if told_apart and len(seen) > _HARMONICS:
        design = _terms([np.ones_like(z), z, z.conj(), z**2])
        full = _harmonics(seen, design)
    upside_down = FlangePlane.of(sightings[0].flange).r33 < 0
    # Columns are X of all sightings, then Y.
    gains = (full or plain).gains(design)[2:4].reshape(2, 2, -1).transpose(0, 2, 1).reshape(2, -1)
    gains[1] *= -1.0 if upside_down else 1.0
    return _report(
        plain,
        full,
        sigma_mm,
        mirror=upside_down,
        counts=(len(distinct), rank),
        gains=gains,
        warnings=warnings,
    )


def _report(
    plain: LinearFit,
    full: LinearFit | None,
    sigma_mm: float | None,
    *,
    mirror: bool,
    counts: tuple[int, int],
    gains: Floats,
    warnings: tuple[str, ...],
) -> RunoutReport:
    best, left = full or plain, plain.residuals.reshape(2, -1)
    noise, dof = float(best.residuals @ best.residuals), best.residuals.size - len(best.x)
    scatter = Dispersion.of(noise, dof, sigma_mm)
    amplitudes = [math.hypot(*best.x[k : k + 2].tolist()) for k in range(4, len(best.x), 2)]
    limit = None
    if full is not None:
        # The scatter of these sightings, stated or not: only so is the share of false alarms kept.
        gain = math.sqrt(
            2 * f_quantile(WOBBLE_QUANTILE, 2, dof) * float(full.unit_covariance[4, 4])
        )
        limit = gain * math.sqrt(noise / dof)
    matters = limit is not None and max(amplitudes) > max(limit, _ROUNDING_MM)
    centre_x, centre_y, x, y = best.x[:4].tolist()
    gain = math.sqrt(float(best.unit_covariance[2, 2]))
    distinct, rank = counts
    return RunoutReport(
        tip_mm=(x, -y if mirror else y),
        half_width95_mm=scatter.factor95 * scatter.sigma_mm * gain if scatter else None,
        centre_mm=(centre_x, centre_y),
        ellipse_mm=amplitudes[0] if amplitudes else None,
        second_mm=amplitudes[1] if amplitudes else None,
        amplitude_limit_mm=limit,
        rms_mm=math.sqrt(float((left**2).sum()) / left.shape[1]),
        peak_mm=float(np.hypot(*left).max()),
        rms_after_mm=math.sqrt(noise / left.shape[1]) if full else None,
        residuals_mm=tuple(map(tuple, best.residuals.reshape(2, -1).T.tolist())),
        noise_mm2=noise,
        dof=dof,
        gains=tuple(map(tuple, gains.tolist())),
        sigma_gain=gain,
        harmonics_matter=matters,
        distinct_angles=distinct,
        rank=rank,
        warnings=(*warnings, "wobble") if matters else warnings,
    )


def _distinct(angles_deg: Sequence[float]) -> list[float]:
    """Return the angles modulo 360, those that agree within the encoder's noise once."""
    found: list[float] = []
    for angle in sorted(angle % 360.0 for angle in angles_deg):
        if not found or angle - found[-1] > _SAME_ANGLE_DEG:
            found.append(angle)
    if len(found) > 1 and found[0] + 360.0 - found[-1] <= _SAME_ANGLE_DEG:
        found.pop()
    return found


def _told_apart(angles_deg: Sequence[float]) -> tuple[int, bool]:
    """Return how many of the four terms some angles tell apart, and whether all of them well."""
    z = np.exp(1j * np.radians(angles_deg))
    columns = np.column_stack((np.ones_like(z), z, z.conj(), z**2))
    sizes = np.linalg.svd(columns, compute_uv=False)
    rank = int((sizes > _RANK_BELOW).sum())
    return rank, rank == _HARMONICS and bool(sizes[0] <= _BADLY_TOLD_APART * sizes[-1])


def _terms(terms: Sequence[Complexes]) -> Floats:
    """Return a design of complex amplitudes.

    Unknowns alternate real and imaginary part, rows are X of all sightings, then Y.
    """
    return np.hstack(
        [
            np.vstack((np.column_stack((t.real, -t.imag)), np.column_stack((t.imag, t.real))))
            for t in terms
        ]
    )


def _harmonics(seen: Complexes, design: Floats) -> LinearFit:
    return linear_fit(design, np.concatenate((seen.real, seen.imag)))
