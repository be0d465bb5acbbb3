"""Files that a person named: read only if regular, never overwritten unasked."""

import errno
import os
import stat
from collections.abc import Iterable
from pathlib import Path
from typing import Final, TextIO

from robolink.errors import ConfigError
from robolink.files.durable import sync_folder, write_whole
from robolink.messages import tr
from robolink.remedy_words import RemedyWord, remedy_word

MOST_BYTES: Final = 4_000_000
"""Size limit in bytes: cell files, recipes, maps, backups and pose lists are far smaller."""

_ANYONE: Final = 0o666


class OthersMayReadError(OSError):
    """A file with a secret is open to others than its owner."""


def read_named(path: Path, *, most_bytes: int = MOST_BYTES, secret: bool = False) -> bytes:
    """Return what is in a regular file; nothing is waited for and no memory filled by another.

    A pipe would be waited on for ever, and a device may never end: a mistake in a name must not
    hold up a command on which a person, or a machine, waits.

    Args:
        path: The file; a link is followed.
        most_bytes: Longest file that is read.
        secret: Whether nobody but its owner may be able to read it; Windows keeps access in
            lists, and is believed.

    Raises:
        OthersMayReadError: It is secret, and others may read it.
        OSError: It cannot be read, is no regular file, or is too long; ``strerror`` says which in
            a person's language. The caller says which file, and what it is for.
    """
    descriptor = os.open(path, os.O_RDONLY | _AT_ONCE)
    try:
        mode = _mode_of_regular(descriptor)
        file = os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise
    with file:
        if secret and os.name == "posix" and mode & 0o077:
            raise OthersMayReadError(errno.EPERM, tr("people other than its owner may read it"))
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise OSError(errno.EFBIG, tr("it is longer than {most:g} MB", most=most_bytes / 1_000_000))
    return data


def holds(path: Path, data: bytes) -> bool:
    """Return whether a regular file holds exactly ``data``."""
    try:
        return read_named(path, most_bytes=len(data)) == data
    except OSError:
        return False


def append_to_named(path: Path, *, encoding: str = "ascii") -> TextIO:
    """Open a regular file to append text; it is created if it is missing.

    Args:
        path: The file; a link is followed.
        encoding: Of the text; what it lacks is written as an escape.

    Raises:
        OSError: As of :func:`read_named`.
    """
    descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | _AT_ONCE, _ANYONE)
    try:
        _mode_of_regular(descriptor)
        return os.fdopen(
            descriptor, "a", encoding=encoding, errors="backslashreplace", newline="\n"
        )
    except BaseException:
        os.close(descriptor)
        raise


def require_free(path: Path, *, replace: bool = False) -> None:
    """Refuse a name that cannot be used, before the controller is asked for anything.

    Raises:
        ConfigError: A file is there already and ``replace`` is not set, or its folder is
            missing or may not be written.
    """
    if path.is_dir() or (path.exists() and not replace):
        raise _taken(path)
    if not path.parent.is_dir() or not os.access(path.parent, os.W_OK):
        raise _unwritable(path, tr("there is no such folder, or it cannot be written to"))


def save_named(path: Path, data: bytes | Iterable[bytes], *, replace: bool = False) -> None:
    """Write ``data``; on return the file is complete and on the disk.

    The data may come in one piece or in several.

    Raises:
        ConfigError: A file is there already and ``replace`` is not set, or it cannot be
            written. What was there is unchanged.
    """
    try:
        write_whole(path, data, replace=replace, mode=_ANYONE)
        sync_folder(path.parent)
    except FileExistsError as error:
        raise _taken(path) from error
    except OSError as error:
        raise _unwritable(path, str(error.strerror or error)) from error


_AT_ONCE: Final = (
    getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)
)
"""Flags for opening a file: a pipe without a writer does not block, and a terminal does not become
the controlling terminal of this process."""


def _mode_of_regular(descriptor: int) -> int:
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, tr("it is not a regular file"))
    return mode


def _taken(path: Path) -> ConfigError:
    return ConfigError(
        tr("{path} exists already and was not overwritten.", path=path),
        remedy=tr(
            "Give another name, or {overwrite} to replace it.",
            overwrite=remedy_word(RemedyWord.OVERWRITE),
        ),
    )


def _unwritable(path: Path, cause: str) -> ConfigError:
    return ConfigError(
        tr("{path} cannot be written: {cause}.", path=path, cause=cause),
        remedy=tr("Give a file in a folder that exists and can be written."),
    )
