"""A row that was measured for its own sake: what goes on record, and how it is read back."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

from robolink.calibration import ACCURACY_ROWS, RowFact
from robolink.messages import declared, spoken, tr
from robolink.model import EntryKind, NewEntry, Recorded
from robolink.timing import local_label

_HOW: Final = {
    "artefact-test": declared("artefact test"),
    "gauge-study": declared("gauge study"),
    "turned-nozzles": declared("nozzles turned in the mount"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredRow:
    """How large a row was found.

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
    details: Mapping[str, object] = field(default_factory=dict)
    number: int | None = None
    at: str = ""

    @property
    def how(self) -> str:
        """How it was found, in words."""
        return spoken(_HOW[self.by])

    @property
    def fact(self) -> RowFact:
        """What it tells."""
        told = tr(
            "{how}, entry {number}, {at}",
            how=self.how,
            number=self.number,
            at=local_label(self.at) if self.at else "",
        )
        return RowFact(self.half_width, "record", told=told)


def measured_entry(found: MeasuredRow) -> NewEntry:
    """Return the entry that makes a measured row count from now on."""
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
            "by": found.by,
            "station": found.station,
            "count": found.count,
            "records": list(found.records),
            **found.details,
        },
    )


def measured_row(entry: Recorded) -> MeasuredRow | None:
    """Return the row that an entry tells; ``None`` for one that cannot be read as that."""
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
    """Return what entries tell of the rows at a station.

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
