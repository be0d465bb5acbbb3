"""How a tip moves when the tool turns on the spot: the offset, and what is not offset.

With z = exp(iU), what a camera sees of the tip about the flange is

    c + t z + e conj(z) + s z^2

c is where the camera believes the axis to be off; t is the constant offset that a tool holds,
and for a tip on the axis its runout; e makes the circle an ellipse (camera scale, or a tilted
view), and s comes from a bearing or a bent shaft. Only t belongs into a tool
(docs/reference/calibration.md 2.8).

Few angles cannot tell them apart: at 0 and 180 degrees conj(z) is z. The offset is then that of
a round circle, and the report says that a wobble would not show (docs/reference/evidence.md 9).

A table of where a tip lies at each angle: what a constant offset leaves of a runout.

A pick nozzle on a spindle that wobbles has no single offset. X and Y of the tool are the constant
part; the table says, angle by angle, how far beside that the tip really is, so that a program can
take it back before it places a part. Between two angles it is interpolated along a straight line,
which for an ellipse or a second harmonic of amplitude a, in steps h, is off by up to a (1 - cos h):
a seventh of it at 30 degrees (docs/reference/evidence.md 9).
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from robolink.calibration.camera.camera_model import CameraModel, Sighting, check_sightings
from robolink.calibration.camera.camera_round import CAMERA_MOVED_MM, CameraRound
from robolink.calibration.camera.camera_uncertainty import camera_sources
from robolink.calibration.core.dispersion import Dispersion, interval_of
from robolink.calibration.core.least_squares import Floats, LinearFit, linear_fit
from robolink.calibration.core.pose_checks import (
    MIN_ROTATION_DEG,
    check_planar,
    components,
    refuses_by_name,
    require_poses,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import f_quantile
from robolink.calibration.flange_plane import FlangePlane, standing_upright
from robolink.calibration.pin.n_angle import Complexes
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import ToolOffset

WOBBLE_QUANTILE = 0.995
"""Quantile of F, for each of two amplitudes: a true circle is reported as a wobble in 1 % of cases.
"""

_HARMONICS = 4

_RANK_BELOW = 1e-6

_BADLY_TOLD_APART = 100.0
"""Largest condition number of a design; above it the angles are too close together, and errors look
like wobble."""

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


@refuses_by_name
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
    # Four sightings fit exactly and leave no residual that separates a wobble from noise.
    if told_apart and len(seen) > _HARMONICS:
        design = _terms([np.ones_like(z), z, z.conj(), z**2])
        full = _harmonics(seen, design)
    upside_down = FlangePlane.of(sightings[0].flange).r33 < 0
    # The columns are X of all sightings, then Y of all sightings.
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
        # The scatter of these sightings, even if one is stated: only this keeps the false-alarm
        # rate.
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
    """Return how many of the four terms some angles separate, and whether all of them well."""
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


LARGEST_GAP_DEG = 60.0
"""Largest gap between neighbouring angles around the circle; with a larger gap, half of a wobble
could stay unseen."""

LEAST_LOOKS = 8


@dataclass(frozen=True, slots=True)
class RunoutRow:
    """How far, in base axes, the tip is from where X and Y of the tool put it, at one flange U."""

    u_deg: float
    dx_mm: float
    dy_mm: float


@dataclass(frozen=True, slots=True)
class RunoutTable:
    """Rows by angle, ascending within 0 to 360."""

    rows: tuple[RunoutRow, ...]

    @classmethod
    def of(cls, rows: Iterable[RunoutRow]) -> "RunoutTable":
        """Return the table of some rows; rows of one angle are averaged."""
        groups: list[list[RunoutRow]] = []
        for row in sorted(rows, key=lambda row: row.u_deg % 360.0):
            if groups and row.u_deg % 360.0 - groups[-1][0].u_deg % 360.0 <= _SAME_ANGLE_DEG:
                groups[-1].append(row)
            else:
                groups.append([row])
        return cls(tuple(map(_mean, groups)))

    @property
    def largest_gap_deg(self) -> float:
        """The widest step between neighbouring angles, round the circle."""
        angles = [row.u_deg for row in self.rows]
        following = [*angles[1:], angles[0] + 360.0]
        return max(b - a for a, b in zip(angles, following, strict=True))

    @property
    def peak_mm(self) -> float:
        """The largest distance of the tip from where the tool's X and Y put it."""
        return max(math.hypot(row.dx_mm, row.dy_mm) for row in self.rows)

    def at(self, u_deg: float) -> tuple[float, float]:
        """Return how far off the tip is at an angle, base X and Y in mm.

        A flange that goes by the opposite has the tip where X and Y of the tool say.
        """
        angle, last = u_deg % 360.0, self.rows[-1]
        before = RunoutRow(last.u_deg - 360.0, last.dx_mm, last.dy_mm)
        for row in (*self.rows, RunoutRow(self.rows[0].u_deg + 360.0, *_place(self.rows[0]))):
            if angle <= row.u_deg:
                share = (angle - before.u_deg) / (row.u_deg - before.u_deg)
                return (
                    before.dx_mm + share * (row.dx_mm - before.dx_mm),
                    before.dy_mm + share * (row.dy_mm - before.dy_mm),
                )
            before = row
        return _place(last)

    def plain(self) -> list[dict[str, float]]:
        """Return the rows for JSON."""
        return [{"u_deg": r.u_deg, "dx_mm": r.dx_mm, "dy_mm": r.dy_mm} for r in self.rows]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunoutTableResult(CameraRound):
    """A tool offset, and the runout that is left at each angle.

    Attributes:
        table: That.
        wobble: Whether ellipse or second harmonic are more than noise.
        between_mm: By how much the straight line between two rows may miss the wobble.
    """

    table: RunoutTable
    wobble: bool
    between_mm: float = 0.0

    @property
    def held_to_table_mm(self) -> float:
        """How far off the table may be between its rows."""
        return self.between_mm

    def details(self) -> dict[str, object]:
        """Return the table, and the camera's error."""
        return {
            **CameraRound.details(self),
            "runout_table": self.table.plain(),
            "runout_peak_mm": self.table.peak_mm,
            "wobble": self.wobble,
        }


