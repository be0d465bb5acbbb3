"""Tool changes and recoveries in processes of their own, to be killed or held at a commit.

The process counts every durable transaction of the journal; after each one it writes down number
and hash of the newest entry, so that acknowledged entries can be looked for afterwards.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing.connection import wait
from pathlib import Path
from typing import Final, Literal

from robolink_simulators.cell.clock import ManualClock

import robolink
from robolink.backup import plan_restore, restore, take_backup
from robolink.journal import open_journal
from robolink.model import TIP, Controller, LookingController, ToolOffset
from robolink.transaction import ToolChange, Wanted, carrying_out, change_tools, recover
from tests._patience import PATIENCE_S
from tests.faults import _client_process

OLD: Final = {1: ToolOffset(12.0, -3.5, -20.0), 2: ToolOffset(-12.0, -3.5, -21.0)}
NEW: Final = {1: ToolOffset(12.25, -3.25, -20.0), 2: ToolOffset(-11.75, -3.5, -21.0)}

ORDER: Final = "A-17/3"

CommitMoment = Literal["before it is durable", "once it is durable"]


@dataclass(frozen=True)
class CommitStep:
    """One instant of a program: the number of a durable transaction, and a moment of it."""

    number: int
    moment: CommitMoment

    def __str__(self) -> str:
        return f"commit {self.number}, {self.moment}"


def _wanted(*tools: int) -> list[Wanted]:
    return [Wanted(tool, NEW[tool], OLD[tool]) for tool in tools]


def _write_verified(controller: Controller) -> None:
    with controller.preserved("nozzle change"):
        controller.tools.select(0)
        with ToolChange(controller, _wanted(1, 2), verify=True) as change:
            change.write()
            controller.status()
            change.keep("verified")


def _deliver(controller: Controller, *tools: int) -> None:
    """Carry an order out, unless that was done before."""
    with carrying_out(controller, ORDER, {"tools": list(tools)}) as order:
        if order.done is None:
            change_tools(controller, _wanted(*tools), order=order)


def _restore(controller: Controller) -> None:
    """Restore a backup that has tool 2 selected with a new value, and tool 1 undefined."""
    now = take_backup(controller)
    wanted = replace(now.state, selected=2, tools={**now.state.tools, 1: None, 2: NEW[2]})
    restore(controller.tools, plan_restore(replace(now, state=wanted), now.state, selected=True))


def _look(controller: Controller) -> None:
    assert isinstance(controller, LookingController)
    controller.look(TIP, program=7)


PROGRAMS: Final[dict[str, Callable[[Controller], object]]] = {
    "one tool": lambda controller: change_tools(controller, _wanted(1)),
    "two tools": lambda controller: change_tools(controller, _wanted(1, 2)),
    "two tools, verified": _write_verified,
    "one tool, ordered": lambda controller: _deliver(controller, 1),
    "two tools, ordered": lambda controller: _deliver(controller, 1, 2),
    "recover": recover,
    "restore": _restore,
    "look": _look,
}


class ProgramProcess:
    """One of :data:`PROGRAMS` on a controller.

    Args:
        program: Its name.
        url: The controller.
        folder: The folder of its journal and of its notes on acknowledged entries.
        kill_at: The instant at which it kills itself with SIGKILL.
    """

    def __init__(
        self, program: str, url: str, folder: Path, *, kill_at: CommitStep | None = None
    ) -> None:
        self._process = _client_process._FORKS.Process(
            target=_run, args=(program, url, str(folder), kill_at)
        )
        self._process.start()

    def kill(self) -> None:
        """Send SIGKILL; return when the process and its socket are gone."""
        assert self._process.pid is not None
        os.kill(self._process.pid, signal.SIGKILL)
        assert wait([self._process.sentinel], PATIENCE_S), "it outlived SIGKILL"

    def exit_code(self) -> int:
        """Wait for its end and return the exit code, negative for a signal."""
        assert wait([self._process.sentinel], PATIENCE_S), "it hangs"
        self._process.join()
        code = self._process.exitcode
        self._process.close()
        assert code is not None
        return code


def acknowledged(folder: Path) -> list[tuple[int, str]]:
    """Return number and hash of the newest entry after each acknowledged transaction."""
    noted = folder / "acknowledged"
    lines = noted.read_text().splitlines() if noted.exists() else []
    # There is no hash before the first entry: only the controller's identity was stored.
    pairs = [line.partition(" ") for line in lines]
    return [(int(number), last_hash) for number, _, last_hash in pairs]


def _run(program: str, url: str, folder: str, kill_at: CommitStep | None) -> None:
    os.environ["ROBOLINK_STATE_DIR"] = folder
    _watch_commits(Path(folder) / "acknowledged", kill_at)
    journal = open_journal(f"{folder}/journal.db")
    # Its time stands still: no sign of life comes between the transactions that are counted.
    outcomes = journal.log(url, clock=ManualClock())
    with robolink.connect(url, outcomes=outcomes) as controller:
        PROGRAMS[program](controller)
    sys.exit(0)


def _watch_commits(noted: Path, kill_at: CommitStep | None) -> None:
    from robolink.journal.store.store import Store, Tables

    write = Store.write
    file = os.open(noted, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    number = 0

    def reach(moment: CommitMoment) -> None:
        if kill_at == CommitStep(number, moment):
            os.kill(os.getpid(), signal.SIGKILL)

    @contextmanager
    def watched(store: Store, what: str = "", then: str = "", **room: int) -> Iterator[Tables]:
        nonlocal number
        with write(store, what, then, **room) as tables:
            yield tables
            number += 1
            head = tables.entries.head()
            reach("before it is durable")
        assert head is not None
        os.write(file, f"{head[0]} {head[1]}\n".encode())
        reach("once it is durable")

    Store.write = watched  # type: ignore[method-assign, assignment]
