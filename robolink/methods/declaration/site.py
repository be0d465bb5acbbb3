"""Where and for what a method measures: what it is told besides its own parameters."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from robolink.model import Controller, Recorded, TipSensor, ToolOffset
    from robolink.pose_tables import ReadingChoices
    from robolink.stations import Station  # what --help does without


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """Where and for what a method measures.

    Attributes:
        controller: The controller, connected.
        tool: Number of the tool.
        station: What is known of the station; its name is empty where nobody named one.
        points: Numbers of the taught points that touch the pin, where they are measured with.
        pose_file: A file of poses in place of the points, and what it does not say itself.
        sigma_mm: Standard deviation of one coordinate of one measurement, where it is known.
        max_change_mm: Largest change that is believed.
        interval_mm: Largest half width of a 95 % interval that is believed, if one is judged.
        sensor: The camera: open, or its name or URL; it goes before what parameters and station
            say. ``None`` leaves it to them. One that is open is left open.
    """

    controller: "Controller"
    tool: int
    station: "Station"
    points: tuple[int, ...] = ()
    pose_file: "tuple[Path, ReadingChoices] | None" = None
    sigma_mm: float | None = None
    max_change_mm: float = 2.0
    interval_mm: float | None = None
    sensor: "str | TipSensor | None" = None

    def stating(self, **details: object) -> "Station":
        """Return the station with what the parameters say of it; ``None`` says nothing."""
        said = {name: value for name, value in details.items() if value is not None}
        return replace(self.station, details={**self.station.details, **said})


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolHistory:
    """What is on record of a tool at a station: what is known before anything is connected.

    Attributes:
        station: Name of the station.
        kept: Entries of the tool that say that a value stays, the newest first.
        holds: What the tool was seen to hold last, ``None`` where nothing says it.
        sigma_mm: Standard deviation of one coordinate of one measurement, where it is stated.
        interval_mm: Largest half width of a 95 % interval that is believed, if one is judged.
    """

    station: str
    kept: "Iterable[Recorded]"
    holds: "ToolOffset | None" = None
    sigma_mm: float | None = None
    interval_mm: float | None = None
