"""SQLite's own file functions, wrapped: the library's writes pass here first.

SQLite reaches files through a table of functions, its VFS (https://www.sqlite.org/vfs.html). The
usual one is copied, and of each file opened under it writing, truncating and syncing are replaced.
So whoever opens a database by ``sqlite3`` in this process gets it, unpatched and without knowing.
It needs a Python whose ``_sqlite3`` shows SQLite's functions, as those of Linux distributions,
pyenv and conda do.
"""

import ctypes
from collections.abc import Callable
from ctypes import CFUNCTYPE, POINTER, Structure, byref, c_char_p, c_int, c_int64, c_void_p, cast
from functools import cache
from threading import Lock
from typing import Any, Final, Protocol

from robolink.errors import ConfigError
from robolink.messages import tr

OK: Final = 0
FULL: Final = 13
IOERR_WRITE: Final = 10 | 3 << 8
IOERR_FSYNC: Final = 10 | 4 << 8
READ_ONLY, READ_WRITE, CREATE = 0x1, 0x2, 0x4
"""Codes and flags of sqlite3.h."""


class _VfsTable(Structure):
    _fields_ = (
        *((name, c_int) for name in ("version", "file_bytes", "longest_path")),
        *((name, c_void_p) for name in ("next", "name", "data", "open", "delete")),
        ("others", c_void_p * 14),
    )


class _FileTable(Structure):
    _fields_ = (
        ("version", c_int),
        *((name, c_void_p) for name in ("close", "read", "write", "truncate", "sync", "size")),
        ("others", c_void_p * 12),
    )


_OPEN: Final = CFUNCTYPE(c_int, c_void_p, c_void_p, c_void_p, c_int, POINTER(c_int))
_MOVE: Final = CFUNCTYPE(c_int, c_void_p, c_void_p, c_int, c_int64)
_TRUNCATE: Final = CFUNCTYPE(c_int, c_void_p, c_int64)
_SYNC: Final = CFUNCTYPE(c_int, c_void_p, c_int)
_SIZE: Final = CFUNCTYPE(c_int, c_void_p, POINTER(c_int64))
_CLOSE: Final = CFUNCTYPE(c_int, c_void_p)


class SqliteWatcher(Protocol):
    """Decides the outcome of SQLite's file operations; each answers with SQLite's code."""

    def watches(self, path: str) -> bool:
        """Return whether a file is watched."""

    def opened(self, path: str, flags: int) -> int:
        """Return the flags that a file is opened with."""

    def write(self, file: "WatchedFile", data: bytes, offset: int) -> int:
        """Write, or do not."""

    def truncate(self, file: "WatchedFile", size: int) -> int:
        """Cut a file short, or do not."""

    def sync(self, file: "WatchedFile", flags: int) -> int:
        """Make sure that all is on the disk, or do not."""


class WatchedFile:
    """An open file, and what SQLite's own functions do to it."""

    def __init__(self, path: str, handle: int, table: _FileTable) -> None:
        self.path = path
        self._handle = handle
        self._table = table

    def read(self, count: int, offset: int) -> bytes:
        """Return what is there; beyond the end nothing is."""
        count = max(0, min(count, self.size() - offset))
        buffer = ctypes.create_string_buffer(count)
        if count:
            _MOVE(self._table.read)(self._handle, cast(buffer, c_void_p), count, offset)
        return buffer.raw

    def write(self, data: bytes, offset: int) -> int:
        """Write for good."""
        return int(
            _MOVE(self._table.write)(
                self._handle, cast(c_char_p(data), c_void_p), len(data), offset
            )
        )

    def truncate(self, size: int) -> int:
        """Cut short for good."""
        return int(_TRUNCATE(self._table.truncate)(self._handle, size))

    def sync(self, flags: int) -> int:
        """Make sure that all is on the disk."""
        return int(_SYNC(self._table.sync)(self._handle, flags))

    def size(self) -> int:
        """Return how long the file is."""
        found = c_int64()
        _SIZE(self._table.size)(self._handle, byref(found))
        return found.value


