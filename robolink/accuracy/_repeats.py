"""What repeated learning of a station shows: the scatter of its place and of a camera's turn.

Every learning on record counts, by ``cell station learn`` and by calibrations that find their
station. What was found in another base is another place, and what is no number is passed over.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from typing import Final

from robolink.accuracy._row_measurements import RowBound, scatter_of_repeats
from robolink.calibration import CameraModel, RowFact
from robolink.messages import tr
from robolink.model import Recorded
from robolink.stations import Station, StationKind, find_stations
from robolink.stations import station_of as station_in
from robolink.timing import local_label, wall_time

PLACED_ANEW_MM: Final = 0.5
"""A station that moved further than this, in mm, was remounted or hit by something."""

_TURNED_ANEW_DEG: Final = 2.0
_FOCUSED_ANEW_PERCENT: Final = 2.0

_LAST_DIGIT_MM: Final = 0.001 / math.sqrt(12)
_LAST_DIGIT: Final = 0.001
"""Smallest standard deviation assumed for a turn, in degrees, or a scale, in percent."""

_NEWEST: Final = 100


def learnt_rows(entries: Iterable[Recorded], station: str) -> dict[str, RowFact]:
    """Return the rows that repeated learning of a station shows; empty for too few.

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
        learnt = [(one, camera) for one in found if (camera := _camera(one)) is not None]
        stations, seen = [one for one, _ in learnt], [camera for _, camera in learnt]
        _add(rows, "camera_turn_deg", _turns(seen), stations)
        _add(rows, "camera_scale_percent", _scales(seen), stations)
        _add(rows, "place_mm", _camera_places(seen), stations)
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
    found: Sequence[Station],
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


def _camera(station: Station) -> CameraModel | None:
    """Return a camera as one calibration found it, ``None`` for an incomplete entry.

    The place that it knows best is the one to which tips are brought, where nothing else says it.
    """
    rows, origin = station.details.get("mm_per_px"), station.details.get("origin_mm")
    if not isinstance(rows, list) or not isinstance(origin, list):
        return None
    flat = [value for row in rows if isinstance(row, list) for value in row]
    matrix, place = _finite(*flat), _finite(*origin)
    if matrix is None or place is None or len(matrix) != 4 or len(place) != 2:
        return None
    a, b, c, d = matrix
    centre = station.details.get("centre_mm")
    known = _finite(*centre) if isinstance(centre, list) and len(centre) == 2 else None
    middle = known or _finite(station.x_mm, station.y_mm)
    camera = CameraModel(
        ((a, b), (c, d)), (place[0], place[1]), None if middle is None else (middle[0], middle[1])
    )
    return camera if camera.determinant else None


def _turns(seen: Sequence[CameraModel]) -> RowBound | None:
    turns: list[tuple[float]] = []
    for one in seen:
        turn = one.turn_deg
        if turns:  # relative to the turn before, so that 179.9 and -179.9 count as neighbours
            turn = turns[-1][0] + math.remainder(turn - turns[-1][0], 360)
        turns.append((turn,))
    return scatter_of_repeats(turns, anew_from=_TURNED_ANEW_DEG, floor=_LAST_DIGIT)


def _scales(seen: Sequence[CameraModel]) -> RowBound | None:
    scales = [(100 * math.log(abs(one.determinant)) / 2,) for one in seen]
    return scatter_of_repeats(scales, anew_from=_FOCUSED_ANEW_PERCENT, floor=_LAST_DIGIT)


def _camera_places(seen: Sequence[CameraModel]) -> RowBound | None:
    """Return how the place scatters at which one pixel looks: where the newest sees its middle."""
    if not seen or seen[-1].centre_mm is None:
        return None
    pixel = seen[-1].pixel(*seen[-1].centre_mm)
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
    """Return how many months ago a station was learnt; ``None`` if not recorded.

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
    # A damaged time label gives no age.
    with suppress(ValueError):
        then = datetime.fromisoformat(at)
        age = wall_time() - (then if then.tzinfo else then.replace(tzinfo=UTC))
        return max(age.total_seconds(), 0.0) / 86_400 / _DAYS_A_MONTH
    return None
