"""A table of where a tip lies at each angle: what a constant offset leaves of a runout.

A pick nozzle on a spindle that wobbles has no single offset. X and Y of the tool are the constant
part; the table says, angle by angle, how far beside that the tip really is, so that a program can
take it back before it places a part. Between two angles it is interpolated along a straight line,
which for an ellipse or a second harmonic of amplitude a, in steps h, is off by up to a (1 - cos h):
a seventh of it at 30 degrees (docs/reference/evidence.md 9).
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

from robolink.calibration.camera.camera_model import CameraModel
from robolink.calibration.camera.camera_round import CAMERA_MOVED_MM, CameraRound
from robolink.calibration.camera.camera_uncertainty import camera_sources
from robolink.calibration.camera.runout import RunoutReport, runout_report
from robolink.calibration.camera.sighting import Sighting
from robolink.calibration.core.dispersion import Dispersion
from robolink.calibration.core.pose_checks import keep_unmeasured, require_poses
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.flange_plane import FlangePlane
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import ToolOffset

LARGEST_GAP_DEG = 60.0
"""Between neighbouring angles, round the circle; beyond it half of a wobble stays unseen."""

LEAST_LOOKS = 8

_SAME_ANGLE_DEG = 0.01

_KEPT = ("z_mm", "u_deg", "v_deg", "w_deg")


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
        """Return the table of some rows; several of one angle become their mean."""
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
        """The farthest that the tip is from where the tool's X and Y put it."""
        return max(math.hypot(row.dx_mm, row.dy_mm) for row in self.rows)

    def at(self, u_deg: float) -> tuple[float, float]:
        """Return how far the tip is beside at an angle, base X and Y in mm.

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
    """A tool offset, and what it leaves at each angle.

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
        """Return the table, and what the camera is off by."""
        return {
            **CameraRound.details(self),
            "runout_table": self.table.plain(),
            "runout_peak_mm": self.table.peak_mm,
            "wobble": self.wobble,
        }


def solve_runout_table(
    sightings: Sequence[Sighting],
    *,
    stored: ToolOffset | None = None,
    sigma_mm: float | None = None,
    camera: CameraModel | None = None,
) -> RunoutTableResult:
    """Return the constant offset of a tip and the table of what it leaves.

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
                "Look all round, at least every {limit:g} degrees of U.", limit=LARGEST_GAP_DEG
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
    covariance: tuple[tuple[float, ...], ...] = ()
    region_mm = None
    if scatter is not None:
        variance = (scatter.sigma_mm * report.sigma_gain) ** 2
        covariance = ((variance, 0.0), (0.0, variance))
        region_mm = scatter.region_mm(variance, 2)
    x_mm, y_mm = report.tip_mm
    moved = max(map(abs, report.centre_mm)) > CAMERA_MOVED_MM
    # A wobble is what is measured here, so it is no doubt.
    warnings = tuple(code for code in report.warnings if code != "wobble")
    distances = [math.hypot(*residual) for residual in report.residuals_mm]
    return CalibrationResult(
        method="runout-table",
        offset=keep_unmeasured(stored, x_mm=x_mm, y_mm=y_mm),
        measured=("x_mm", "y_mm"),
        kept=_KEPT,
        reference_point_mm=(),
        sigma_gain=report.sigma_gain,
        warnings=(*warnings, "camera_moved") if moved else warnings,
        inputs=tuple(sighting.flange for sighting in sightings),
        covariance=covariance,
        half_width95=scatter.half_widths(covariance) if scatter else (),
        sigma_mm=scatter.sigma_mm if scatter else None,
        sigma_stated=sigma_mm is not None,
        rms_mm=report.rms_after_mm if report.dof else None,
        max_residual_mm=max(distances) if report.dof else None,
        residuals_mm=report.residuals_mm,
        rank=report.rank,
        dof=report.dof,
        unobservable=_KEPT,
        interval_from=scatter.source if scatter else "",
        region95_radius_mm=region_mm,
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
