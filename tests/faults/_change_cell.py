"""A cell with two tools, programs that are killed while they change them, and recovery.

It is served for programs in processes of their own, or lives in this process.
"""

import re
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import Any, ClassVar, Final, Literal, TypeVar, get_args

import pytest
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import served

import robolink
from robolink.journal import Journal, memory_journal, open_journal
from robolink.model import EntryKind, MarkerKind, ToolOffset
from robolink.transaction import changed_since
from tests._commands import run_command
from tests._patience import PATIENCE_S
from tests.faults._change_process import OLD, PROGRAMS, CommitStep, ProgramProcess, acknowledged
from tests.faults._recipe_instants import Instants, exchanges_and_commits

Moment = Literal["before it is carried out", "before its answer leaves"]
MOMENTS: Final[tuple[Moment, Moment]] = get_args(Moment)
EpsonWire = Literal["sim", "tcp", "serial"]

_WRITE = re.compile(r'\$Execute,"TL(?:Set (\d+), XY|Clr (\d+))')


@dataclass(frozen=True)
class WireStep:
    """One instant of a program: the number of an exchange, and a moment of it."""

    number: int
    moment: Moment
    request: str

    def __str__(self) -> str:
        return f"exchange {self.number}, {self.moment}: {self.request}"


Step = WireStep | CommitStep


class ChangeCell(ABC):
    """A controller that holds ``OLD`` in tools 1 and 2, of which 1 is selected.

    Attributes:
        matters: The beginnings of requests that take ownership, select or write.
        skip: Skips some seconds, if the clock can.
    """

    matters: ClassVar[re.Pattern[str]]

    def __init__(
        self,
        simulator: EpsonSimulator | SoftMotionSimulator | PlcSimulator,
        url: str,
        folder: Path,
    ) -> None:
        self.simulator = simulator
        self.url = url
        self.folder = folder
        self.skip: Callable[[float], None] = lambda _seconds: None
        in_memory = "+sim://" in url
        self.journal: Journal = (
            memory_journal(url.partition("?")[0])
            if in_memory
            else open_journal(str(folder / "journal.db"))
        )

    @property
    @abstractmethod
    def tools(self) -> dict[int, ToolOffset | None]:
        """The stored values of both tools, past the wire."""

    @property
    @abstractmethod
    def selected(self) -> int:
        """The selected tool, past the wire."""

    @abstractmethod
    def writes(self) -> list[int]:
        """Return the tools that were written or cleared so far, in order."""

    @abstractmethod
    def values_written(self, tool: int = 1) -> list[ToolOffset]:
        """Return the values written to a tool so far, in order."""

    @abstractmethod
    def act(self) -> None:
        """Let the controller carry out what it has received."""

    @property
    def requests(self) -> list[str]:
        """The requests so far."""
        return [text for _, direction, text in self.simulator.log if direction == ">"]

    def steps_of(self, program: str) -> list[Step]:
        """Run a program undisturbed and return all its instants."""
        exchanges, commits = len(self.requests), len(acknowledged(self.folder))
        assert ProgramProcess(program, self.url, self.folder).exit_code() == 0
        wire = [
            WireStep(number, moment, request)
            for number, request in enumerate(self.requests[exchanges:], start=1)
            for moment in MOMENTS
        ]
        count = len(acknowledged(self.folder)) - commits
        durable = [
            step
            for number in range(1, count + 1)
            for step in (
                CommitStep(number, "before it is durable"),
                CommitStep(number, "once it is durable"),
            )
        ]
        return [*wire, *durable]

    def run(self, program: str, instants: Instants) -> None:
        """Run a program in this process and record all its instants."""
        with exchanges_and_commits(self.simulator, instants):
            # Its time stands still: no sign of life comes between the transactions.
            log = self.journal.log(self.url, clock=ManualClock())
            with robolink.connect(self.url, outcomes=log) as controller:
                PROGRAMS[program](controller)

    def deliver(self, program: str) -> None:
        """Run a program in this process to its end."""
        with robolink.connect(self.url, outcomes=self.journal.log(self.url)) as controller:
            PROGRAMS[program](controller)

    def kill(self, program: str, step: Step) -> None:
        """Run a program and kill it at ``step``."""
        if isinstance(step, CommitStep):
            client = ProgramProcess(program, self.url, self.folder, kill_at=step)
        else:
            client = self._killed_at_the_wire(program, step)
        assert client.exit_code() == -9, f"it was not killed at {step}"

    def recover(self) -> str:
        """Run ``robolink recover`` and return its output; nothing may be left open."""
        return self.command("recover")

    def command(self, *words: str) -> str:
        """Run a command that must succeed, and return its output."""
        with pytest.MonkeyPatch.context() as environment:
            environment.setenv("ROBOLINK_JOURNAL", str(self.folder / "journal.db"))
            environment.setenv("ROBOLINK_STATE_DIR", str(self.folder))
            ended = run_command("-c", self.url, *words)
        assert ended.code == 0, ended.err
        return ended.out + ended.err

    def check_what_was_acknowledged_is_there(self) -> None:
        """Every entry acknowledged as durable is in the journal, which is whole."""
        assert self.journal.verify().problems == ()
        for number, last_hash in acknowledged(self.folder):
            entry = self.journal.entry(number) if number else None
            assert number == 0 or (entry is not None and entry.hash == last_hash), number

    def check_the_selected_tool_is_right_or_named(self) -> None:
        """Status reports which tool is the cell's own."""
        if self.selected != 1:
            markers = [marker for _, marker in self.journal.open_markers()]
            (named,) = [marker for marker in markers if marker.kind is MarkerKind.SELECTION]
            assert named.details["tool"] == 1

    def meet(self) -> None:
        """Store the controller's identity in the journal once, for all programs."""
        with robolink.connect(self.url, outcomes=self.journal.log(self.url)) as controller:
            assert controller.outcomes.open_markers() == ()

    def check_all_is_settled(self) -> None:
        """Nothing is open, the record is true, and the cell's own tool is selected."""
        assert self.journal.open_markers() == ()
        assert self.selected == 1
        self.check_what_was_acknowledged_is_there()
        outcomes = self.journal.log(self.url, clock=ManualClock())
        with robolink.connect(self.url, outcomes=outcomes) as controller:
            controller.require_settled("the next command")
            for tool, held in self.tools.items():
                assert changed_since(controller, tool, held) is None, tool

    def verified(self) -> bool:
        """Whether it is recorded that a verified change stays."""
        done = self.journal.entries(kinds=(EntryKind.DONE,))
        return any(entry.verdict == "verified" for entry in done)

    def _killed_at_the_wire(self, program: str, step: WireStep) -> ProgramProcess:
        started: SimpleQueue[ProgramProcess] = SimpleQueue()
        reached = threading.Event()
        before = len(self.requests)

        def hold(number: int, _text: str) -> None:
            if number == before + step.number and not reached.is_set():
                started.get(timeout=PATIENCE_S).kill()
                reached.set()

        with self.simulator.lock:
            if step.moment == MOMENTS[0]:
                self.simulator.on_request = hold
            else:
                self.simulator.on_reply = hold
        client = ProgramProcess(program, self.url, self.folder)
        started.put(client)
        assert reached.wait(PATIENCE_S), "the step was not reached"
        with self.simulator.lock:
            self.simulator.on_request = self.simulator.on_reply = None
        return client


