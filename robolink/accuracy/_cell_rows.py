"""The rows of a cell in one place: stated, else from its record, else the default."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Final, Protocol

from robolink.accuracy._repeats import learnt_rows, months_at
from robolink.accuracy._row_measurements import LooksAlike, measured_rows, pooled_look
from robolink.calibration import ACCURACY_ROWS, AccuracyFacts, RowFact
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import EntryKind, Recorded
from robolink.stations import Station, StationKind, find_stations
from robolink.timing import local_label

if TYPE_CHECKING:
    from robolink.config import Cell


_NEWEST: Final = 500
"""Largest number of entries read of each kind, newest first."""


class Recall(Protocol):
    """Yields the records of one controller, newest first."""

    def __call__(self, *, kinds: tuple[EntryKind, ...]) -> Iterator[Recorded]:
        """Yield entries of some kinds."""


class CellRecord:
    """The records of one controller, or of its current robot, for the rows of its budgets.

    A journal that is lost or cannot be read tells nothing, and then the defaults count.

    Args:
        recall: Yields the entries of some kinds, newest first.

    Example:
        >>> from robolink.accuracy import CellRecord
        >>> record = CellRecord(lambda *, kinds: iter(()))
        >>> record.stations, record.rows
        ((), ())
    """

    def __init__(self, recall: Recall) -> None:
        self._recall = recall
        self._read: dict[EntryKind, tuple[Recorded, ...]] = {}

    @property
    def stations(self) -> tuple[Recorded, ...]:
        """Entries about stations, newest first."""
        return self._newest(EntryKind.STATION)

    @property
    def rows(self) -> tuple[Recorded, ...]:
        """Entries about rows that were measured, newest first."""
        return self._newest(EntryKind.ACCURACY)

    @property
    def calibrations(self) -> tuple[Recorded, ...]:
        """The newest calibrations, newest first."""
        return self._newest(EntryKind.CALIBRATION)

    def all_calibrations(self) -> Iterator[Recorded]:
        """Yield all calibrations, newest first."""
        try:
            yield from self._recall(kinds=(EntryKind.CALIBRATION,))
        except ConfigError:
            return

    def _newest(self, kind: EntryKind) -> tuple[Recorded, ...]:
        if kind not in self._read:
            self._read[kind] = tuple(_readable(partial(self._recall, kinds=(kind,))))
        return self._read[kind]


def _readable(recall: Callable[[], Iterable[Recorded]]) -> Iterator[Recorded]:
    try:
        yield from islice(recall(), _NEWEST)
    except ConfigError:
        return


def facts_at(
    record: CellRecord,
    *,
    station: str,
    stated: Mapping[str, RowFact],
    alike: LooksAlike | None = None,
    learnt: bool = True,
    inputs_per_look: int = 1,
) -> AccuracyFacts:
    """Return the rows that apply to a measurement: stated, else from the record.

    Args:
        record: What is on record.
        station: Where it is measured; empty for no station.
        stated: What is stated, by key.
        alike: Which calibrations on record were made like it; ``None`` for none.
        learnt: Whether the place of the station is the one on record, where there is one.
        inputs_per_look: How many inputs together tell both coordinates once.

    Example:
        >>> from robolink.accuracy import CellRecord, facts_at
        >>> facts = facts_at(CellRecord(lambda *, kinds: iter(())), station="PIN-07", stated={})
        >>> facts.of("place_mm").basis
        'default'
    """
    # Without a station none of them counts, and a long record takes long to read.
    pooled = pooled_look(record.calibrations, alike) if alike and alike.station else None
    sigma_mm = None
    if pooled is not None:
        # The look is the mean of its inputs in each coordinate.
        sigma_mm = pooled[0] / math.sqrt(max(inputs_per_look / 2, 1.0))
    months = months_at(
        station,
        stations=record.stations,
        calibrations=record.all_calibrations,
        learnt=learnt,
    )
    facts = AccuracyFacts(
        months=months,
        by_contact=alike is not None and alike.by_contact,
        look_sigma_mm=sigma_mm,
        look_nu=0.0 if pooled is None else pooled[1],
    )
    on_record = _on_record(record, station, learnt=learnt)
    facts = replace(facts, rows={**on_record, **stated})
    if "plate_mm" not in facts.rows and learnt:
        facts = replace(facts, rows={**facts.rows, **_height_learnt(record, station, facts)})
    return facts


def _on_record(record: CellRecord, station: str, *, learnt: bool = True) -> dict[str, RowFact]:
    """Return the recorded rows of a station, empty for none.

    Args:
        record: What is on record.
        station: The station.
        learnt: Whether its place on record is what counts.
    """
    repeated = learnt_rows(record.stations, station) if station and learnt else {}
    return {**repeated, **measured_rows(record.rows, station)}


def _height_learnt(record: CellRecord, station: str, facts: AccuracyFacts) -> dict[str, RowFact]:
    """Return the row of a surface with a learnt height: it has a place row, and ages.

    What its learning itself is unsure of is in it.
    """
    known = find_stations(None, record.stations).get(station) if station else None
    if known is None or known.kind is not StationKind.TOUCH:
        return {}
    place = facts.of("place_mm")
    half_width = math.hypot(place.half_width, math.sqrt(3) * _sigma_of(known))
    told = place.told or tr("height learnt {at}", at=local_label(known.found_at))
    return {"plate_mm": RowFact(half_width, place.basis, place.growth, told)}


def _sigma_of(station: Station) -> float:
    sigma_mm = station.sigma_mm
    return sigma_mm if sigma_mm is not None and 0 < sigma_mm < math.inf else 0.0


@dataclass(frozen=True, slots=True)
class KnownRow:
    """One row of a cell with its present value.

    Attributes:
        key: Its key.
        fact: How large it is, and what tells it.
        on_record: What the record tells besides, where a statement goes before it.
    """

    key: str
    fact: RowFact
    on_record: RowFact | None = None

    @property
    def half_width(self) -> float:
        """Half its width, enlarged for its age."""
        return self.fact.half_width + self.fact.growth

    @property
    def exceeded(self) -> bool:
        """Whether the record shows more than is stated."""
        return self.on_record is not None and self.on_record.half_width > self.half_width


def rows_at(
    record: CellRecord, keys: Iterable[str], *, station: str, stated: Mapping[str, RowFact]
) -> tuple[KnownRow, ...]:
    """Return the rows that apply at a station.

    Args:
        record: What is on record.
        keys: Which rows.
        station: The station; empty for the whole cell.
        stated: What is stated, by key.

    Raises:
        KeyError: There is no such row.

    Example:
        >>> from robolink.accuracy import CellRecord, rows_at
        >>> record = CellRecord(lambda *, kinds: iter(()))
        >>> [(row.key, row.half_width) for row in rows_at(record, ["touch_mm"], station="",
        ...     stated={})]
        [('touch_mm', 0.05)]
    """
    facts = facts_at(record, station=station, stated=stated)
    told = facts_at(record, station=station, stated={})
    found = []
    for key in keys:
        assert key in ACCURACY_ROWS  # noqa: S101 - a key of a row
        fact, other = facts.of(key), told.of(key)
        beside = other if fact.basis == "stated" and other.basis == "record" else None
        found.append(KnownRow(key, fact, beside))
    return tuple(found)


def stated_rows(
    cell: "Cell | None",
    station: Station | str,
    *,
    recipe: Mapping[str, float] | None = None,
    recipe_name: str = "",
) -> dict[str, RowFact]:
    """Return the stated rows of a measurement.

    A recipe is for one job at one station, a station stands in one cell: what the recipe states
    goes before what is stated for its station, and that before what is stated for the cell.

    Args:
        cell: The cell; ``None`` where none is named.
        station: Where it is measured, with what is on record; its name alone where nothing is.
        recipe: Half widths that the recipe states, by key.
        recipe_name: How the recipe is called.

    Example:
        >>> from robolink.accuracy import stated_rows
        >>> rows = stated_rows(None, "PIN-07", recipe={"touch_mm": 0.02}, recipe_name="needle")
        >>> rows["touch_mm"].half_width, rows["touch_mm"].basis
        (0.02, 'stated')
    """
    name = station if isinstance(station, str) else station.id
    rows: dict[str, RowFact] = {}
    if cell is not None:
        told = tr("cell file, cell {cell}", cell=cell.name)
        rows |= _facts(cell.settings.accuracy, told)
    if isinstance(station, Station):
        rows |= _height_of(station)
    rows |= rows_of_station(cell, name)
    if recipe:
        told = tr("recipe {name}", name=recipe_name)
        rows |= {key: RowFact(value, "stated", told=told) for key, value in recipe.items()}
    return rows


def rows_of_station(cell: "Cell | None", station: str) -> dict[str, RowFact]:
    """Return the rows that the cell file states for a station itself."""
    said = None if cell is None else (cell.settings.stations or {}).get(station)
    if said is None:
        return {}
    return _facts(said, tr("cell file, station {station}", station=station))


def _height_of(station: Station) -> dict[str, RowFact]:
    """Return the uncertainty of a surface's height from its stated standard deviation.

    One that was learnt is as sure as its learning, which the record tells.
    """
    if station.kind is not StationKind.TOUCH or station.learnt or not station.sigma_mm:
        return {}
    told = tr("standard deviation stated for station {station}", station=station.id)
    return {"plate_mm": RowFact(math.sqrt(3) * station.sigma_mm, "stated", told=told)}


def _facts(said: object, told: str) -> dict[str, RowFact]:
    values = {key: getattr(said, key, None) for key in ACCURACY_ROWS}
    return {
        key: RowFact(float(value), "stated", told=told)
        for key, value in values.items()
        if value is not None
    }
