"""A row that was measured for its own sake: what is recorded, and how it is read back."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice, pairwise
from typing import Final

from robolink.calibration import ACCURACY_ROWS, RowFact, chi_square_quantile, student_t
from robolink.errors import CalibrationError
from robolink.messages import declared, spoken, tr
from robolink.model import EntryKind, NewEntry, Recorded, json_fields
from robolink.timing import local_label

_HOW: Final = {
    "artefact-test": declared("artefact test"),
    "gauge-study": declared("gauge study"),
    "turned-nozzles": declared("nozzles turned in the mount"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredRow:
    """The measured size of a row.

    Attributes:
        row: Its key.
        half_width: Half its width, in its unit, from an upper 95 % bound.
        by: How it was found: ``artefact-test``, ``gauge-study`` or ``turned-nozzles``.
        station: The station that it holds for; empty for the whole cell.
        count: How many measurements it rests on.
        records: Numbers of the entries that it rests on.
        details: More for the record, plain JSON.
        number: Number of its own entry, ``None`` before it is on record.
        at: When it was recorded, ISO 8601 UTC.
    """

    row: str
    half_width: float
    by: str
    station: str = ""
    count: int = 0
    records: tuple[int, ...] = ()
    details: Mapping[str, object] = field(default_factory=dict, hash=False)
    number: int | None = None
    at: str = ""

    @property
    def how(self) -> str:
        """How it was found, in words."""
        return spoken(_HOW[self.by])

    @property
    def fact(self) -> RowFact:
        """This row as a fact for a budget."""
        told = tr(
            "{how}, entry {number}, {at}",
            how=self.how,
            number=self.number,
            at=local_label(self.at) if self.at else "",
        )
        return RowFact(self.half_width, "record", told=told)


def measured_entry(found: MeasuredRow) -> NewEntry:
    """Return the entry that makes a measured row apply from now on."""
    row = ACCURACY_ROWS[found.row]
    return NewEntry(
        EntryKind.ACCURACY,
        verdict=tr(
            "{title}: +-{half_width:.4g} {unit}, by {how}",
            title=spoken(row.title),
            half_width=found.half_width,
            unit=row.unit,
            how=found.how,
        ),
        details={
            "row": found.row,
            "half_width": found.half_width,
            "unit": row.unit,
            **json_fields(found, "by", "station", "count", "records"),
            **found.details,
        },
    )


def measured_row(entry: Recorded) -> MeasuredRow | None:
    """Return the row in an entry; ``None`` if the entry cannot be read as one."""
    said = entry.details
    key, half_width = said.get("row"), _positive(said.get("half_width"))
    if entry.kind is not EntryKind.ACCURACY or half_width is None or not isinstance(key, str):
        return None
    row = ACCURACY_ROWS.get(key)
    by = said.get("by")
    if row is None or said.get("unit") != row.unit or by not in _HOW:
        return None
    records, count = said.get("records"), said.get("count")
    return MeasuredRow(
        row=key,
        half_width=half_width,
        by=str(by),
        station=str(said.get("station", "")),
        count=count if isinstance(count, int) else 0,
        records=tuple(one for one in records if isinstance(one, int))
        if isinstance(records, list)
        else (),
        number=entry.number,
        at=entry.at,
    )


def measured_rows(entries: Iterable[Recorded], station: str) -> dict[str, RowFact]:
    """Return the rows at a station that entries record.

    The newest counts; one of the station goes before one of the whole cell.

    Args:
        entries: Entries about rows, newest first.
        station: The station, empty for none.
    """
    own: dict[str, RowFact] = {}
    whole: dict[str, RowFact] = {}
    for found in filter(None, map(measured_row, entries)):
        if not found.station:
            whole.setdefault(found.row, found.fact)
        elif found.station == station:
            own.setdefault(found.row, found.fact)
    return {**whole, **own}


def _positive(value: object) -> float | None:
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return None
    return float(value) if math.isfinite(value) and value > 0 else None


LEAST_DOF: Final = 6
"""Smallest number of degrees of freedom from which the record gives the scatter of a look."""

_NEWEST: Final = 200

_LAST_DIGIT_MM: Final = 0.001 / math.sqrt(12)
"""Smallest standard deviation of a look, in mm: the rounding to the last digit printed."""


@dataclass(frozen=True, slots=True)
class LooksAlike:
    """Which recorded calibrations were made in the same way.

    Attributes:
        station: Name of the station; without one nothing is alike.
        method: Name of the method.
        by_contact: Whether an input showed each touch.
        change: Id of the tool change under way, which is none of them.
    """

    station: str
    method: str
    by_contact: bool = False
    change: str = ""

    def made(self, entry: Recorded) -> bool:
        """Return whether an entry was made in that way."""
        said = entry.details
        return (
            entry.kind is EntryKind.CALIBRATION
            and entry.signature.station == self.station
            and said.get("method") == self.method
            and _by_contact(said.get("touches")) is self.by_contact
            and not (self.change and entry.change == self.change)
        )


def pooled_look(entries: Iterable[Recorded], alike: LooksAlike) -> tuple[float, float] | None:
    """Return the standard deviation of one coordinate of one placement, and its freedom.

    s^2 = sum of the squares of all residuals that were kept, by the sum of the degrees of freedom.

    Args:
        entries: Calibrations on record, newest first; the newest 200 that are alike count.
        alike: Which of them.

    Returns:
        mm and degrees of freedom; ``None`` for fewer than six of these.
    """
    if not alike.station:
        return None
    squares, dof = 0.0, 0
    for entry in islice(filter(alike.made, entries), _NEWEST):
        found = _residuals(entry)
        if found is not None:
            squares, dof = squares + found[0], dof + found[1]
    if dof < LEAST_DOF:
        return None
    return max(math.sqrt(squares / dof), _LAST_DIGIT_MM), float(dof)


def _residuals(entry: Recorded) -> tuple[float, int] | None:
    """Return the sum of squares and the degrees of freedom of a fit; ``None`` without any."""
    vectors, dof = entry.details.get("residuals_mm"), entry.details.get("dof")
    rejected = entry.details.get("rejected", [])
    if not isinstance(vectors, list) or not isinstance(dof, int) or dof < 1:
        return None
    left_out = set(rejected) if isinstance(rejected, list) else set()
    squares = 0.0
    for index, vector in enumerate(vectors):
        if not isinstance(vector, list):
            return None
        if index in left_out:
            continue
        for value in vector:
            if not isinstance(value, (int, float)) or not math.isfinite(value):
                return None
            squares += value * value
    return squares, dof


def _by_contact(touches: object) -> bool:
    """Return whether an input confirmed every touch of an entry."""
    if not isinstance(touches, Sequence) or isinstance(touches, str) or not touches:
        return False
    return all(isinstance(one, dict) and one.get("contact") is True for one in touches)


LEAST_RECORDS: Final = 5
"""Smallest number of records from which a row is learnt."""

_OUTSIDE: Final = 0.05
"""Probability that the bound is too low."""


@dataclass(frozen=True, slots=True)
class RowBound:
    """What the records show about a row.

    Attributes:
        half_width: Half its width, from the upper 95 % bound, in the unit of the values.
        sigma: Standard deviation that was found, same unit.
        nu: Its degrees of freedom.
        count: How many records it rests on.
    """

    half_width: float
    sigma: float
    nu: float
    count: int


def upper_half_width(sigma: float, nu: float) -> float:
    """Return the half width of a row whose standard deviation was estimated.

    Args:
        sigma: The standard deviation.
        nu: Its degrees of freedom, above 0.
    """
    return math.sqrt(3 * nu / chi_square_quantile(_OUTSIDE, nu)) * sigma


def scatter_of_repeats(
    values: Sequence[Sequence[float]], *, anew_from: float, floor: float = 0.0
) -> RowBound | None:
    """Return the scatter of something that was found repeatedly; ``None`` for too few.

    It may have wandered all the while, and may have been placed anew: so the scatter is that of
    successive differences, s^2 = sum d^2 / (2 m) of the m that count, with
    nu = 2 m^2 / (3 m - 1) degrees of freedom for each coordinate. A difference of more than
    ``anew_from`` is somebody's doing and no scatter; a smaller one counts in full, whatever made
    it, for nobody can tell.

    Args:
        values: What was found each time, coordinate by coordinate, in the order of time.
        anew_from: From this distance on it was placed anew.
        floor: The least standard deviation that is believed, such as that of the last digit.

    Example:
        >>> from robolink.accuracy import scatter_of_repeats
        >>> found = [(0, 0), (0.01, 0), (0, 0.01), (0.01, 0.01), (0, 0), (5, 5)]
        >>> bound = scatter_of_repeats(found, anew_from=0.5)
        >>> bound.count, round(bound.sigma, 4), round(bound.half_width, 3)
        (5, 0.0061, 0.021)
        >>> scatter_of_repeats(found[:4], anew_from=0.5) is None
        True
    """
    squares, used = 0.0, 0
    for before, after in pairwise(values):
        step = math.dist(before, after)
        if step <= anew_from:
            squares, used = squares + step * step, used + 1
    if used + 1 < LEAST_RECORDS:
        return None
    coordinates = len(values[0])
    sigma = max(math.sqrt(squares / (2 * used * coordinates)), floor)
    nu = coordinates * 2 * used * used / (3 * used - 1)
    return RowBound(upper_half_width(sigma, nu), sigma, nu, used + 1)


@dataclass(frozen=True, slots=True)
class ArtefactTest:
    """Result of measuring a tip whose offset is known.

    Attributes:
        bias_mm: Mean of measured less known, each coordinate.
        sigma_mm: How much one measurement scatters about that mean, each coordinate.
        half_width_mm: Half width of the row, from the upper 95 % bound of the bias.
        count: How many measurements it rests on.
    """

    bias_mm: tuple[float, ...]
    sigma_mm: float
    half_width_mm: float
    count: int


def artefact_test(
    measured_mm: Sequence[Sequence[float]], known_mm: Sequence[float], *, known_u_mm: float = 0.0
) -> ArtefactTest:
    """Return how far from its known place a cell measures a tip.

    The bias of each coordinate has an upper 95 % bound, |b| + t_0.95(nu) s / sqrt(n); the row is
    sqrt(3) times the rms of these bounds, so that the region of a result, 2.45 u, holds a bias in
    any direction.

    Args:
        measured_mm: The measured offsets, coordinate by coordinate.
        known_mm: What the offset is, by its certificate or by a better instrument.
        known_u_mm: Standard uncertainty of that, each coordinate.

    Raises:
        CalibrationError: ``too_few_records``: fewer than five measurements.

    Example:
        >>> from robolink.accuracy import artefact_test
        >>> seen = [(12.03, -4.01), (12.05, -4.0), (12.04, -3.99), (12.03, -4.0), (12.05, -4.01)]
        >>> test = artefact_test(seen, (12.0, -4.0))
        >>> round(test.bias_mm[0], 3), round(test.half_width_mm, 3)
        (0.04, 0.06)
    """
    count, axes = len(measured_mm), range(len(known_mm))
    require_records(count)
    means = [math.fsum(one[i] for one in measured_mm) / count for i in axes]
    squares = math.fsum((one[i] - means[i]) ** 2 for one in measured_mm for i in axes)
    nu = len(known_mm) * (count - 1)
    sigma_mm = math.sqrt(squares / nu)
    bias = tuple(mean - known for mean, known in zip(means, known_mm, strict=True))
    beyond = student_t(1 - _OUTSIDE, nu) * sigma_mm / math.sqrt(count)
    mean_square = math.fsum((abs(one) + beyond) ** 2 for one in bias) / len(bias)
    return ArtefactTest(bias, sigma_mm, math.sqrt(3 * (mean_square + known_u_mm**2)), count)


def paired_half_width(
    first: Sequence[Sequence[float]], turned: Sequence[Sequence[float]]
) -> RowBound:
    """Return what turns with a nozzle, from nozzles measured before and after half a turn.

    Half the difference of the two is what turned along: what the camera sees beside the middle of
    the tip, and how much the nozzle itself is out of true. Nothing parts the two, so the row is
    that of both together: too large rather than too small.

    Args:
        first: Where the tip of each nozzle was measured.
        turned: Where, after half a turn of the nozzle in its mount.

    Raises:
        CalibrationError: ``too_few_records``: fewer than five nozzles.
    """
    require_records(min(len(first), len(turned)))
    halves = [math.dist(a, b) / 2 for a, b in zip(first, turned, strict=True)]
    nu = len(first[0]) * len(first)
    sigma = math.sqrt(math.fsum(half * half for half in halves) / nu)
    return RowBound(upper_half_width(sigma, nu), sigma, nu, len(first))


def require_records(count: int) -> None:
    """Refuse to learn a row from fewer than five records.

    Raises:
        CalibrationError: ``too_few_records``.
    """
    if count >= LEAST_RECORDS:
        return
    raise CalibrationError(
        "too_few_records",
        tr(
            "{count} measurements count here; {least} are needed.", count=count, least=LEAST_RECORDS
        ),
        remedy=tr("Nothing was recorded. Measure more often, then ask again."),
    )
