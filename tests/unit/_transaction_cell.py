"""A controller with two tools in this process, a journal in memory, and people with roles."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from typing import Final

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.hosting.in_process.epson import register, unregister

import robolink
from robolink.journal import Journal, JournalOutcomeLog, LeaseHolder, memory_journal
from robolink.model import Controller, EntryKind, Recorded, Signature, ToolOffset
from robolink.transaction import Wanted

OLD: Final = {1: ToolOffset(12.0, -3.5, -20.0), 2: ToolOffset(-12.0, -3.5, -21.0)}
NEW: Final = {1: ToolOffset(12.25, -3.25, -20.0), 2: ToolOffset(-11.75, -3.5, -21.0)}
OTHER: Final = ToolOffset(1.0, 2.0, 3.0)
UNDEFINED: Final = 3

_names = count()


def wanted(*tools: int) -> list[Wanted]:
    """Return the intended changes, with the old values expected."""
    return [Wanted(tool, NEW[tool], OLD[tool]) for tool in tools]


@dataclass
class Cell:
    """A simulated controller, its clients, and the record."""

    simulator: EpsonSimulator
    journal: Journal
    clock: ManualClock

    @property
    def identity(self) -> str:
        """The controller's name in the journal."""
        return self.simulator.url

    def log(self, operator: str = "Ann", **signed: str) -> JournalOutcomeLog:
        """Return the log of one of several people on this computer."""
        return self.journal.log(
            self.identity,
            signature=Signature(operator=operator, **signed),
            holder=LeaseHolder(os_user=operator, host="here", boot="today"),
            clock=self.clock,
        )

    @contextmanager
    def connected(self, log: JournalOutcomeLog | None = None) -> Iterator[Controller]:
        """Connect as a person."""
        with robolink.connect(self.simulator.url, outcomes=log or self.log()) as controller:
            yield controller

    @property
    def tools(self) -> dict[int, ToolOffset | None]:
        """The stored values of both tools, past the wire."""
        return {tool: self.simulator.machine.tools.get(tool) for tool in OLD}

    @property
    def writes(self) -> int:
        """The number of writes to flash."""
        return self.simulator.machine.flash_writes

    def put(self, tool: int, offset: ToolOffset) -> None:
        """Let somebody else write a tool."""
        machine = self.simulator.machine
        machine.tools.set(tool, offset)
        machine.tools.flash_writes -= 1

    def after_answer_to(self, request: str, tool: int, offset: ToolOffset) -> None:
        """Let somebody else write a tool just after the answer to ``request``, once."""
        waiting = [request]

        def look(_number: int, _text: str) -> None:
            last = [text for _, way, text in self.simulator.log if way == ">"][-1]
            if waiting and waiting[0] in last:
                waiting.clear()
                self.put(tool, offset)

        self.simulator.on_reply = look

    def entries(self, *kinds: EntryKind) -> list[Recorded]:
        """Return the journal entries, oldest first."""
        return list(self.journal.entries(kinds=kinds, newest_first=False))

    def story(self, tool: int | None = None) -> list[str]:
        """Return the journal entries in words, oldest first."""
        return [str(entry.kind) for entry in self.entries() if tool in (None, entry.tool)]


@contextmanager
def tool_cell(options: EpsonOptions | None = None) -> Iterator[Cell]:
    """Set a cell up."""
    simulator = EpsonSimulator(seed=1, options=options)
    for tool, offset in OLD.items():
        simulator.machine.tools.set(tool, offset)
    simulator.machine.tools.flash_writes = 0
    name = f"transaction-{next(_names)}"
    register(name, simulator)
    try:
        yield Cell(simulator, memory_journal(name), ManualClock())
    finally:
        unregister(name)
