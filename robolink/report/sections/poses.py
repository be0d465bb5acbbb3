"""The poses of the measurement, in the order in which they were taken, with their residuals."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.model import COMPONENTS, Pose
from robolink.report._values import Report
from robolink.report.sections.offsets import AXES


@dataclass(frozen=True, slots=True)
class PoseRow:
    """One pose.

    Attributes:
        name: Its number from 1, and what it is beside a touch.
        values: Its coordinates, as the columns of the table say.
        hand: Its arm configuration; ``None`` where the table has no such column.
        residual: Its residual in base axes; empty for none.
        distance_mm: The length of that, ``None`` for none.
        left_out: Whether the fit left it out.
    """

    name: str
    values: tuple[float, ...]
    hand: str | None
    residual: tuple[float, ...]
    distance_mm: float | None
    left_out: bool


@dataclass(frozen=True, slots=True)
class PoseRows:
    """A table of poses.

    Attributes:
        title: What they are.
        why: What was wrong with them, empty where they were used.
        columns: Heads of the table, after the one of the names.
        rows: The poses.
        residuals: Whether they have residuals.
    """

    title: str
    why: str
    columns: tuple[str, ...]
    rows: tuple[PoseRow, ...]
    residuals: bool


def pose_tables(report: Report) -> list[PoseRows]:
    """Return the poses of the measurement, and those of refused measurements."""
    tables = []
    if report.poses:
        # A measurement that does not determine Z needs no height; typed poses have none.
        heights = report.record is not None or "z_mm" in report.determined
        title = tr("Poses of the flange that it was computed from")
        tables.append(_table(title, "", report.poses, report.fit, heights=heights))
    for attempt in report.attempts:
        if attempt.poses:
            title = tr("Poses of a measurement that was refused")
            tables.append(_table(title, attempt.why, attempt.poses, None, heights=True))
    return tables


def _table(
    title: str, why: str, poses: Sequence[Pose], fit: CalibrationResult | None, *, heights: bool
) -> PoseRows:
    names = ["x_mm", "y_mm", *(["z_mm"] if heights else []), "u_deg"]
    names += [name for name in ("v_deg", "w_deg") if any(getattr(pose, name) for pose in poses)]
    handed = any(pose.hand for pose in poses)
    residuals = fit.residuals_mm if fit else ()
    columns = [AXES[COMPONENTS.index(name)] for name in names] + ([tr("hand")] if handed else [])
    if residuals:
        axes = ("Z", "X, Y", "X, Y, Z")[max(map(len, residuals)) - 1]
        columns += [tr("residual {axes} mm", axes=axes), tr("length mm")]
    rows = []
    for number, pose in enumerate(poses):
        residual = tuple(residuals[number]) if number < len(residuals) else ()
        left_out = fit is not None and number in fit.rejected
        rows.append(
            PoseRow(
                name=_named(number, len(poses), fit, left_out=left_out),
                values=tuple(getattr(pose, name) for name in names),
                hand=(str(pose.hand) if pose.hand else "-") if handed else None,
                residual=residual,
                distance_mm=math.hypot(*residual) if residual else None,
                left_out=left_out,
            )
        )
    return PoseRows(title, why, tuple(columns), tuple(rows), bool(residuals))


def _named(number: int, count: int, fit: CalibrationResult | None, *, left_out: bool) -> str:
    """Return the label of a pose: its number from 1, and what it is besides a touch."""
    if left_out:
        return tr("{number} (left out)", number=number + 1)
    six_point = fit is not None and fit.method in ("six-point", "six_point")
    if fit is None or not six_point or number < len(fit.residuals_mm):
        return str(number + 1)
    # The last two show the axes; the one before is where they begin, unless it is a touch.
    part = (tr("where the moves begin"), tr("along X"), tr("second move"))[number - count]
    return tr("{number} ({part})", number=number + 1, part=part)
