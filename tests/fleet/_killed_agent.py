"""``robolink``, which is killed by SIGKILL at a commit of a database.

    python -m tests.fleet._killed_agent N ARGUMENT...

N counts from 0: at an even N the process ends before commit N // 2 + 1, at an odd one after it.
Commits are those of the plant's database, of the jobs' and of the record that change something in
an SQLite file, counted from when the agent has started.
"""

import itertools
import os
import signal
import sys
import threading

from robolink_cli.entry import main
from sqlalchemy.engine.base import RootTransaction

from robolink.fleet import agent
from robolink.journal.store.connection import DatabaseConnection

_LOCK = threading.Lock()


def killed_at(number: int) -> None:
    """Have this process killed at a commit."""

    done, started = itertools.count(1), threading.Event()
    seen: dict[int, int] = {}

    def changes(driver):
        before, now = seen.get(id(driver), 0), driver.total_changes
        seen[id(driver)] = now
        return now != before

    def around(commit, driver_of):
        def counted(self):
            with _LOCK:
                counts = changes(driver_of(self)) and started.is_set()
                here = counts and next(done) == number // 2 + 1
            if here and number % 2 == 0:
                os.kill(os.getpid(), signal.SIGKILL)
            commit(self)
            if here:
                os.kill(os.getpid(), signal.SIGKILL)

        return counted

    def noted(state):
        if state == "READY=1":
            started.set()

    agent.notify = noted  # type: ignore[attr-defined]
    DatabaseConnection.commit = around(  # type: ignore[method-assign]
        DatabaseConnection.commit, lambda ours: ours.driver
    )
    RootTransaction._do_commit = around(  # type: ignore[method-assign]
        RootTransaction._do_commit, lambda theirs: theirs.connection.connection.dbapi_connection
    )


if __name__ == "__main__":
    killed_at(int(sys.argv[1]))
    del sys.argv[1]
    main()
