"""What repeated learning of a station tells: how its place, and a camera's turn, scatter.

Every learning on record counts, by ``cell station learn`` and by calibrations that find their
station. What was found in another base is another place, and what is no number is passed over.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from typing import Final

from robolink.accuracy._row_measurements import RowBound, scatter_of_repeats
from robolink.calibration import RowFact
from robolink.messages import tr
from robolink.model import Recorded
from robolink.stations import Station, StationKind, find_stations
from robolink.stations import station_of as station_in
from robolink.timing import local_label, wall_time

PLACED_ANEW_MM: Final = 0.5
"""A station found further than this from where it was has been put up anew, or run into."""

_TURNED_ANEW_DEG: Final = 2.0
_FOCUSED_ANEW_PERCENT: Final = 2.0

_LAST_DIGIT_MM: Final = 0.001 / math.sqrt(12)
_LAST_DIGIT: Final = 0.001
"""No turn, degrees, and no scale, percent, is believed to scatter less."""

_NEWEST: Final = 100


def learnt_rows(entries: Iterable[Recorded], station: str) -> dict[str, RowFact]:
    """Return what repeated learning of a station tells of its rows; empty for too little.

    Args:
        entries: Entries about stations, newest first.
        station: Its name.
    """
    found = _comparable(entries, station)
    if not found:
        return {}
    rows: dict[str, RowFact] = {}
    kind = found[-1].kind
    if kind is StationKind.CAMERA:
        seen = [one for one in map(_CameraSeen.of, found) if one is not None]
        _add(rows, "camera_turn_deg", _turns(seen), seen)
        _add(rows, "camera_scale_percent", _scales(seen), seen)
        _add(rows, "place_mm", _camera_places(seen), seen)
    else:
        places = [(one, place) for one in found if (place := _place(one)) is not None]
        bound = scatter_of_repeats(
            [place for _, place in places], anew_from=PLACED_ANEW_MM, floor=_LAST_DIGIT_MM
        )
        _add(rows, "place_mm", bound, [one for one, _ in places])
    return rows


def _comparable(entries: Iterable[Recorded], station: str) -> list[Station]:
    """Return where a station was found, oldest first, in the base and as the kind of the newest."""
    found: list[Station] = []
    for entry in entries:
        if entry.details.get("station") != station:
            continue
        one = station_in(entry)
        if one is None:
            continue
        if not found or (one.kind is found[0].kind and one.base == found[0].base):
            found.append(one)
        if len(found) == _NEWEST:
            break
    return found[::-1]


def _add(
    rows: dict[str, RowFact],
    key: str,
    bound: RowBound | None,
    found: "Sequence[Station | _CameraSeen]",
) -> None:
    if bound is None:
        return
    first, last = found[0], found[-1]
    told = tr(
        "learnt {count} times, entries {first} to {last}, {at}",
        count=bound.count,
        first=first.entry,
        last=last.entry,
        at=local_label(last.found_at),
    )
    rows[key] = RowFact(bound.half_width, "record", told=told)


def _place(station: Station) -> tuple[float, ...] | None:
    """Return the place of a pin or of where beams cross, X and Y; of a surface its height."""
    if station.kind is StationKind.BEAMS:
        return _crossing(station.details.get("beams"))
    if station.kind is StationKind.TOUCH:
        return _finite(station.z_mm)
    return _finite(station.x_mm, station.y_mm)


def _crossing(lines: object) -> tuple[float, float] | None:
    """Return where two beams cross, seen from above."""
    if not isinstance(lines, Sequence) or len(lines) != 2:
        return None
    numbers = [_line(one) for one in lines]
    one, other = numbers
    if one is None or other is None:
        return None
    (x1, y1, a1), (x2, y2, a2) = one, other
    across = math.sin(a2 - a1)
    if abs(across) < 0.1:
        return None
    along = ((x2 - x1) * math.sin(a2) - (y2 - y1) * math.cos(a2)) / across
    return x1 + along * math.cos(a1), y1 + along * math.sin(a1)


def _line(line: object) -> tuple[float, float, float] | None:
    if not isinstance(line, Mapping):
        return None
    values = _finite(*(line.get(name) for name in ("x_mm", "y_mm", "direction_deg")))
    return None if values is None else (values[0], values[1], math.radians(values[2]))


def _finite(*values: object) -> tuple[float, ...] | None:
    numbers = [
        float(one)
        for one in values
        if isinstance(one, (int, float)) and not isinstance(one, bool) and math.isfinite(one)
    ]
    return tuple(numbers) if len(numbers) == len(values) else None


class _CameraSeen:
    """A camera as one calibration found it.

    Args:
        entry: Number of the entry.
        found_at: When, ISO 8601 UTC.
        matrix: Its mm per pixel, row by row.
        origin: Base point at pixel (0, 0).
        middle: Base point that it knows best, or to which tips are brought; ``None`` for neither.
    """

    def __init__(
        self,
        entry: int | None,
        found_at: str,
        matrix: tuple[float, ...],
        origin: tuple[float, ...],
        *,
        middle: tuple[float, ...] | None,
    ) -> None:
        self.entry, self.found_at = entry, found_at
        self.matrix, self.origin, self.middle = matrix, origin, middle

    @classmethod
    def of(cls, station: Station) -> "_CameraSeen | None":
        """Return what an entry says, ``None`` where it does not say all of it."""
        rows, origin = station.details.get("mm_per_px"), station.details.get("origin_mm")
        if not isinstance(rows, list) or not isinstance(origin, list):
            return None
        flat = [value for row in rows if isinstance(row, list) for value in row]
        matrix, place = _finite(*flat), _finite(*origin)
        if matrix is None or place is None or len(matrix) != 4 or len(place) != 2:
            return None
        a, b, c, d = matrix
        if not a * d - b * c:
            return None
        centre = station.details.get("centre_mm")
        known = _finite(*centre) if isinstance(centre, list) and len(centre) == 2 else None
        middle = known or _finite(station.x_mm, station.y_mm)
        return cls(station.entry, station.found_at, matrix, place, middle=middle)

    @property
    def area(self) -> float:
        """Area of a pixel, negative where the image is mirrored."""
        a, b, c, d = self.matrix
        return a * d - b * c

    @property
    def turn_deg(self) -> float:
        """Direction of the image's first axis in the base."""
        a, _, c, _ = self.matrix
        return math.degrees(math.atan2(c, a))

    def base_mm(self, px: float, py: float) -> tuple[float, float]:
        """Return where a pixel looks."""
        a, b, c, d = self.matrix
        return a * px + b * py + self.origin[0], c * px + d * py + self.origin[1]

    def pixel(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        """Return the pixel that looks at a place."""
        a, b, c, d = self.matrix
        dx, dy = x_mm - self.origin[0], y_mm - self.origin[1]
        return (d * dx - b * dy) / self.area, (a * dy - c * dx) / self.area


def _turns(seen: "Sequence[_CameraSeen]") -> RowBound | None:
    turns: list[tuple[float]] = []
    for one in seen:
        turn = one.turn_deg
        if turns:  # from the one before, so that 179.9 and -179.9 lie side by side
            turn = turns[-1][0] + math.remainder(turn - turns[-1][0], 360)
        turns.append((turn,))
    return scatter_of_repeats(turns, anew_from=_TURNED_ANEW_DEG, floor=_LAST_DIGIT)


def _scales(seen: "Sequence[_CameraSeen]") -> RowBound | None:
    scales = [(100 * math.log(abs(one.area)) / 2,) for one in seen]
    return scatter_of_repeats(scales, anew_from=_FOCUSED_ANEW_PERCENT, floor=_LAST_DIGIT)


def _camera_places(seen: "Sequence[_CameraSeen]") -> RowBound | None:
    """Return how the place scatters at which one pixel looks: where the newest sees its middle."""
    if not seen or seen[-1].middle is None:
        return None
    x_mm, y_mm = seen[-1].middle
    pixel = seen[-1].pixel(x_mm, y_mm)
    places = [one.base_mm(*pixel) for one in seen]
    return scatter_of_repeats(places, anew_from=PLACED_ANEW_MM, floor=_LAST_DIGIT_MM)


_DAYS_A_MONTH: Final = 30.44


def months_at(
    station: str,
    *,
    stations: Iterable[Recorded],
    calibrations: Callable[[], Iterable[Recorded]],
    learnt: bool = True,
) -> float | None:
    """Return how long ago a station was learnt, in months; ``None`` where nothing says it.

    One whose place is only stated is as old as the first calibration there at least: nobody has
    looked since where it stands.

    Args:
        station: Its name, empty for none.
        stations: Entries about stations, newest first.
        calibrations: Returns all calibrations on record; only asked for a place that is stated.
        learnt: Whether its place on record is what counts, where there is one.

    Example:
        >>> from robolink.accuracy import months_at
        >>> months_at("PIN-07", stations=[], calibrations=list) is None
        True
    """
    if not station:
        return None
    known = find_stations(None, stations).get(station) if learnt else None
    if known is not None and known.found_at:
        return _months_since(known.found_at)
    there = (one.at for one in calibrations() if one.signature.station == station)
    first = min(there, default="")
    return _months_since(first) if first else None


def _months_since(at: str) -> float | None:
    # A label of a damaged record tells no age.
    with suppress(ValueError):
        then = datetime.fromisoformat(at)
        age = wall_time() - (then if then.tzinfo else then.replace(tzinfo=UTC))
        return max(age.total_seconds(), 0.0) / 86_400 / _DAYS_A_MONTH
    return None
