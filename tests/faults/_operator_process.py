"""An operator in a process of its own, who waits at each step until he is let on.

A step is what two operators share: a read or a write of a tool, a read or a durable transaction
of the journal; on a PLC each command in the mailbox, a write of a tool among them, and the look
at what the PLC answers. What lies between two of them cannot be seen by the other.
"""

import os
import re
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Final, Literal

from robolink_simulators.clock import ManualClock

import robolink
from robolink.controllers.epson._session import EpsonSession
from robolink.controllers.softmotion._wire import MailboxWire
from robolink.errors import RobolinkError
from robolink.journal import JournalOutcomeLog, open_journal
from robolink.journal._store import Store, Tables
from robolink.model import Signature, ToolOffset
from robolink.protocols.epson_text import Refusal, Reply
from robolink.protocols.mailbox import COMMAND, Opcode
from robolink.protocols.spel import Statement
from robolink.timing import NS_PER_S
from robolink.transaction import Wanted, change_tools
from robolink.transport import MailboxHead
from tests.faults import _client_process

StepKind = Literal[
    "tool read",
    "tool write",
    "journal read",
    "journal write",
    "mailbox command",
    "mailbox answer",
]
Wait = Callable[..., None]
"""Waits before a step: its kind, and the tool where it is about one."""

ALL_TOOLS: Final = -1
"""They are listed at once."""

_PATIENCE_S: Final = 30.0
_TOOL: Final = re.compile(r"(Print )?TLSet\(?\s*(\d+)")


@dataclass(frozen=True)
class Waiting:
    """Before which step he stands.

    Attributes:
        kind: Of the step.
        epoch: Under which he has the lease; 0 without it.
        tool: Which tool is read or written, or :data:`ALL_TOOLS`; 0 for a step of another kind.
        by_mailbox: Whether a tool is written by a command in a PLC's mailbox.
    """

    kind: StepKind
    epoch: int
    tool: int = 0
    by_mailbox: bool = False

    def touches(self) -> dict[str, bool]:
        """Return what the step reads or changes that the other may see, and whether it changes."""
        where, _, what = self.kind.partition(" ")
        tools = range(1, 16) if self.tool == ALL_TOOLS else [self.tool]
        touched = {f"{where} {tool}": what in ("write", "command") for tool in tools}
        if self.by_mailbox:
            touched["mailbox 0"] = True
        return touched


@dataclass(frozen=True)
class Ended:
    """How it ended: ``done``, or the kind of error and its sentences."""

    how: str
    said: str = ""


class OperatorProcess:
    """Reads tools, then changes them if they still hold what was read.

    Args:
        url: The controller.
        folder: Where the journal is.
        name: Of the operator.
        wanted: What the tools are to hold.
        stepwise: Whether he waits at each step.
        later_s: By how much his clock is ahead.
    """

    def __init__(
        self,
        url: str,
        folder: Path,
        name: str,
        wanted: dict[int, ToolOffset],
        *,
        stepwise: bool = True,
        later_s: float = 0.0,
    ) -> None:
        forks = _client_process._FORKS
        self._line, far_end = forks.Pipe()
        task = (url, str(folder), name, wanted, later_s)
        self._process = forks.Process(target=_operate, args=(far_end, task, stepwise))
        self._process.start()
        far_end.close()
        self.state: Waiting | Ended | None = None
        if stepwise:
            self._listen()

    def step(self) -> None:
        """Let him do his next step and come to the one after it, or to his end."""
        self._line.send(None)
        self._listen()

    def advance_to(self, kind: StepKind, *, count: int = 1) -> None:
        """Let him on until he stands before the ``count``-th step of a kind."""
        while True:
            assert isinstance(self.state, Waiting), f"he did not come to a {kind}: {self.state}"
            if self.state.kind == kind:
                count -= 1
            if not count:
                return
            self.step()

    def end(self) -> Ended:
        """Let him on to the end."""
        while not isinstance(self.state, Ended):
            if isinstance(self.state, Waiting):
                self._line.send(None)
            self._listen()
        self.close()
        return self.state

    def freeze(self) -> None:
        """Send SIGSTOP."""
        self._signal(signal.SIGSTOP)

    def thaw(self) -> None:
        """Send SIGCONT."""
        self._signal(signal.SIGCONT)

    def close(self) -> None:
        """End the process, wherever it is."""
        self._process.kill()
        self._process.join()
        self._process.close()
        self._line.close()

    def _listen(self) -> None:
        assert self._line.poll(_PATIENCE_S), "he hangs"
        self.state = self._line.recv()

    def _signal(self, number: signal.Signals) -> None:
        assert self._process.pid is not None
        os.kill(self._process.pid, number)


