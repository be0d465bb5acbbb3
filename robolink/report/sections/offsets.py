"""The offset before and after: what was measured apart from what was kept."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink.model import angle_difference_deg
from robolink.report._values import Report

NAMES: Final = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")
AXES: Final = ("X mm", "Y mm", "Z mm", "U deg", "V deg", "W deg")


@dataclass(frozen=True, slots=True)
class OffsetComponent:
    """One component of the offset; ``None`` stands for what is not known.

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
        """Whether any of them is known to be repeatable to something."""
        return any(one.half95 is not None for one in self.own)

    @property
    def accurate(self) -> bool:
        """Whether any of them is known to be accurate to something."""
        return any(one.accurate95 is not None for one in self.own)


def offsets(report: Report) -> OffsetTables | None:
    """Return the tables of the offset, ``None`` where the values are not on record."""
    if not report.compared:
        return None
    components = tuple(_components(report))
    if not report.determined:
        # Neither a measurement nor typed components are on record: all that is known changed.
        return OffsetTables(components, tr("Offset"), (), "")
    own = tuple(
        one for one, name in zip(components, NAMES, strict=True) if name in report.determined
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
    for name, axis, old, new in zip(NAMES, AXES, before, after, strict=True):
        change = None
        if old is not None and new is not None:
            change = angle_difference_deg(new, old) if name.endswith("deg") else new - old
        if fit is not None and name in fit.changed:
            axis = tr("{axis} (only its change is known)", axis=axis)
        yield OffsetComponent(axis, old, new, change, halves.get(name), wider.get(name))
