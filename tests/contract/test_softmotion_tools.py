"""The tool slots of a PLC keep their contract on every link."""

import pytest
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef
from robolink_simulators.softmotion.mailbox import (
    MailboxOptions,
    PlcOptions,
    SoftMotionSimulator,
)

from robolink.errors import (
    NotReadyError,
    NotReadyReason,
    ReadBackError,
    RejectedError,
    SelectedToolError,
    ToolChangedError,
    UndefinedToolError,
)
from robolink.model import ANY, ToolOffset, WorkBox
from robolink.protocols.mailbox import ErrorClass, ReadMode, frames_match
from tests.contract._softmotion_cell import LINKS, QUICK, above, few_links, served

SCRATCH = 15
NEW = ToolOffset(11.25, -3.125, -20.5, 12.0, 30.0, -40.0)
ZYZ_OF_NEW = (71.21026697116785, 48.43923742984067, -48.06989481005915)
"""Its angles with R = Rz(A) Ry(B) Rz(C), computed independently of robolink."""

OTHER = ToolOffset(9.0, 9.0, 9.0)
ANYWHERE = WorkBox()


@pytest.fixture(params=few_links())
def backend(request):
    return request.param


@pytest.fixture
def cell(backend):
    with served(backend) as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connect() as controller:
        yield controller


def put_into_scratch(cell, x_mm):
    """Let somebody at the PLC itself store another value there."""
    with cell.simulator.acting():
        cell.simulator.plc.memory.define(SCRATCH, (x_mm, 9.0, 9.0, 0.0, 0.0, 0.0), "panel")


@pytest.mark.parametrize("backend", few_links("modbus-rtu"), indirect=True)
def test_there_are_fifteen_slots_and_the_flange_reads_as_zero(controller):
    read = controller.tools.read_all()
    assert list(read) == list(controller.tools.indices()) == list(range(1, 16))
    assert [tool for tool, offset in read.items() if offset is not None] == [1]
    assert controller.tools.read(0) == ToolOffset()


@pytest.mark.parametrize("backend", LINKS, indirect=True)
def test_a_write_is_read_back_and_receipted(cell, controller):
    receipt = controller.tools.write(SCRATCH, NEW, expected=None)
    assert (receipt.before, receipt.requested, receipt.skipped) == (None, NEW, False)
    assert controller.tools.same(receipt.read_back, NEW)
    assert controller.tools.same(controller.tools.read(SCRATCH), NEW)
    assert cell.commands == ["WRITE_TOOL"]
    assert cell.slot_changes(SCRATCH) == 1
    assert cell.open_requests == []


def test_an_equal_value_is_not_written_again_whatever_was_expected(cell, controller):
    controller.tools.write(SCRATCH, NEW, expected=ANY)
    other_triple = ToolOffset(*NEW.components()[:3], NEW.u_deg - 360.0, *NEW.components()[4:])
    assert controller.tools.write(SCRATCH, other_triple, expected=OTHER).skipped
    assert cell.slot_changes(SCRATCH) == 1


def test_a_slot_that_somebody_changed_meanwhile_is_not_written(cell):
    with cell.connect() as one:
        one.tools.write(SCRATCH, NEW, expected=None)
    with cell.connect() as other:
        put_into_scratch(cell, 9.0)
        with pytest.raises(ToolChangedError, match=r"holds X 9\.0") as refusal:
            other.tools.write(SCRATCH, ToolOffset(1.0, 2.0, 3.0), expected=NEW)
    assert refusal.value.remedy
    assert cell.slot_changes(SCRATCH) == 2


def test_an_empty_slot_reads_as_none_is_a_legal_expectation_and_comes_back_by_clear(controller):
    assert controller.tools.read(SCRATCH) is None
    assert controller.tools.write(SCRATCH, NEW, expected=None).before is None
    assert controller.tools.clear(SCRATCH, expected=NEW).read_back is None
    assert controller.tools.clear(SCRATCH, expected=None).skipped


def test_a_selection_is_read_back_from_slot_and_axis_group(cell, controller):
    assert controller.tools.selected() == 1
    controller.tools.write(SCRATCH, NEW, expected=None)
    controller.tools.select(SCRATCH)
    assert controller.tools.selected() == SCRATCH
    assert controller.tools.same(controller.tools.read_mode(ReadMode.SET), NEW)
    controller.tools.select(SCRATCH)
    assert cell.commands.count("SELECT_TOOL") == 1
    controller.tools.select(0)
    assert controller.tools.selected() == 0


def test_an_empty_slot_is_not_selected(cell, controller):
    with pytest.raises(UndefinedToolError, match="not defined"):
        controller.tools.select(SCRATCH)
    assert controller.tools.selected() == 1
    assert cell.commands == []


def test_writing_the_selected_slot_moves_the_tip_and_not_the_robot(cell, controller):
    before, pose = controller.tools.read(1), controller.groups[0].pose()
    lower = ToolOffset(before.x_mm, before.y_mm, before.z_mm - 1.5)
    controller.tools.write(1, lower, expected=before)
    assert controller.groups[0].pose().z_mm == pytest.approx(pose.z_mm - 1.5, abs=1e-9)
    assert cell.movements_started == 0
    assert cell.commands == ["WRITE_TOOL", "READ_TOOL"]