class SqliteFiles:
    """Lets a watcher decide about the files of databases that this process opens from here on.

    Args:
        watcher: Who decides.

    Raises:
        ConfigError: This Python hides SQLite's functions.
    """

    def __init__(self, watcher: SqliteWatcher) -> None:
        self._watcher = watcher
        self._library = _library()
        self._usual = self._library.sqlite3_vfs_find(None)
        self._vfs = _VfsTable.from_buffer_copy(ctypes.string_at(self._usual, _VFS_BYTES))
        self._usual_open = _OPEN(self._vfs.open)
        self._name = c_char_p(b"robolink-faulty-disk-%d" % id(self))
        self._vfs.name = cast(self._name, c_void_p)
        self._vfs.next = None
        self._open = _OPEN(self._opened)
        self._vfs.open = cast(self._open, c_void_p)
        self._files: dict[int, WatchedFile] = {}
        self._tables: dict[int, tuple[_FileTable, _FileTable]] = {}
        self._kept: list[Any] = []
        self._taken = True

    def serves(self, watcher: SqliteWatcher) -> bool:
        """Serve another watcher from here on, unless the earlier one is still needed."""
        if self._taken or self._files:
            return False
        self._watcher, self._taken = watcher, True
        return True

    def begin(self) -> None:
        """Route everything that is opened from now on through here."""
        self._library.sqlite3_vfs_register(byref(self._vfs), 1)

    def end(self) -> None:
        """Leave the files that are opened from now on alone."""
        self._library.sqlite3_vfs_register(self._usual, 1)
        self._library.sqlite3_vfs_unregister(byref(self._vfs))
        self._taken = False

    def _opened(self, vfs: int, name: int, handle: int, flags: int, told: Any) -> int:  # noqa: ANN401 - a pointer
        path = ctypes.string_at(name).decode() if name else ""
        watched = bool(path) and self._watcher.watches(path)
        flags = self._watcher.opened(path, flags) if watched else flags
        code = int(self._usual_open(vfs, name, handle, flags, told))
        if code == OK and watched:
            place = c_void_p.from_address(handle)
            usual, ours = self._table_for(int(place.value or 0))
            self._files[handle] = WatchedFile(path, handle, usual)
            place.value = ctypes.addressof(ours)
        return code

    def _table_for(self, address: int) -> tuple[_FileTable, _FileTable]:
        """Return the table of a kind of file as it was, and as it is now."""
        if address not in self._tables:
            data = ctypes.string_at(address, ctypes.sizeof(_FileTable))
            usual, ours = _FileTable.from_buffer_copy(data), _FileTable.from_buffer_copy(data)
            close = _CLOSE(usual.close)
            functions: dict[str, Any] = {
                "close": _CLOSE(lambda file: self._closed(close, file)),
                "write": _MOVE(self._write),
                "truncate": _TRUNCATE(
                    lambda file, size: self._watcher.truncate(self._files[file], size)
                ),
                "sync": _SYNC(lambda file, flags: self._watcher.sync(self._files[file], flags)),
            }
            for name, function in functions.items():
                setattr(ours, name, cast(function, c_void_p))
            self._kept.append(functions)
            self._tables[address] = usual, ours
        return self._tables[address]

    def _write(self, file: int, data: int, count: int, offset: int) -> int:
        return self._watcher.write(self._files[file], ctypes.string_at(data, count), offset)

    def _closed(self, close: Callable[[int], int], file: int) -> int:
        self._files.pop(file, None)
        return int(close(file))


_VFS_BYTES: Final = ctypes.sizeof(_VfsTable)
_ALIVE: Final[list[SqliteFiles]] = []
_MAKING: Final = Lock()


def files_for(watcher: SqliteWatcher) -> SqliteFiles:
    """Return the files of a watcher: those of one before that needs them no longer, or new ones.

    A database may outlive whoever wanted it, and opens its files by the same functions until it is
    closed; so no function is ever freed, and each is used again.

    Raises:
        ConfigError: This Python hides SQLite's functions.
    """
    with _MAKING:
        for files in _ALIVE:
            if files.serves(watcher):
                return files
        _ALIVE.append(SqliteFiles(watcher))
        return _ALIVE[-1]


@cache
def _library() -> Any:  # noqa: ANN401 - a library has no type
    import _sqlite3

    try:
        library = ctypes.CDLL(_sqlite3.__file__)
        library.sqlite3_vfs_find.restype = c_void_p
        library.sqlite3_vfs_register.argtypes = (c_void_p, c_int)
        library.sqlite3_vfs_unregister.argtypes = (c_void_p,)
    except (AttributeError, OSError) as error:
        raise ConfigError(
            tr("This Python hides the functions of its SQLite: {cause}.", cause=error),
            remedy=tr("Use a Python that is linked with a SQLite library of the system."),
        ) from error
    return library
