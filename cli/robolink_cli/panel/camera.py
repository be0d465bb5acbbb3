"""The newest picture of a cell's camera, as a job left it on this computer; no camera is opened."""

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Final

from robolink.timing import wall_time

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink.report import LookPicture

READ_S: Final = 1.0
"""Shortest pause between two looks for a newer picture, in s."""

OLD_S: Final = 5.0
"""Age in s from which a picture is drawn pale: it is not what the camera sees now."""

GONE_S: Final = 3600.0
"""Age in s from which it is not shown any more."""

_MOST_CIRCLES: Final = 8


@dataclass(frozen=True, slots=True)
class CameraLook:
    """What a camera of the cell saw last.

    Attributes:
        stamp: Of this picture and no other; it goes into the address of the picture.
        at: When it was taken.
        picture: The picture with its circles. What is told of it is said in the language of
            whoever is asked.
        accepted: How many of the circles were accepted.
    """

    stamp: str
    at: datetime
    picture: "LookPicture"
    accepted: int

    def age_s(self) -> float:
        """Return how old it is now; never less than nothing, whatever the clock did."""
        return max(0.0, (wall_time() - self.at).total_seconds())


def cameras_of(configured: "Cell | None") -> tuple[str, ...]:
    """Return the addresses of a cell's cameras, without user and password.

    Args:
        configured: What the cell file says; ``None`` where there is none.
    """
    from robolink.model import sensor_address

    stations = configured.settings.stations if configured is not None else None
    said = (getattr(station, "sensor", None) for station in (stations or {}).values())
    return tuple(dict.fromkeys(sensor_address(sensor) for sensor in said if sensor))


def newest_of(addresses: Sequence[str], before: CameraLook | None) -> CameraLook | None:
    """Return the newest picture of some cameras; ``None`` where there is none, or it is too old.

    Args:
        addresses: The cameras, as :func:`cameras_of` names them.
        before: What was found last: a picture that is still the newest is not read again.
    """
    from robolink.eye.record.newest_look import newest_path

    found = list[tuple[int, str]]()
    for address in addresses:
        try:
            found.append((os.stat(newest_path(address)).st_mtime_ns, address))
        except OSError:
            continue  # nothing was seen there yet
    if not found:
        return None
    changed_ns, address = max(found)
    stamp = hashlib.sha256(f"{changed_ns} {address}".encode()).hexdigest()[:16]
    look = before if before is not None and before.stamp == stamp else _read(address, stamp)
    return look if look is not None and look.age_s() <= GONE_S else None


def _read(address: str, stamp: str) -> CameraLook | None:
    from robolink.eye.record.newest_look import read_newest
    from robolink.report import LookCircle, LookPicture

    newest = read_newest(address)
    if newest is None:
        return None
    try:
        at = datetime.fromisoformat(newest.at)
    except ValueError:
        return None
    circles = tuple(
        LookCircle(one.x_px, one.y_px, one.radius_px, one.accepted, str(number))
        for number, one in enumerate(newest.candidates[:_MOST_CIRCLES], start=1)
    )
    picture = LookPicture(
        newest.png, newest.width_px, newest.height_px, circles, newest.station or address
    )
    accepted = sum(one.accepted for one in newest.candidates)
    return CameraLook(stamp, at, picture, accepted)
