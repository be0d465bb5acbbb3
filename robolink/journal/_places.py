"""Where a journal is, and where none can be: on a network share, as far as can be detected.

A database in WAL mode keeps an index in memory that all its users have to share, so they have to
be on one computer (https://www.sqlite.org/wal.html); and locks and fsync of a share are not those
of a disk. Linux names the file system of each mount (proc(5), mountinfo), Windows the kind of each
drive. Other systems tell neither here, and a share is not recognized there.
"""

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path, PureWindowsPath
from typing import Final

from robolink.errors import ConfigError, JournalError
from robolink.journal._homes import CellHome, name_homes
from robolink.messages import tr

_SQLITE: Final = "sqlite:///"

MOUNT_TABLE: Final = Path("/proc/self/mountinfo")

_SHARES: Final = r"""
    9p | acfs | afs | beegfs | ceph | cifs | coda | davfs | gfs2 | glusterfs | gpfs | lustre
    | ncpfs | nfs4? | ocfs2 | orangefs | prl_fs | pvfs2 | smb2 | smb3 | smbfs | vboxsf | vmhgfs
    | fuse\.(ceph(-fuse)? | cifs | davfs2? | glusterfs | gvfsd-fuse | nfs | rclone | s3fs
    | smbnetfs | sshfs | vmhgfs-fuse)
    """
"""Linux names of file systems to which several running systems may write."""

_REMOTE: Final = 4
"""Result of GetDriveType on Windows for a network drive: DRIVE_REMOTE."""

_ESCAPED: Final = re.compile(r"\\([0-7]{3})")


@dataclass(frozen=True, slots=True)
class JournalPlace:
    """Where one journal is: a file, a server, or the memory of this process.

    Attributes:
        location: The URL without its password.
        name: What a person is told: the file's path, or the URL.
        path: The file; ``None`` when it is none.
        url: The URL of a server, password and all; empty when it is none.
    """

    location: str
    name: str
    path: Path | None = None
    url: str = field(default="", repr=False)

    def file_now(self) -> tuple[int, int] | None:
        """Return which file is at its path: ``(0, 0)`` for none; ``None`` where it has no path."""
        if self.path is None:
            return None
        try:
            found = os.stat(self.path)
        except FileNotFoundError:
            return (0, 0)
        return (found.st_dev, found.st_ino)


_named: dict[str, str] = {}
"""Journals that the cell files name for this process, by the address of the controller; under an
empty address the one of everything else."""


def name_journals(
    places: Mapping[str, str],
    *,
    homes: Mapping[str, CellHome] | None = None,
    afresh: bool = False,
) -> None:
    """Look for journals where the cell files name them, from now on in this process.

    The environment goes before (:func:`default_location`); it moves no home.

    Args:
        places: URLs or paths of journals, by the address of a controller; under an empty address
            that of everything else. An empty place names none.
        homes: Homes of the cells, by the same addresses.
        afresh: Whether what was named before is forgotten.

    Example:
        >>> from robolink.journal import CellHome, name_journals
        >>> address = "epson+sim://named-example"
        >>> name_journals({address: "line3.db"}, homes={address: CellHome("line3", "PC7")})
    """
    name_homes(homes or {}, afresh=afresh)
    global _named  # noqa: PLW0603 - a process has one environment, and one set of cell files
    if not afresh and places.items() <= _named.items():
        return  # as each of many cells says when it is connected to
    _named = {} if afresh else dict(_named)
    _named.update(places)


def named_by_environment() -> str:
    """Return the environment variable that says where the journal is; empty for none."""
    variables = ("ROBOLINK_JOURNAL", "ROBOLINK_STATE_DIR")
    return next((name for name in variables if os.environ.get(name)), "")


def default_location(address: str = "") -> str:
    """Return the URL of the journal of a controller, or of this user.

    ROBOLINK_JOURNAL names it, as a URL or as a path. Without that it is ``journal.db`` in
    ROBOLINK_STATE_DIR; without that, what the cell files name (:func:`name_journals`); and
    without that too, ``journal.db`` in the user's data folder for robolink.

    Args:
        address: How the controller is reached; empty for the journal of this user.
    """
    variable = named_by_environment()
    if variable == "ROBOLINK_STATE_DIR":
        return _file_location(Path(os.environ[variable]) / "journal.db")
    named = os.environ[variable] if variable else _named.get(address) or _named.get("", "")
    if named:
        return named if "://" in named else _file_location(Path(named))
    from platformdirs import user_data_path

    return _file_location(user_data_path("robolink", appauthor=False) / "journal.db")


def shown_location(location: str) -> str:
    """Return a journal's URL without its password, or the path of a file."""
    if location.startswith(_SQLITE) or "://" not in location:
        return location.removeprefix(_SQLITE)
    scheme, _, rest = location.partition("://")
    return f"{scheme}://{_without_password(rest)}"


def without_user(location: str) -> str:
    """Return a journal's location as all who use it have it: its owner and the cells' role."""
    return re.sub(r"^(postgresql(?:\+psycopg)?://)[^/?]*@", r"\1", location)