@refuses_by_name
def solve_runout_table(
    sightings: Sequence[Sighting],
    *,
    stored: ToolOffset | None = None,
    sigma_mm: float | None = None,
    camera: CameraModel | None = None,
) -> RunoutTableResult:
    """Return the constant offset of a tip and the table of its runout.

    Args:
        sightings: Eight and more, all round, in steps of 60 degrees at most; the flange may stand
            anywhere, upright or upside down.
        stored: The offset stored now; Z, U, V and W are kept from it, or 0 without one.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        camera: The camera, where it is known what its pixels mean.

    What the tip does at all angles alike in the base cannot be told from the camera's own error
    and is taken for that.

    Raises:
        CalibrationError: ``too_few_poses``, ``angles_too_far_apart``, and those of
            :func:`runout_report`.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import Sighting, solve_runout_table
        >>> from robolink.model import rotate_xy
        >>> looks = []
        >>> for u_deg in range(-180, 180, 30):
        ...     dx_mm, dy_mm = rotate_xy(12.3, -3.7, u_deg)
        ...     looks.append(Sighting(Pose(300, 100, -60, u_deg), 300 + dx_mm, 100 + dy_mm))
        >>> found = solve_runout_table(looks, sigma_mm=0.01)
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3), found.wobble
        (12.3, -3.7, False)
    """
    require_poses(len(sightings), LEAST_LOOKS)
    report = runout_report(sightings, sigma_mm=sigma_mm)
    table = RunoutTable.of(_row(sighting, report) for sighting in sightings)
    if table.largest_gap_deg > LARGEST_GAP_DEG + _SAME_ANGLE_DEG:
        raise CalibrationError(
            "angles_too_far_apart",
            tr(
                "Between two looks the tool turned by {gap:.1f} degrees.", gap=table.largest_gap_deg
            ),
            remedy=tr(
                "Look over a full turn, at least every {limit:g} degrees of U.",
                limit=LARGEST_GAP_DEG,
            ),
        )
    plain = _result(sightings, report, stored, sigma_mm, camera)
    values = {field.name: getattr(plain, field.name) for field in fields(CalibrationResult)}
    return RunoutTableResult(
        **values,
        camera_error_mm=report.centre_mm,
        table=table,
        wobble=report.harmonics_matter,
        between_mm=_missed_mm(report, table.largest_gap_deg),
    )


def _missed_mm(report: RunoutReport, gap_deg: float) -> float:
    """Return how far half way between two rows lies from the line that joins them, at most."""
    half = math.radians(gap_deg) / 2
    ellipse_mm, second_mm = report.ellipse_mm or 0.0, report.second_mm or 0.0
    return ellipse_mm * (1 - math.cos(half)) + second_mm * (1 - math.cos(2 * half))


def _row(sighting: Sighting, report: RunoutReport) -> RunoutRow:
    flange, (centre_x, centre_y) = sighting.flange, report.centre_mm
    dx, dy = FlangePlane.of(flange).in_base(*report.tip_mm)
    return RunoutRow(
        flange.u_deg,
        sighting.x_mm - flange.x_mm - centre_x - dx,
        sighting.y_mm - flange.y_mm - centre_y - dy,
    )


def _result(
    sightings: Sequence[Sighting],
    report: RunoutReport,
    stored: ToolOffset | None,
    sigma_mm: float | None,
    camera: CameraModel | None,
) -> CalibrationResult:
    scatter = Dispersion.of(report.noise_mm2, report.dof, sigma_mm)
    variance = (scatter.sigma_mm * report.sigma_gain) ** 2 if scatter else 0.0
    x_mm, y_mm = report.tip_mm
    moved = max(map(abs, report.centre_mm)) > CAMERA_MOVED_MM
    # The wobble is the measurement here, so it raises no doubt.
    warnings = tuple(code for code in report.warnings if code != "wobble")
    distances = [math.hypot(*residual) for residual in report.residuals_mm]
    return CalibrationResult(
        method="runout-table",
        **components(stored, x_mm=x_mm, y_mm=y_mm),
        reference_point_mm=(),
        sigma_gain=report.sigma_gain,
        warnings=(*warnings, "camera_moved") if moved else warnings,
        inputs=tuple(sighting.flange for sighting in sightings),
        **interval_of(scatter, (variance, variance), 2),
        sigma_mm=scatter.sigma_mm if scatter else None,
        sigma_stated=sigma_mm is not None,
        rms_mm=report.rms_after_mm if report.dof else None,
        max_residual_mm=max(distances) if report.dof else None,
        residuals_mm=report.residuals_mm,
        rank=report.rank,
        dof=report.dof,
        interval_from=scatter.source if scatter else "",
        sources=camera_sources(sightings, report.gains, camera=camera, finds_place=True),
    )


def _mean(rows: list[RunoutRow]) -> RunoutRow:
    count = len(rows)
    return RunoutRow(
        rows[0].u_deg % 360.0,
        math.fsum(row.dx_mm for row in rows) / count,
        math.fsum(row.dy_mm for row in rows) / count,
    )


def _place(row: RunoutRow) -> tuple[float, float]:
    return row.dx_mm, row.dy_mm
