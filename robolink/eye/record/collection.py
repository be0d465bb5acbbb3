"""Pictures that a site collected, each with its truth marked by hand.

A folder holds ``NAME.png`` and beside it ``NAME.json`` (docs/reference/eye.md). What a finder
answers to them is counted in four ways, and only the first is good: ``right``; ``none``, nothing
accepted where there is a tip; ``several``, more tips than there are; ``wrong``, a tip where there
is none, which is what a finder must not do.
"""

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from enum import StrEnum
from math import hypot, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from robolink.errors import ConfigError
from robolink.eye.candidate import Candidate, Polarity, TipShape
from robolink.eye.record.candidate_json import candidate_as_json
from robolink.eye.record.png import png_of
from robolink.files.named import read_named, save_named
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.eye.picture import Grey

__all__ = [
    "CollectedPicture",
    "FinderAnswer",
    "MarkedTip",
    "SCHEMA",
    "answer_to",
    "read_collection",
    "save_collected",
    "tally",
]

SCHEMA: Final = "robolink/eye-picture/1"

MOST_PICTURE_BYTES: Final = 64_000_000

NEAR_PX: Final = 3.0
NEAR_SHARE: Final = 0.1
"""A tip counts as found within 3 px or a tenth of its radius, whichever is more."""


class FinderAnswer(StrEnum):
    """What a finder's answer to a picture is worth."""

    RIGHT = "right"
    NONE = "none"
    SEVERAL = "several"
    WRONG = "wrong"


@dataclass(frozen=True, slots=True)
class MarkedTip:
    """Where a person saw a tip.

    Attributes:
        x_px, y_px: Its middle: X to the right and Y down, (0, 0) the middle of the first pixel.
        radius_px: Half the width of its face.
    """

    x_px: float
    y_px: float
    radius_px: float


@dataclass(frozen=True, slots=True)
class CollectedPicture:
    """A picture of a collection, and what a person marked in it.

    Attributes:
        path: The picture.
        shape: What was known of the tip when it was taken.
        tips: Those that a person saw; empty where there is none, or the picture cuts it.
        camera: Which camera it was, without user and password; empty where nobody said it.
    """

    path: Path
    shape: TipShape
    tips: tuple[MarkedTip, ...]
    camera: str = ""


def answer_to(tips: Sequence[MarkedTip], candidates: Iterable[Candidate]) -> FinderAnswer:
    """Return what an answer is worth, by docs/reference/eye.md.

    Args:
        tips: Those in the picture.
        candidates: What the finder answers; only what it accepted counts.
    """
    accepted = [one for one in candidates if one.accepted]
    found = [any(_is_at(tip, one) for one in accepted) for tip in tips]
    if any(not any(_is_at(tip, one) for tip in tips) for one in accepted):
        # With a right one beside it, it is refused as several, and nothing is measured.
        return FinderAnswer.SEVERAL if any(found) else FinderAnswer.WRONG
    if len(accepted) > len(tips):
        return FinderAnswer.SEVERAL
    if len(tips) > 1 and len(accepted) == 1:
        # One of two that is told as the only one may be the wrong one.
        return FinderAnswer.WRONG
    return FinderAnswer.RIGHT if all(found) else FinderAnswer.NONE


def _is_at(tip: MarkedTip, one: Candidate) -> bool:
    apart_px = hypot(one.x_px - tip.x_px, one.y_px - tip.y_px)
    return apart_px <= max(NEAR_PX, NEAR_SHARE * tip.radius_px)


