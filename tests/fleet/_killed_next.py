"""``robolink``, with somebody at the terminal who agrees to everything, and killed by SIGKILL.

    python -m tests.fleet._killed_next WHERE ARGUMENT...

WHERE is ``begun`` (the job is on record as begun, nothing was done), ``unreported`` (the change is
kept, the plant was not told) or a number: at an even N before commit N // 2 + 1, at an odd one
after it. Commits are those of the plant's database and of the record; in a file, those that change
something.
"""

import io
import itertools
import os
import signal
import sys
import threading
from collections.abc import Callable
from typing import Any

from robolink_cli.entry import run
from robolink_cli.prompts import operator

from robolink.fleet import FleetStore
from robolink.journal.store.connection import DatabaseConnection

_LOCK = threading.Lock()


class TerminalStream(io.StringIO):
    """A stream that counts as a terminal, of which no screen can be made."""

    def isatty(self) -> bool:
        return True


class Agrees:
    """Says yes to all."""

    def tell(self, _text: str) -> None:
        """Hear a sentence."""

    def ask(self, _question: str, _kind: object) -> None:
        """Hear a question."""

    def poll(self, _wait_s: float) -> str:
        """Say yes."""
        return "y"


def killed(*_: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def killed_at_commit(number: int) -> None:
    done = itertools.count(1)
    seen: dict[int, int] = {}
    commit = DatabaseConnection.commit

    def counted(self: DatabaseConnection) -> None:
        with _LOCK:
            before = seen.get(id(self), 0)
            # PostgreSQL does not tell how much a transaction changed: all of them count.
            seen[id(self)] = now = getattr(self.driver, "total_changes", before + 1)
            here = now != before and next(done) == number // 2 + 1
        if here and number % 2 == 0:
            killed()
        commit(self)
        if here:
            killed()

    DatabaseConnection.commit = counted  # type: ignore[method-assign]


def killed_where(where: str) -> None:
    begin: Callable[..., Any] = FleetStore.begin
    if where == "begun":
        FleetStore.begin = lambda *given, **named: killed(begin(*given, **named))  # type: ignore[assignment,method-assign]
    elif where == "unreported":
        FleetStore.record_outcome = killed  # type: ignore[assignment,method-assign]
    else:
        killed_at_commit(int(where))


if __name__ == "__main__":
    killed_where(sys.argv[1])
    operator.terminal = lambda: Agrees()
    sys.stdin = sys.stderr = TerminalStream()
    code = run(sys.argv[2:], last=True)
    sys.stdout.write(sys.stderr.getvalue())
    sys.exit(code)
