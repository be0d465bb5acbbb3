"""The tool slots of a PLC: compare-and-set, read back from slot and axis group.

Source: docs/reference/rules.md 2.
"""

from contextlib import suppress
from dataclasses import replace

import pytest

from robolink.errors import (
    ConfigError,
    LeaseHeldError,
    LeaseLostError,
    NotReadyError,
    NotReadyReason,
    OutcomeUnknownError,
    ReadBackError,
    RejectedError,
    RemoteProtocolError,
    ReservedToolError,
    SelectedToolError,
    ToolChangedError,
    ToolError,
    ToolIndexError,
    TransportClosedError,
    TransportTimeoutError,
    UndefinedToolError,
)
from robolink.model import ANY, EntryKind, ToolOffset, Verdict, describe_offset
from robolink.protocols.mailbox import (
    Bits,
    Capability,
    ErrorClass,
    GroupState,
    Kinematics,
    Opcode,
    ReadMode,
    Slot,
    kinematics_word,
)
from robolink.transaction import Wanted, change_tools, recover
from tests.unit.softmotion_driver._plc import STRANGER

OLD = ToolOffset(1.5, -2.0, 40.0, 10.0)
NEW = ToolOffset(1.7, -2.1, 40.3, 20.0, 30.0, -40.0)


@pytest.fixture
def controller(cell):
    controller = cell.met()
    controller.tools.write(3, OLD, expected=None)
    cell.plc.executed.clear()
    return controller


def select(plc, number):
    plc.now = replace(plc.now, tool_slot=number)
    plc.set_tool = plc.slots[number].tool


def test_a_write_is_read_back_and_recorded(cell, plc, controller):
    receipt = controller.tools.write(3, NEW, expected=OLD)
    assert not receipt.skipped
    assert controller.tools.same(receipt.before, OLD)
    assert controller.tools.same(receipt.read_back, NEW)
    assert plc.opcodes() == [Opcode.WRITE_TOOL]
    assert cell.open_requests() == []
    kinds = {entry.kind for entry in cell.outcomes.recorded(tool=3)}
    assert {EntryKind.WRITE, EntryKind.READ_BACK, EntryKind.DONE} <= kinds


@pytest.mark.fault("F40")
def test_angles_reach_the_plc_as_zyz_and_come_back_as_the_same_rotation(plc, controller):
    controller.tools.write(4, NEW, expected=None)
    assert plc.slots[4].tool[3:] != pytest.approx((20.0, 30.0, -40.0))
    assert controller.tools.same(controller.tools.read(4), NEW)


def test_lengths_reach_the_plc_in_its_own_unit(cell, plc):
    plc.now = replace(plc.now, unit_um=25400.0)
    controller = cell.met()
    controller.tools.write(4, ToolOffset(25.4, 0.0, 50.8), expected=None)
    assert plc.slots[4].tool[:3] == pytest.approx((1.0, 0.0, 2.0))
    assert controller.tools.same(controller.tools.read(4), ToolOffset(25.4, 0.0, 50.8))


def test_a_value_that_is_stored_already_is_not_written(plc, controller):
    other_triple = replace(OLD, u_deg=OLD.u_deg + 360.0)
    assert controller.tools.write(3, other_triple, expected=None).skipped
    assert plc.executed == []


@pytest.mark.fault("F36")
def test_two_values_a_nanometre_apart_are_not_the_same(controller):
    assert controller.tools.same(OLD, replace(OLD, x_mm=OLD.x_mm + 5e-10))
    assert not controller.tools.same(OLD, replace(OLD, x_mm=OLD.x_mm + 5e-9))


def test_a_tool_that_somebody_changed_is_not_written(cell, plc, controller):
    with pytest.raises(ToolChangedError, match="as expected"):
        controller.tools.write(3, NEW, expected=None)
    assert plc.executed == []
    assert cell.open_requests() == []


def test_an_empty_slot_reads_as_none_and_can_be_expected(controller):
    assert controller.tools.read(5) is None
    assert controller.tools.read_all()[3] is not None
    assert controller.tools.write(5, NEW, expected=None).before is None