Cell = TypeVar("Cell", bound=ChangeCell)


class EpsonChangeCell(ChangeCell):
    """An EPSON controller.

    Attributes:
        epson: The controller.
    """

    matters = re.compile(r'\$(Log|Execute,"(Tool \d|TL(Set|Clr) ))')

    def __init__(self, simulator: EpsonSimulator, url: str, folder: Path) -> None:
        super().__init__(simulator, url, folder)
        self.epson = simulator
        self._machine = simulator.machine

    @property
    def tools(self) -> dict[int, ToolOffset | None]:
        """The stored values of both tools, past the wire."""
        return {tool: self._machine.tools.get(tool) for tool in OLD}

    @property
    def selected(self) -> int:
        """The selected tool, past the wire."""
        return self._machine.tools.selected

    def writes(self) -> list[int]:
        """Return the tools that were written or cleared so far, in order."""
        found = [match[1] or match[2] for match in map(_WRITE.match, self.requests) if match]
        assert len(found) == self._machine.flash_writes
        return [int(tool) for tool in found]

    def values_written(self, tool: int = 1) -> list[ToolOffset]:
        """Return the values written to a tool so far, in order."""
        sent = [text for text in self.requests if text.startswith(f'$Execute,"TLSet {tool}, XY')]
        texts = [text.partition("XY(")[2].partition(")")[0] for text in sent]
        return [ToolOffset(*map(float, text.split(","))) for text in texts]

    def act(self) -> None:
        """Do nothing: the controller acts on requests at once."""


@contextmanager
def change_cell(
    folder: Path,
    kind: type[EpsonSimulator] = EpsonSimulator,
    *,
    wire: EpsonWire = "tcp",
    **habits: Any,
) -> Iterator[EpsonChangeCell]:
    """Open a cell with its own journal, over TCP, on a pseudo terminal, or in this process."""
    folder.mkdir(parents=True)
    options = EpsonOptions(**{"remote_timeout_s": 0, "login_timeout_s": 0, **habits})
    simulator = kind(seed=1, options=options)
    for tool, offset in OLD.items():
        simulator.machine.tools.set(tool, offset)
    simulator.machine.tools.flash_writes = 0
    clock = ManualClock() if wire == "sim" else ScaledClock(200.0)
    with (
        served(simulator, wire, clock=clock) as url,
        kept(EpsonChangeCell(simulator, url, folder)) as cell,
    ):
        if isinstance(clock, ManualClock):
            cell.skip = clock.sleep
        yield cell


@contextmanager
def kept(cell: Cell) -> Iterator[Cell]:
    """Open the journal of a cell, which already has the controller's identity."""
    cell.meet()
    try:
        yield cell
    finally:
        cell.journal.close()
