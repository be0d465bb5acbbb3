"""Ctrl-C, SIGTERM or SIGHUP at each step of a nozzle change: all of before is put back.

Until the verification has passed, an interrupted change ends with the old value in tool 1: it
was not written, or it is written back, and that is said. From then on the new value is kept.
Steps are taken as in the test of kill points; ``ROBOLINK_ALL_KILL_POINTS=1`` takes all.
"""

import json
import math
import signal
from dataclasses import dataclass, field
from queue import SimpleQueue

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

import robolink
from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.interrupts import InterruptGate
from robolink.journal import JournalOutcomeLog, memory_journal
from robolink.model import describe_offset
from tests._patience import PATIENCE_S
from tests.faults._client_process import ClientProcess
from tests.faults._nozzle_cell import MOVE, OLD_TIP, NozzleCell, served_cell
from tests.faults._steps import SHARES, Step, disturbed, steps_of

pytestmark = pytest.mark.timeout(3600)

POSE = '$Execute,"Print RealPos"'

CODES = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129}
WAYS = tuple(CODES)
"""Taken in turn: what cleans up after one, cleans up after all."""


@pytest.fixture(scope="module")
def requests(tmp_path_factory):
    """What a nozzle change asks of the controller when nothing disturbs it."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        with served_cell(tmp_path_factory.mktemp("whole") / "cell", monkeypatch) as cell:
            client = cell.calibrate()
            assert client.exit_code() == 0, client.err
            return cell.requests


def check(cell: NozzleCell, step: Step, *, verified: bool) -> None:
    way = WAYS[step.number % len(WAYS)]
    client = disturbed(cell, step, lambda client: client.signal(way))
    code = client.exit_code()
    assert code == CODES[way], client.err
    document = json.loads(client.out)
    assert document["exit_code"] == code
    assert document["error"]["ended_by"] == way.name
    check_last_line(cell, client.err.splitlines()[-1])
    assert not cell.simulator.status_flags().running, "the robot still moves"
    assert cell.requests.count("$Abort") <= 1
    cell.check_nothing_else_was_written()
    cell.check_settings_are_those_of_before()
    assert cell.open_markers() == (), client.err
    if verified:
        assert cell.tool_1 != OLD_TIP
        kept = ("Tool 1 keeps the new value", "Tool 1 is written and read back")
        assert any(sentence in client.err for sentence in kept), client.err
    else:
        assert cell.tool_1 == OLD_TIP, client.err
    if cell.simulator.machine.flash_writes == 2:
        assert "The old value of tool 1 is back" in client.err


def check_last_line(cell: NozzleCell, line: str) -> None:
    """It says what stands, what was written and what is selected, as it is past the wire."""
    moved = cell.simulator.machine.arm.moves_started
    assert line.startswith("Every movement has ended. " if moved else "Nothing was moved. "), line
    holds = describe_offset(cell.tool_1)
    if cell.tool_1 != OLD_TIP:
        written = f"Tool 1 now holds {holds}; before, it held {describe_offset(OLD_TIP)}."
    elif cell.simulator.machine.flash_writes:
        written = f"Tool 1 holds {holds}, as before."
    else:
        written = "Nothing was written."
    assert written in line
    # Before it was read once, nobody claims to know it.
    selected = (
        f"Tool {cell.selected_tool} is selected.",
        "It was not read which tool is selected.",
    )
    assert line.endswith(selected)


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
        check_last_line(cell, client.err.splitlines()[-1])


@pytest.mark.fault("F24")
@pytest.mark.parametrize("share", range(SHARES))
def test_ctrl_c_at_each_step_leaves_no_tool_selected_that_is_not_the_cell_s_own(
    tmp_path, monkeypatch, requests, share
):
    poses = [number for number, text in enumerate(requests, start=1) if text == POSE]
    steps = steps_of(requests, share)
    for step in steps:
        folder = tmp_path / f"{step.number}-{step.moment[:10]}"
        with served_cell(folder, monkeypatch) as cell:
            try:
                check(cell, step, verified=step.number > poses[-1])
            except AssertionError as error:
                error.add_note(f"interrupted at {step}")
                raise
    print(f"{len(steps)} steps of {2 * len(requests)}")  # noqa: T201 - for pytest -s


class InterruptingLog:
    """Presses Ctrl-C just after the change number ``at`` of the journal.

    Attributes:
        changes: How many there were so far.
        begun: How many movements had begun at Ctrl-C.
    """

    def __init__(self, at: float, simulator: EpsonSimulator) -> None:
        self.changes = 0
        self.begun = 0
        self._simulator = simulator
        self._at = at
        self._log: JournalOutcomeLog = memory_journal(f"interrupted-{at}").log("interrupted")

    def __getattr__(self, name):
        return getattr(self._log, name)

    def begin(self, marker):
        self._log.begin(marker)
        self._changed()

    def clear(self, operation, *entries):
        self._log.clear(operation, *entries)
        self._changed()

    def append(self, *entries):
        self._log.append(*entries)
        self._changed()

    def _changed(self) -> None:
        self.changes += 1
        if self.changes == self._at:
            self.begun = self._simulator.machine.arm.moves_started
            signal.raise_signal(signal.SIGINT)


@dataclass
class Change:
    """A nozzle change in this process, and what was said during it."""

    simulator: EpsonSimulator = field(default_factory=lambda: EpsonSimulator(seed=1))
    said: list[str] = field(default_factory=list)

    def run(self, outcomes: InterruptingLog) -> None:
        with robolink.connect(register("interrupted", self.simulator), outcomes=outcomes) as robot:
            operator = AssistedOperator.with_eyes(
                InProcessEyes(self.simulator), self.said.append, clock=robot.clock
            )
            plan = ChangePlan((ToolPlan(1),), ask_before_write=False)
            NozzleChange(robot, plan, operator=operator).run()


@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.soak)])
def test_ctrl_c_while_a_marker_is_written_or_cleared_leaves_none_open_and_nothing_moves(every):
    whole = Change()
    undisturbed = InterruptingLog(math.inf, whole.simulator)
    try:
        whole.run(undisturbed)
    finally:
        unregister("interrupted")
    for at in range(1, undisturbed.changes + 1, every):
        change = Change()
        outcomes = InterruptingLog(at, change.simulator)
        with pytest.raises(KeyboardInterrupt):
            try:
                change.run(outcomes)
            finally:
                unregister("interrupted")
        machine = change.simulator.machine
        assert outcomes.open_markers() == (), at
        assert machine.tools.selected == 1, at
        assert not change.simulator.status_flags().running, at
        assert machine.arm.moves_started == outcomes.begun, at
        kept = "Tool 1 keeps the new value." in change.said
        assert (machine.tools.get(1) == OLD_TIP) is not kept, at


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
