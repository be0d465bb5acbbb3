"""The tool slots of the simulated mailbox, over commands and over restarts."""

import json

import pytest
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef
from robolink_simulators.softmotion.mailbox import (
    MailboxOptions,
    PlcOptions,
    SoftMotionSimulator,
)

from robolink.errors import ConfigError
from robolink.protocols.mailbox import (
    Bits,
    CommandState,
    ErrorClass,
    GroupState,
    Opcode,
    ReadMode,
    Slot,
    frames_match,
)
from tests.unit._mailbox_client import LINE, MCS, NO_TOOL, linked, owning, shifted

pytestmark = pytest.mark.usefixtures("mailbox_program")

TOOL = (1.0, -2.0, 30.5, 10.0, 20.0, 30.0)
SIDEWAYS = (5.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_a_slot_keeps_what_is_written_and_counts_it():
    client, _ = owning()
    assert client.slot(7) == Slot()
    client.done(Opcode.WRITE_TOOL, 7, pose=TOOL, name="needle 0.4")
    assert client.slot(7) == Slot(1, True, TOOL, "needle 0.4")
    client.done(Opcode.WRITE_TOOL, 7, pose=TOOL, name="needle 0.4")
    client.done(Opcode.CLEAR_TOOL, 7)
    client.done(Opcode.CLEAR_TOOL, 7)
    assert client.slot(7) == Slot(3)
    assert client.now().tool_slot == 1


@pytest.mark.parametrize("slot", [0, 16, -1])
@pytest.mark.parametrize("opcode", [Opcode.WRITE_TOOL, Opcode.CLEAR_TOOL])
def test_there_are_fifteen_slots(slot, opcode):
    client, _ = owning()
    assert client.refused(opcode, slot, pose=TOOL) == ErrorClass.SLOT_OUT_OF_RANGE


@pytest.mark.parametrize(("unit_um", "longest"), [(1000.0, 10_000.0), (1_000_000.0, 10.0)])
def test_a_tool_is_no_longer_than_ten_metres_whatever_the_unit(unit_um, longest):
    client, _ = owning(options=PlcOptions(mailbox=MailboxOptions(unit_um=unit_um)))
    client.done(Opcode.WRITE_TOOL, 7, pose=shifted(NO_TOOL, z=longest))
    before = client.slot(7)
    for axis in "xyz":
        tool = shifted(NO_TOOL, **{axis: -1.01 * longest})
        assert client.refused(Opcode.WRITE_TOOL, 7, pose=tool) == ErrorClass.OPERAND
    assert client.slot(7) == before


def test_selecting_sets_the_tool_and_answers_with_it():
    client, _ = owning()
    client.done(Opcode.WRITE_TOOL, 7, pose=TOOL)
    now = client.done(Opcode.SELECT_TOOL, 7)
    assert now.tool_slot == 7
    assert frames_match(now.answer.pose, TOOL, tolerance=1e-9)
    assert client.done(Opcode.SELECT_TOOL, 0).answer.pose == NO_TOOL
    assert client.refused(Opcode.SELECT_TOOL, 16) == ErrorClass.SLOT_OUT_OF_RANGE
    assert client.refused(Opcode.SELECT_TOOL, 8) == ErrorClass.SLOT_EMPTY


def test_writing_the_selected_slot_sets_the_tool_and_the_reported_tcp_jumps():
    client, _ = owning()
    before = client.now()
    tool = client.slot(1).tool
    client.done(Opcode.WRITE_TOOL, 1, pose=shifted(tool, z=3.0))
    after = client.now()
    assert after.tcp == pytest.approx(shifted(before.tcp, z=3.0), abs=1e-9)
    assert after.axes == before.axes
    assert client.done(Opcode.READ_TOOL).answer.pose == pytest.approx(shifted(tool, z=3.0))


def test_a_refused_write_of_the_selected_slot_changes_neither_slot_nor_tool():
    client, simulator = owning(kinematics="Kin_Scara2_Z")
    before = client.slot(1)
    assert client.refused(Opcode.WRITE_TOOL, 1, pose=SIDEWAYS) == ErrorClass.TOOL_INCOMPATIBLE
    simulator.panel.fail_axis(0)
    assert client.refused(Opcode.WRITE_TOOL, 1, pose=before.tool) == ErrorClass.ERRORSTOP
    assert client.slot(1) == before
    client.done(Opcode.WRITE_TOOL, 2, pose=SIDEWAYS)
    assert client.slot(2).defined


def test_the_selected_slot_is_not_cleared():
    client, _ = owning()
    assert client.refused(Opcode.CLEAR_TOOL, 1) == ErrorClass.WRONG_STATE
    assert client.slot(1).defined


def test_the_three_tools_that_can_be_read():
    client, _ = owning()
    old = client.slot(1).tool
    for mode in (ReadMode.ACTIVE, ReadMode.LAST_COMMANDED):
        assert client.refused(Opcode.READ_TOOL, mode) == ErrorClass.NO_SUCH_MOVEMENT
    client.move(z=-20.0)
    client.done(Opcode.WRITE_TOOL, 2, pose=TOOL)
    client.done(Opcode.SELECT_TOOL, 2)
    client.move(z=-21.0, mode=1)
    read = {mode: client.done(Opcode.READ_TOOL, mode).answer.pose for mode in ReadMode}
    assert frames_match(read[ReadMode.SET], TOOL, tolerance=1e-9)
    assert frames_match(read[ReadMode.ACTIVE], old, tolerance=1e-9)
    assert frames_match(read[ReadMode.LAST_COMMANDED], TOOL, tolerance=1e-9)


def test_a_tool_that_the_machine_sets_by_itself_is_not_known():
    client, simulator = owning()
    simulator.panel.set_tool(CoordRef(z_mm=77.0))
    assert not client.after_a_cycle().bits & Bits.TOOL_KNOWN
    assert client.done(Opcode.READ_TOOL).answer.pose[2] == 77.0
    client.done(Opcode.SELECT_TOOL, 1)
    assert client.now().bits & Bits.TOOL_KNOWN


def test_lengths_are_in_user_units_and_angles_in_degrees():
    options = PlcOptions(mailbox=MailboxOptions(unit_um=100.0))
    client, simulator = owning(options=options)
    client.done(Opcode.WRITE_TOOL, 3, pose=(10.0, 0.0, 250.0, 90.0, 0.0, 0.0))
    client.done(Opcode.SELECT_TOOL, 3)
    x_mm, y_mm, z_mm = simulator.plc.group.tool.frame.shift_mm
    assert (x_mm, y_mm, z_mm) == pytest.approx((1.0, 0.0, 25.0))
    now = client.now()
    assert now.unit_um == 100.0
    assert now.tcp[:3] == pytest.approx([10 * it for it in simulator.plc.group.tcp().shift_mm])
    assert now.axes[0] == simulator.plc.group.values[0]
    assert now.axes[3] == pytest.approx(10 * simulator.plc.group.values[3])
    sequence = client.tell(
        Opcode.MOVE_LINEAR, 0, 0, MCS, 0, pose=shifted(now.tcp, z=-100.0), dynamics=LINE
    ).ack_head
    client.wait(0.5)
    assert client.now().active_movement == sequence
    assert client.end_of(sequence).state == CommandState.DONE
    assert simulator.plc.group.values[3] == pytest.approx(now.axes[3] / 10 - 10.0)


def test_a_restart_takes_the_tool_and_keeps_the_slots():
    client, simulator = owning()
    client.done(Opcode.WRITE_TOOL, 7, pose=TOOL, name="needle")
    client.move(z=-50.0)
    simulator.panel.restart()
    now = client.now()
    assert (now.boot_id, now.tool_slot, now.ack_head, now.queue_length) == (2, 0, 0, 0)
    assert (now.group_state, now.state) == (GroupState.DISABLED, CommandState.EMPTY)
    assert now.answer.pose == NO_TOOL
    assert client.slot(7) == Slot(1, True, TOOL, "needle")
    assert [end.sequence for end in now.finished] == [0, 0, 0, 0]


def test_the_command_that_stood_there_is_not_carried_out_after_a_restart():
    client, simulator = owning()
    client.done(Opcode.SELECT_TOOL, 0)
    simulator.panel.restart()
    client.link.clock.sleep(1.0)
    assert client.now().ack_head == 0


def test_the_boot_id_is_never_zero():
    client, simulator = owning()
    simulator.plc.memory.boot_id = 65535
    simulator.panel.restart()
    assert client.now().boot_id == 1


def test_a_file_keeps_what_is_retained(tmp_path):
    path = tmp_path / "plc.json"
    client, _ = owning(state_path=path)
    client.done(Opcode.WRITE_TOOL, 7, pose=TOOL, name="needle")
    again = linked(SoftMotionSimulator(state_path=path))
    assert again.slot(7) == Slot(1, True, TOOL, "needle")
    now = again.now()
    assert (now.boot_id, now.tool_slot) == (2, 0)
    assert now.group_state == GroupState.DISABLED
    assert again.take().answer.epoch == 2
    assert json.loads(path.read_text())["memory"]["boot_id"] == 2


@pytest.mark.parametrize("change", [("Kin_Scara3_Z", "Kin_Gantry3"), ("counter", "number")])
def test_a_file_that_does_not_fit_is_refused(tmp_path, change):
    path = tmp_path / "plc.json"
    SoftMotionSimulator(state_path=path)
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(ConfigError, match="not a saved state"):
        SoftMotionSimulator(state_path=path)
