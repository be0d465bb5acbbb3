"""What a controller's charts show, in words: a worn nozzle, a slipping mount, a moved pin."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import combinations
from statistics import fmean
from typing import Final

from robolink.calibration import LEAST_BASELINE, stated_mm, student_t
from robolink.deprecation import without_sign
from robolink.drift.charts import Chart, charts_of
from robolink.drift.history import (
    LEVEL,
    MeasuredChange,
    measured_changes,
    shift_is_sure,
    slope_of,
    value_is_unusual,
)
from robolink.messages import tr
from robolink.model import Recorded, is_simulated_name

LEAST_MEASUREMENTS: Final = 6


@dataclass(frozen=True, slots=True)
class MountedTrend:
    """A nozzle that changes.

    Attributes:
        first: Its first measurement.
        count: How many there are.
        moved_mm: By how much, by axis, along the line, mm.
        shorter: Whether it is its length alone, towards the flange.
    """

    first: MeasuredChange
    count: int
    moved_mm: dict[str, float]
    shorter: bool


def mounted_trend(changes: Sequence[MeasuredChange]) -> MountedTrend | None:
    """Return how the mounted nozzle changes, ``None`` if it does not.

    Args:
        changes: The measured changes of one tool, oldest first. A nozzle without an id is not
            known to be the same one, and is not judged.
    """
    nozzle = changes[-1].nozzle if changes else ""
    count = next((i for i, c in enumerate(reversed(changes)) if c.nozzle != nozzle), len(changes))
    mounted = changes[len(changes) - count :]
    if not nozzle:
        return None
    moved, towards_flange = dict[str, float](), False
    for axis in ("x", "y", "z"):
        values = [change.tip_mm[axis] for change in mounted if axis in change.tip_mm]
        if len(values) < LEAST_MEASUREMENTS:
            continue
        slope, steepness = slope_of(values)
        if abs(steepness) > student_t(1 - LEVEL / 2, len(values) - 2):
            moved[axis] = slope * (len(values) - 1)
            towards_flange = axis == "z" and slope * fmean(values) < 0
    if not moved:
        return None
    return MountedTrend(mounted[0], count, moved, shorter=towards_flange and set(moved) == {"z"})


LEAST_SHIFTED: Final = 3
"""Number of successive changes needed to confirm a shift; one alone may be a bad touch."""

_ALIKE_SIGMA: Final = 3.0


class DriftCode(StrEnum):
    """What a chart shows."""

    UNUSUAL_CHANGE = "unusual_change"
    MOUNT_SHIFTED = "mount_shifted"
    LENGTH_SHIFTED = "length_shifted"
    TOOLS_SHIFTED_ALIKE = "tools_shifted_alike"
    NOZZLE_WORN = "nozzle_worn"
    NOZZLE_MOVES = "nozzle_moves"
    PIN_MOVED = "pin_moved"
    TURN_TEST_GROWS = "turn_test_grows"


@dataclass(frozen=True, slots=True)
class DriftFinding:
    """One thing that somebody should look at.

    Attributes:
        code: What it is.
        subject: Numbers of the tools, or name of the station.
        since: Label of the change with which it began.
        change: Id of that change.
        shift_mm: By how much, by axis; a turn test has the axis "".
        sentence: The same for a person.
        remedy: What to do.
    """

    code: DriftCode
    subject: tuple[int | str, ...]
    since: str
    change: str
    shift_mm: Mapping[str, float] = field(hash=False)
    sentence: str
    remedy: str


def findings_in(
    charts: Sequence[Chart], changes: Sequence[MeasuredChange]
) -> tuple[DriftFinding, ...]:
    """Return what the charts of one controller show now; nothing for a steady cell.

    Args:
        charts: Its charts.
        changes: The changes that they were drawn from, oldest first.
    """
    return (
        *_unusual(charts, changes),
        *_sideways(charts),
        *_lengths(charts),
        *_mounted(changes),
        *_pins(charts),
        *_turn_tests(charts),
    )


def _unusual(charts: Sequence[Chart], changes: Sequence[MeasuredChange]) -> Iterator[DriftFinding]:
    """Yield tools whose last change is outside the limits and does not continue a shift."""
    newest = {change.tool: change for change in changes}
    for tool, change in newest.items():
        of_tool = [c for c in charts if c.quantity == "tip" and c.subject == tool]
        out = [c for c in of_tool if c.last.change is change and _is_unusual(c)]
        if not out or any(_has_shifted(c) for c in out):
            continue
        off = {c.axis: c.last.value_mm - c.centre_mm for c in out}
        yield DriftFinding(
            DriftCode.UNUSUAL_CHANGE,
            (tool,),
            change.at,
            change.change,
            off,
            tr(
                "Tool {tool}: the last change is unusual, {off} from the average.",
                tool=tool,
                off=_said(off),
            ),
            tr(
                "Is the right nozzle mounted, clean and tight? Is the pin clean? Measure again to "
                "see whether it stays."
            ),
        )


def _is_unusual(chart: Chart) -> bool:
    before = [point.value_mm for point in chart.counted[:-1]]
    return chart.last.outside and value_is_unusual(before, chart.last.value_mm)


def _sideways(charts: Sequence[Chart]) -> Iterator[DriftFinding]:
    shifted: dict[int | str, list[Chart]] = {}
    for chart in charts:
        if chart.quantity == "tip" and chart.axis in ("x", "y") and _has_shifted(chart):
            shifted.setdefault(chart.subject, []).append(chart)
    alike = _alike(charts, shifted)
    if alike:
        together = [chart for tool in alike for chart in shifted[tool]]
        yield _shift(
            DriftCode.TOOLS_SHIFTED_ALIKE,
            tuple(alike),
            together,
            tr(
                "Tools {tools} have moved alike by {off} on average over the last {count} changes, "
                "since {when}.",
                tools=", ".join(map(str, alike)),
                **_facts(together),
            ),
            tr(
                "Something that they share has moved: the pin, the adapter at the flange, "
                "or the zero of U."
            ),
        )
    for tool, moved in shifted.items():
        if tool not in alike:
            yield _shift(
                DriftCode.MOUNT_SHIFTED,
                (tool,),
                moved,
                tr(
                    "Tool {tool} has moved sideways by {off} on average over the last {count} "
                    "changes, since {when}.",
                    tool=tool,
                    **_facts(moved),
                ),
                tr("The mount may slip: check its screws and pins, then calibrate in full."),
            )


def _alike(charts: Sequence[Chart], shifted: Mapping[int | str, object]) -> list[int | str]:
    """Return the tools, two or more, that moved alike within their scatter."""
    plane = {
        (chart.subject, chart.axis): chart
        for chart in charts
        if chart.quantity == "tip" and chart.axis in ("x", "y") and chart.subject in shifted
    }
    found: dict[int | str, None] = {}
    for one, other in combinations(shifted, 2):
        pairs = [(plane.get((one, axis)), plane.get((other, axis))) for axis in ("x", "y")]
        if all(a is not None and b is not None and _same_shift(a, b) for a, b in pairs):
            found |= {one: None, other: None}
    return list(found)


def _same_shift(a: Chart, b: Chart) -> bool:
    shifts, variance = list[float](), 0.0
    for chart in (a, b):
        since = chart.shifted or chart.judged[-LEAST_SHIFTED:]
        shifts.append(sum(p.value_mm for p in since) / len(since) - chart.centre_mm)
        variance += chart.sigma_mm**2 * (1 / len(since) + 1 / chart.baseline)
    return abs(shifts[0] - shifts[1]) <= _ALIKE_SIGMA * math.sqrt(variance)


def _lengths(charts: Sequence[Chart]) -> Iterator[DriftFinding]:
    for chart in charts:
        if chart.quantity == "tip" and chart.axis == "z" and _has_shifted(chart):
            yield _shift(
                DriftCode.LENGTH_SHIFTED,
                (chart.subject,),
                [chart],
                tr(
                    "The length of tool {tool} has changed: {off} on average over the "
                    "last {count} changes, since {when}.",
                    tool=chart.subject,
                    **_facts([chart]),
                ),
                tr(
                    "Are these nozzles of another length or make, worn, or not pushed home in the "
                    "mount?"
                ),
            )


def _mounted(changes: Sequence[MeasuredChange]) -> Iterator[DriftFinding]:
    for tool in dict.fromkeys(change.tool for change in changes):
        trend = mounted_trend([change for change in changes if change.tool == tool])
        if trend is None:
            continue
        first = trend.first
        facts = {
            "tool": tool,
            "nozzle": first.nozzle,
            "count": trend.count,
            "when": first.at[:10],
            "off": _said(trend.moved_mm),
        }
        if trend.shorter:
            code = DriftCode.NOZZLE_WORN
            sentence = tr(
                "Nozzle {nozzle} of tool {tool} becomes shorter: {off} over {count} measurements "
                "since {when}.",
                **facts,
            )
            remedy = tr("It wears. Change it before the lost length matters to the process.")
        else:
            code = DriftCode.NOZZLE_MOVES
            sentence = tr(
                "Nozzle {nozzle} of tool {tool} moves: {off} over {count} measurements since "
                "{when}.",
                **facts,
            )
            remedy = tr("It sits loose in its mount, or bends: fasten or change it.")
        yield DriftFinding(code, (tool,), first.at, first.change, trend.moved_mm, sentence, remedy)


def _pins(charts: Sequence[Chart]) -> Iterator[DriftFinding]:
    moved: dict[int | str, list[Chart]] = {}
    for chart in charts:
        if chart.quantity == "pin" and _has_shifted(chart):
            moved.setdefault(chart.subject, []).append(chart)
    for station, of_pin in moved.items():
        yield _shift(
            DriftCode.PIN_MOVED,
            (station,),
            of_pin,
            tr(
                "Station {station} has been found {off} away on average over the last {count} "
                "changes, since {when}.",
                station=station,
                **_facts(of_pin),
            ),
            tr("The pin, or what it stands on, has moved: fasten it, then learn it again."),
        )


def _turn_tests(charts: Sequence[Chart]) -> Iterator[DriftFinding]:
    for chart in charts:
        if chart.quantity == "turn test" and _has_shifted(chart) and chart.shift_mm > 0:
            yield _shift(
                DriftCode.TURN_TEST_GROWS,
                (chart.subject,),
                [chart],
                tr(
                    "The turn test of tool {tool} is {off} worse on average over the "
                    "last {count} changes, since {when}.",
                    tool=chart.subject,
                    **_facts([chart]),
                ),
                tr(
                    "Something has come loose, or the touches have become worse: check "
                    "mount, pin, lens and light."
                ),
            )


def _has_shifted(chart: Chart) -> bool:
    since = [point.value_mm for point in chart.shifted]
    if len(since) < LEAST_SHIFTED:
        return False
    before = [point.value_mm for point in chart.counted[: -len(since)]]
    if shift_is_sure(before, since):
        return True
    # One bad touch at the end adds scatter that would hide a shift.
    *others, last = since
    if len(others) < LEAST_SHIFTED or not value_is_unusual(others, last):
        return False
    return shift_is_sure(before, others)


def _shift(
    code: DriftCode,
    subject: tuple[int | str, ...],
    charts: Sequence[Chart],
    sentence: str,
    remedy: str,
) -> DriftFinding:
    first = _first(charts)
    return DriftFinding(code, subject, first.at, first.change, _off(charts), sentence, remedy)


def _facts(charts: Sequence[Chart]) -> dict[str, object]:
    """Return the figures of a sentence about charts that shifted together."""
    return {
        "off": _said(_off(charts)),
        "count": max(len(chart.shifted) for chart in charts),
        "when": _first(charts).at[:10],
    }


def _off(charts: Sequence[Chart]) -> dict[str, float]:
    """Return the shift by axis; for several tools their mean."""
    axes = dict.fromkeys(chart.axis for chart in charts)
    return {axis: fmean(c.shift_mm for c in charts if c.axis == axis) for axis in axes}


def _first(charts: Sequence[Chart]) -> MeasuredChange:
    return min((chart.shifted[0].change for chart in charts), key=lambda change: change.number)


def _said(off: Mapping[str, float]) -> str:
    return ", ".join(f"{axis.upper()} {value:+.3f} mm".lstrip() for axis, value in off.items())


@dataclass(frozen=True, slots=True)
class CellDrift:
    """How the tools of one controller changed.

    Attributes:
        controller: Its identity, as in the journal.
        changes: Its measured changes, oldest first.
        charts: What was drawn from them, tools first.
        findings: What somebody should look at; empty for a steady cell.
    """

    controller: str
    changes: tuple[MeasuredChange, ...]
    charts: tuple[Chart, ...]
    findings: tuple[DriftFinding, ...]

    @property
    def simulated(self) -> bool:
        """Whether it, or one of its changes, was simulated; else nothing says so."""
        simulated = any(change.simulated for change in self.changes)
        return simulated or is_simulated_name(self.controller)


def drift_of(
    controller: str,
    entries: Iterable[Recorded],
    *,
    finds_pin: Callable[[str], bool],
    tool: int | None = None,
    since: str = "",
    baseline: int = LEAST_BASELINE,
) -> CellDrift:
    """Return how the tools of one controller changed.

    Args:
        controller: Its identity, for the reader.
        entries: Its entries of the kinds in :data:`robolink.drift.KINDS`, oldest first.
        finds_pin: Tells whether a method, by its name, finds its pin with the offset.
        tool: Only this tool; what several tools did alike is then not seen.
        since: Only changes with this label or a later one, ISO 8601; all by default. After a
            repair the charts begin anew there.
        baseline: How many of the first values the limits rest on; fewer than 20 draw none.

    Raises:
        ConfigError: ``baseline`` is less than 2.

    Example:
        >>> from robolink.drift import drift_of
        >>> cell = drift_of("cell-a", [], finds_pin=lambda method: True)
        >>> cell.charts, cell.findings
        ((), ())
    """
    changes = tuple(
        change
        for change in measured_changes(entries, finds_pin)
        if change.at >= since and tool in (None, change.tool)
    )
    charts = charts_of(changes, baseline=baseline)
    return CellDrift(controller, changes, charts, findings_in(charts, changes))


@without_sign
def last_statements(changes: Sequence[MeasuredChange]) -> Iterator[str]:
    """Yield a sentence for each tool whose last change has a recorded statement.

    Args:
        changes: The changes of one controller, oldest first.

    Example:
        >>> from robolink.drift import MeasuredChange, last_statements
        >>> at, tip_mm = "2026-11-22T08:00:00Z", {"x": 12.3, "y": -3.9}
        >>> change = MeasuredChange(7, at, "c-1", 1, "", "", tip_mm, None, 0.05, 0.024, 0.064)
        >>> list(last_statements([change]))
        ['Tool 1, last change: repeatable to +-0.024 mm, accurate to +-0.064 mm (95 %).']
    """
    for tool, last in sorted({change.tool: change for change in changes}.items()):
        if last.accurate_to_mm is None:
            continue
        accurate = stated_mm(last.accurate_to_mm)
        if last.repeatable_to_mm is None:
            yield tr(
                "Tool {tool}, last change: repeatable: not known, accurate to +-{u} mm (95 %).",
                tool=tool,
                u=accurate,
            )
        else:
            yield tr(
                "Tool {tool}, last change: repeatable to +-{r} mm, accurate to +-{u} mm (95 %).",
                tool=tool,
                r=stated_mm(last.repeatable_to_mm),
                u=accurate,
            )
