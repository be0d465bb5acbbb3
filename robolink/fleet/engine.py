"""The engine: which jobs are handed out, kept by DBOS in a database.

The only module that knows DBOS (docs/decisions/0072-a-fleet-on-an-engine-that-others-keep.md). A
fleet wants four things of it: many jobs are handed out at once and outlive the process; one job a
cell at a time; so many at once and no more; and a new process goes on with what an old one had
begun. What the engine keeps may be thrown away at any time: plans and outcomes are the plant's
own, and whoever misses a job here hands it out again.

After a kill a job is begun again, which its order makes harmless (``transaction.carrying_out``).
"""

import logging
import math
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from enum import StrEnum
from typing import ClassVar, Final

import sqlalchemy
from dbos import (
    DBOS,
    DBOSClient,
    DBOSPortableJSONSerializer,
    EnqueueOptions,
    WorkflowSerializationFormat,
)
from sqlalchemy import event
from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from robolink import runtime
from robolink.fleet.errors import PlantError
from robolink.journal.store.connection import prompt_connection, server_parameters
from robolink.messages import listed, tr

__all__ = ["Engine", "JobEndedError", "QueuePlace"]

_JOB: Final = "robolink-fleet-job"
_FORM: Final = "1"
"""What DBOS takes for the version: jobs of another one are not begun. It counts steps of a job."""

_POLL_S: Final = 0.1
_BESIDES: Final = 8
"""Threads and connections beside those of the workers, for the engine's own looks."""


class QueuePlace(StrEnum):
    """Where a job stands that was handed out and has not ended, in DBOS's words."""

    WAITING = "ENQUEUED"
    RUNNING = "PENDING"


class JobEndedError(Exception):
    """A job did not do what it was for: DBOS keeps an error, the plan an outcome."""


@DBOS.workflow(
    name=_JOB,
    max_recovery_attempts=None,  # else DBOS gives a job up whose agent was killed 100 times
    serialization_type=WorkflowSerializationFormat.PORTABLE,
)
def _job(order: str) -> None:
    """Carry out one job of the engine of this process."""
    Engine.of_process().run(order)


