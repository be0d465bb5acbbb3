"""A refused nozzle change leaves the old tool in place and records the reason."""

from dataclasses import replace

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.world import STORED

import robolink
from robolink.calibration_run import ChangePlan, Listener, NozzleChange, ToolPlan
from robolink.errors import CalibrationError, DeclinedError, VerifyError
from robolink.journal import memory_journal
from robolink.model import EntryKind, Signature, ToolReceipt, read_offset
from robolink.transaction import earlier_corrections


class Cell:
    """A simulated cell, its journal, and the person who touches the pin."""

    def __init__(self, simulator, controller):
        self.simulator = simulator
        self.controller = controller

    def mount(self, dx_mm):
        """Mount a nozzle whose tip is this far from the first one's."""
        self.simulator.world.tips[1] = replace(STORED, x_mm=STORED.x_mm + dx_mm)

    def change(self, *, operator=None, listener=None):
        NozzleChange(
            self.controller,
            ChangePlan((ToolPlan(1),), ask_before_write=False),
            operator=operator
            or AssistedOperator.with_eyes(
                InProcessEyes(self.simulator), lambda _: None, clock=self.controller.clock
            ),
            listener=listener,
            earlier=lambda tool: earlier_corrections(self.controller, tool),
        ).run()

    def recorded(self, kind):
        return list(self.controller.outcomes.recorded(kinds=(kind,)))

    def check_the_tool_is(self, offset, *, writes):
        machine = self.simulator.machine
        assert machine.tools.get(1) == offset
        assert machine.tools.selected == 1
        assert machine.flash_writes == writes
        assert self.controller.outcomes.open_markers() == ()


@pytest.fixture
def cell(serve_simulator):
    simulator = EpsonSimulator(seed=3)
    url = serve_simulator(simulator).url
    outcomes = memory_journal(url).log(url, signature=Signature(nozzle="N-7"))
    with robolink.connect(url, outcomes=outcomes) as controller:
        yield Cell(simulator, controller)


def test_a_nozzle_that_is_too_far_off_is_refused(cell):
    cell.mount(dx_mm=4.0)
    with pytest.raises(CalibrationError, match="would move 4") as refused:
        cell.change()
    assert refused.value.code == "implausible_change"
    assert "all poses touched the same point" in refused.value.remedy
    cell.check_the_tool_is(STORED, writes=0)
    (entry,) = cell.recorded(EntryKind.REFUSED)
    assert (entry.tool, entry.details["code"]) == (1, "implausible_change")
    assert "change up to 2 mm" in entry.tolerance
    assert cell.recorded(EntryKind.INTENT) == []


class GivesUp(AssistedOperator):
    """A person who gives up if the pin is not reached after some steps."""

    def poll(self, wait_s):
        self.patience = getattr(self, "patience", 60) - 1
        return super().poll(wait_s) if self.patience else "q"


def test_a_pin_that_is_not_reached_is_refused(cell):
    x_mm, y_mm, z_mm = cell.simulator.world.pin_mm
    cell.simulator.world.pin_mm = (x_mm, y_mm, z_mm - 100)
    said: list[str] = []
    with pytest.raises(DeclinedError, match="jogs in a row were refused"):
        cell.change(
            operator=GivesUp.with_eyes(
                InProcessEyes(cell.simulator), said.append, clock=cell.controller.clock
            )
        )
    assert any("allowed area" in sentence for sentence in said), said
    cell.check_the_tool_is(STORED, writes=0)
    (entry,) = cell.recorded(EntryKind.REFUSED)
    assert entry.details == {"code": "DeclinedError", "poses": []}


class LooseNozzle(Listener):
    """A nozzle that slips when the robot begins to turn after the write."""

    def __init__(self, cell):
        self.cell = cell

    def wrote(self, receipt: ToolReceipt) -> None:
        assert receipt.read_back == self.cell.simulator.machine.tools.get(1) != STORED
        self.cell.mount(dx_mm=2.0)


def test_a_failed_verification_puts_the_old_tool_back(cell):
    cell.mount(dx_mm=0.4)
    with pytest.raises(VerifyError, match="Turn test failed") as failed:
        cell.change(listener=LooseNozzle(cell))
    assert "The old value of tool 1 is back." in failed.value.what
    cell.check_the_tool_is(STORED, writes=2)
    (verify,) = cell.recorded(EntryKind.VERIFY)
    assert verify.details["passed"] is False
    (rolled_back,) = cell.recorded(EntryKind.ROLLED_BACK)
    assert read_offset(rolled_back.details["value"]) == STORED
    assert read_offset(rolled_back.details["requested"]) != STORED
    assert rolled_back.change == verify.change != ""


def test_corrections_of_one_nozzle_that_grow_are_refused(cell):
    cell.mount(dx_mm=0.3)
    cell.change()
    kept = cell.simulator.machine.tools.get(1)
    assert kept.x_mm == pytest.approx(STORED.x_mm + 0.3, abs=0.1)
    cell.mount(dx_mm=0.9)
    with pytest.raises(CalibrationError) as refused:
        cell.change()
    assert refused.value.code == "diverging"
    cell.check_the_tool_is(kept, writes=1)
    (entry,) = cell.recorded(EntryKind.REFUSED)
    assert entry.details["code"] == "diverging"
