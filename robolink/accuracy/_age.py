"""How long ago a station was learnt, or has been used at least."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from datetime import UTC, datetime
from typing import Final

from robolink.model import Recorded
from robolink.stations import find_stations
from robolink.timing import wall_time

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