def test_a_cleared_slot_is_empty_again(controller):
    assert controller.tools.clear(3, expected=OLD).read_back is None
    assert controller.tools.read(3) is None


def test_the_slot_in_force_is_not_cleared(plc, controller):
    select(plc, 3)
    with pytest.raises(SelectedToolError, match="is selected"):
        controller.tools.clear(3, expected=ANY)
    assert plc.executed == []


def test_tool_zero_and_unknown_tools_are_refused_unsent(plc, controller):
    with pytest.raises(ReservedToolError):
        controller.tools.write(0, NEW, expected=None)
    with pytest.raises(ToolIndexError):
        controller.tools.write(16, NEW, expected=None)
    with pytest.raises(ToolIndexError):
        controller.tools.read(-1)
    assert controller.tools.read(0) == ToolOffset()
    assert plc.executed == []


def test_the_name_of_a_slot_is_kept(plc, controller):
    plc.slots[3] = replace(plc.slots[3], name="needle 27G")
    controller.tools.write(3, NEW, expected=OLD)
    assert plc.slots[3].name == "needle 27G"
    controller.tools.write(4, NEW, expected=None)
    assert controller.tools.name(4) == "Tool 4"


def test_writing_the_selected_slot_is_proved_by_the_axis_group(plc, controller):
    select(plc, 3)
    controller.tools.write(3, NEW, expected=OLD)
    assert plc.opcodes() == [Opcode.WRITE_TOOL, Opcode.READ_TOOL]


def test_an_axis_group_that_does_not_take_the_tool_over_is_found_out(plc, controller):
    select(plc, 3)
    plc.takes_tools = False
    with pytest.raises(ReadBackError, match="axis group works with"):
        controller.tools.write(3, NEW, expected=OLD)


@pytest.mark.parametrize("state", [GroupState.DISABLED, GroupState.ERRORSTOP])
def test_the_selected_slot_is_not_written_where_softmotion_forbids_it(plc, controller, state):
    select(plc, 3)
    plc.now = replace(plc.now, group_state=state)
    with pytest.raises(NotReadyError):
        controller.tools.write(3, NEW, expected=OLD)
    controller.tools.write(4, NEW, expected=None)
    assert plc.opcodes() == [Opcode.WRITE_TOOL]


def test_nothing_is_written_while_the_group_moves(plc, controller):
    plc.now = replace(plc.now, group_state=GroupState.HOMING)
    for change in (
        lambda: controller.tools.write(4, NEW, expected=None),
        lambda: controller.tools.clear(3, expected=OLD),
        lambda: controller.tools.select(3),
    ):
        with pytest.raises(NotReadyError) as refusal:
            change()
        assert refusal.value.reason is NotReadyReason.RUNNING
    assert plc.executed == []


def test_nothing_is_written_without_the_machines_permit(cell, plc, controller):
    plc.now = replace(plc.now, bits=plc.now.bits & ~Bits.PERMITTED)
    with pytest.raises(NotReadyError, match="does not permit") as refusal:
        controller.tools.write(3, NEW, expected=OLD)
    assert refusal.value.reason is NotReadyReason.NOT_REMOTE
    assert plc.executed == []
    assert cell.open_requests() == []


def test_a_refused_tool_leaves_no_doubt(cell, plc, controller):
    plc.refusals[Opcode.WRITE_TOOL] = ErrorClass.TOOL_INCOMPATIBLE
    with pytest.raises(RejectedError, match="cannot carry this tool") as refusal:
        controller.tools.write(3, NEW, expected=OLD)
    assert refusal.value.code == 301
    assert "11000" in refusal.value.what
    assert refusal.value.remedy
    assert cell.open_requests() == []
    assert EntryKind.REFUSED in {entry.kind for entry in cell.outcomes.recorded(tool=3)}