def may_exist(location: str) -> bool:
    """Return whether a journal may exist at a place: files are looked for, servers are not."""
    path = place_of(location).path
    return path is None or path.exists()


def place_of(location: str) -> JournalPlace:
    """Parse a URL or a path.

    A PostgreSQL URL without a driver means psycopg. Nothing is opened.

    Raises:
        JournalError: It is neither a file nor a PostgreSQL database; a pipe, for which SQLite
            would wait for ever, is no file. Or it is a file on a network share.
    """
    if "://" not in location:
        location = _file_location(Path(location))
    if location.startswith(_SQLITE) and location != _SQLITE:
        path = Path(location.removeprefix(_SQLITE)).absolute()
        _require_regular(path)
        _require_local(path)
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


def plant_place(url: str) -> JournalPlace:
    """Parse the URL of a plant's database; nothing is opened.

    Raises:
        ConfigError: It names no PostgreSQL database.
    """
    place = place_of(url) if url.partition("://")[0].startswith("postgresql") else None
    if place is None:
        raise ConfigError(
            tr("{url!r} names no database of a plant.", url=_without_password(url)),
            remedy=tr("Name it as postgresql://user@host/database."),
        )
    return place


def memory_place(identity: str) -> JournalPlace:
    """Return the place of a journal that ends with this process."""
    name = tr("in memory, of {identity}", identity=identity)
    return JournalPlace("sqlite://", name)


def share_of(path: Path) -> str | None:
    """Return what kind of network share a file lies on, or would.

    Args:
        path: The file, which need not exist; links in its path are followed.

    Returns:
        The file system's name, ``UNC`` or a drive; ``None`` for a disk of this computer, and where
        that cannot be told.
    """
    real = os.path.realpath(path)
    if os.name == "nt":
        return share_of_windows(real, _drive_type)
    try:
        table = MOUNT_TABLE.read_bytes()
    except OSError:
        return None
    return share_in(os.fsdecode(table), real)


def share_in(table: str, path: str) -> str | None:
    """Return what kind of share holds a path, by the text of a table of mounts (proc(5)).

    What is mounted at ``/`` is this computer's own: a diskless PC, a container.
    """
    longest, found = "/", ""
    for point, kind in _mounts(table):
        # A later mount covers an earlier one at the same place.
        if len(point) >= len(longest) and (path + "/").startswith(point.rstrip("/") + "/"):
            longest, found = point, kind
    return found if longest != "/" and re.fullmatch(_SHARES, found, re.VERBOSE) else None


@lru_cache(maxsize=1)  # each journal that is opened reads the table, which seldom changes
def _mounts(table: str) -> tuple[tuple[str, str], ...]:
    """Return where something is mounted, and its kind, in the order of a table of mounts."""
    found = []
    for line in table.split("\n"):
        mount, _, source = line.partition(" - ")
        fields, kind = mount.split(" "), source.partition(" ")[0]
        if len(fields) >= 5 and kind:
            found.append((_ESCAPED.sub(lambda code: chr(int(code[1], 8)), fields[4]), kind))
    return tuple(found)


def share_of_windows(path: str, drive_type: Callable[[str], int]) -> str | None:
    """Return what a path of Windows says of a share: a UNC path, or a drive of the network.

    Args:
        path: The whole path.
        drive_type: Asks GetDriveType for the root of a drive.
    """
    drive = PureWindowsPath(path).drive
    if drive.startswith("\\\\"):
        device = drive[4:] if drive[2:4] in ("?\\", ".\\") else "UNC"
        if device.upper().startswith("UNC"):
            return "UNC"
        drive = device
    return drive if drive_type(f"{drive}\\") == _REMOTE else None


def _drive_type(root: str) -> int:
    import ctypes

    kernel = ctypes.windll.kernel32  # type: ignore[attr-defined,unused-ignore]
    return int(kernel.GetDriveTypeW(ctypes.c_wchar_p(root)))


def _require_regular(path: Path) -> None:
    try:
        special = path.exists() and not path.is_file()
    except OSError:
        return  # opening the file reports why
    if special:
        raise JournalError(
            tr("The journal {path} is not a regular file.", path=path),
            remedy=tr("Name a file, or a PostgreSQL database, in ROBOLINK_JOURNAL."),
        )


def _require_local(path: Path) -> None:
    kind = share_of(path)
    if kind is not None:
        raise JournalError(
            tr(
                "The journal {path} is on a network share ({kind}), where two computers could "
                "damage it.",
                path=path,
                kind=kind,
            ),
            remedy=tr(
                "In ROBOLINK_JOURNAL, name a local file or PostgreSQL. Moving: docs/journal.md"
            ),
        )


def _file_location(path: Path) -> str:
    return _SQLITE + path.absolute().as_posix()


def _without_password(rest: str) -> str:
    # Up to the last @: rather hide the host too than show half of a password.
    shown = re.sub(r"^([^/@:?]*):.*@", r"\1:***@", rest)
    return re.sub(r"(?i)(password=)[^&]*", r"\1***", shown)
