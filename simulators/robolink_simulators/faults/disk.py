"""A disk that fails under SQLite databases: full, unwritable, with a sync that fails or lies.

Nothing of the program under test is replaced: :class:`FaultyDisk` stands where SQLite hands bytes
to the system (:mod:`robolink_simulators.faults.sqlite_vfs`), and where a log of SQLite's is opened
beside it, as a journal does to make one longer. What each fault does:

======================  =======================================================================
``FULL``                a write that makes a file longer fails, as ENOSPC would (SQLITE_FULL)
``UNWRITABLE``          every write fails; files are opened to be read only (as EROFS would)
``SYNC_FAILS``          the sync fails, and nobody knows what is on the disk (as EIO would)
``SYNC_LIES``           the sync succeeds, and what was written may be lost at a power cut
power cut               files as the disk holds them: all that was synced, and of the rest
                        nothing, or a share of its sectors that a seed draws
kill                    files as the system holds them: all that was written
cut short, bent page    of a file that nobody has open
======================  =======================================================================

Other files of the program (the traces beside a journal) are not SQLite's, and not touched; the
shared memory of WAL is never on the disk. That a log was removed counts as synced.
"""

import errno
import io
import os
import random
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self

from robolink_simulators.faults.sqlite_vfs import (
    CREATE,
    FULL,
    IOERR_FSYNC,
    IOERR_WRITE,
    OK,
    READ_ONLY,
    READ_WRITE,
    SqliteFiles,
    WatchedFile,
    files_for,
)

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_SECTOR: Final = 512
_WITH: Final = ("", "-wal", "-journal")
"""Suffixes of a database file and of the logs beside it."""


class DiskFault(Enum):
    """Faults of a disk that can begin and end."""

    FULL = auto()
    UNWRITABLE = auto()
    SYNC_FAILS = auto()
    SYNC_LIES = auto()


@dataclass(frozen=True, slots=True)
class _Change:
    """What was done to a file and is not certain to be on the disk."""

    offset: int
    before: bytes
    size_before: int
    data: bytes
    size_after: int


class _WatchedLog(io.FileIO):
    """A log that was opened beside SQLite."""

    def __init__(self, path: str, disk: "FaultyDisk") -> None:
        super().__init__(path, "r+b")
        self._disk = disk

    def write(self, data: "ReadableBuffer", /) -> int:
        """Write, unless the disk is full or unwritable."""
        end = self.tell() + memoryview(data).nbytes
        self._disk.admit(longer=end > os.fstat(self.fileno()).st_size)
        return super().write(data)


_disks: Final = list["FaultyDisk"]()
"""Those that are in use, the last one last."""
_open: Final = io.open


def _opened(file: Any, mode: str = "r", *more: Any, **named: Any) -> Any:  # noqa: ANN401 - as io.open
    """Open a file; a log that is to be written beside SQLite is watched."""
    if mode == "r+b" and isinstance(file, str | os.PathLike):
        path = os.fspath(file)
        disk = next((one for one in reversed(_disks) if one.watches(path)), None)
        if disk is not None and path.endswith("-wal"):
            disk.admit(longer=False)
            return _WatchedLog(path, disk)
    return _open(file, mode, *more, **named)


