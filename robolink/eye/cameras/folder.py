"""Pictures that another program writes into a folder."""

import hashlib
import os
from pathlib import Path
from typing import Final, NamedTuple

from robolink.errors import CalibrationError
from robolink.eye.cameras.decoding import MOST_BYTES, decoded, unreadable
from robolink.eye.picture import CameraPicture
from robolink.messages import tr
from robolink.timing import NS_PER_S, Clock, Deadline, SystemClock

__all__ = ["FolderSource", "SUFFIXES"]

SUFFIXES: Final = (".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".pgm")
"""Ends of the names of pictures; capital letters count alike."""

_POLL_S: Final = 0.02
"""Time between two looks at the folder."""

_STEADY: Final = 2
"""Number of looks at the folder in a row in which a file has to be the same to be complete."""


class _File(NamedTuple):
    """A file as it is listed.

    Attributes:
        number: What it is, whatever its name.
        version: Size and time of the last change, compared for equality only.
        changed_ns: When anything of it changed last, its name too; for an order only.
        name: Its name.
    """

    number: tuple[int, int]
    version: tuple[int, int]
    changed_ns: int
    name: str


class _SeenFiles:
    """What happens in a folder from a question on.

    Args:
        there: What was in it when the question came.
    """

    def __init__(self, there: list[_File]) -> None:
        self._there = {file.number: file.version for file in there}
        self._absent = dict[tuple[int, int], int]()
        self._renewed = set[tuple[int, int]]()
        self._same = dict[_File, int]()

    def steady(self, listed: list[_File]) -> list[_File]:
        """Return pictures that are new or changed, and now as they were before; newest first."""
        self._forget({file.number for file in listed})
        changed = [
            file
            for file in listed
            if self._there.get(file.number) != file.version and file.name.lower().endswith(SUFFIXES)
        ]
        self._same = {file: self._same.get(file, 0) + 1 for file in changed}
        found = [file for file, times in self._same.items() if times == _STEADY]
        return sorted(found, key=lambda file: (file.changed_ns, file.name), reverse=True)

    def counts(self, file: _File) -> bool:
        """Return whether a whole picture was begun after the question."""
        if file.number not in self._there or file.number in self._renewed:
            return True
        self._there[file.number] = file.version
        self._renewed.add(file.number)
        return False

    def _forget(self, listed: set[tuple[int, int]]) -> None:
        """Forget files that are gone: their numbers are given to new ones.

        Only when they are missing twice: while a file is being renamed, a listing may miss it.
        """
        self._absent = {
            number: self._absent.get(number, 0) + 1 for number in self._there.keys() - listed
        }
        for number, times in self._absent.items():
            if times >= _STEADY:
                del self._there[number]


class FolderSource:
    """Implements :class:`~robolink.eye.source.PictureSource` on a folder.

    A picture counts if its file appeared after the question and is complete. Times in files are
    not believed: a copy keeps an old one, and the clock of another computer may be a day off. So
    the folder is listed when the question comes, and compared with that:

    * A file that was there does not count, not under another name either.
    * A file that is overwritten in place may have been half written when the question came. So
      its first whole picture is waited for, and the one after it counts.
    * A file is whole when it stays as it is for two looks at the folder and can be decoded.

    Args:
        folder: Where the pictures appear.
        timeout_s: How long is waited for one.
        clock: What is waited on.
    """

    def __init__(
        self, folder: Path, *, timeout_s: float = 10.0, clock: Clock | None = None
    ) -> None:
        self._folder = folder
        self._timeout_s = timeout_s
        self._clock = clock or SystemClock()

    @property
    def identity(self) -> str:
        """The folder."""
        return f"folder {self._folder}"

    @property
    def exposure_us(self) -> float | None:
        """Unknown: another program has the camera."""
        return None

    def expose(self, exposure_us: float) -> None:
        """Do nothing: another program has the camera."""

    def take(self) -> CameraPicture:
        """Wait for a picture; see :class:`~robolink.eye.source.PictureSource`.

        Raises:
            CalibrationError: ``camera_gone``: the folder cannot be read; ``picture_late``: no
                file appeared in time; ``picture_unreadable``: one did, and is no whole picture.
        """
        asked_ns = self._clock.now_ns()
        deadline = Deadline.after(self._clock, self._timeout_s)
        seen = _SeenFiles(self._listed())
        damaged: CalibrationError | None = None
        while not deadline.expired:
            self._clock.sleep(_POLL_S)
            for file in seen.steady(self._listed()):
                try:
                    picture = self._picture(file.name, asked_ns)
                except CalibrationError as error:
                    damaged = error  # it may still be written
                    continue
                if seen.counts(file):
                    return picture
                damaged = None
        raise self._late() if damaged is None else damaged

    def _listed(self) -> list[_File]:
        listed = list[_File]()
        try:
            with os.scandir(self._folder) as entries:
                for entry in entries:
                    try:
                        # Not entry.stat: on Windows it does not know the number of the file.
                        found = os.stat(entry.path)
                    except FileNotFoundError:
                        continue  # gone meanwhile, or a link to nothing
                    version = found.st_size, found.st_mtime_ns
                    number = found.st_dev, found.st_ino
                    listed.append(_File(number, version, found.st_ctime_ns, entry.name))
        except OSError as error:
            raise CalibrationError(
                "camera_gone",
                tr(
                    "The folder {folder} cannot be read: {cause}.",
                    folder=self._folder,
                    cause=error.strerror or error,
                ),
                remedy=tr("Check the folder, its drive, and the program that writes pictures."),
            ) from error
        return listed

    def _picture(self, name: str, asked_ns: int) -> CameraPicture:
        path = self._folder / name
        try:
            with open(path, "rb") as file:
                data = file.read(MOST_BYTES + 1)
        except OSError as error:
            raise unreadable(name, cause=error.strerror or str(error)) from error
        if len(data) > MOST_BYTES:
            raise unreadable(name, cause=tr("it is larger than {most} bytes", most=MOST_BYTES))
        return CameraPicture(
            grey=decoded(data, name),
            asked_s=asked_ns / NS_PER_S,
            digest=hashlib.sha256(data).hexdigest(),
            name=name,
            encoded=data,
        )

    def _late(self) -> CalibrationError:
        return CalibrationError(
            "picture_late",
            tr(
                "No new picture appeared in {folder} within {limit:g} s.",
                folder=self._folder,
                limit=self._timeout_s,
            ),
            remedy=tr("Check that the camera's program runs and writes its pictures there."),
        )

    def close(self) -> None:
        """Nothing is open."""
