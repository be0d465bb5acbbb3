"""Several robots of one controller call back; a PC recovers after a cut on its own side."""

import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.hosting.in_process.epson import register, unregister

import robolink
from robolink.journal import memory_journal, open_journal
from robolink.model import ANY, EntryKind, ToolOffset, Verdict
from robolink.protocols.spel_callback import CallbackLine, CallbackWord
from robolink.serving import CallbackConversation, CallbackLimits
from robolink.transaction import Wanted, change_tools, recover
from tests.faults._callback_cell import SERIAL, CallbackCell
from tests.faults._callback_robots import TwoRobotCell

NAMES = (f"epson:{SERIAL}", f"epson:{SERIAL}-2")
ON_RECORD = f"epson:C-{SERIAL}/{SERIAL}"


@pytest.fixture
def cell(tmp_path):
    made = TwoRobotCell(tmp_path)
    yield made
    made.close()


def kinds(cell, number):
    found = cell.journal.entries(controller=NAMES[number - 1], newest_first=False)
    return [entry.kind for entry in found]


def z_error_mm(cell):
    return abs(cell.simulator.world.tips[1].z_mm - cell.tool.z_mm)


def test_each_robot_is_calibrated_and_on_record_as_itself(cell):
    """Robot 2 has six axes: pivot measures X, Y and Z."""
    for number in (1, 2):
        cell.change_needle_of(number)
        before = cell.error_mm
        others = cell.simulator.machine.robots[2 - number].tools.get(1)
        assert cell.calibrate(number) == ["kept"]
        assert cell.error_mm < 0.02 < before
        assert cell.simulator.machine.robots[2 - number].tools.get(1) == others
        assert kinds(cell, number)[-1] is EntryKind.DONE
    assert z_error_mm(cell) < 0.02
    assert kinds(cell, 1) == kinds(cell, 2)


def test_what_robot_2_left_open_is_put_back_on_robot_2_when_robot_1_starts(cell):
    cell.change_needle_of(2)
    old = cell.tool
    cut = 3 + 6 + 2  # HELLO, BEGIN, six touches, SOLVE, WROTE: in the turn test
    cell.calls.fault = lambda at, _line: power_off(cell) if at == cut else None
    with pytest.raises(PowerOff):
        cell.calibrate(2)
    cell.choose(2)
    assert cell.tool.rounded(3) != old.rounded(3)
    cell.lose_power()
    cell.calls.fault = lambda _at, _line: None
    cell.change_needle_of(1)
    assert cell.calibrate(1) == ["kept"]
    assert cell.error_mm < 0.02
    assert EntryKind.ROLLED_BACK in kinds(cell, 2)
    assert EntryKind.ROLLED_BACK not in kinds(cell, 1)
    assert cell.open_markers() == []
    cell.choose(2)
    assert cell.tool.rounded(3) == old.rounded(3)


class PowerOff(BaseException):
    """The controller loses its power at this moment."""


def power_off(_cell):
    raise PowerOff


@pytest.mark.parametrize(
    ("controllers", "serial", "number", "word"),
    [
        (("epson:C/A",), "A", "2", CallbackWord.WELCOME),
        (("epson:C/A",), "B", "1", CallbackWord.WELCOME),
        (("epson:C/A",), "B", "2", CallbackWord.REFUSE),
        (("epson:C/A", "epson:C/B"), "B", "2", CallbackWord.WELCOME),
        (("epson:C/A", "epson:C/B"), "D", "1", CallbackWord.REFUSE),
    ],
)
def test_a_name_that_was_given_is_that_of_one_robot(controllers, serial, number, word):
    """Otherwise tool 1 of one robot and tool 1 of another would be recorded as one tool."""
    talk = CallbackConversation(
        open_journal(), CallbackLimits(), peer="here", controllers=controllers
    )
    fields = (serial, number, "0", "-", "0", *["0"] * 7)
    answer = talk.answer(CallbackLine(1, CallbackWord.HELLO, fields))
    assert answer.word is word
    assert answer.fields in ((), ("unknown_robot",))
    talk.close()


def test_a_pc_that_was_cut_off_settles_it_when_it_is_the_control_device(tmp_path):
    """The program is never started again before: recover alone restores the old value."""
    address = "epson+sim://recovered"  # in process, the journal belongs to the address
    cell = CallbackCell(tmp_path, journal=memory_journal(address), controllers=(ON_RECORD,))
    cell.simulator.url = register("recovered", cell.simulator, clock=ManualClock())
    assert cell.simulator.url == address
    try:
        cell.change_needle()
        old = cell.tool
        cell.calls.fault = lambda at, _line: power_off(cell) if at == 9 else None
        with pytest.raises(PowerOff):
            cell.run()
        cell.lose_power()
        cell.restart_server()  # waits for the end of the program's conversation: its lease is free
        assert cell.tool.rounded(3) != old.rounded(3)
        own = ToolOffset(11.0, -3.0, -20.0)
        with robolink.connect(address) as controller:
            (settled,) = recover(controller).settled
            assert settled.verdict is not Verdict.DONE
            assert cell.tool.rounded(3) == old.rounded(3)
            # The PC goes on with it; the flag in the controller knows nothing of that.
            change_tools(controller, [Wanted(1, own, ANY)])
        assert cell.open_markers() == []
        cell.calls.fault = lambda _at, _line: None
        cell.restore()
        assert cell.tool.rounded(3) == own
        cell.bring()
        assert cell.run() == ["kept"]
        assert cell.error_mm < 0.02
        assert cell.open_markers() == []
    finally:
        unregister("recovered")
        cell.close()
