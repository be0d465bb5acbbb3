"""What a measurement of a station puts on record, and how it is read back."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from robolink.messages import tr
from robolink.model import EntryKind, NewEntry, Recorded, finding_named_now
from robolink.stations._station import Station, StationKind


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
    details: Mapping[str, object] = field(default_factory=dict)


def station_entry(found: Found, *, base: tuple[float, ...] | None = None) -> NewEntry:
    """Return the entry that makes a measurement of a station count from now on.

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
        "x_mm": found.x_mm,
        "y_mm": found.y_mm,
        "z_mm": found.z_mm,
        "sigma_mm": found.sigma_mm,
        "how": found.how,
        "gauge": found.gauge,
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


_AXES: Final = 6

_COMMON = frozenset(
    {"station", "kind", "x_mm", "y_mm", "z_mm", "sigma_mm", "how", "gauge", "base"},
)


def station_of(entry: Recorded) -> Station | None:
    """Return the station that an entry speaks of, ``None`` when it cannot be read."""
    details = entry.details
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
    """Return a base of an entry; one that is no six numbers is none."""
    numbers = [_number(one) for one in value] if isinstance(value, list) else []
    known = tuple(one for one in numbers if one is not None)
    return known if len(known) == len(numbers) == _AXES else None