def _operate(
    line: Connection, task: tuple[str, str, str, dict[int, ToolOffset], float], stepwise: bool
) -> None:
    url, folder, name, wanted, later_s = task
    clock = ManualClock(round(later_s * NS_PER_S))
    signature = Signature(operator=name)
    outcomes = open_journal(f"{folder}/journal.db").log(url, signature=signature, clock=clock)
    try:
        with robolink.connect(url, outcomes=outcomes, timeout_s=1.0) as controller:
            if stepwise:
                _wait_at_each_step(line, outcomes)
            found = {tool: controller.tools.read(tool) for tool in wanted}
            change_tools(
                controller, [Wanted(tool, wanted[tool], value) for tool, value in found.items()]
            )
    except RobolinkError as error:
        line.send(Ended(type(error).__name__, str(error)))
    else:
        line.send(Ended("done"))
    sys.exit(0)


def _wait_at_each_step(line: Connection, outcomes: JournalOutcomeLog) -> None:
    def wait(kind: StepKind, tool: int = 0, *, by_mailbox: bool = False) -> None:
        line.send(Waiting(kind, outcomes._lease._epoch, tool, by_mailbox))
        line.recv()

    _watch_window(wait)
    _watch_mailbox(wait)
    _watch_journal(wait)


def _watch_window(wait: Wait) -> None:
    execute = EpsonSession.execute

    def executed(session: EpsonSession, statement: Statement) -> Reply | Refusal:
        if statement == "TLSet":
            wait("tool read", ALL_TOOLS)
        elif found := _TOOL.match(statement):
            wait("tool read" if found[1] else "tool write", int(found[2]))
        return execute(session, statement)

    EpsonSession.execute = executed  # type: ignore[method-assign, assignment]


def _watch_mailbox(wait: Wait) -> None:
    write, read_slot, read_head = MailboxWire.write, MailboxWire.read_slot, MailboxWire.read_head
    unseen: list[MailboxWire] = []

    def slot_read(wire: MailboxWire, slot: int) -> tuple[int, ...]:
        wait("tool read", slot)
        return read_slot(wire, slot)

    def block_written(wire: MailboxWire, words: Sequence[int]) -> None:
        if words[COMMAND["opcode"].word] == Opcode.WRITE_TOOL:
            wait("tool write", words[COMMAND["i0"].word], by_mailbox=True)
        else:
            wait("mailbox command")
        write(wire, words)
        unseen.append(wire)

    def head_read(wire: MailboxWire) -> MailboxHead:
        if unseen:
            unseen.clear()
            wait("mailbox answer")
        return read_head(wire)

    MailboxWire.write = block_written  # type: ignore[method-assign, assignment]
    MailboxWire.read_slot = slot_read  # type: ignore[method-assign, assignment]
    MailboxWire.read_head = head_read  # type: ignore[method-assign, assignment]


def _watch_journal(wait: Wait) -> None:
    read, write = Store.read, Store.write

    @contextmanager
    def reading(store: Store, consequence: str = "") -> Iterator[Tables]:
        wait("journal read")
        with read(store, consequence) as tables:
            yield tables

    @contextmanager
    def writing(store: Store, consequence: str = "") -> Iterator[Tables]:
        wait("journal write")
        with write(store, consequence) as tables:
            yield tables

    Store.read, Store.write = reading, writing  # type: ignore[method-assign, assignment]
