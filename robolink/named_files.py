"""Files that a person named: never written over unasked, whole or not there at all."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from robolink.durable_files import sync_folder, write_whole
from robolink.errors import ConfigError
from robolink.messages import tr

_ANYONE: Final = 0o666


def require_free(path: Path, *, replace: bool = False) -> None:
    """Refuse a name that cannot be used, before the controller is asked for anything.

    Raises:
        ConfigError: A file is there already and ``replace`` is not set, or its folder is
            missing or may not be written.
    """
    if path.is_dir() or (path.exists() and not replace):
        raise _taken(path)
    if not path.parent.is_dir() or not os.access(path.parent, os.W_OK):
        raise _unwritable(path, tr("there is no such folder, or it may not be written"))


def save_named(path: Path, data: bytes | Iterable[bytes], *, replace: bool = False) -> None:
    """Write ``data``; the file is whole and on the disk when this returns.

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


def _taken(path: Path) -> ConfigError:
    return ConfigError(
        tr("{path} exists already; it was not written over.", path=path),
        remedy=tr("Give another name, or --force to replace it."),
    )


def _unwritable(path: Path, cause: str) -> ConfigError:
    return ConfigError(
        tr("{path} cannot be written: {cause}.", path=path, cause=cause),
        remedy=tr("Give a file in a folder that exists and can be written."),
    )
