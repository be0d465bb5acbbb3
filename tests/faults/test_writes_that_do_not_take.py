"""A write that is acknowledged but not done, and a write to a tool that is not selected.

No movement may follow either of them: rows F43 and F44 of the catalogue.
"""

from dataclasses import replace
from typing import Any

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef

import robolink
from robolink.errors import NotReadyError, NotReadyReason, ReadBackError
from robolink.journal import open_journal
from robolink.model import EntryKind, MotionProfile, Path, ToolOffset, WorkBox
from robolink.transaction import Wanted, change_tools
from tests.contract._softmotion_cell import QUICK, SLOW, above, served
from tests.faults._nozzle_cell import MOVE, OLD_TIP, served_cell

NEW = ToolOffset(12.5, -3.0, -20.0)
ANYWHERE = WorkBox()


@pytest.mark.soak
@pytest.mark.fault("F43")
def test_f43_a_nozzle_change_ends_at_a_write_that_was_not_done(tmp_path, monkeypatch):
    with served_cell(tmp_path / "cell", monkeypatch) as cell:
        cell.simulator.faults.add(Fault(FaultAction.IGNORE_WRITE, match="TLSet 1, XY"))
        ended = cell.run(*cell.calibration)
        assert ended.code not in (0, 6), ended.err
        assert "reads back as" in ended.err
        written = next(n for n, text in enumerate(cell.requests) if "TLSet 1, XY" in text)
        assert not [text for text in cell.requests[written:] if MOVE.match(text)]
        assert cell.tool_1 == OLD_TIP
        cell.check_settings_are_those_of_before()
        record = open_journal().log(cell.url)
        ends = [entry.kind for entry in record.recorded(kinds=(EntryKind.DONE, EntryKind.CONFLICT))]
        assert ends == [EntryKind.CONFLICT]


@pytest.mark.fault("F43")
def test_f43_a_plc_that_says_done_and_keeps_the_old_value_is_not_believed():
    with served("modbus-tcp") as cell, cell.connect() as controller:
        old = controller.tools.read(1)
        assert old is not None
        memory, lied = cell.simulator.plc.memory, list[int]()
        define: Any = memory.define

        def forget(number: int, tool: Any, name: str) -> None:
            lied.append(number)
            if len(lied) > 1:  # the write that restores the old value is carried out
                define(number, tool, name)

        memory.define = forget  # type: ignore[method-assign]
        with pytest.raises(ReadBackError, match=r"reads back as|works with"):
            change_tools(controller, [Wanted(1, NEW, old)])
        kinds = [entry.kind for entry in cell.journal.entries()]
        assert EntryKind.CONFLICT in kinds
        assert EntryKind.DONE not in kinds
        assert controller.tools.same(controller.tools.read(1), old)
        assert cell.movements_started == 0


@pytest.mark.fault("F44")
def test_f44_a_movement_in_another_tool_than_the_one_in_force_is_refused_on_epson():
    simulator = EpsonSimulator(seed=2)
    machine = simulator.machine
    machine.tools.set(2, ToolOffset(1.0, 2.0, 3.0))
    with serve_tcp(simulator) as host, robolink.connect(host.url) as controller:
        controller.motors(True)
        group = controller.groups[0]
        here = group.pose()  # in tool 1
        controller.tools.write(2, NEW, expected=machine.tools.get(2))
        assert controller.tools.selected() == 1  # a write selects nothing
        controller.tools.write(1, NEW, expected=machine.tools.get(1))
        machine.tools.select(2)  # at the pendant
        began, slow = machine.arm.moves_started, MotionProfile(Path.STRAIGHT, 1, 1.0)
        for target in (here, replace(group.pose(), tool=1)):
            with pytest.raises(NotReadyError, match="tool 1, but tool 2 is selected") as refusal:
                group.move_to(target, slow, box=ANYWHERE)
            assert refusal.value.reason is NotReadyReason.WRONG_TOOL
        assert machine.arm.moves_started == began
        assert machine.tools.selected == 2  # nor is it changed unnoticed


@pytest.mark.fault("F44")
def test_f44_a_movement_in_another_tool_than_the_one_in_force_is_refused_on_a_plc():
    with served("modbus-tcp") as cell, cell.connect() as controller:
        group = controller.groups[0]
        here = group.pose()
        controller.tools.write(2, NEW, expected=None)
        assert controller.tools.selected() == 1
        controller.tools.select(2)
        with pytest.raises(NotReadyError, match="tool 1, but tool 2 is selected") as refusal:
            group.move_to(above(here, 1.0), SLOW, box=ANYWHERE)
        assert refusal.value.reason is NotReadyReason.WRONG_TOOL
        assert cell.movements_started == 0


@pytest.mark.fault("F44")
@pytest.mark.parametrize("slot", [0, 1])
def test_f44_a_tool_that_the_machine_sets_behind_the_slot_is_not_moved_by(slot):
    """The slot reads as selected; the axis group uses another one."""
    with served("modbus-tcp") as cell, cell.connect() as controller:
        controller.tools.select(slot)
        group = controller.groups[0]
        here = group.pose()
        cell.simulator.panel.set_tool(CoordRef(z_mm=77.0))
        with pytest.raises(NotReadyError, match="has given the axis group another") as refusal:
            group.move_to(above(here, 1.0), QUICK, box=ANYWHERE)
        assert refusal.value.reason is NotReadyReason.WRONG_TOOL
        assert cell.movements_started == 0
        # A tool reported as already selected is selected again, and then it is.
        controller.tools.select(slot)
        assert group.pose().coordinates() == pytest.approx(here.coordinates(), abs=1e-6)
        group.move_to(above(here, 1.0), QUICK, box=ANYWHERE).wait(timeout_s=10)
        assert cell.movements_started == 1
