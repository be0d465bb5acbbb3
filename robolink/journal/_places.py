"""Where a journal is."""

import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from robolink.errors import JournalError
from robolink.messages import tr

_SQLITE: Final = "sqlite:///"


@dataclass(frozen=True, slots=True)
class JournalPlace:
    """Where one journal is: a file, a server, or the memory of this process.

    Attributes:
        location: The SQLAlchemy URL without its password.
        name: What a person is told: the file's path, or the URL.
        path: The file; ``None`` when it is none.
        url: The URL of a server, password and all; empty when it is none.
    """

    location: str
    name: str
    path: Path | None = None
    url: str = field(default="", repr=False)


def default_location() -> str:
    """Return the SQLAlchemy URL of this user's journal.

    ROBOLINK_JOURNAL names it, as a URL or as a path. Without that it is ``journal.db`` in
    ROBOLINK_STATE_DIR or, without that too, in the user's data folder for robolink.
    """
    named = os.environ.get("ROBOLINK_JOURNAL")
    if named:
        return named if "://" in named else _file_location(Path(named))
    folder = os.environ.get("ROBOLINK_STATE_DIR")
    if folder:
        return _file_location(Path(folder) / "journal.db")
    from platformdirs import user_data_path

    return _file_location(user_data_path("robolink", appauthor=False) / "journal.db")


def may_exist(location: str) -> bool:
    """Tell whether there may be a journal at a place: a file is looked for, a server is not."""
    path = place_of(location).path
    return path is None or path.exists()


def place_of(location: str) -> JournalPlace:
    """Understand a URL or a path.

    A PostgreSQL URL without a driver means psycopg. Nothing is opened.

    Raises:
        JournalError: It is neither a file nor a PostgreSQL database; a pipe, for which SQLite
            would wait for ever, is no file.
    """
    if "://" not in location:
        location = _file_location(Path(location))
    if location.startswith(_SQLITE) and location != _SQLITE:
        path = Path(location.removeprefix(_SQLITE)).absolute()
        _require_regular(path)
        return JournalPlace(_file_location(path), str(path), path=path)
    scheme, _, rest = location.partition("://")
    if scheme in ("postgresql", "postgresql+psycopg") and rest:
        url = f"postgresql+psycopg://{rest}"
        shown = f"postgresql+psycopg://{_without_password(rest)}"
        return JournalPlace(shown, shown, url=url)
    raise JournalError(
        tr("robolink cannot keep its journal in a {scheme!r} database.", scheme=scheme),
        remedy=tr(
            "Name a file, or a database as postgresql+psycopg://user@host/database, in "
            "ROBOLINK_JOURNAL."
        ),
    )


def memory_place(identity: str) -> JournalPlace:
    """Return the place of a journal that ends with this process."""
    name = tr("in memory, of {identity}", identity=identity)
    return JournalPlace("sqlite://", name)


def _require_regular(path: Path) -> None:
    try:
        special = path.exists() and not path.is_file()
    except OSError:
        return  # opening it says why
    if special:
        raise JournalError(
            tr("The journal {path} is not a regular file.", path=path),
            remedy=tr("Name a file, or a PostgreSQL database, in ROBOLINK_JOURNAL."),
        )


def _file_location(path: Path) -> str:
    return _SQLITE + path.absolute().as_posix()


def _without_password(rest: str) -> str:
    # Up to the last @: better a host that is hidden too than half a password shown.
    shown = re.sub(r"^([^/@:?]*):.*@", r"\1:***@", rest)
    return re.sub(r"(?i)(password=)[^&]*", r"\1***", shown)
