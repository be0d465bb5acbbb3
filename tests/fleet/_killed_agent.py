"""``robolink``, which is killed by SIGKILL at a commit of a database.

    python -m tests.fleet._killed_agent N ARGUMENT...

N counts from 0: at an even N the process ends before commit N // 2 + 1 is sent, at an odd one after
it was answered. Commits are those of the plant's database, of the jobs' and of the record, on
SQLite and PostgreSQL alike, that make a change durable, counted from when the agent has started;
a statement that changes something outside of any transaction is one.
"""

import itertools
import os
import re
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import psycopg
from psycopg.pq import TransactionStatus
from robolink_cli.entry import main
from sqlalchemy.engine.base import RootTransaction

from robolink.fleet import agent
from robolink.fleet.watchdog import notify
from robolink.journal.store.connection import DatabaseConnection

_PATCHED: tuple[Any, ...] = (agent, DatabaseConnection, RootTransaction, psycopg.Cursor)

_ASKED = "SELECT pg_current_xact_id_if_assigned()"
"""A transaction has a number as soon as it has changed or locked a row."""

_CHANGES = re.compile(r"\b(INSERT|UPDATE|DELETE|CREATE|DROP|ALTER)\b")


class Commits:
    """Counts the commits of this process, and ends it at one.

    Args:
        number: Which, as the module says.
    """

    def __init__(self, number: int) -> None:
        self._number, self._done = number, itertools.count(1)
        self._lock, self._started = threading.Lock(), threading.Event()
        self._changes: dict[int, int] = {}

    def install(self) -> None:
        """Have them counted from when the agent is ready."""
        agent_module, of_store, of_jobs, of_server = _PATCHED
        agent_module.notify = self._noted
        ours, theirs = DatabaseConnection.commit, RootTransaction._do_commit
        sent = psycopg.Cursor.execute

        def commit(one: DatabaseConnection) -> None:
            with self._around(self._is_change(one.driver)):
                ours(one)

        def commit_of_jobs(one: RootTransaction) -> None:
            with self._around(self._is_change(one.connection.connection.dbapi_connection)):
                theirs(one)

        def execute(cursor: Any, query: Any, *args: Any, **named: Any) -> Any:
            with self._around(_is_alone(cursor.connection) and _CHANGES.search(str(query))):
                return sent(cursor, query, *args, **named)

        of_store.commit, of_jobs._do_commit, of_server.execute = commit, commit_of_jobs, execute

    def _noted(self, state: str) -> bool:
        if state == "READY=1":
            self._started.set()
        return notify(state)

    def _is_change(self, driver: Any) -> bool:
        if isinstance(driver, psycopg.Connection):
            if driver.info.transaction_status is not TransactionStatus.INTRANS:
                return False
            return driver.cursor().execute(_ASKED).fetchone() != (None,)
        with self._lock:
            before, now = self._changes.get(id(driver), 0), driver.total_changes
            self._changes[id(driver)] = now
        return bool(now != before)

    @contextmanager
    def _around(self, counts: object) -> Iterator[None]:
        with self._lock:
            point = next(self._done) - 1 if counts and self._started.is_set() else -1
        if 2 * point == self._number:
            os.kill(os.getpid(), signal.SIGKILL)
        yield
        if 2 * point + 1 == self._number:
            os.kill(os.getpid(), signal.SIGKILL)


def _is_alone(connection: Any) -> bool:
    """Whether a statement sent now is a transaction by itself."""
    idle = connection.info.transaction_status is TransactionStatus.IDLE
    return bool(connection.autocommit and idle)


if __name__ == "__main__":
    Commits(int(sys.argv[1])).install()
    del sys.argv[1]
    main()