def test_a_program_without_tools_is_told_nothing(cell, plc):
    plc.now = replace(plc.now, capabilities=Capability.MOTION)
    with pytest.raises(RejectedError, match="does not hold this command"):
        cell.met().tools.write(3, NEW, expected=None)
    assert [command.opcode for command in plc.executed] == [Opcode.OWNERSHIP]


def test_selecting_is_proved_by_slot_and_group(cell, plc, controller):
    controller.tools.select(3)
    assert controller.tools.selected() == 3
    assert plc.opcodes() == [Opcode.SELECT_TOOL, Opcode.READ_TOOL]
    controller.tools.select(3)
    assert len(plc.executed) == 2
    controller.tools.select(0)
    assert plc.set_tool == (0.0,) * 6


def test_an_empty_slot_is_not_selected(plc, controller):
    with pytest.raises(UndefinedToolError):
        controller.tools.select(9)
    assert plc.executed == []


def test_the_groups_own_tool_can_be_read(controller):
    controller.tools.select(3)
    assert controller.tools.same(controller.tools.read_mode(ReadMode.SET), OLD)
    assert controller.tools.read_mode(ReadMode.ACTIVE) is None


def test_a_preview_sends_nothing(cell, plc, controller):
    sent = len(cell.link.sent)
    assert controller.tools.preview_write(3, OLD) == ()
    (text,) = controller.tools.preview_write(3, NEW)
    assert text.startswith("5205 WRITE_TOOL 3 (1.7 -2.1 40.3")
    assert controller.tools.preview_clear(3) == ("30003 CLEAR_TOOL 3",)
    assert controller.tools.preview_select(3) == ("30001 SELECT_TOOL 3",)
    assert len(cell.link.sent) == sent


def test_the_selected_tool_is_put_back_after_a_procedure(cell, plc, controller):
    controller.tools.select(3)
    with controller.preserved("calibration"):
        controller.tools.select(0)
        assert len(cell.open_requests()) == 1
    assert controller.tools.selected() == 3
    assert cell.open_requests() == []


def test_the_selected_tool_is_put_back_after_an_error(cell, plc, controller):
    controller.tools.select(3)
    with pytest.raises(ConfigError), controller.preserved("calibration"):
        controller.tools.select(0)
        raise ConfigError("no", remedy="")
    assert controller.tools.selected() == 3


def test_a_selection_that_could_not_be_put_back_is_offered(cell, plc, controller):
    controller.tools.select(3)
    with pytest.raises(ConfigError, match="could not select the previous tool"):
        with controller.preserved("calibration"):
            controller.tools.select(0)
            plc.now = replace(plc.now, group_state=GroupState.ERRORSTOP)
            raise ConfigError("no", remedy="")
    plc.now = replace(plc.now, group_state=GroupState.STANDBY)
    controller.close()
    later = cell.connect()
    (marker,) = cell.outcomes.open_markers()
    finding = later.resolver.examine(marker)
    assert finding.verdict is Verdict.NOT_RESTORED
    later.resolver.settle(finding)
    assert later.tools.selected() == 3
    assert cell.open_requests() == []


@pytest.mark.parametrize(
    ("lose", "verdict"),
    [("lose_answer", Verdict.DONE), ("lose_request", Verdict.NOT_APPLIED)],
)
def test_a_write_without_an_answer_is_unknown_until_it_is_read(cell, controller, lose, verdict):
    getattr(cell.link, lose)("write_command")
    with pytest.raises(OutcomeUnknownError):
        controller.tools.write(3, NEW, expected=OLD)
    assert len(cell.open_requests()) == 1
    later = cell.connect()
    (marker,) = cell.outcomes.open_markers()
    finding = later.resolver.examine(marker)
    assert finding.verdict is verdict
    later.resolver.settle(finding)
    assert cell.open_requests() == []
    assert cell.link.sent == []


