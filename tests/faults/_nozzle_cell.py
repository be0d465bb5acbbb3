"""A served cell with a changed nozzle, and the checks after a mishap."""

import re
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.assist import serve_assist
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.world import STORED
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.testkit import media

from robolink.journal import Journal, memory_journal, open_journal
from robolink.model import Marker, Secret, ToolOffset
from tests._commands import Ended, run_command
from tests.faults._client_process import ClientProcess
from tests.faults._requests import changes

SPEED = 200.0
"""Simulated seconds per real second. The remote time-out is off: it would be 0.3 s."""

STATE = "state"
"""The state folder, in the folder of the cell."""

FAST = (30, 40, 50)
"""The speed of the cell's own program, which a calibration must restore."""

OLD_TIP = STORED
"""The value of tool 1 before the nozzle change."""

MOVE = re.compile(r'\$Execute,"(Move|Go) ')
OF_A_CALIBRATION = re.compile(
    r'\$Execute,"(Tool [01]|TLSet 1, XY\(.*\)|Power (Low|High)|SpeedS? [\d., ]+'
    r'|(Move|Go) XY\(.*\).*)"|\$Abort'
)
"""All requests other than readings that a calibration of tool 1 may send."""


class NozzleCell:
    """A controller that holds the old tip in tool 1, with fast and high-power settings."""

    def __init__(self, simulator: EpsonSimulator, url: str, assist_url: str, folder: Path) -> None:
        self.simulator = simulator
        self.url = url
        self.assist_url = assist_url
        self.folder = folder
        self.state_folder = folder / STATE
        machine = simulator.machine
        machine.power_high, machine.parameters.speed = True, FAST
        self._settings = self._settings_now()
        self._others = self._all_but_tool_1()

    @property
    def calibration(self) -> list[str]:
        """The command of the whole nozzle change."""
        assist = ["--assist", self.assist_url]
        return ["calibrate", "two-pose", "--tool", "1", "--yes", *assist]

    def calibrate(self) -> ClientProcess:
        """Start the whole nozzle change in a separate process."""
        return ClientProcess(
            ["-c", self.url, *self.calibration, "--json"],
            environment={"ROBOLINK_STATE_DIR": str(self.state_folder)},
            folder=self.folder,
        )

    def run(self, *arguments: str) -> Ended:
        """Run another command, in this process."""
        return run_command("-c", self.url, *arguments)

    def wait_at_rest(self) -> None:
        """Wait until a movement without a client has ended."""
        while self.simulator.status_flags().running:
            time.sleep(0.002)

    @property
    def selected_tool(self) -> int:
        """The selected tool, past the wire."""
        return self.simulator.machine.tools.selected

    @property
    def tool_1(self) -> ToolOffset | None:
        """The stored value, past the wire."""
        return self.simulator.machine.tools.get(1)

    @property
    def requests(self) -> list[str]:
        """The requests so far."""
        return [text for _, direction, text in self.simulator.log if direction == ">"]

    @property
    def moves_requested(self) -> int:
        """The number of moves requested so far."""
        return sum(MOVE.match(text) is not None for text in self.requests)

    @property
    def journal(self) -> Journal:
        """What is on record of it: in the state folder, or in the process that it ends with."""
        return memory_journal(self.url) if self.url == self.assist_url else open_journal()

    def open_markers(self) -> tuple[Marker, ...]:
        """Return the markers that the command line counts as open."""
        return self.journal.log(self.url).open_markers()

    def check_nothing_else_was_written(self) -> None:
        """Tool 1 holds the old or the measured value, written once at most; the rest is as
        before.
        """
        machine = self.simulator.machine
        asked = changes(self.requests)
        strange = [text for text in asked if not OF_A_CALIBRATION.fullmatch(text)]
        assert not strange, strange
        written = [ToolOffset(*numbers(text)) for text in asked if "TLSet" in text]
        assert machine.flash_writes == len(written) <= 2
        assert self.tool_1 == (written[-1] if written else OLD_TIP)
        assert self._all_but_tool_1() == self._others
        assert machine.arm.moves_started <= self.moves_requested

    def check_settings_are_those_of_before(self) -> None:
        """Tool, power and speed are as the cell's own program set them."""
        assert self.selected_tool == 1
        assert self._settings_now() == self._settings

    def _settings_now(self) -> object:
        machine = self.simulator.machine
        return machine.power_high, machine.parameters.speed, machine.parameters.speed_s

    def _all_but_tool_1(self) -> object:
        machine = self.simulator.machine
        others = {tool: value for tool, value in machine.tools.defined().items() if tool != 1}
        return others, machine.outputs.get_byte(0), machine.memory.get_byte(0)


@contextmanager
def served_cell(
    folder: Path, monkeypatch, *, speed: float = SPEED, password: str = "", **habits: Any
) -> Iterator[NozzleCell]:
    """Serve a cell; commands of this process share its state folder."""
    simulator = _simulator(folder, monkeypatch, password, habits)
    clock = ScaledClock(speed)
    with ExitStack() as stack:
        tcp = stack.enter_context(serve_tcp(simulator, clock=clock))
        assist = stack.enter_context(serve_assist(simulator, clock=clock))
        yield NozzleCell(simulator, tcp.url, assist.url, folder)


@contextmanager
def cell_in_process(folder: Path, monkeypatch) -> Iterator[NozzleCell]:
    """The same cell without a socket: movements take no time, and only this process reaches it."""
    simulator = _simulator(folder, monkeypatch, "", {})
    with media.served(simulator, "sim") as url:
        yield NozzleCell(simulator, url, url, folder)


def _simulator(folder: Path, monkeypatch, password: str, habits: dict[str, Any]) -> EpsonSimulator:
    folder.mkdir(parents=True)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(folder / STATE))
    options = EpsonOptions(**{"remote_timeout_s": 0, "login_timeout_s": 0, **habits})
    return EpsonSimulator(seed=1, password=Secret(password), options=options)


def numbers(statement: str) -> list[float]:
    inside = statement.partition("(")[2].partition(")")[0]
    return [float(number) for number in inside.split(",")]
