"""One agent a plant and home: the lock that it holds while it lives, and who holds it.

On a server it is an advisory lock of a connection of its own, which the server releases when the
agent's process is gone. Beside a file, which only one computer uses, it is a transaction in a
second file, which ends with the process too.
"""

import json
import sqlite3
from contextlib import suppress
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Final, Self

from robolink.errors import LeaseHeldError
from robolink.files.durable import make_folder, write_whole
from robolink.fleet.errors import PlantError
from robolink.journal import LeaseHolder, computer_key, this_process
from robolink.journal._lease_view import describe_holder
from robolink.journal._places import JournalPlace, place_of
from robolink.journal.store.connection import backend_of
from robolink.journal.store.failures import cause_of
from robolink.messages import listed, tr

__all__ = ["AgentLock", "agent_name", "own_name"]

_CLASS: Final = 0x666C6565
"""The first half of the number of each advisory lock: no other part of robolink takes it."""

_LONGEST_NAME: Final = 63
"""Of a connection at PostgreSQL, in bytes."""

_HOLDER_OF: Final = """
    SELECT application_name FROM pg_stat_activity JOIN pg_locks USING (pid)
    WHERE locktype = 'advisory' AND classid = :class AND objid = :plant AND granted
    AND database = (SELECT oid FROM pg_database WHERE datname = current_database())
"""


def agent_name(plant: str, home: str) -> str:
    """Return what the agent of a plant at a home is called where several computers meet.

    Args:
        plant: Id of the plant.
        home: Name of the computer; empty where it has none.
    """
    return f"{plant}@{computer_key(home)}" if home else plant


def own_name() -> str:
    """Return how a refusal names this process at a server."""
    here = this_process()
    return f"{here.os_user}@{here.host} {here.pid}"[:_LONGEST_NAME]


class AgentLock:
    """The lock of a plant's agent at one home; a context manager that holds it.

    Args:
        location: The plant's database: path of a file, or URL of PostgreSQL.
        plant: Id of the plant.
        home: Name of the computer.

    Raises:
        LeaseHeldError: Another agent of this plant lives at this home; it is named.
        PlantError: The database cannot be used.

    Example:
        >>> from robolink.fleet.agent_lock import AgentLock
        >>> with AgentLock("plant.db", "plant") as lock:
        ...     lock.is_held()
        True
    """

    def __init__(self, location: str, plant: str, home: str = "") -> None:
        self._place = place_of(location)
        self._plant, self._home = plant, home
        self._held: _ServerLock | _FileLock | None = None

    def __enter__(self) -> Self:
        self.take()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def take(self) -> None:
        """Take the lock; one that was held and lost is taken anew.

        Raises:
            LeaseHeldError: Another agent has it.
            PlantError: The database cannot be used.
        """
        self.release()
        if self._place.path is None:
            lock: _ServerLock | _FileLock = _ServerLock(self._place, self._plant, self._home)
        else:
            lock = _FileLock(self._place.path, self._plant)
        self._held = lock

    def is_held(self) -> bool:
        """Whether it is held still: a server that was restarted knows nothing of it any more."""
        return self._held is not None and self._held.is_held()

    def release(self) -> None:
        """Release it."""
        lock, self._held = self._held, None
        if lock is not None:
            lock.release()


class _FileLock:
    """A lock that lies in a file beside a plant's file."""

    def __init__(self, path: Path, plant: str) -> None:
        stem = f"{path.name}.agent-{sha256(plant.encode()).hexdigest()[:8]}"
        self._holder = path.with_name(f"{stem}.json")
        make_folder(path.parent)
        self._connection = sqlite3.connect(
            path.with_name(stem), timeout=0.0, isolation_level=None, check_same_thread=False
        )
        try:
            self._connection.execute("BEGIN EXCLUSIVE")
            write_whole(self._holder, json.dumps(asdict(this_process())).encode())
        except sqlite3.OperationalError as error:
            self._connection.close()
            if error.sqlite_errorcode == sqlite3.SQLITE_BUSY:
                raise _refused(plant, self._who()) from error
            raise _unusable(str(path), error) from error
        except OSError as error:
            self._connection.close()
            raise _unusable(str(path), error) from error

    def is_held(self) -> bool:
        """Whether it is held: as long as this process lives."""
        return True

    def release(self) -> None:
        """Release it."""
        self._holder.unlink(missing_ok=True)
        self._connection.close()

    def _who(self) -> str:
        with suppress(OSError, ValueError, TypeError):
            return describe_holder(LeaseHolder(**json.loads(self._holder.read_bytes())))
        return tr("Another process")


class _ServerLock:
    """A lock that a server keeps as long as a connection lives."""

    def __init__(self, place: JournalPlace, plant: str, home: str) -> None:
        self._plant = plant
        name = agent_name(plant, home)
        self._number = int.from_bytes(sha256(name.encode()).digest()[:4]) >> 1
        backend = backend_of(place, read_only=False, prompt=True)
        self._failures = backend.failures
        try:
            self._connection = backend.connect()
        except self._failures as error:
            raise _unusable(place.name, error) from error
        try:
            self._take()
        except self._failures as error:
            self.release()
            raise _unusable(place.name, error) from error
        except BaseException:
            self.release()
            raise

    def _take(self) -> None:
        said = {"said": own_name()}
        self._connection.rows("SELECT set_config('application_name', :said, false)", said)
        lock = {"class": _CLASS, "plant": self._number}
        ((taken,),) = self._connection.rows("SELECT pg_try_advisory_lock(:class, :plant)", lock)
        if not taken:
            who = [name for (name,) in self._connection.rows(_HOLDER_OF, lock) if name]
            raise _refused(self._plant, who[0] if who else tr("Another process"))
        self._connection.commit()  # the lock is the session's, and no transaction stays open

    def is_held(self) -> bool:
        """Whether the connection lives, and the lock with it."""
        try:
            self._connection.rows("SELECT 1")
            self._connection.commit()
        except self._failures:
            return False
        return True

    def release(self) -> None:
        """Release it."""
        self._connection.close()


def _refused(plant: str, who: str) -> LeaseHeldError:
    error = LeaseHeldError(
        tr("{who} is the agent of plant {plant} already.", who=who, plant=plant),
        remedy=tr("Nothing was begun. End that agent first; this one then goes on with its jobs."),
    )
    error.holder = who
    return error


def _unusable(name: str, error: Exception) -> PlantError:
    return PlantError(
        listed(tr("The plant's database {name} cannot be used:", name=name), [cause_of(error)]),
        remedy=tr("Nothing was begun. Check the file or the server, then repeat it."),
    )