@pytest.mark.parametrize("method", ["read_head", "read_response"])
@pytest.mark.parametrize("nth", [1, 2, 3, 4, 5, 6])
def test_a_link_that_dies_at_any_read_never_hides_a_write(cell, plc, controller, method, nth):
    cell.link.lose_answer(method, nth=nth)
    with suppress(TransportTimeoutError, OutcomeUnknownError):
        controller.tools.write(3, NEW, expected=OLD)
    doubted = len(cell.open_requests())
    sent = plc.opcodes().count(Opcode.WRITE_TOOL)
    assert sent <= 1
    proved = any(entry.kind is EntryKind.DONE for entry in cell.outcomes.recorded(tool=3))
    assert doubted or proved or not sent


def test_a_slot_that_cannot_be_read_back_leaves_the_write_in_doubt(cell, controller):
    cell.link.lose_answer("read_slot", nth=2)
    with pytest.raises(OutcomeUnknownError):
        controller.tools.write(3, NEW, expected=OLD)
    assert len(cell.open_requests()) == 1


def test_another_clients_mailbox_is_not_taken(cell, plc):
    plc.owner = STRANGER
    with pytest.raises(LeaseHeldError, match="CAFE0001"):
        cell.met().tools.write(3, NEW, expected=None)
    assert not plc.slots[3].defined
    assert cell.open_requests() == []


def test_a_person_may_insist(cell, plc):
    plc.owner = STRANGER
    controller = cell.met()
    controller.take(insist=True)
    controller.tools.write(3, NEW, expected=None)
    assert plc.slots[3].defined


def test_a_mailbox_that_another_took_is_not_taken_back(cell, plc, controller):
    plc.owner, plc.epoch = STRANGER, 9
    with pytest.raises(RejectedError) as refusal:
        controller.tools.write(3, NEW, expected=OLD)
    assert refusal.value.code == ErrorClass.NOT_OWNER
    with pytest.raises(LeaseLostError):
        controller.tools.write(3, NEW, expected=OLD)
    assert plc.owner == STRANGER
    assert cell.open_requests() == []


def test_a_stale_epoch_is_refused_and_not_renewed(cell, plc, controller):
    plc.epoch += 1
    with pytest.raises(RejectedError) as refusal:
        controller.tools.write(3, NEW, expected=OLD)
    assert refusal.value.code == ErrorClass.STALE_EPOCH
    assert controller.tools.same(controller.tools.read(3), OLD)


def test_the_mailbox_is_given_back_on_closing(plc, controller):
    assert plc.owner
    controller.close()
    controller.close()
    assert plc.owner == 0
    assert plc.opcodes() == [Opcode.OWNERSHIP]


def test_another_kinematics_is_proved_and_takes_the_tool_away(cell, plc, controller):
    controller.tools.select(3)
    controller.set_kinematics(Kinematics.GANTRY3, Kinematics.C_AXIS)
    assert plc.now.kinematics == kinematics_word(Kinematics.GANTRY3, Kinematics.C_AXIS)
    assert controller.tools.selected() == 0
    assert controller.mailbox_facts().orientation_kinematics == "Kin_CAxis"
    assert cell.open_requests() == []


def test_a_lost_answer_about_the_kinematics_is_settled_by_reading(cell, controller):
    cell.link.lose_answer("write_command")
    with pytest.raises(OutcomeUnknownError):
        controller.set_kinematics(Kinematics.GANTRY3)
    later = cell.connect()
    (marker,) = cell.outcomes.open_markers()
    assert later.resolver.examine(marker).verdict is Verdict.DONE


@pytest.mark.fault("F31")
def test_a_slot_in_the_middle_of_a_change_is_read_again(cell, plc, controller):
    plc.slots[3] = Slot(counter=9, defined=True, tool=plc.slots[3].tool)
    whole = cell.link.read_slot
    torn = iter([True, False])
    cell.link.read_slot = lambda slot: (*whole(slot)[:-1], 1) if next(torn) else whole(slot)
    assert controller.tools.read(3) is not None


NO_TOOL = (-1.5e-27, 1.6e-314, 1.6e-314, 0.0, 0.0, 0.0)
"""5.012, -1 and -10 with swapped words."""


