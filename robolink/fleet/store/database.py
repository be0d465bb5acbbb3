"""The connection to a plant's database: a file or a server, one transaction at a time."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from robolink import runtime
from robolink.config import named_plant
from robolink.errors import JournalError
from robolink.fleet.errors import PlanError, PlantError
from robolink.fleet.store.migrations import bring_up_to_date, enter_schema
from robolink.journal._places import JournalPlace, place_of
from robolink.journal.store.connection import DatabaseConnection, backend_of
from robolink.journal.store.failures import cause_of
from robolink.messages import listed, tr

_OF_FILES: Final = (OSError, UnicodeDecodeError)


def default_plant() -> str:
    """Return where this computer keeps its plans.

    In the plant's database, to which the journals are copied (:func:`robolink.config.named_plant`).
    Where nothing names one, that is ``fleet.db`` in ROBOLINK_STATE_DIR or, without that, in the
    user's data folder for robolink.
    """
    named = named_plant()
    if named is not None:
        return named.location
    folder = os.environ.get("ROBOLINK_STATE_DIR")
    if folder:
        return str(Path(folder) / "fleet.db")
    from platformdirs import user_data_path

    return str(user_data_path("robolink", appauthor=False) / "fleet.db")


class FleetDatabase:
    """Keeps one connection and gives it to one thread at a time.

    After any error the connection is dropped, and the next use makes a new one.

    Args:
        location: Path of a file, or URL of a PostgreSQL database.

    Raises:
        PlantError: The location is none.
    """

    def __init__(self, location: str) -> None:
        try:
            self._place: JournalPlace = place_of(location)
        except JournalError as error:
            raise PlantError(
                tr("{location} cannot be a plant's database.", location=location),
                remedy=tr("Name a local file, or PostgreSQL: postgresql://user@host/database."),
            ) from error
        self._lock = runtime.reentrant_lock()
        self._connection: DatabaseConnection | None = None
        self._file: tuple[int, int] | None = None
        self._failures: tuple[type[Exception], ...] = _OF_FILES

    @property
    def name(self) -> str:
        """Where it is, as a person is told: no password."""
        return self._place.name

    @property
    def made(self) -> bool:
        """Whether it may hold anything: files are looked for, servers are not."""
        return self._place.path is None or self._place.path.exists()

    @property
    def shared(self) -> bool:
        """Whether several computers may use it: a server, no file."""
        return self._place.path is None

    def close(self) -> None:
        """Close the connection; the next use makes a new one."""
        with self._lock:
            self._drop()

    @contextmanager
    def transaction(self) -> Iterator[DatabaseConnection]:
        """Run a block as one transaction that is durable at its end, or undone.

        Raises:
            PlantError: The database cannot be used. The block was not stored, or the connection
                was lost at its very end.
        """
        with self._lock:
            try:
                database = self._connected()
                if database.begin_writing:
                    database.run(database.begin_writing)
                try:
                    yield database
                except BaseException:
                    database.roll_back()
                    raise
                database.commit()
            except PlanError:
                raise  # what was asked is wrong, not the connection
            except (JournalError, PlantError):
                self._drop()
                raise
            except self._failures as error:
                self._drop()
                head = tr("The plant's database {name} cannot be used:", name=self.name)
                raise PlantError(
                    listed(head, [cause_of(error)]),
                    # A commit whose answer was lost may have come to pass; to repeat is safe.
                    remedy=tr("Check the file or the server, then repeat it."),
                ) from error

    def _connected(self) -> DatabaseConnection:
        if self._connection is None:
            backend = backend_of(self._place, read_only=False, prompt=True)
            self._failures = (*_OF_FILES, *backend.failures)
            connection = backend.connect()
            try:
                enter_schema(connection)
                bring_up_to_date(connection, self.name, self._failures)
            except BaseException:
                connection.close()
                raise
            self._connection, self._file = connection, self._place.file_now()
        elif self._place.file_now() != self._file:
            # What is written to a file that nobody can open any more would be lost.
            raise PlantError(
                tr("The plant's database {name} was moved or deleted.", name=self.name),
                remedy=tr("Put it back, then repeat it. Without it no plan is known."),
            )
        return self._connection

    def _drop(self) -> None:
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()
