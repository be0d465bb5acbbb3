"""How far the cell file and the journal are apart about one station."""

import math
from collections.abc import Iterator, Mapping, Sequence

from robolink.stations._station import Station

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
