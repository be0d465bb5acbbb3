"""From the journal's entries to what each tool change measured."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from statistics import fmean, median, variance
from typing import Final

from robolink.calibration import student_t
from robolink.model import EntryKind, Recorded, read_offset, with_method_name_now

KINDS = (EntryKind.CALIBRATION, EntryKind.VERIFY, EntryKind.DONE, EntryKind.ROLLED_BACK)
"""Entries that record how a change ended."""

_AXES = {"x_mm": "x", "y_mm": "y", "z_mm": "z"}


@dataclass(frozen=True, slots=True)
class MeasuredChange:
    """A tool change with a measured value that was kept.

    Attributes:
        number: Number of the entry that kept it.
        at: When, as a label: ISO 8601, UTC.
        change: Id of the change.
        tool: Number of the tool.
        nozzle: Id of the nozzle or needle, empty when nobody gave one.
        station: Name of the pin, beams or camera, empty when nobody gave one.
        tip_mm: What was measured of the tip, mm, by axis (``x``, ``y``, ``z``); an axis that was
            kept is not in it.
        pin_mm: Where the pin was found with it, base, mm, by axis ``x`` and ``y``; ``None`` where
            the method does not find its pin.
        turn_test_mm: Largest distance of the proof about the new tip, ``None`` without one.
        repeatable_to_mm: Within which the tip would be found again in 95 %; ``None`` where that is
            not on record.
        accurate_to_mm: Within which of the truth it lies in 95 %, by the statement that stood when
            it was kept; ``None`` likewise.
        simulated: Whether the controller said then that nothing real moves.
    """

    number: int
    at: str
    change: str
    tool: int
    nozzle: str
    station: str
    tip_mm: Mapping[str, float] = field(hash=False)
    pin_mm: Mapping[str, float] | None = field(hash=False)
    turn_test_mm: float | None
    repeatable_to_mm: float | None = None
    accurate_to_mm: float | None = None
    simulated: bool = False


def measured_changes(
    entries: Iterable[Recorded], finds_pin: Callable[[str], bool]
) -> list[MeasuredChange]:
    """Return one controller's changes with a measured and kept value, oldest first.

    What was taken back, refused or only typed is none: it says nothing about the nozzle.

    Args:
        entries: Those of :data:`KINDS` of one controller, in the order in which they were stored.
        finds_pin: Tells whether a method, by its name, finds its pin with the offset.
    """
    measured: dict[tuple[str, int], Recorded] = {}
    turned: dict[tuple[str, int], float] = {}
    kept: dict[tuple[str, int], MeasuredChange] = {}
    for entry in entries:
        if entry.tool is None or not entry.change:
            continue
        key = entry.change, entry.tool
        match entry.kind:
            case EntryKind.CALIBRATION:
                measured[key] = entry
            case EntryKind.VERIFY:
                turned.update(_turn_test(key, entry))
            case EntryKind.ROLLED_BACK:
                for taken_back in [one for one in kept if one[0] == entry.change]:
                    del kept[taken_back]
            case EntryKind.DONE if key in measured:
                kept[key] = _change(entry, measured[key], turned.get(key), finds_pin)
    return list(kept.values())


def _turn_test(key: tuple[str, int], entry: Recorded) -> Iterator[tuple[tuple[str, int], float]]:
    largest = entry.details.get("max_drift_mm")
    if isinstance(largest, (int, float)):
        yield key, float(largest)


def _change(
    done: Recorded,
    calibration: Recorded,
    turn_test_mm: float | None,
    finds_pin: Callable[[str], bool],
) -> MeasuredChange:
    said = with_method_name_now(calibration.details)
    return MeasuredChange(
        number=done.number,
        at=done.at,
        change=done.change,
        tool=done.tool or 0,
        nozzle=done.signature.nozzle,
        station=done.signature.station,
        tip_mm=_tip(said, done.details),
        pin_mm=_pin(said) if finds_pin(str(said.get("method", ""))) else None,
        turn_test_mm=turn_test_mm,
        repeatable_to_mm=_number(said, "repeatable_to_mm"),
        accurate_to_mm=_number(done.details, "accurate_to_mm") or _number(said, "accurate_to_mm"),
        simulated=said.get("simulated") is True,
    )


def _number(said: Mapping[str, object], name: str) -> float | None:
    value = said.get(name)
    return float(value) if isinstance(value, (int, float)) else None


def _tip(said: Mapping[str, object], end: Mapping[str, object]) -> dict[str, float]:
    """Return the tip as measured, not as written: a recipe may write a difference."""
    tip = read_offset(said.get("tip") or said.get("proposed"))
    measured = said.get("measured")
    if tip is None or not isinstance(measured, (list, tuple)):
        return {}
    axes = {axis: name in measured for name, axis in _AXES.items()}
    axes["z"] = axes["z"] or end.get("z_from") == "measured"
    return {axis: getattr(tip, f"{axis}_mm") for axis, known in axes.items() if known}


def _pin(said: Mapping[str, object]) -> dict[str, float] | None:
    place = said.get("reference_point_mm")
    if not isinstance(place, (list, tuple)) or len(place) < 2:
        return None
    return {"x": float(place[0]), "y": float(place[1])}


LEVEL: Final = 0.001
"""False-alarm rate of one test of one coordinate of a steady cell."""

_RESOLUTION_MM: Final = 0.001 / math.sqrt(12)
"""Standard deviation, in mm, due to a controller's three decimals alone."""


