"""Pictures that are kept: of every refused look, and the first and the last of each run."""

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Final

from robolink import runtime
from robolink.eye.candidate import Candidate
from robolink.eye.record.candidate_json import candidate_as_json, candidate_of
from robolink.eye.record.newest_look import note_newest
from robolink.files.durable import make_folder, state_folder, write_whole
from robolink.timing import Clock, Deadline, SystemClock, wall_time

if TYPE_CHECKING:
    from robolink.eye.picture import CameraPicture, Grey

__all__ = [
    "KeptLook",
    "KeptPicture",
    "LookRole",
    "PictureStore",
    "kept_pictures",
]

SCHEMA: Final = "robolink/kept-picture/1"

MOST_LOOKS: Final = 200
"""Number of looks that are kept; the oldest goes first."""

MOST_BYTES: Final = 200 * 1024 * 1024
"""Size of all kept pictures together."""


SHOWN_S: Final = 0.5
"""Shortest pause between two looks that can be watched, in s."""


class LookRole(StrEnum):
    """Why a picture is kept."""

    FIRST = "first"
    """The first of a run in which the mark was seen."""

    LAST = "last"
    """The last of a run in which it was."""

    REFUSED = "refused"
    """One in which it was not, or more than one."""


@dataclass(frozen=True, slots=True)
class KeptLook:
    """What is kept with a picture.

    Attributes:
        role: Why it is kept.
        code: Why the look was refused, empty where it was not.
        camera: Which camera, without a user or a password.
        station: Name of the station, empty where nobody named it.
        mark: What was looked for: the tip (0), or the number of a fiducial.
        candidates: All that was found.
        change: Id of the tool change for which it was taken, empty for none.
    """

    role: LookRole
    code: str
    camera: str
    station: str
    mark: int
    candidates: tuple[Candidate, ...]
    change: str = ""


@dataclass(frozen=True, slots=True)
class KeptPicture:
    """A picture that was kept, as it is found again.

    Attributes:
        path: The picture.
        at: When, ISO 8601 UTC with milliseconds.
        size_px: Width and height.
        look: What was found in it.
    """

    path: Path
    at: str
    size_px: tuple[int, int]
    look: KeptLook


