"""A station as it is known now: from the cell file, from the journal, or from both."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date, datetime, timedelta
from enum import StrEnum
from typing import Final

from robolink.messages import tr
from robolink.model import EntryKind, NewEntry, Recorded, finding_named_now, json_fields
from robolink.timing import local_label, wall_time

AGREEING_MM: Final = 2.0
"""Largest distance of the cell file's place from the learnt one, in mm, at which a search finds the
station."""


class StationKind(StrEnum):
    """The kind of a station."""

    PIN = "pin"
    BEAMS = "beams"
    TOUCH = "touch"
    CAMERA = "camera"


@dataclass(frozen=True, slots=True)
class Gauge:
    """What is measured against, as it is recorded.

    Attributes:
        id: Its id, as on its certificate.
        station: The station at which it stands.
        due: Until when its calibration holds, ISO 8601; empty where nobody says it.
        overdue: Whether that is over.
    """

    id: str
    station: str
    due: str = ""
    overdue: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Station:
    """One station of a cell.

    Attributes:
        id: Its name.
        kind: What it is.
        x_mm, y_mm, z_mm: Where it is, base; ``None`` while nobody knows.
        sigma_mm: Standard deviation of each of them, ``None`` when it is not known.
        how: How it was found, in words.
        found_at: When, ISO 8601 UTC; empty when the cell file says where it is.
        entry: Number of the entry in the journal, ``None`` when the cell file says it.
        base: Where the controller's base stood when it was learnt: X, Y, Z in mm, U, V, W in
            degrees, seen from the robot; ``None`` where that is not on record.
        gauge: Id of the gauge that stands there, empty for none.
        gauge_due: Until when the calibration of that holds, ISO 8601; empty where nobody says it.
        check_every_days: After so many days it has to be learnt again, ``None`` for never.
        declared: Whether the cell file names it.
        apart_mm: How far the place in the cell file is from the one that was learnt.
        details: What its kind needs besides, plain JSON: inputs, beams.
    """

    id: str
    kind: StationKind
    x_mm: float | None = None
    y_mm: float | None = None
    z_mm: float | None = None
    sigma_mm: float | None = None
    how: str = ""
    found_at: str = ""
    entry: int | None = None
    base: tuple[float, ...] | None = None
    gauge: str = ""
    gauge_due: str = ""
    check_every_days: float | None = None
    declared: bool = False
    apart_mm: float = 0.0
    details: Mapping[str, object] = field(default_factory=dict, hash=False)

    def at(
        self,
        x_mm: float | None,
        y_mm: float | None,
        z_mm: float | None,
        *,
        sigma_mm: float | None = None,
    ) -> "Station":
        """Return the same station at another place, base; it then rests on no entry.

        A camera's entry says what its pixels mean, wherever a tip is brought before it.

        Args:
            x_mm: Where it is, base; ``None`` where nobody knows.
            y_mm: Likewise.
            z_mm: Likewise.
            sigma_mm: Standard deviation of each of them, where it is known.

        Example:
            >>> from robolink.stations import Station, StationKind
            >>> pin = Station(id="PIN-07", kind=StationKind.PIN).at(300, 100, -80, sigma_mm=0.02)
            >>> pin.x_mm, pin.sigma_mm
            (300, 0.02)
        """
        moved = (x_mm, y_mm, z_mm) != (self.x_mm, self.y_mm, self.z_mm)
        told = moved and self.kind is not StationKind.CAMERA
        return replace(
            self,
            x_mm=x_mm,
            y_mm=y_mm,
            z_mm=z_mm,
            sigma_mm=sigma_mm,
            entry=None if told else self.entry,
        )

    @property
    def learnt(self) -> bool:
        """Whether a measurement found it."""
        return self.entry is not None

    @property
    def check_due(self) -> datetime | None:
        """When it has to be relearnt; ``None`` if nothing says so, or nobody ever did."""
        if self.check_every_days is None or not self.found_at:
            return None
        return datetime.fromisoformat(self.found_at) + timedelta(days=self.check_every_days)

    def remark(self, now: datetime | None = None) -> str:
        """Return what a person has to know before it is used; empty when all is well.

        Args:
            now: The time of day; the computer's own by default.
        """
        return " ".join(filter(None, (self._contradiction(), self._check(now), self._gauge(now))))

    def gauge_overdue(self, now: datetime | None = None) -> bool:
        """Return whether the calibration of its gauge has expired; the due day itself still counts.

        Args:
            now: The time of day; the computer's own by default.
        """
        if not self.gauge_due:
            return False
        today = (now or wall_time()).date()
        return date.fromisoformat(self.gauge_due) < today

    def gauge_on_record(self) -> Gauge | None:
        """Return the gauge as a present measurement records it; ``None`` for none."""
        if not self.gauge:
            return None
        return Gauge(self.gauge, self.id, self.gauge_due, self.gauge_overdue())

    def _gauge(self, now: datetime | None) -> str:
        if not self.gauge_overdue(now):
            return ""
        return tr(
            "The calibration of gauge {gauge} at station {id} ran out on {due}: have it "
            "calibrated, or use another one.",
            gauge=self.gauge or tr("without a name"),
            id=self.id,
            due=self.gauge_due,
        )

    def _contradiction(self) -> str:
        if self.apart_mm <= AGREEING_MM:
            return ""
        return tr(
            "The cell file puts station {id} {apart:.1f} mm from where it was learnt "
            "({at}, entry {entry}), and what was learnt counts: learn it again if it was moved, "
            "else correct the cell file.",
            id=self.id,
            apart=self.apart_mm,
            at=local_label(self.found_at),
            entry=self.entry,
        )

    def _check(self, now: datetime | None) -> str:
        due = self.check_due
        if due is not None and (now or wall_time()) >= due:
            return tr(
                "The check of station {id} has been due since {due}: learn it again.",
                id=self.id,
                due=due.date().isoformat(),
            )
        if self.check_every_days is not None and not self.found_at:
            return tr(
                "Station {id} is to be checked every {days:g} days, and no check is on record.",
                id=self.id,
                days=self.check_every_days,
            )
        return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """Where a measurement found a station.

    Attributes:
        id: Its name.
        kind: What it is.
        x_mm, y_mm, z_mm: Where, base; ``None`` for what the measurement does not tell.
        sigma_mm: Standard deviation of each of them, ``None`` when it is not known.
        how: How it was found, in words.
        gauge: Id of the gauge that stands there, empty for none.
        tool: The tool whose tip found it.
        details: What its kind needs besides, plain JSON.
    """

    id: str
    kind: StationKind
    x_mm: float | None
    y_mm: float | None
    z_mm: float | None = None
    sigma_mm: float | None = None
    how: str = ""
    gauge: str = ""
    tool: int | None = None
    details: Mapping[str, object] = field(default_factory=dict, hash=False)


def station_entry(found: Found, *, base: tuple[float, ...] | None = None) -> NewEntry:
    """Return the entry that makes a measurement of a station apply from now on.

    Args:
        found: What was found.
        base: Where the controller's base stands, as :func:`~robolink.stations.base_now` tells;
            ``None`` where that is not known.
    """
    places = ((found.x_mm, "X"), (found.y_mm, "Y"), (found.z_mm, "Z"))
    place = " ".join(f"{name} {value:.3f}" for value, name in places if value is not None)
    details: dict[str, object] = {
        "station": found.id,
        "kind": found.kind.value,
        **json_fields(found, "x_mm", "y_mm", "z_mm", "sigma_mm", "how", "gauge"),
        **found.details,
    }
    if base is not None:
        details["base"] = list(base)
    return NewEntry(
        EntryKind.STATION,
        tool=found.tool,
        verdict=tr("station {id} found at {place}", id=found.id, place=place),
        details=details,
    )


TAUGHT: Final = "taught"
"""Key of the details of an entry that says what a camera was taught, and not where a station is."""

_AXES: Final = 6

_COMMON = frozenset(
    {"station", "kind", "x_mm", "y_mm", "z_mm", "sigma_mm", "how", "gauge", "base"},
)


def station_of(entry: Recorded) -> Station | None:
    """Return the station in an entry, ``None`` if it cannot be read or tells no place of one."""
    details = entry.details
    if TAUGHT in details:
        return None
    name, kind = details.get("station"), details.get("kind")
    if not isinstance(name, str) or kind not in list(StationKind):
        return None
    return Station(
        id=name,
        kind=StationKind(str(kind)),
        x_mm=_number(details.get("x_mm")),
        y_mm=_number(details.get("y_mm")),
        z_mm=_number(details.get("z_mm")),
        sigma_mm=_number(details.get("sigma_mm")),
        how=finding_named_now(str(details.get("how", ""))),
        gauge=str(details.get("gauge", "")),
        found_at=entry.at,
        entry=entry.number,
        base=_base(details.get("base")),
        details={key: value for key, value in details.items() if key not in _COMMON},
    )


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, (int, float)) else None


def _base(value: object) -> tuple[float, ...] | None:
    """Return the base in an entry; one without six numbers is none."""
    numbers = [_number(one) for one in value] if isinstance(value, list) else []
    known = tuple(one for one in numbers if one is not None)
    return known if len(known) == len(numbers) == _AXES else None


_NAMES = ("x_mm", "y_mm", "z_mm")


def apart_mm(declared: Station, learnt: Station) -> float:
    """Return the distance between two places of a station, in what both of them state.

    A beam is a line: only what lies across it counts.
    """
    pairs = [(getattr(declared, name), getattr(learnt, name)) for name in _NAMES]
    place = math.hypot(*(a - b for a, b in pairs if a is not None and b is not None))
    return max(place, *_across_mm(declared, learnt), 0.0)


def _across_mm(declared: Station, learnt: Station) -> Iterator[float]:
    stated, found = (station.details.get("beams") for station in (declared, learnt))
    if not isinstance(stated, Sequence) or not isinstance(found, Sequence):
        return
    for one, other in zip(stated, found, strict=False):
        yield _beside_mm(one, other)


def _beside_mm(point: Mapping[str, float], line: Mapping[str, float]) -> float:
    along = math.radians(line["direction_deg"])
    dx, dy = point["x_mm"] - line["x_mm"], point["y_mm"] - line["y_mm"]
    return abs(dy * math.cos(along) - dx * math.sin(along))
