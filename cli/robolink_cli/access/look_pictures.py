"""Pictures of a camera for a report: the first and the last of a change, and the refused ones."""

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Final

from robolink.errors import RobolinkError
from robolink.files.durable import state_folder
from robolink.messages import tr
from robolink.timing import local_label

if TYPE_CHECKING:
    from robolink.eye.candidate import Candidate
    from robolink.eye.kept_pictures import KeptPicture
    from robolink.eye.picture import CameraPicture
    from robolink.report import LookPicture

MOST_REFUSED: Final = 4
"""Number of refused looks in a report, the newest."""

MOST_PX: Final = 480
"""Longest side of a picture in a report, in pixels: about 200 kB a picture."""

_MOST_LINES: Final = 1


def looks_of(change: str) -> "tuple[LookPicture, ...]":
    """Return the pictures of a change that are kept on this computer, for its report.

    Args:
        change: Its whole id; empty for none.
    """
    if not change or not state_folder("pictures").is_dir():
        return ()  # no own eye was ever used here
    from robolink.eye.kept_pictures import kept_pictures

    return tuple(_pages(_chosen(kept_pictures(change=change))))


def picture_for_page(
    picture: "CameraPicture",
    candidates: "Sequence[Candidate]",
    *,
    caption: str,
    told: Sequence[str] = (),
    most_px: int = MOST_PX,
) -> "LookPicture":
    """Return a picture with its circles, as pages show it.

    Args:
        picture: The picture.
        candidates: What was found in it.
        caption: When it was taken, and what for.
        told: What else is to be read of it.
        most_px: Longest side in the page.
    """
    from robolink.eye.record.png import png_of, shrunk
    from robolink.report import LookCircle, LookPicture

    small, by = shrunk(picture.grey, most_px)
    height, width = small.shape
    circles = tuple(
        LookCircle(one.x_px, one.y_px, one.radius_px, one.accepted, str(number))
        for number, one in enumerate(candidates, start=1)
    )
    return LookPicture(png_of(small), width * by, height * by, circles, caption, tuple(told))


def _chosen(kept: "Sequence[KeptPicture]") -> "list[KeptPicture]":
    """Return the first and the last look in which the tip was seen, and the newest refused ones."""
    from robolink.eye.kept_pictures import LookRole

    firsts = [one for one in kept if one.look.role is LookRole.FIRST]
    lasts = [one for one in kept if one.look.role is LookRole.LAST]
    refused = [one for one in kept if one.look.role is LookRole.REFUSED]
    chosen = [*firsts[:1], *refused[-MOST_REFUSED:], *lasts[-1:]]
    return sorted(chosen, key=lambda one: one.at)


def _pages(kept: "Sequence[KeptPicture]") -> "Iterator[LookPicture]":
    from robolink.eye.cameras.decoding import decoded
    from robolink.eye.picture import CameraPicture
    from robolink.eye.reasons import candidate_line

    for one in kept:
        try:
            grey = decoded(one.path.read_bytes(), one.path.name)
        except (OSError, RobolinkError):
            continue  # deleted meanwhile, or its package was: the report is good without it
        candidates = one.look.candidates
        lines = (candidate_line(number, found) for number, found in enumerate(candidates, start=1))
        yield picture_for_page(
            CameraPicture(grey, asked_s=0.0),
            candidates,
            caption=_caption(one),
            told=tuple(islice(lines, _MOST_LINES)),
        )


def _caption(one: "KeptPicture") -> str:
    from robolink.eye.kept_pictures import LookRole

    at, camera = local_label(one.at), one.look.station or one.look.camera
    match one.look.role:
        case LookRole.FIRST:
            return tr("First look, {camera}, {at}", camera=camera, at=at)
        case LookRole.LAST:
            return tr("Last look, {camera}, {at}", camera=camera, at=at)
    return tr("Refused ({code}), {camera}, {at}", code=one.look.code, camera=camera, at=at)
