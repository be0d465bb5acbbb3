"""A station as it is known now: from the cell file, from the journal, or from both."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import date, datetime, timedelta
from enum import StrEnum
from typing import Final

from robolink.messages import tr
from robolink.timing import local_label, wall_time

AGREEING_MM: Final = 2.0
"""So far may the cell file be from what was learnt: a search finds the station still."""


class StationKind(StrEnum):
    """What a station is."""

    PIN = "pin"
    BEAMS = "beams"
    TOUCH = "touch"
    CAMERA = "camera"


@dataclass(frozen=True, slots=True)
class Gauge:
    """What is measured against, as it goes on record.

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
    details: Mapping[str, object] = field(default_factory=dict)

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
        """When it has to be learnt again; ``None`` when nothing says so, or nobody ever did."""
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
        """Tell whether the calibration of its gauge has run out; the due day itself still counts.

        Args:
            now: The time of day; the computer's own by default.
        """
        if not self.gauge_due:
            return False
        today = (now or wall_time()).date()
        return date.fromisoformat(self.gauge_due) < today

    def gauge_on_record(self) -> Gauge | None:
        """Return the gauge as a measurement made now puts it on record; ``None`` for none."""
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
