"""A station as it is known now: from the cell file, from the journal, or from both."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from typing import Final

from robolink.messages import tr

AGREEING_MM: Final = 2.0
"""So far may the cell file be from what was learnt: a search finds the station still."""


class StationKind(StrEnum):
    """What a station is."""

    PIN = "pin"
    BEAMS = "beams"
    TOUCH = "touch"
    CAMERA = "camera"


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
        gauge: Id of the gauge that stands there, empty for none.
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
    gauge: str = ""
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
        return " ".join(filter(None, (self._contradiction(), self._check(now))))

    def _contradiction(self) -> str:
        if self.apart_mm <= AGREEING_MM:
            return ""
        return tr(
            "The cell file puts station {id} {apart:.1f} mm from where it was learnt "
            "({at}, entry {entry}), and what was learnt counts: learn it again if it was moved, "
            "else correct the cell file.",
            id=self.id,
            apart=self.apart_mm,
            at=self.found_at,
            entry=self.entry,
        )

    def _check(self, now: datetime | None) -> str:
        due = self.check_due
        if due is not None and (now or datetime.now(UTC)) >= due:
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
