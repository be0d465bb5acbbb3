"""Where taught points lead afterwards: sentences and the table."""

from collections.abc import Iterator
from typing import Final

from robolink.calibration import Impact, PointImpact
from robolink.messages import tr
from robolink.report._values import Report

_SAME_MM: Final = 1e-6


def absence(report: Report) -> str:
    """Return why nothing is shown, for a report without taught points."""
    if report.before is None:
        return tr("The tool was undefined: no program can have driven to a point with it.")
    return tr("No taught points were named, so where they lead afterwards is not shown.")


def moves_nothing(impact: Impact) -> bool:
    """Tell whether the tip stays where it is at every point."""
    return impact.largest is not None and impact.largest.distance_mm < _SAME_MM


def is_alike(impact: Impact) -> bool:
    """Tell whether the tip moves equally far at every point, and sideways."""
    largest = impact.largest
    if largest is None or not impact.alike:
        return False
    return abs(largest.dx_mm) > _SAME_MM or abs(largest.dy_mm) > _SAME_MM


def values_of(entry: PointImpact) -> tuple[float, ...]:
    """Return the figures of a point's row."""
    pose = entry.pose
    return (
        *(pose.x_mm, pose.y_mm, pose.z_mm, pose.u_deg),
        *(entry.dx_mm, entry.dy_mm, entry.dz_mm, entry.turn_deg, entry.distance_mm),
    )


def left_out(impact: Impact) -> Iterator[str]:
    """Yield which points could not be judged, and why."""
    if impact.undefined:
        yield tr("Not taught, skipped: {count}.", count=len(impact.undefined))
    if impact.other_local:
        named = ", ".join(f"P{n} (local {local})" for n, local in impact.other_local.items())
        yield tr("In another local, left out: {points}.", points=named)
