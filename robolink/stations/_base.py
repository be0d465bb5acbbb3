"""The base that places count from: the one a station was learnt in is the one it is used in."""

from typing import Final

from robolink.errors import NotReadyError, NotReadyReason, RobolinkError
from robolink.messages import tr
from robolink.model import Controller
from robolink.stations._station import Station

_SAME: Final = 0.0015
"""Bases that differ by less, in mm or degrees, are one: controllers show three decimals."""

_TURN_DEG: Final = 360.0


def base_now(controller: Controller) -> tuple[float, ...] | None:
    """Read where the base stands that positions count from.

    Args:
        controller: The controller, connected.

    Returns:
        X, Y, Z in mm and U, V, W in degrees, seen from the robot; ``None`` where that cannot be
        read, because this kind of controller has none or does not show it now.
    """
    if not controller.groups:
        return None
    try:
        return controller.groups[0].base()
    except RobolinkError:  # what lasts is met again by whoever does more than look
        return None


def learnt_elsewhere(controller: Controller, station: Station) -> tuple[float, ...] | None:
    """Return the base that stands now, if a station was learnt in another one; else ``None``.

    Nothing is asked for a station whose base is not on record.

    Args:
        controller: The controller, connected.
        station: What is known of the station.
    """
    if station.base is None or not station.learnt:
        return None
    now = base_now(controller)
    return None if now is None or _alike(station.base, now) else now


def require_base_of(controller: Controller, station: Station) -> None:
    """Refuse to use a station that was learnt in another base: its place is another one now.

    Args:
        controller: The controller, connected.
        station: What is known of the station.

    Raises:
        NotReadyError: ``other_base``, with both bases.
    """
    now = learnt_elsewhere(controller, station)
    if now is None or station.base is None:
        return
    raise NotReadyError(
        tr(
            "Station {id} was learnt with the controller's base (Base) at {before}; "
            "it is at {now} now, so the place on record is somewhere else.",
            id=station.id,
            before=_shown(station.base),
            now=_shown(now),
        ),
        reason=NotReadyReason.OTHER_BASE,
        remedy=tr(
            "Set Base as it was, or learn the station in this one with 'robolink cell station "
            "learn {id}'.",
            id=station.id,
        ),
        controller=controller.identity,
    )


def _alike(before: tuple[float, ...], now: tuple[float, ...]) -> bool:
    offs = [abs(a - b) for a, b in zip(before, now, strict=True)]
    turns = [min(off % _TURN_DEG, -off % _TURN_DEG) for off in offs[3:]]
    return max(*offs[:3], *turns) < _SAME


def _shown(base: tuple[float, ...]) -> str:
    return " ".join(f"{axis} {at:g}" for axis, at in zip("XYZUVW", base, strict=True))