def shift_is_sure(before: Sequence[float], since: Sequence[float]) -> bool:
    """Return whether the later values have another mean.

    Student's t of two samples with one variance, at a split that was chosen because it looked
    best: the level is divided by the number of splits there were.

    Args:
        before: Two values or more.
        since: Two values or more, after them.
    """
    first, then = len(before), len(since)
    dof = first + then - 2
    pooled = (variance(before) * (first - 1) + variance(since) * (then - 1)) / dof
    sigma = math.sqrt(max(pooled, _RESOLUTION_MM**2) * (1 / first + 1 / then))
    limit = student_t(1 - LEVEL / (2 * (dof + 1)), dof)
    return abs(fmean(since) - fmean(before)) > limit * sigma


def likeliest_split(values: Sequence[float], earliest: int) -> int:
    """Return the index from which the later values most likely have another mean.

    The split with the least sum of squares about the two means, which is the maximum likelihood
    for normal values of one variance; of medians of three neighbours, which keep a step as it is
    and leave out a single bad touch.

    Args:
        values: Three values or more, in the order of time.
        earliest: The first index that is thought of; 1 or more.
    """
    steady = [median(values[max(0, i - 1) : i + 2]) for i in range(1, len(values) - 1)]
    steady = [values[0], *steady, median(values[-3:])]
    mean, before = fmean(steady), math.fsum(steady[:earliest])
    best, found = -1.0, earliest
    for first in range(earliest, len(steady)):
        # Sum of squares between the two parts: the larger it is, the smaller the rest.
        between = (before - first * mean) ** 2 * (1 / first + 1 / (len(steady) - first))
        if between > best:
            best, found = between, first
        before += steady[first]
    return found


def value_is_unusual(before: Sequence[float], value: float) -> bool:
    """Return whether one more value lies outside the prediction interval of those before.

    Args:
        before: Two values or more.
        value: The one after them.
    """
    count = len(before)
    spread = math.sqrt(max(variance(before), _RESOLUTION_MM**2) * (1 + 1 / count))
    return abs(value - fmean(before)) > student_t(1 - LEVEL / 2, count - 1) * spread


def slope_of(values: Sequence[float]) -> tuple[float, float]:
    """Return the slope of the line through values at 0, 1, 2 .., in standard deviations as well.

    Args:
        values: Three values or more.
    """
    count, mean = len(values), fmean(values)
    middle = (count - 1) / 2
    spread = sum((i - middle) ** 2 for i in range(count))
    slope = sum((i - middle) * (v - mean) for i, v in enumerate(values)) / spread
    rest = sum((v - mean - slope * (i - middle)) ** 2 for i, v in enumerate(values))
    variance_left = max(rest / (count - 2), _RESOLUTION_MM**2)
    return slope, slope / math.sqrt(variance_left / spread)
