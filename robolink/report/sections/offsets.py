"""The offset before and after: measured components apart from kept ones."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from robolink.calibration import Impact, PointImpact
from robolink.messages import tr
from robolink.model import COMPONENTS, angle_difference_deg
from robolink.report._values import Report

AXES: Final = ("X mm", "Y mm", "Z mm", "U deg", "V deg", "W deg")


@dataclass(frozen=True, slots=True)
class OffsetComponent:
    """One component of the offset; ``None`` is unknown.

    Attributes:
        axis: Its name and unit.
        before: What is or was stored.
        after: What is proposed or written.
        change: By how much they differ.
        half95: What it is repeatable to alone, half its 95 % interval.
        accurate95: What it is accurate to alone, likewise.
    """

    axis: str
    before: float | None
    after: float | None
    change: float | None
    half95: float | None
    accurate95: float | None = None


@dataclass(frozen=True, slots=True)
class OffsetTables:
    """The components in two tables.

    Attributes:
        own: Those that were measured, or typed.
        own_title: Which of both.
        kept: The others.
        kept_title: What they are.
    """

    own: tuple[OffsetComponent, ...]
    own_title: str
    kept: tuple[OffsetComponent, ...]
    kept_title: str

    @property
    def intervals(self) -> bool:
        """Whether the repeatability of any of them is known."""
        return any(one.half95 is not None for one in self.own)

    @property
    def accurate(self) -> bool:
        """Whether the accuracy of any of them is known."""
        return any(one.accurate95 is not None for one in self.own)


def offsets(report: Report) -> OffsetTables | None:
    """Return the tables of the offset, ``None`` if the values are not recorded."""
    if not report.compared:
        return None
    components = tuple(_components(report))
    if not report.determined:
        # Neither a measurement nor typed components are recorded: list all that changed.
        return OffsetTables(components, tr("Offset"), (), "")
    own = tuple(
        one for one, name in zip(components, COMPONENTS, strict=True) if name in report.determined
    )
    kept = tuple(one for one in components if one not in own)
    if report.method is None:
        return OffsetTables(own, tr("Given"), kept, tr("As stored, not given"))
    return OffsetTables(own, tr("Measured"), kept, tr("Kept, not measured"))


def _components(report: Report) -> Iterator[OffsetComponent]:
    before = [None] * 6 if report.before is None else report.before.components()
    after = [None] * 6 if report.after is None else report.after.components()
    fit = report.fit
    halves = {} if fit is None else dict(zip(fit.measured, fit.half_width95, strict=False))
    accuracy = None if fit is None else fit.accuracy
    wider = (
        {}
        if fit is None or accuracy is None or report.widened_mm is not None
        else dict(zip(fit.measured, accuracy.half_width95, strict=False))
    )
    for name, axis, old, new in zip(COMPONENTS, AXES, before, after, strict=True):
        change = None
        if old is not None and new is not None:
            change = angle_difference_deg(new, old) if name.endswith("deg") else new - old
        if fit is not None and name in fit.changed:
            axis = tr("{axis} (only its change is known)", axis=axis)
        yield OffsetComponent(axis, old, new, change, halves.get(name), wider.get(name))


_SAME_MM: Final = 1e-6


def absence(report: Report) -> str:
    """Return why nothing is shown, for a report without taught points."""
    if report.before is None:
        return tr("The tool was undefined: no program can have driven to a point with it.")
    return tr("No taught points were named, so this page shows none.")


def moves_nothing(impact: Impact) -> bool:
    """Return whether the tip does not move at any point."""
    return impact.largest is not None and impact.largest.distance_mm < _SAME_MM


def is_alike(impact: Impact) -> bool:
    """Return whether the tip moves equally far at every point, and sideways."""
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
        yield tr("In another local coordinate system, left out: {points}.", points=named)