def test_a_slot_with_the_values_of_no_tool_is_named_and_never_worked_with(plc, controller):
    plc.slots[3] = replace(plc.slots[3], tool=NO_TOOL)
    held = controller.tools.read(3)
    assert held.components() == NO_TOOL
    assert "not the values of a tool" in describe_offset(held)
    with pytest.raises(ToolError, match="not the values of a tool") as refusal:
        controller.tools.select(3)
    assert "'robolink tool clear'" in refusal.value.remedy
    with pytest.raises(ToolError, match="not the values of a tool"):
        controller.tools.write(4, held, expected=None)
    assert plc.executed == []


@pytest.mark.parametrize("wanted", [NEW, None])
def test_a_slot_with_the_values_of_no_tool_is_written_or_cleared(plc, controller, wanted):
    plc.slots[3] = replace(plc.slots[3], tool=NO_TOOL)
    held = controller.tools.read(3)
    (receipt,) = change_tools(controller, [Wanted(3, wanted, held)])
    assert receipt.before == held
    assert controller.tools.same(controller.tools.read(3), wanted)


def test_an_angle_that_no_tool_has_is_not_taken_for_a_rotation(plc, controller):
    plc.slots[3] = replace(plc.slots[3], tool=(1.0, 2.0, 3.0, 1e200, 0.0, 0.0))
    with pytest.raises(ToolError, match="not the values of a tool"):
        controller.tools.select(3)


def test_a_write_that_left_the_values_of_no_tool_is_settled_with_a_way_out(cell, plc, controller):
    cell.link.lose_answer("write_command")
    with pytest.raises(OutcomeUnknownError):
        controller.tools.write(3, NEW, expected=OLD)
    plc.slots[3] = replace(plc.slots[3], tool=NO_TOOL)
    done = recover(cell.connect(), confirm=lambda _finding: True)
    (finding,) = done.settled
    assert finding.verdict is Verdict.CONFLICT
    assert "'robolink tool set' gives such a tool other values" in finding.sentence


STILL_A_TOOL = ToolOffset(3.080040797, -1.730152027, -9.87097183, -9.8303)
"""Read high word first, none of its numbers is impossible for a tool (1e-79, say)."""


@pytest.mark.fault("F33")
def test_a_word_order_that_changes_before_the_read_back_leaves_the_write_in_doubt(cell, controller):
    before = list(cell.outcomes.recorded(tool=3))
    cell.link.before("read_slot", cell.link.lay_high_first, nth=2)
    with pytest.raises(OutcomeUnknownError, match="high word first"):
        controller.tools.write(3, STILL_A_TOOL, expected=OLD)
    assert len(cell.open_requests()) == 1
    since = [entry.kind for entry in cell.outcomes.recorded(tool=3) if entry not in before]
    assert EntryKind.READ_BACK not in since
    done = recover(cell.connect(), confirm=lambda _finding: True)
    assert [finding.verdict for finding in done.settled] == [Verdict.DONE]


@pytest.mark.fault("F33")
@pytest.mark.parametrize("read", [lambda tools: tools.read(3), lambda tools: tools.read_all()])
def test_a_slot_in_another_word_order_is_neither_told_nor_recorded(cell, controller, read):
    controller.tools.write(3, STILL_A_TOOL, expected=OLD)
    before = list(cell.outcomes.recorded(tool=3))
    cell.link.lay_high_first()
    with pytest.raises(RemoteProtocolError, match="high word first"):
        read(controller.tools)
    assert list(cell.outcomes.recorded(tool=3)) == before
    with pytest.raises(TransportClosedError):
        controller.tools.read(3)


@pytest.mark.parametrize(("apart_mm", "same"), [(0.9e-9, True), (1.2e-9, False)])
def test_offsets_within_a_billionth_are_one_value_to_a_plc(controller, apart_mm, same):
    """LREALs that differ by more were not written by one command (docs/reference/rules.md 3)."""
    assert controller.tools.same(ToolOffset(), ToolOffset(x_mm=apart_mm)) is same
