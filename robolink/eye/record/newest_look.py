"""The newest look of each camera, small, for whoever watches a job from another process."""

import json
from base64 import b64decode, b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from robolink.eye.candidate import Candidate
from robolink.eye.record.candidate_json import candidate_as_json, candidate_of
from robolink.files.durable import file_name, make_folder, state_folder, write_whole
from robolink.timing import wall_time

if TYPE_CHECKING:
    from robolink.eye.picture import CameraPicture

__all__ = ["NewestLook", "note_newest", "read_newest"]

SCHEMA: Final = "robolink/newest-look/1"

MOST_PX: Final = 480
"""Longest side of the picture, in pixels."""

MOST_BYTES: Final = 2_000_000


@dataclass(frozen=True, slots=True)
class NewestLook:
    """What a camera saw last.

    Attributes:
        at: When, ISO 8601 UTC with milliseconds.
        station: Name of the station, empty where nobody named it.
        code: Why the look was refused, empty where it was not.
        width_px, height_px: Size of the picture when it was taken.
        candidates: All that was found, in those pixels.
        png: The picture, made smaller.
    """

    at: str
    station: str
    code: str
    width_px: int
    height_px: int
    candidates: tuple[Candidate, ...]
    png: bytes


def newest_path(address: str) -> Path:
    """Return the file of a camera's newest look.

    Args:
        address: Its URL, without user and password.
    """
    return state_folder("newest-looks") / file_name(address)


def note_newest(
    address: str,
    picture: "CameraPicture",
    candidates: Sequence[Candidate],
    *,
    station: str,
    code: str = "",
) -> None:
    """Write the newest look of a camera; where that is not possible, it is left out.

    Args:
        address: The camera's URL, without user and password.
        picture: The picture.
        candidates: What was found in it.
        station: Name of the station, empty where nobody named it.
        code: Why the look was refused, empty where it was not.
    """
    from robolink.eye.record.png import png_of, shrunk

    small, by = shrunk(picture.grey, MOST_PX)
    height, width = small.shape
    document = {
        "schema": SCHEMA,
        "at": wall_time().isoformat(timespec="milliseconds"),
        "station": station,
        "code": code,
        "width_px": width * by,
        "height_px": height * by,
        "candidates": [candidate_as_json(one) for one in candidates],
        "png": b64encode(png_of(small, level=1)).decode("ascii"),
    }
    path = newest_path(address)
    try:
        make_folder(path.parent)
        write_whole(path, json.dumps(document, allow_nan=False).encode("ascii"))
    except (OSError, ValueError):
        return  # nobody misses a picture that is only watched


def read_newest(address: str) -> NewestLook | None:
    """Return the newest look of a camera; ``None`` where there is none that can be read.

    Args:
        address: Its URL, without user and password.
    """
    try:
        with newest_path(address).open("rb") as file:
            document = json.loads(file.read(MOST_BYTES))
        return NewestLook(
            at=str(document["at"]),
            station=str(document["station"]),
            code=str(document["code"]),
            width_px=int(document["width_px"]),
            height_px=int(document["height_px"]),
            candidates=tuple(map(candidate_of, document["candidates"])),
            png=b64decode(document["png"], validate=True),
        )
    except (OSError, ValueError, KeyError, TypeError):
        return None