def save_collected(
    folder: Path,
    grey: "Grey",
    tips: Sequence[MarkedTip],
    *,
    shape: TipShape,
    at: datetime,
    camera: str,
    candidates: Sequence[Candidate],
    robolink_version: str,
    marked_by: str = "",
) -> CollectedPicture:
    """Write a picture and what a person marked in it; the picture is there before its marks.

    Args:
        folder: Where.
        grey: The picture.
        tips: What a person saw.
        shape: What is known of the tip.
        at: Wall-clock label, from which the name is made.
        camera: Which camera it was, without user and password.
        candidates: What the finder answered, for whoever looks at it later; no test reads it.
        robolink_version: What wrote it.
        marked_by: Who marked it.

    Raises:
        ConfigError: It cannot be written.
    """
    path = free_name(folder, at)
    height, width = grey.shape
    save_named(path, png_of(grey))
    said = {
        "schema": SCHEMA,
        "picture": path.name,
        "taken_at": at.isoformat(timespec="seconds"),
        "camera": camera,
        "width_px": width,
        "height_px": height,
        "shape": asdict(shape),
        "tips": [asdict(one) for one in tips],
        "marked_by": marked_by,
        "robolink_version": robolink_version,
        "candidates": [candidate_as_json(one) for one in candidates],
    }
    text = json.dumps(said, indent=2, ensure_ascii=False, allow_nan=False)
    save_named(path.with_suffix(".json"), text.encode("utf-8"))
    return CollectedPicture(path, shape, tuple(tips), camera)


def free_name(folder: Path, at: datetime) -> Path:
    """Return the path of a picture that is not there yet, named by its moment."""
    stem, number = at.strftime("%Y%m%d-%H%M%S"), 1
    path = folder / f"{stem}.png"
    while path.exists() or path.with_suffix(".json").exists():
        number += 1
        path = folder / f"{stem}-{number}.png"
    return path


def read_collection(folder: Path) -> tuple[CollectedPicture, ...]:
    """Return all pictures of a folder with what was marked in them, by name.

    Args:
        folder: As :func:`save_collected` fills it. Pictures without a JSON file beside them were
            never marked and are left out.

    Raises:
        ConfigError: A file cannot be read, or says something that cannot be; names the file.
    """
    if not folder.is_dir():
        raise ConfigError(
            tr("There is no folder {folder}.", folder=folder),
            remedy=tr("'robolink eye collect FOLDER' fills one."),
        )
    return tuple(_collected(path) for path in sorted(folder.glob("*.json")))


def _collected(path: Path) -> CollectedPicture:
    try:
        said = json.loads(read_named(path))
        if said.get("schema") != SCHEMA:
            raise ValueError(tr("its schema is not {schema}", schema=SCHEMA))
        picture = path.with_name(_plain_name(said["picture"]))
        if not picture.is_file():
            raise ValueError(tr("its picture {name} is missing", name=picture.name))
        tips = tuple(_tip(one) for one in said["tips"])
        return CollectedPicture(picture, _shape(said["shape"]), tips, str(said.get("camera", "")))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        cause = getattr(error, "strerror", None) or error
        raise ConfigError(
            tr("{file} is no marked picture: {cause}", file=path, cause=cause),
            remedy=tr("Correct it as docs/reference/eye.md shows, or remove it."),
        ) from error


def _plain_name(name: object) -> str:
    if not isinstance(name, str) or not re.fullmatch(r"[^/\\:\0]+", name) or name in (".", ".."):
        raise ValueError(tr("its picture is no name of a file beside it"))
    return name


def _tip(said: Mapping[str, Any]) -> MarkedTip:
    tip = MarkedTip(*(float(said[key]) for key in ("x_px", "y_px", "radius_px")))
    if not (isfinite(tip.x_px) and isfinite(tip.y_px) and 0 < tip.radius_px < float("inf")):
        raise ValueError(tr("a tip needs three numbers, the radius above 0"))
    return tip


def _shape(said: Mapping[str, Any]) -> TipShape:
    known = {key: said[key] for key in TipShape.__dataclass_fields__ if key in said}
    return TipShape(**{**known, "polarity": Polarity(known.get("polarity", "either"))})


def tally(
    pictures: Iterable[CollectedPicture], find: Callable[[CollectedPicture], Sequence[Candidate]]
) -> dict[FinderAnswer, list[Path]]:
    """Return the pictures by what a finder's answer to them is worth.

    Args:
        pictures: A collection.
        find: Looks at one.
    """
    found: dict[FinderAnswer, list[Path]] = {answer: [] for answer in FinderAnswer}
    for one in pictures:
        found[answer_to(one.tips, find(one))].append(one.path)
    return found
