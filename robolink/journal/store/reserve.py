"""Room on the disk for the ends of jobs that have begun: a reserve in SQLite's write-ahead log.

A write that cannot be recorded is put back, and its order is delivered again later: the wire shows
new, old, new. So nothing begins unless the log has room for how it will end. A commit writes to the
log alone, and to the database at checkpoints, which may fail without harm as long as the log has
room. Behind its last frame the log is made longer with zeros, which SQLite takes for the end of it
and writes over (https://www.sqlite.org/fileformat2.html 4.1 to 4.4): so no other program of this
computer can take that room, a process that is killed leaves nothing to repair, and a journal needs
no new tables.

Which frames are in use is read from the file: those with the salts of its header, always the
first ones. A transaction that is larger than SQLite's cache (2 MB) writes frames before its commit,
and those behind a page that it changed once more have no salts until then, but the number of a
page. Frames that a rolled-back transaction left count too; that is more than is in use, never less.
The file may be opened beside SQLite because SQLite locks other files.

It does not hold where writing over a block takes another one (btrfs, ZFS), and not for the index of
a log that readers or a full disk kept from its restart for 4,062 frames.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Final
from weakref import finalize

if TYPE_CHECKING:
    import sqlite3

JOB_FRAMES: Final = 160
"""Frames that are free for each job when one begins: 330 KB. Of 400 changes of one tool by an
order, in a record of 2 MB, the longest took 58; the others are for a turn test and its movements.
"""

END_FRAMES: Final = 64
"""Frames of these that a job leaves for its end, with what it may put back."""

MOST_JOBS: Final = 32
"""Jobs at once for which room is kept, about 11 MB; twice as many as an agent works on."""

_MAGIC: Final = (b"\x37\x7f\x06\x82", b"\x37\x7f\x06\x83")
_HEADER_BYTES: Final = 32
_FRAME_HEADER_BYTES: Final = 24
_SALTS: Final = slice(16, 24)
_PAGE_NUMBER: Final = slice(0, 4)
_FRAME_SALTS: Final = slice(8, 16)
_NO_PAGE: Final = bytes(4)
_NO_SALTS: Final = bytes(8)


class LogReserve:
    """Keeps room in the write-ahead log of one connection.

    Args:
        driver: The connection to the file of the database.

    Raises:
        sqlite3.Error: The file cannot be read; so each call.
    """

    def __init__(self, driver: "sqlite3.Connection") -> None:
        self._driver = driver
        self._extent = (0, 0, 0)
        self._opened: FileIO | None = None
        self._close: Callable[[], object] = lambda: None
        self._frame_bytes = _FRAME_HEADER_BYTES + self._pragma("page_size")

    def begin(self) -> None:
        """Note how the file is at the start of a transaction; the caller has the write lock."""
        self._extent = self._now()

    def keep(self, frames: int) -> None:
        """Make sure that so many more frames can be written behind those of the transaction.

        Those are as many as the pages that the file grew by, the pages that were taken from its
        free list or put there, and the rows that were changed, but no more than the file has pages.
        That is too few where it takes pages that it freed itself, of rows of more than a page.

        Raises:
            OSError: The disk has no room for them; the log is as long as it was.
        """
        before, now = self._extent, self._now()
        written = sum(abs(new - old) for old, new in zip(before, now, strict=True))
        frames += min(written, max(before[0], now[0]))
        log = self._opened or self._open()
        size = log.seek(0, 2)
        there = max(0, size - _HEADER_BYTES) // self._frame_bytes
        salts = _salts_in_use(log)
        free_from = there - frames
        if free_from >= 0 and not self._is_used(log, free_from, salts):
            return
        used = bisect_left(range(there), x=True, key=lambda at: not self._is_used(log, at, salts))
        self._extend(log, size, used + frames)

    def begin_log_anew(self) -> None:
        """Let the log begin anew, if no reader and no full disk prevents that.

        SQLite does so by itself after some 200 frames. On a full disk the log may be shorter than
        that and have no room left but for ends, while a job goes on and gives signs of life.
        """
        with self.unwaiting():
            ((busy, *_),) = self._driver.execute("PRAGMA wal_checkpoint(RESTART)").fetchall()
            if not busy:  # so the next frame is the first, whoever writes it
                self._write_page()

    @contextmanager
    def unwaiting(self) -> Iterator[None]:
        """Within the block, fail at once where another program keeps the file locked."""
        wait_ms = self._pragma("busy_timeout")
        self._driver.execute("PRAGMA busy_timeout=0")
        try:
            yield
        finally:
            self._driver.execute(f"PRAGMA busy_timeout={wait_ms}")

    def close(self) -> None:
        """Close the file; what was made longer stays so until SQLite deletes the log."""
        self._close()

    def _now(self) -> tuple[int, int, int]:
        pages, free = self._pragma("page_count"), self._pragma("freelist_count")
        return pages, free, self._driver.total_changes

    def _pragma(self, name: str) -> int:
        ((value,),) = self._driver.execute(f"PRAGMA {name}").fetchall()
        return int(value)

    def _write_page(self) -> None:
        """Write the first page as it is: one frame."""
        self._driver.execute("BEGIN IMMEDIATE")
        try:
            self._driver.execute(f"PRAGMA user_version={self._pragma('user_version')}")
            self._driver.commit()
        finally:
            self._driver.rollback()

    def _open(self) -> FileIO:
        """Open the log, which is there as long as a connection that has read or written."""
        # SQLite follows links to the database on POSIX, not on Windows, and names the log after it.
        listed = self._driver.execute("PRAGMA database_list").fetchall()
        (database,) = [file for _number, name, file in listed if name == "main"]
        # Unbuffered: others write it between two looks.
        log = Path(f"{database}-wal").open("r+b", buffering=0)  # noqa: SIM115 - closed below
        self._opened, self._close = log, finalize(self, log.close)  # also of one nobody closes
        return log

    def _is_used(self, log: FileIO, at: int, salts: bytes) -> bool:
        log.seek(_HEADER_BYTES + at * self._frame_bytes)
        header = log.read(_FRAME_HEADER_BYTES)
        written = bool(salts) and header[_PAGE_NUMBER] != _NO_PAGE
        return written and header[_FRAME_SALTS] in (salts, _NO_SALTS)

    def _extend(self, log: FileIO, size: int, frames: int) -> None:
        end = _HEADER_BYTES + frames * self._frame_bytes
        try:
            while (at := log.seek(0, 2)) < end:
                log.write(bytes(end - at))
        except OSError:
            log.truncate(size)
            raise


def _salts_in_use(log: FileIO) -> bytes:
    """Return the salts of the frames in use; empty if there is none."""
    log.seek(0)
    header = log.read(_HEADER_BYTES)
    return header[_SALTS] if header[:4] in _MAGIC else b""
