"""The folder that a controller's file statements reach, and nothing outside of it.

Drives are folders named by their letters, ``c`` for ``C:``; a name without a drive counts from
the present folder of the present drive. Neither ``..`` nor a link leads out of the whole.
"""

import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from tempfile import mkdtemp
from typing import Final
from weakref import finalize

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

FIRST_DRIVE: Final = "c"
_DRIVE: Final = re.compile(r"([A-Za-z]):(.*)$", re.DOTALL)
_FORBIDDEN: Final = re.compile(r'[\x00-\x1f<>:"|?*]')
"""Characters that Windows, where a controller's files are stored, does not allow in a file name."""


class FileFolder:
    """A folder with drives in it.

    Args:
        root: The folder; by default one of its own that is removed at the end.

    Attributes:
        encoding: How texts are written and read; the project's.
        drive: The present drive, a letter in lower case.
    """

    def __init__(self, root: Path | None = None) -> None:
        self._root = root
        self.encoding = "utf-8"
        self.drive = FIRST_DRIVE
        self._present: tuple[str, ...] = ()

    @property
    def root(self) -> Path:
        """The folder on this machine."""
        if self._root is None:
            self._root = Path(mkdtemp(prefix="robolink-spel-"))
            finalize(self, shutil.rmtree, self._root, ignore_errors=True)
        return self._root

    @root.setter
    def root(self, folder: Path) -> None:
        self._root = folder
        self.drive, self._present = FIRST_DRIVE, ()

    @property
    def present(self) -> str:
        """The present folder as CurDir$ gives it; how it is written is assumed."""
        return f"{self.drive.upper()}:\\" + "\\".join(self._present)

    def path(self, name: str) -> Path:
        """Return the path of a name on this machine, existing or not.

        Raises:
            Refusal: It leads out of the folder, or is no name of a file.
        """
        return self._within(*self._parts(name))

    def exists(self, name: str, *, folder: bool) -> bool:
        """Return whether a file, or a folder, of that name exists (FileExists, FolderExists).

        Raises:
            Refusal: It is no name, or leads out of the folder.
        """
        path = self.path(name)
        return path.is_dir() if folder else path.is_file()

    def change(self, name: str) -> None:
        """Go to a folder (ChDir).

        Raises:
            Refusal: There is no such folder.
        """
        drive, parts = self._parts(name)
        if parts and not self._within(drive, parts).is_dir():
            raise SpelRefusal(RefusalKind.FILE_FOLDER, f"There is no folder {name}")
        self.drive, self._present = drive, parts

    def change_drive(self, letter: str) -> None:
        """Go to the uppermost folder of a drive (ChDrive).

        Raises:
            Refusal: It is no letter of a drive.
        """
        drive = letter.rstrip(":\\").lower()
        if len(drive) != 1 or not drive.isascii() or not drive.isalpha():
            raise SpelRefusal(RefusalKind.FILE_DRIVE, f"There is no drive {letter}")
        self.drive, self._present = drive, ()

    def write(self, name: str, content: bytes) -> None:
        """Write a whole file; one that is there is replaced (assumed).

        Raises:
            Refusal: Its folder is not there, or it cannot be written.
        """
        self._carry_out(name, lambda path: path.write_bytes(content))

    def copy(self, source: str, target: str) -> None:
        """Copy a file; one that is there is replaced (assumed).

        Raises:
            Refusal: It is not there, or cannot be copied.
        """
        there = self.path(target)
        self._carry_out(source, lambda path: shutil.copyfile(self._file(path, source), there))

    def delete(self, name: str) -> None:
        """Delete a file.

        Raises:
            Refusal: It is not there, or cannot be deleted.
        """
        self._carry_out(name, lambda path: os.unlink(self._file(path, name)))

    def rename(self, name: str, other: str) -> None:
        """Give a file another name; one that is there already is left (assumed).

        Raises:
            Refusal: It is not there, the other one is, or it cannot be renamed.
        """
        there = self.path(other)
        if there.exists():
            raise SpelRefusal(RefusalKind.FILE_DENIED, f"There is a file {other}")
        self._carry_out(name, lambda path: os.rename(self._file(path, name), there))

    def make(self, name: str) -> None:
        """Make a folder.

        Raises:
            Refusal: It is there, or what it would stand in is not.
        """
        self._carry_out(name, os.mkdir)

    def remove(self, name: str) -> None:
        """Remove an empty folder.

        Raises:
            Refusal: It is not there, or holds something.
        """
        self._carry_out(name, os.rmdir)

    def _carry_out(self, name: str, act: Callable[[Path], object]) -> None:
        path = self.path(name)
        try:
            act(path)
        except FileNotFoundError as error:
            raise SpelRefusal(RefusalKind.NO_SUCH_FILE, f"There is no {name}") from error
        except OSError as error:
            raise SpelRefusal(RefusalKind.FILE_DENIED, f"{name}: {error.strerror}") from error

    def _file(self, path: Path, name: str) -> Path:
        if not path.is_file():
            raise SpelRefusal(RefusalKind.NO_SUCH_FILE, f"There is no file {name}")
        return path

    def _parts(self, name: str) -> tuple[str, tuple[str, ...]]:
        """Return the drive of a name, and the folders and the file below it."""
        match = _DRIVE.match(name)
        drive, rest = (self.drive, name) if match is None else (match[1].lower(), match[2])
        rest = rest.replace("\\", "/")
        parts = [] if match is not None or rest.startswith("/") else list(self._present)
        for part in rest.split("/"):
            if part in ("", "."):
                continue
            if part == "..":
                if not parts:
                    raise SpelRefusal(RefusalKind.FILE_DENIED, f"{name} leads outside")
                parts.pop()
                continue
            if _FORBIDDEN.search(part) or part != part.rstrip(" ."):
                raise SpelRefusal(RefusalKind.FILE_ACCESS, f"{part!r} is no name of a file")
            parts.append(part)
        return drive, tuple(parts)

    def _within(self, drive: str, parts: tuple[str, ...]) -> Path:
        base = self.root.resolve() / drive
        base.mkdir(parents=True, exist_ok=True)
        path = base.joinpath(*parts)
        if not path.resolve().is_relative_to(base.resolve()) or base.is_symlink():
            raise SpelRefusal(RefusalKind.FILE_DENIED, "A link leads outside")
        return path