class PictureStore:
    """Keeps pictures in a folder, not more than so many and so large together.

    A disk that is full, or a folder that cannot be written, ends no measurement: the picture is
    not kept then.

    Args:
        folder: Where; made when it is needed. The state folder by default.
        most_looks: How many are kept.
        most_bytes: How large all files together may be.
        address: URL of the camera, without user and password, under which its newest look can be
            watched; empty for none.
        clock: What the pause between two newest looks is read on.
    """

    def __init__(
        self,
        folder: Path | None = None,
        *,
        most_looks: int = MOST_LOOKS,
        most_bytes: int = MOST_BYTES,
        address: str = "",
        clock: Clock | None = None,
    ) -> None:
        self._address = address
        self._clock = clock or SystemClock()
        self._shown = Deadline.after(self._clock, 0.0)
        self._folder = folder
        self._most_looks = most_looks
        self._most_bytes = most_bytes

    @property
    def folder(self) -> Path:
        """Where the pictures are."""
        return self._folder or state_folder("pictures")

    def keep(self, look: KeptLook, picture: "CameraPicture") -> Path | None:
        """Keep a picture.

        Args:
            look: What was found in it.
            picture: The picture.

        Returns:
            Where it is; ``None`` where it could not be kept.
        """
        try:
            return self._kept(look, picture)
        except OSError:
            return None

    def show(self, look: KeptLook, picture: "CameraPicture") -> None:
        """Let a look be watched, in place of the one before; at most two a second.

        A refused one is shown whenever it comes: it may be the last.

        Args:
            look: What was found in it.
            picture: The picture.
        """
        if self._address and (look.code or self._shown.expired):
            self._shown = Deadline.after(self._clock, SHOWN_S)
            note_newest(
                self._address, picture, look.candidates, station=look.station, code=look.code
            )

    def _kept(self, look: KeptLook, picture: "CameraPicture") -> Path:
        folder, data = self.folder, picture.encoded or _pgm(picture.grey)
        make_folder(folder)
        at = wall_time().isoformat(timespec="milliseconds")
        drawn = runtime.random_bytes(4).hex()
        stem = f"{at[:23].replace(':', '').replace('.', '-')}-{look.role}-{drawn}"
        path = folder / f"{stem}{_suffix(data)}"
        document = {
            "schema": SCHEMA,
            "at": at,
            "picture": path.name,
            "size_px": list(picture.size_px),
            **{key: value for key, value in asdict(look).items() if key != "candidates"},
            "candidates": [candidate_as_json(one) for one in look.candidates],
        }
        text = json.dumps(document, indent=1, allow_nan=False).encode()
        self._make_room(len(data) + len(text))
        write_whole(path, data)
        try:
            write_whole(folder / f"{stem}.json", text)
        except OSError:
            path.unlink(missing_ok=True)  # a picture of which nothing is known
            raise
        return path

    def _make_room(self, size: int) -> None:
        """Delete the oldest until one more has room."""
        stems = dict[str, int]()
        for path in sorted(self.folder.iterdir()):
            with suppress(FileNotFoundError):
                stems[path.stem] = stems.get(path.stem, 0) + path.stat().st_size
        total = sum(stems.values())
        while stems and (len(stems) >= self._most_looks or total + size > self._most_bytes):
            oldest = next(iter(stems))
            total -= stems.pop(oldest)
            for path in self.folder.glob(f"{oldest}.*"):
                path.unlink(missing_ok=True)

    def pictures(self) -> Iterator[KeptPicture]:
        """Yield what is kept, the oldest first; what cannot be read is left out."""
        with suppress(OSError):
            for path in sorted(self.folder.glob("*.json")):
                with suppress(OSError, ValueError, KeyError, TypeError):
                    yield _read(path)


def kept_pictures(
    *,
    change: str = "",
    station: str = "",
    since: str = "",
    until: str = "",
    store: PictureStore | None = None,
) -> list[KeptPicture]:
    """Return the kept pictures of a change, of a station or of a run there; the oldest first.

    Args:
        change: Id of the tool change for which they were taken; empty for any.
        station: Name of the station; empty for all.
        since: When the run began, ISO 8601; empty for the beginning.
        until: When it ended, likewise; empty for now.
        store: Where they are kept; the state folder by default.
    """
    return [
        one
        for one in (store or PictureStore()).pictures()
        if (not change or one.look.change == change)
        and (not station or one.look.station == station)
        and (not since or one.at[:19] >= since[:19])
        and (not until or one.at[:19] <= until[:19])
    ]


def _read(path: Path) -> KeptPicture:
    document = json.loads(path.read_text())
    picture = path.with_name(Path(str(document["picture"])).name)
    width, height = document["size_px"]
    return KeptPicture(
        path=picture,
        at=str(document["at"]),
        size_px=(int(width), int(height)),
        look=KeptLook(
            role=LookRole(document["role"]),
            code=str(document["code"]),
            camera=str(document["camera"]),
            station=str(document["station"]),
            mark=int(document["mark"]),
            candidates=tuple(map(candidate_of, document["candidates"])),
            change=str(document.get("change", "")),
        ),
    )


def _pgm(grey: "Grey") -> bytes:
    height, width = grey.shape
    return b"P5 %d %d 255\n" % (width, height) + grey.tobytes()


_SUFFIXES: Final = {b"\xff\xd8": ".jpg", b"\x89P": ".png", b"BM": ".bmp", b"P5": ".pgm"}


def _suffix(data: bytes) -> str:
    return _SUFFIXES.get(data[:2], ".tif")
