"""Whole procedures on a PLC, on every link: read, back up, calibrate, recover, undo."""

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.faults import PlcFault, PlcFaultAction

from robolink.backup import (
    backup_from_text,
    backup_to_text,
    compare,
    plan_restore,
    read_tools,
    restore,
    take_backup,
)
from robolink.calibration_run import ChangePlan, Limits, NozzleChange, ToolPlan
from robolink.errors import (
    NotReadyError,
    NotReadyReason,
    OutcomeUnknownError,
    TransportBrokenError,
)
from robolink.model import ANY, ControllerState, EntryKind, ToolOffset, Verdict, WorkBox
from robolink.transaction import Wanted, change_tools, plan_undo, recover, undo
from tests.contract._softmotion_cell import (
    LINKS,
    OWNER_SILENCE_S,
    QUICK,
    above,
    few_links,
    on_links,
    served,
)

SCRATCH = 15
NEW = ToolOffset(11.25, -3.125, -20.5, 12.0)
OTHER = ToolOffset(1.0, 2.0, 3.0, 0.0, 20.0)
TIMEOUT_S = 0.4


@pytest.fixture(params=few_links())
def cell(request):
    with served(request.param) as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connect() as controller:
        yield controller


def test_a_ready_cell_says_so(controller):
    status = controller.status()
    assert status.remote
    assert status.ready
    assert not any((status.running, status.paused, status.fault))
    assert controller.condition()["selected_tool"] == 1
    assert controller.exchanges > 0


def test_the_machine_is_named_and_its_start_is_numbered(cell, controller):
    shared, facts = controller.facts(), controller.mailbox_facts()
    assert shared.controller_type == "CODESYS SoftMotion"
    assert shared.robot_models == ("Kin_Scara3_Z",)
    assert (facts.axis_count, facts.unit_um) == (4, 1000.0)
    controller.close()
    cell.restart()
    with cell.connect() as again:
        assert again.mailbox_facts().boot_id == facts.boot_id + 1


@pytest.mark.fault("F70")
@pytest.mark.parametrize("cell", LINKS, indirect=True)
def test_a_start_of_the_plc_is_told_as_one_on_every_link(cell, controller):
    cell.restart()
    with pytest.raises(TransportBrokenError, match="restarted") as ended:
        controller.status()
    assert "No tool slot is selected" in ended.value.remedy
    with cell.connect() as again:
        assert again.status().state is ControllerState.DISABLED


def test_without_the_permit_of_the_machine_nothing_is_changed(cell, controller):
    cell.simulator.panel.withdraw_permit()
    assert not controller.status().remote
    with pytest.raises(NotReadyError, match="does not permit") as refusal:
        controller.tools.write(SCRATCH, NEW, expected=None)
    assert refusal.value.reason is NotReadyReason.NOT_REMOTE
    assert "xPermit" in refusal.value.remedy
    assert cell.commands == []
    cell.simulator.panel.give_permit()
    controller.tools.write(SCRATCH, NEW, expected=None)


def test_a_backup_goes_through_a_file_and_a_restore_brings_it_back(cell, controller):
    controller.tools.write(3, NEW, expected=None)
    backup = backup_from_text(backup_to_text(take_backup(controller)), source="a file")
    assert backup.controller == controller.identity
    assert backup.state.selected == 1
    controller.tools.write(1, OTHER, expected=ANY)
    controller.tools.clear(3, expected=NEW)
    controller.tools.write(4, OTHER, expected=None)
    found = compare(backup.state, read_tools(controller))
    assert [one.tool for one in found.tools if not one.equal] == [1, 3, 4]
    changes = [cell.slot_changes(tool) for tool in (1, 3, 4)]
    receipts = restore(controller.tools, plan_restore(backup, read_tools(controller)))
    assert len(receipts) == 3
    assert compare(backup.state, read_tools(controller)).equal
    assert [cell.slot_changes(tool) for tool in (1, 3, 4)] == [count + 1 for count in changes]


@pytest.mark.parametrize(
    "cell", ["modbus-tcp", pytest.param("sim", marks=pytest.mark.soak)], indirect=True
)
def test_a_nozzle_change_finds_the_true_tip_writes_it_once_and_proves_it(cell, controller):
    world, before = cell.simulator.world, cell.slot_changes(1)

    said: list[str] = []
    limits = Limits(speed_percent=100, speed_mm_s=2000.0)
    plan = ChangePlan((ToolPlan(1),), limits, ask_before_write=False)
    operator = AssistedOperator.with_eyes(
        InProcessEyes(cell.simulator), said.append, clock=controller.clock
    )
    (report,) = NozzleChange(controller, plan, operator=operator).run().tools
    found, truth = controller.tools.read(1), world.tips[1]
    assert found is not None
    assert (found.x_mm, found.y_mm) == pytest.approx((truth.x_mm, truth.y_mm), abs=0.05)
    assert report.receipt is not None
    assert controller.tools.same(report.receipt.read_back, found)
    assert report.verification is not None
    assert controller.tools.selected() == 1
    assert cell.slot_changes(1) == before + 1
    assert cell.open_requests == []
    kinds = {entry.kind for entry in cell.journal.entries()}
    assert {EntryKind.CALIBRATION, EntryKind.WRITE, EntryKind.DONE, EntryKind.VERIFY} <= kinds


SETTLED = {
    "done": (PlcFaultAction.DROP_REPLY, Verdict.DONE, NEW),
    "not applied": (PlcFaultAction.IGNORE_WRITE, Verdict.NOT_APPLIED, None),
}


@pytest.mark.parametrize(
    ("ended", "cell"),
    [*on_links("done", LINKS), *on_links("not applied", few_links("modbus-tcp"))],
    indirect=["cell"],
)
def test_a_write_without_an_answer_is_settled_by_reading(cell, ended):
    action, verdict, held = SETTLED[ended]
    cell.simulator.faults.add(PlcFault(action, match="write_command WRITE_TOOL"))
    with cell.connect(timeout_s=TIMEOUT_S) as controller:
        with pytest.raises(OutcomeUnknownError, match="WRITE_TOOL") as unknown:
            controller.tools.write(SCRATCH, NEW, expected=None)
    assert "Not sent again" in unknown.value.remedy
    assert len(cell.open_requests) == 1
    cell.clock.advance(OWNER_SILENCE_S)
    with cell.connect() as controller:
        group = controller.groups[0]
        with pytest.raises(OutcomeUnknownError, match="WRITE_TOOL"):
            group.move_to(above(group.pose(), 1.0), QUICK, box=WorkBox())
        (finding,) = recover(controller).settled
        assert finding.verdict is verdict
        assert controller.tools.same(controller.tools.read(SCRATCH), held)
    assert cell.commands.count("WRITE_TOOL") == 1
    assert cell.movements_started == 0
    assert cell.open_requests == []


def test_a_change_is_undone_and_the_undo_again(cell, controller):
    old = controller.tools.read(1)
    change_tools(controller, [Wanted(1, NEW, old), Wanted(3, NEW, None)])
    undo(controller, plan_undo(controller))
    assert controller.tools.same(controller.tools.read(1), old)
    assert controller.tools.read(3) is None
    undo(controller, plan_undo(controller))
    assert controller.tools.same(controller.tools.read(1), NEW)
    assert controller.tools.same(controller.tools.read(3), NEW)
    assert cell.commands.count("WRITE_TOOL") == 5
    assert cell.commands.count("CLEAR_TOOL") == 1
    assert cell.open_requests == []