class Engine:
    """Hands jobs out, and has them carried out in threads of this process.

    DBOS knows one engine a process, so there is one.

    Args:
        url: PostgreSQL, or ``sqlite:///`` and the path of a file of the engine's own.
        plant: Name of the agent, whose lock the caller holds: one engine of it runs at a time.
        carry_out: Carries out the job of an order. It returns when the outcome is durable, and
            raises :class:`JobEndedError` for one that is not what the job was for.
        workers: How many jobs run at once.
    """

    _one: "ClassVar[Engine | None]" = None

    def __init__(
        self, url: str, plant: str, carry_out: Callable[[str], None], *, workers: int = 16
    ) -> None:
        self._url, self._plant, self._carry_out, self._workers = url, plant, carry_out, workers
        self._queue = f"fleet-{plant}"
        self._room = runtime.waiting_room()
        self._running: set[str] = set()
        self._idle: frozenset[str] = frozenset()
        self._news = self._draining = self._ended = False

    @classmethod
    def of_process(cls) -> "Engine":
        """Return the engine that this process runs."""
        assert cls._one is not None  # noqa: S101 - it was started
        return cls._one

    def start(self) -> None:
        """Start it; jobs that an earlier process had begun are begun again.

        Raises:
            PlantError: The database cannot be used.
        """
        logging.getLogger("dbos").addHandler(logging.NullHandler())  # else it fills the console
        json = DBOSPortableJSONSerializer()
        Engine._one, self._database = self, _database(self._url, self._workers + _BESIDES)
        event.listen(self._database, "checkout", self._require_not_ended)
        DBOS(
            config={
                "name": "robolink-fleet",
                "system_database_engine": self._database,
                "executor_id": self._plant,
                "application_version": _FORM,
                "serializer": json,
                "enable_otlp": False,
                "use_listen_notify": False,
                "max_executor_threads": self._workers + _BESIDES,
            }
        )
        DBOS.listen_queues([self._queue])
        try:
            with self._reached():
                DBOS.launch()
                DBOS.register_queue(
                    self._queue,
                    worker_concurrency=self._workers,
                    partition_concurrency=1,
                    polling_interval_sec=_POLL_S,
                    on_conflict="always_update",
                )
                self._client = DBOSClient(
                    system_database_engine=self._database,
                    serializer=json,
                    retry_connection_errors=False,
                )
        except BaseException:
            self._end()
            raise

    def hand_out(self, cells: Mapping[str, str]) -> tuple[str, ...]:
        """Store that jobs are to be carried out; return the orders of those that were not here.

        A job that waits or runs here stays as it is; one that has ended is handed out anew.

        Args:
            cells: The cell of each job, by its order. Of a cell, one job runs at a time.

        Raises:
            PlantError: The database cannot be used; none or all are stored.
        """
        with self._reached():
            held = self.held()  # without those that an agent of another name left in its queue
            new = tuple(order for order in cells if order not in held)
            if new:
                self._client.delete_workflows([*new])  # what is on record of earlier deliveries
            with self._database.begin() as transaction:
                for order in new:
                    options: EnqueueOptions = {
                        "workflow_name": _JOB,
                        "queue_name": self._queue,
                        "workflow_id": order,
                        "queue_partition_key": cells[order],
                        "app_version": _FORM,
                        "serialization_type": WorkflowSerializationFormat.PORTABLE,
                    }
                    self._client.enqueue_in_transaction(transaction, options, order)
        return new

    def held(self) -> Mapping[str, QueuePlace]:
        """Return the jobs that were handed out and have not ended, by order.

        Raises:
            PlantError: The database cannot be used.
        """
        with self._reached():
            found = self._client.list_workflows(
                queue_name=self._queue, status=[*QueuePlace], load_input=False, load_output=False
            )
        return {one.workflow_id: QueuePlace(one.status) for one in found}

    def withdraw(self, orders: Iterable[str]) -> None:
        """Take back jobs that wait; one that runs goes on to its end.

        Raises:
            PlantError: The database cannot be used.
        """
        held = self.held()
        waiting = [one for one in orders if held.get(one) is QueuePlace.WAITING]
        if waiting:
            with self._reached():
                self._client.delete_workflows(waiting)

    def drop_stranded(self) -> tuple[str, ...]:
        """Forget jobs that count as running here and do not run; return their orders.

        Where the database goes away while DBOS looks for what was begun before, or between a job's
        dequeue and its start, the job stands as running for ever and keeps its cell
        (dbos-transact-py #716, #804, #805). What is like that at two calls in a row is forgotten.

        Raises:
            PlantError: The database cannot be used.
        """
        held = self.held()
        running = self.running()
        idle = {one for one, place in held.items() if place is QueuePlace.RUNNING} - running
        found, self._idle = tuple(sorted(idle & self._idle)), frozenset(idle)
        if found:
            with self._reached():
                self._client.delete_workflows([*found])
        return found

    def running(self) -> frozenset[str]:
        """Return the orders whose jobs run now."""
        with self._room:
            return frozenset(self._running)

    def wait_for_news(self, wait_s: float) -> None:
        """Wait until a job has ended, at most so long."""
        with self._room:
            self._room.wait_for(lambda: self._news, wait_s)
            self._news = False

    def run(self, order: str) -> None:
        """Carry out the job of an order: DBOS calls this in a thread."""
        with self._room:
            if self._draining:
                raise JobEndedError(order)  # not begun: it is handed out again
            self._running.add(order)
        try:
            self._carry_out(order)
        finally:
            with self._room:
                self._running.discard(order)
                self._news = True
                self._room.notify_all()

    def stop(
        self, wait_s: float, given_up: Callable[[], frozenset[str]] = frozenset
    ) -> frozenset[str]:
        """Begin no more jobs, wait for those that run and are not given up, and end the engine.

        Returns:
            The orders of those that run on: the next engine begins them again.
        """
        with self._room:
            self._draining = True
            for _ in range(math.ceil(wait_s)):
                if self._room.wait_for(lambda: self._running <= given_up(), min(wait_s, 1.0)):
                    break
        self._end()
        return self.running()

    def _end(self) -> None:
        DBOS.destroy()
        Engine._one, self._ended = None, True
        self._database.dispose()

    def _require_not_ended(self, *_: object) -> None:
        if self._ended:  # else DBOS asks for ever how a job ended that another process took over
            raise JobEndedError

    @contextmanager
    def _reached(self) -> Iterator[None]:
        try:
            yield
        except SQLAlchemyError as error:
            cause = error.orig if isinstance(error, DBAPIError) else error
            raise PlantError(
                listed(tr("The database of the fleet's jobs cannot be used:"), [str(cause)]),
                remedy=tr("Check the file or the server. No job is lost."),
            ) from error


def _database(url: str, connections: int) -> sqlalchemy.Engine:
    """Return the engine's connections to its database; none is made yet."""
    if url.startswith("sqlite"):
        made = sqlalchemy.create_engine(url, pool_size=connections, max_overflow=0)
        event.listen(made, "connect", _prepare_file)
        return made
    return sqlalchemy.create_engine(
        "postgresql+psycopg://",
        creator=lambda: prompt_connection(server_parameters(url)),
        pool_size=connections,
        max_overflow=0,
        pool_pre_ping=True,
    )


def _prepare_file(connection: sqlite3.Connection, _record: object) -> None:
    """Set a connection to SQLite up as DBOS does, with a write-ahead log.

    What the power takes from the file is handed out again, so that a commit waits for no disk.
    """
    connection.isolation_level = "IMMEDIATE"
    waits, logged = "busy_timeout=30000", ("journal_mode=WAL", "synchronous=NORMAL")
    for setting in (waits, "foreign_keys=ON", *logged):
        connection.execute(f"PRAGMA {setting}")
    if sqlite3.sqlite_version_info < (3, 42):  # it has no "subsec", which DBOS asks for
        connection.create_function("unixepoch", 1, lambda _subsec: runtime.wall_s())