class FaultyDisk:
    """The disk under all SQLite databases of a folder that this process opens; a context manager.

    Databases that are open already are not reached: close them first
    (``robolink.journal.close_files``).

    Args:
        folder: Where the databases stand.

    Attributes:
        writes: Writes that succeeded.
        syncs: Syncs, honest or not.
        failed: Writes and syncs that failed.
        on_step: Called with ``write`` or ``sync`` and the file's path before each of them: what
            is copied then is what a kill or a power cut at that moment leaves. It must not raise.

    Raises:
        ConfigError: On entering: this Python hides SQLite's functions.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = str(folder.resolve())
        self._faults: dict[DiskFault, int] = {}
        self._unsynced: dict[str, list[_Change]] = {}
        self._files: SqliteFiles
        self.writes = 0
        self.syncs = 0
        self.failed = 0
        self.on_step: Callable[[str, str], None] | None = None

    def __enter__(self) -> Self:
        self._files = files_for(self)
        self._files.begin()
        _disks.append(self)
        vars(io)["open"] = _opened
        return self

    def __exit__(self, *_details: object) -> None:
        self._faults.clear()
        self._files.end()
        _disks.remove(self)
        if not _disks:
            vars(io)["open"] = _open

    def begin(self, fault: DiskFault, *, after: int = 0) -> None:
        """Begin a fault, after so many more successful writes."""
        self._faults[fault] = self.writes + after

    @property
    def lies(self) -> bool:
        """Whether data that it reports as stored may be lost."""
        return self._is_on(DiskFault.SYNC_LIES)

    def end(self, fault: DiskFault) -> None:
        """End the fault."""
        self._faults.pop(fault, None)

    def after_kill(self, database: Path, into: Path) -> Path:
        """Return a copy as found when the process is killed now.

        The files are closed after reading, with which SQLite's locks against other processes go.
        """
        for suffix in _WITH:
            source = database.with_name(database.name + suffix)
            if source.exists():
                shutil.copyfile(source, into / source.name)
        return into / database.name

    def after_power_cut(self, database: Path, into: Path, *, seed: int | None = None) -> Path:
        """Return a copy as found when the power fails now; see the table above.

        Args:
            database: The file, open or not.
            into: Another folder.
            seed: Draws the sectors that reached the disk unsynced; ``None`` for none of them.

        Example:
            >>> from pathlib import Path
            >>> from robolink.journal import close_files, open_journal
            >>> from robolink_simulators.faults import FaultyDisk
            >>> kept, found = Path("kept"), Path("found")
            >>> kept.mkdir(), found.mkdir()
            (None, None)
            >>> with FaultyDisk(kept) as disk:
            ...     journal = open_journal(str(kept / "journal.db"))
            ...     copy = disk.after_power_cut(kept / "journal.db", found, seed=7)
            ...     close_files()
            >>> copy.name
            'journal.db'
        """
        chance = None if seed is None else random.Random(f"power cut {seed}")
        copied = self.after_kill(database, into)
        for suffix in _WITH:
            changes = self._unsynced.get(str(database.resolve()) + suffix)
            copy = copied.with_name(copied.name + suffix)
            if changes and copy.exists():
                copy.write_bytes(_as_on_disk(copy.read_bytes(), changes, chance))
        return copied

    # The calls that SQLite makes.

    def watches(self, path: str) -> bool:
        """Return whether a file is in the folder."""
        return path.startswith(self._folder)

    def opened(self, path: str, flags: int) -> int:  # noqa: ARG002 - the watcher's own signature
        """Return the flags that a file is opened with."""
        if self._is_on(DiskFault.UNWRITABLE):
            return flags & ~(READ_WRITE | CREATE) | READ_ONLY
        return flags

    def write(self, file: WatchedFile, data: bytes, offset: int) -> int:
        """Write, unless the disk is full or unwritable.

        Args:
            file: Where, as SQLite opened it.
            data: What.
            offset: From which byte on.

        Example:
            >>> from pathlib import Path
            >>> from robolink.journal import close_files, open_journal
            >>> from robolink_simulators.faults import FaultyDisk
            >>> with FaultyDisk(Path.cwd()) as disk:  # SQLite writes by it
            ...     journal = open_journal("journal.db")
            ...     close_files()
            >>> disk.writes > 0
            True
        """
        self._step("write", file)
        size = file.size()
        if self._is_on(DiskFault.UNWRITABLE):
            return self._fail(IOERR_WRITE)
        if offset + len(data) > size and self._is_on(DiskFault.FULL):
            return self._fail(FULL)
        before = file.read(len(data), offset)
        code = file.write(data, offset)
        if code == OK:
            self.writes += 1
            after = max(size, offset + len(data))
            self._note(file, _Change(offset, before, size, data, after))
        return code

    def admit(self, *, longer: bool) -> None:
        """Let a log that was opened beside SQLite be written.

        Args:
            longer: Whether that makes it longer.

        Raises:
            OSError: The disk is unwritable, or full and the log gets longer.
        """
        if self._is_on(DiskFault.UNWRITABLE):
            self.failed += 1
            raise OSError(errno.EROFS, os.strerror(errno.EROFS))
        if longer and self._is_on(DiskFault.FULL):
            self.failed += 1
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def truncate(self, file: WatchedFile, size: int) -> int:
        """Cut a file short, unless the disk is unwritable."""
        if self._is_on(DiskFault.UNWRITABLE):
            return self._fail(IOERR_WRITE)
        before = file.size()
        lost = file.read(before - size, size) if before > size else b""
        self._note(file, _Change(size, lost, before, b"", size))
        return file.truncate(size)

    def sync(self, file: WatchedFile, flags: int) -> int:
        """Write pending data to the disk, fail, or lie about it."""
        self._step("sync", file)
        self.syncs += 1
        if self._is_on(DiskFault.SYNC_FAILS):
            return self._fail(IOERR_FSYNC)
        if self._is_on(DiskFault.SYNC_LIES):
            return OK
        self._unsynced.pop(file.path, None)
        return file.sync(flags)

    def _step(self, what: str, file: WatchedFile) -> None:
        if self.on_step is not None:
            self.on_step(what, file.path)

    def _note(self, file: WatchedFile, change: _Change) -> None:
        self._unsynced.setdefault(file.path, []).append(change)

    def _is_on(self, fault: DiskFault) -> bool:
        since = self._faults.get(fault)
        return since is not None and self.writes >= since

    def _fail(self, code: int) -> int:
        self.failed += 1
        return code


def cut_short(path: Path, count: int) -> None:
    """Leave only the first bytes of a file that nobody has open."""
    with path.open("r+b") as file:
        file.truncate(count)


def bend_page(path: Path, page: int, *, seed: int = 1, page_bytes: int = 2048) -> None:
    """Flip one bit of a page of a database that nobody has open.

    Args:
        path: The file.
        page: Which page, from 0; the first one holds the header.
        seed: Draws the bit.
        page_bytes: Length of a page; those of a journal are 2048 bytes long.

    Raises:
        ValueError: The file has no such page.
    """
    data = bytearray(path.read_bytes())
    if (page + 1) * page_bytes > len(data):
        raise ValueError(f"{path} has no page {page}")
    bit = random.Random(f"page {seed}").randrange(page_bytes * 8)
    data[page * page_bytes + bit // 8] ^= 1 << bit % 8
    path.write_bytes(data)


def _as_on_disk(written: bytes, changes: list[_Change], chance: random.Random | None) -> bytes:
    """Undo changes, and redo those that a seed lets arrive."""
    image = bytearray(written)
    for change in reversed(changes):
        end = change.offset + len(change.before)
        image.extend(bytes(max(0, end - len(image))))
        image[change.offset : end] = change.before
        del image[change.size_before :]
    for change in changes if chance is not None else ():
        if not change.data:
            if chance is not None and chance.random() < 0.5:
                del image[change.size_after :]
            continue
        for start in range(0, len(change.data), _SECTOR):
            if chance is not None and chance.random() < 0.5:
                piece, at = change.data[start : start + _SECTOR], change.offset + start
                image.extend(bytes(max(0, at + len(piece) - len(image))))
                image[at : at + len(piece)] = piece
    return bytes(image)
