"""What a camera was taught of a tip: how wide and how sharp it looks, and how late pictures are."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from robolink.messages import tr
from robolink.model import EntryKind, NewEntry, Recorded, json_value
from robolink.stations._station import TAUGHT, Station, StationKind

_OF_A_TIP: Final = ("radius_px", "edge_px", "bore_ratio")
_OF_THE_CAMERA: Final = ("exposure_us", "lag_s", "lag_pictures")
_SHAPE: Final = ("diameter_mm", "bore", "polarity")


@dataclass(frozen=True, slots=True, kw_only=True)
class Taught:
    """What a person confirmed in one picture of a camera.

    Attributes:
        station: Name of the camera's station.
        tool: The tool whose tip was in the picture.
        radius_px: Half the width of its face.
        edge_px: Width of its edge in focus, 10 to 90 %; ``None`` where it could not be measured.
        bore_ratio: Radius of its bore as a share of the face's; ``None`` for none.
        exposure_us: Exposure time in microseconds; ``None`` where the camera does not tell it.
        lag_s: How long after a movement the camera still shows what was before; ``None`` where no
            movement was made, so that nobody knows.
        lag_pictures: How many pictures after a movement still show what was before, however long
            it waited; ``None`` likewise.
        shape: What the cell file stated of the tips then: ``diameter_mm``, ``bore``,
            ``polarity``. Where it states something else by now, the first three do not count.
        sensor: Name of the camera, without user and password. For another one nothing counts.
    """

    station: str
    tool: int
    radius_px: float
    edge_px: float | None = None
    bore_ratio: float | None = None
    exposure_us: float | None = None
    lag_s: float | None = None
    lag_pictures: int | None = None
    shape: Mapping[str, object] = field(hash=False)
    sensor: str


def shape_stated(details: Mapping[str, object]) -> dict[str, object]:
    """Return what a cell file states of the tips before a camera, from the details of a station."""
    return {key: details[key] for key in _SHAPE if key in details}


def teaching_entry(taught: Taught) -> NewEntry:
    """Return the entry that makes what a camera was taught apply from now on.

    Args:
        taught: What a person confirmed.

    Example:
        >>> from robolink.stations import Taught, teaching_entry
        >>> taught = Taught(station="CAM-01", tool=1, radius_px=24.5, shape={}, sensor="http://cam/")
        >>> teaching_entry(taught).verdict
        'camera CAM-01 taught: tip of radius 24.50 px'
    """
    known = {name: getattr(taught, name) for name in (*_OF_A_TIP, *_OF_THE_CAMERA)}
    return NewEntry(
        EntryKind.STATION,
        tool=taught.tool,
        verdict=tr(
            "camera {id} taught: tip of radius {radius:.2f} px",
            id=taught.station,
            radius=taught.radius_px,
        ),
        details={
            "station": taught.station,
            "kind": StationKind.CAMERA.value,
            **{name: value for name, value in known.items() if value is not None},
            TAUGHT: {"sensor": taught.sensor, "shape": json_value(taught.shape)},
        },
    )


def teachings(entries: Iterable[Recorded]) -> dict[str, Recorded]:
    """Return what is on record as taught, by the name of the station; the newest of each counts.

    Args:
        entries: Entries of stations, newest first.
    """
    found = dict[str, Recorded]()
    for entry in entries:
        name = entry.details.get("station")
        if TAUGHT in entry.details and isinstance(name, str):
            found.setdefault(name, entry)
    return found


def with_teaching(station: Station, entry: Recorded, sensor: str) -> Station:
    """Return a camera's station with what it was taught, as far as that still applies.

    Args:
        station: What else is known of it. What the cell file states goes before.
        entry: The newest teaching.
        sensor: Name of the camera that stands there, without user and password; empty where
            nobody says it.
    """
    taught = entry.details.get(TAUGHT)
    said = taught if isinstance(taught, Mapping) else {}
    if station.kind is not StationKind.CAMERA or (sensor and said.get("sensor") != sensor):
        return station
    shape = said.get("shape")
    recorded = shape if isinstance(shape, Mapping) else {}
    if not station.declared:
        station = replace(station, details={**recorded, **station.details})
    same_tips = recorded == shape_stated(station.details)
    keys = (*(_OF_A_TIP if same_tips else ()), *_OF_THE_CAMERA)
    facts = {key: entry.details[key] for key in keys if key in entry.details}
    facts[TAUGHT] = {"at": entry.at, "entry": entry.number, "counts": same_tips}
    return replace(station, details={**facts, **station.details})
