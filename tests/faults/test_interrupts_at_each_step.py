"""Ctrl-C, SIGTERM or SIGHUP at each step of a nozzle change: everything is restored.

Until the verification has passed, an interrupted change ends with the old value in tool 1: it was
not written, or it is restored, and a message says so. From then on the new value is kept. A fixed
sample of them is tried, half of it only in ``make soak``; ``ROBOLINK_ALL_KILL_POINTS=1`` tries all.
"""

import json
import re
import signal
from dataclasses import dataclass
from queue import SimpleQueue

import pytest

from robolink.interrupts import InterruptGate
from robolink.model import ToolOffset, describe_offset
from tests._commands import Ended
from tests._patience import PATIENCE_S
from tests.faults import _killed_calibrations as calibrations
from tests.faults._client_process import ClientProcess
from tests.faults._epson_recipe_cell import EpsonRecipeCell
from tests.faults._nozzle_cell import MOVE, OLD_TIP, served_cell
from tests.faults._recipe_instants import EVERYTHING, Instant, Instants, noted

pytestmark = [pytest.mark.timeout(3600), pytest.mark.usefixtures("signals_of_a_terminal")]

POSE = "Tool, RealPos"

CODES = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129}
WAYS = tuple(CODES)
"""Used in turn: a clean-up that works for one works for all."""


@pytest.fixture(scope="module")
def passed():
    """The instants of an undisturbed run."""
    whole = Instants()
    with calibrations.begun() as cell:
        assert cell.run(*calibrations.words(cell), "--json", instants=whole).code == 0
    return whole.passed


@dataclass
class Ending:
    """One of the ways to end a command, used once.

    Attributes:
        at: The instant.
        begun: The number of movements begun by then, or requested just then.
        asked: The number of requests by then.
    """

    cell: EpsonRecipeCell
    at: Instant
    begun: int = -1
    asked: int = -1

    @property
    def way(self) -> signal.Signals:
        """The signal."""
        return WAYS[self.at.number % len(WAYS)]

    def __call__(self) -> None:
        """Use it."""
        self.begun = self.cell.moves_begun + (self.at.kind == "request")
        self.asked = len(self.cell.requests())
        assert signal.getsignal(self.way) is not signal.SIG_DFL, "it would end this process"
        signal.raise_signal(self.way)

    def check(self, ended: Ended, last_pose: int) -> None:
        """Check the end of the command: a verified value is kept, any other one undone."""
        cell = self.cell
        assert ended.code == CODES[self.way], ended.err
        document = json.loads(ended.out)
        assert document["exit_code"] == ended.code
        assert document["error"]["ended_by"] == self.way.name
        writes = len(cell.writes())
        held = cell.tools()[1]
        assert held is not None
        check_last_line(ended.err, cell.moves_begun, (cell.before[1], held), writes, cell.selected)
        assert not cell.moving, "the robot still moves"
        assert cell.moves_begun <= self.begun
        assert cell.stops_asked() <= 1
        calibrations.check_nothing_else_was_written(cell)
        assert (cell.selected, cell.settings()) == (1, cell.settings_before)
        assert cell.open_markers() == (), ended.err
        kept = re.search("Tool 1 keeps the new value|The controller has stored tool 1", ended.err)
        # A transaction may lie on either side of the verdict, which follows the last pose.
        assert self.at.kind == "commit" or bool(kept) is (self.asked > last_pose), ended.err
        assert cell.changed() == ({1} if kept else set()), ended.err
        if writes == 2:
            assert "The old value of tool 1 is back" in ended.err


def check_last_line(
    err: str, moved: int, held: tuple[ToolOffset, ToolOffset], writes: int, selected: int
) -> None:
    """It states position, written values and selected tool as they are past the wire."""
    line, (old, now) = err.splitlines()[-1].strip(), held
    assert line.startswith("Every movement has ended. " if moved else "Nothing moved. "), line
    if now != old:
        written = (
            f"Tool 1 now holds {describe_offset(now)}; before, it held {describe_offset(old)}."
        )
    elif writes:
        written = f"Tool 1 holds {describe_offset(now)}, as before."
    else:
        written = "Nothing was written."
    assert written in line
    # Before the first reading nobody claims to know it.
    known = (f"Tool {selected} is selected.", "Selected tool: not checked.")
    assert line.endswith(known)


@pytest.mark.fault("F24")
def test_a_second_signal_during_the_cleaning_up_breaks_nothing(tmp_path, monkeypatch):
    with served_cell(tmp_path / "cell", monkeypatch) as cell:
        started: SimpleQueue[ClientProcess] = SimpleQueue()
        sent: list[str] = []

        def disturb(_number: int, text: str) -> None:
            if not sent and not MOVE.match(text):
                return
            if not sent:
                sent.append("SIGTERM")
                clients.append(started.get(timeout=PATIENCE_S))
                clients[0].signal(signal.SIGTERM)
            elif text == "$Abort":
                sent.append("SIGINT")
                clients[0].signal(signal.SIGINT)
            elif "Tool 1" in text:
                sent.append("SIGHUP")
                clients[0].signal(signal.SIGHUP)

        clients: list[ClientProcess] = []
        with cell.simulator.lock:
            cell.simulator.on_request = disturb
        client = cell.calibrate()
        started.put(client)
        assert client.exit_code() == 143, client.err
        assert sent == ["SIGTERM", "SIGINT", "SIGHUP"]
        assert cell.open_markers() == (), client.err
        cell.check_settings_are_those_of_before()
        machine = cell.simulator.machine
        assert cell.tool_1 is not None
        held = (OLD_TIP, cell.tool_1)
        moved, writes = machine.arm.moves_started, machine.flash_writes
        check_last_line(client.err, moved, held, writes, cell.selected_tool)


EVERY_COMMIT = 3
SHARES = 8
"""The instants are dealt to this many tests, so that several workers can share them."""
EACH_TIME = (1, 3, 5, 6)
"""The shares of each run of the tests, with the write, both selections, login and logout among
them; the others run only in ``make soak``.
"""
OTHERS = [(share,) for share in range(SHARES) if EVERYTHING or share not in EACH_TIME]


@pytest.mark.fault("F24")
@pytest.mark.parametrize(
    "shares",
    OTHERS
    if EVERYTHING
    else [EACH_TIME, *(pytest.param(other, marks=pytest.mark.soak) for other in OTHERS)],
    ids=str,
)
def test_ctrl_c_at_each_step_leaves_no_tool_selected_that_is_not_the_cell_s_own(passed, shares):
    dealt = calibrations.Dealt(*shares, shares=SHARES, every_commit=EVERY_COMMIT)
    steps = list(filter(dealt, passed))
    # The turn test is judged after the last pose.
    last_pose = [at.number for at in passed if at.kind == "request" and POSE in at.what][-1]
    print(f"{len(steps)} steps of {len(passed)}")  # noqa: T201 - for pytest -s
    assert steps
    for at in steps:
        with calibrations.begun() as cell, noted(at):
            ending = Ending(cell, at)
            ended = cell.run(*calibrations.words(cell), "--json", instants=Instants(at, ending))
            ending.check(ended, last_pose)


def test_ctrl_c_waits_for_the_outermost_of_two_operations():
    gate, reached = InterruptGate(), []
    gate.open()
    try:
        with pytest.raises(KeyboardInterrupt), gate:
            with gate:
                signal.raise_signal(signal.SIGINT)
            reached.append("end of the operation")
    finally:
        gate.close()
    assert reached