def test_the_selected_slot_is_not_cleared(cell, controller):
    with pytest.raises(SelectedToolError, match="Tool 1 is selected") as refusal:
        controller.tools.clear(1, expected=ANY)
    assert "then_select=NUMBER" in refusal.value.remedy
    assert cell.commands == []


@pytest.mark.parametrize(
    ("make_it_so", "reason"),
    [
        (lambda controller, _panel: controller.motors(False), NotReadyReason.MOTORS_OFF),
        (lambda _controller, panel: panel.fail_axis(0), NotReadyReason.FAULT),
    ],
    ids=["disabled", "errorstop"],
)
def test_the_selected_slot_is_not_written_where_the_group_takes_no_tool(
    cell, controller, make_it_so, reason
):
    make_it_so(controller, cell.simulator.panel)
    before = cell.slot_changes(1)
    with pytest.raises(NotReadyError) as refusal:
        controller.tools.write(1, NEW, expected=ANY)
    assert refusal.value.reason is reason
    assert refusal.value.remedy
    assert cell.slot_changes(1) == before
    assert not controller.tools.write(SCRATCH, NEW, expected=None).skipped


def test_a_slot_that_holds_something_else_after_the_write_is_found_out(cell, controller):
    def meddle(_number: int, text: str) -> None:
        if text == f"read_slot {SCRATCH}" and cell.commands:
            put_into_scratch(cell, 77.0)

    cell.simulator.on_request = meddle
    with pytest.raises(ReadBackError, match="77") as caught:
        controller.tools.write(SCRATCH, NEW, expected=None)
    assert caught.value.remedy
    assert cell.commands == ["WRITE_TOOL"]


@pytest.mark.fault("F43")
def test_a_tool_that_the_machine_sets_behind_the_mailbox_is_found_out(cell, controller):
    def meddle(_number: int, text: str) -> None:
        if "READ_TOOL" in text:
            cell.simulator.panel.set_tool(CoordRef(0.0, 0.0, 77.0))

    cell.simulator.on_request = meddle
    with pytest.raises(ReadBackError, match="axis group works with") as caught:
        controller.tools.write(1, OTHER, expected=ANY)
    assert "Do not move the robot" in caught.value.remedy
    assert cell.commands.count("WRITE_TOOL") == 1


def test_a_tool_that_the_kinematics_cannot_carry_is_refused_and_changes_nothing(backend):
    with served(backend, SoftMotionSimulator("Kin_Scara2_Z", seed=7)) as cell:
        with cell.connect() as controller:
            before = controller.tools.read(1)
            changes = cell.slot_changes(1)
            with pytest.raises(RejectedError, match="cannot use this tool") as refusal:
                controller.tools.write(1, OTHER, expected=before)
            assert refusal.value.code == ErrorClass.TOOL_INCOMPATIBLE
            assert "X 9.000 mm, Y 9.000 mm" in str(refusal.value)
            assert "Nothing was sent" in refusal.value.remedy
            assert controller.tools.same(controller.tools.read(1), before)
        assert cell.slot_changes(1) == changes
        assert cell.open_requests == []


def test_the_group_tells_the_tools_of_the_running_and_of_the_last_movement(controller):
    group, old = controller.groups[0], controller.tools.read(1)
    assert controller.tools.read_mode(ReadMode.ACTIVE) is None
    assert controller.tools.read_mode(ReadMode.LAST_COMMANDED) is None
    motion = group.move_to(above(group.pose(), 30.0), QUICK, box=ANYWHERE)
    assert controller.tools.same(controller.tools.read_mode(ReadMode.ACTIVE), old)
    motion.abort()
    controller.tools.write(SCRATCH, NEW, expected=None)
    controller.tools.select(SCRATCH)
    assert controller.tools.same(controller.tools.read_mode(ReadMode.SET), NEW)
    assert controller.tools.same(controller.tools.read_mode(ReadMode.LAST_COMMANDED), old)


@pytest.mark.parametrize("unit_um", [1_000_000.0, 25_400.0], ids=["metre", "inch"])
def test_lengths_go_in_the_unit_of_the_plc_and_angles_as_zyz(backend, unit_um):
    options = PlcOptions(mailbox=MailboxOptions(unit_um=unit_um))
    with served(backend, SoftMotionSimulator(options=options)) as cell:
        with cell.connect() as controller:
            assert controller.mailbox_facts().unit_um == unit_um
            controller.tools.write(SCRATCH, NEW, expected=None)
            assert controller.tools.same(controller.tools.read(SCRATCH), NEW)
        held = cell.simulator.plc.memory.slot(SCRATCH).tool
    lengths = [1000.0 * mm / unit_um for mm in NEW.components()[:3]]
    assert held[:3] == pytest.approx(lengths, abs=1e-12)
    assert frames_match((0, 0, 0, *held[3:]), (0, 0, 0, *ZYZ_OF_NEW), tolerance=1e-9)


def test_slots_are_kept_over_a_start_of_the_plc_and_none_is_selected_then(cell):
    with cell.connect() as controller:
        controller.tools.write(SCRATCH, NEW, expected=None)
        controller.tools.select(SCRATCH)
    cell.restart()
    with cell.connect() as controller:
        assert controller.tools.selected() == 0
        assert controller.tools.same(controller.tools.read(SCRATCH), NEW)
        assert not controller.groups[0].motors_on()
        controller.motors(True)
        controller.tools.select(SCRATCH)
        assert controller.tools.selected() == SCRATCH
