"""Faults of a PLC, its field bus or another client, over real links.

Each gives a clear error, and the PLC's own counters show that nothing was carried out twice.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu
from robolink_simulators.softmotion.mailbox import MailboxOptions, PlcOptions, SoftMotionSimulator

import robolink
from robolink.errors import (
    ConnectError,
    ControllerFaultError,
    LeaseHeldError,
    LeaseLostError,
    NotReadyError,
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    TransportError,
)
from robolink.journal import memory_journal
from robolink.model import ToolOffset, Verdict, WorkBox
from robolink.protocols.mailbox import ErrorClass, decode_response, encode_response
from robolink.transaction import recover
from tests.contract._softmotion_cell import (
    OWNER_SILENCE_S,
    SLOW,
    PlcCell,
    above,
    served,
)

SCRATCH = 15
NEW = ToolOffset(11.25, -3.125, -20.5, 12.0)
ANYWHERE = WorkBox()
TIMEOUT_S = 0.4


@contextmanager
def plc_with(*faults: PlcFault, **options: object) -> Iterator[PlcCell]:
    """Serve a PLC with options and planned faults over Modbus TCP."""
    mailbox = replace(MailboxOptions(), **options)  # type: ignore[arg-type]
    simulator = SoftMotionSimulator(options=PlcOptions(mailbox=mailbox), faults=faults)
    with served("modbus-tcp", simulator) as cell:
        yield cell


@pytest.fixture
def cell():
    with plc_with() as cell:
        yield cell


def check_nothing_was_written(cell):
    requests = [text for _, _, text in cell.simulator.log]
    assert requests
    assert all(text.startswith("read") for text in requests)


def lift(controller):
    """Begin a slow movement."""
    group = controller.groups[0]
    return group.move_to(above(group.pose(), 20.0), SLOW, box=ANYWHERE)


@pytest.mark.fault("F33")
@pytest.mark.parametrize(
    ("order", "meaning"),
    [
        ("high_first", "high word first"),
        ("pairs_swapped", "words swapped in pairs"),
        ("halves_swapped", "halves swapped"),
    ],
)
def test_f33_another_word_order_is_named_and_nothing_is_written(order, meaning):
    with plc_with(word_order=order) as cell:
        with pytest.raises(RemoteProtocolError, match=r"\+0 registers") as refusal:
            cell.connect()
        assert meaning in refusal.value.what
        assert "Correct the response address" in refusal.value.remedy
        check_nothing_was_written(cell)


@pytest.mark.fault("F34")
def test_f34_a_shifted_map_is_named_with_its_shift_and_nothing_is_written():
    with plc_with(response=3, slots=500) as cell:
        cell.url = cell.url.replace("response=3", "response=0")
        with pytest.raises(RemoteProtocolError, match=r"\+3 registers") as refusal:
            cell.connect()
        assert "Correct the response address in the URL" in refusal.value.remedy
        check_nothing_was_written(cell)


def test_a_unit_that_is_not_there_is_named():
    simulator = SoftMotionSimulator()
    with serve_modbus_rtu(simulator, unit=7) as host:
        url = host.url.replace("unit=7", "unit=8")
        with pytest.raises(ConnectError, match="Unit 8 does not answer") as refusal:
            robolink.connect(url, timeout_s=TIMEOUT_S)
    assert refusal.value.remedy
    assert simulator.exchanges == 0


@pytest.mark.fault("F70")
def test_a_layout_of_another_major_version_is_refused_and_nothing_is_written(cell):
    response = cell.simulator.plc.response
    cell.simulator.plc.response = lambda now_ns: encode_response(
        replace(decode_response(response(now_ns)), version=0x0200)
    )
    with pytest.raises(RemoteProtocolError, match="another major version") as refusal:
        cell.connect()
    assert "plc export" in refusal.value.remedy
    check_nothing_was_written(cell)


@pytest.mark.fault("F69")
def test_f69_a_mailbox_that_stands_still_is_not_met(cell):
    cell.simulator.panel.freeze()
    with pytest.raises(ConnectError, match="is not running") as refusal:
        cell.connect()
    assert "not called in the motion task" in refusal.value.remedy
    check_nothing_was_written(cell)


@pytest.mark.fault("F69")
def test_f69_a_heartbeat_that_freezes_during_a_movement_leaves_it_unknown_and_blocks_the_next(cell):
    with cell.connect() as controller:
        motion = lift(controller)
        cell.simulator.panel.freeze()
        with pytest.raises(OutcomeUnknownError, match=r"heartbeat .* has stopped") as unknown:
            motion.wait(timeout_s=30)
    assert "robot stays blocked" in unknown.value.remedy
    cell.simulator.panel.thaw()
    with cell.connect() as controller, pytest.raises(OutcomeUnknownError, match="MOVE_LINEAR"):
        lift(controller)
    assert cell.movements_started == 1


@pytest.mark.fault("F30")
def test_f30_a_watchdog_that_zeroes_a_command_before_the_plc_saw_it_leaves_it_not_applied():
    fault = PlcFault(PlcFaultAction.ZERO_INPUTS, match="write_command WRITE_TOOL")
    with plc_with(fault, program_cycle_us=20_000) as cell:
        with cell.connect(timeout_s=TIMEOUT_S) as controller:
            with pytest.raises(OutcomeUnknownError, match="was not acknowledged") as unknown:
                controller.tools.write(SCRATCH, NEW, expected=None)
        assert "Not sent again" in unknown.value.remedy
        with cell.connect() as controller:
            (finding,) = recover(controller).settled
        assert finding.verdict is Verdict.NOT_APPLIED
        assert cell.commands.count("WRITE_TOOL") == 1
        assert cell.slot_changes(SCRATCH) == 0


@pytest.mark.fault("F30")
def test_f30_a_watchdog_that_zeroes_what_was_written_ends_the_movement_at_once():
    fault = PlcFault(PlcFaultAction.ZERO_INPUTS, match="write_command MOVE_LINEAR", seconds=0.02)
    with plc_with(fault) as cell, cell.connect() as controller:
        group = controller.groups[0]
        start = group.pose()
        with pytest.raises(ControllerFaultError, match="heartbeat was missing") as end:
            group.move_to(above(start, 0.3), SLOW, box=ANYWHERE).wait(timeout_s=10)
        assert end.value.code == ErrorClass.HEARTBEAT_LOST
        assert 0 < group.pose().z_mm - start.z_mm < 0.15
        assert cell.open_requests == []
        assert cell.commands.count("MOVE_LINEAR") == 1
        assert cell.movements_started == 1


@pytest.mark.fault("F13")
@pytest.mark.parametrize(
    ("seconds", "held", "verdict"),
    [(0.0, None, Verdict.NOT_APPLIED), (0.03, NEW, Verdict.DONE)],
    ids=["before it is executed", "afterwards"],
)
def test_a_start_of_the_plc_in_the_middle_of_a_write_leaves_it_for_recover(seconds, held, verdict):
    fault = PlcFault(PlcFaultAction.RESTART, match="write_command WRITE_TOOL", seconds=seconds)
    delay = PlcFault(PlcFaultAction.DELAY, match="write_command WRITE_TOOL", seconds=0.1)
    with plc_with(fault, delay, program_cycle_us=20_000) as cell:
        with cell.connect() as controller:
            with pytest.raises(OutcomeUnknownError, match="WRITE_TOOL"):
                controller.tools.write(SCRATCH, NEW, expected=None)
        with cell.connect() as controller:
            assert controller.tools.selected() == 0
            (finding,) = recover(controller).settled
            assert finding.verdict is verdict
            assert controller.tools.same(controller.tools.read(SCRATCH), held)
        assert cell.commands.count("WRITE_TOOL") == 1


@pytest.mark.fault("F13")
def test_a_start_of_the_plc_in_the_middle_of_a_movement_moves_nothing_afterwards(cell):
    with cell.connect() as controller:
        motion = lift(controller)
        cell.simulator.panel.restart()
        with pytest.raises(OutcomeUnknownError, match="MOVE_LINEAR"):
            motion.wait(timeout_s=30)
    with cell.connect() as controller:
        assert not controller.status().running
        with pytest.raises(OutcomeUnknownError):
            lift(controller)
        (finding,) = recover(controller).left
        assert finding.verdict is Verdict.LOOK
    assert cell.commands.count("MOVE_LINEAR") == 1


def test_an_owner_that_died_is_named_and_displaced_after_its_silence(cell):
    cell.simulator.faults.add(PlcFault(PlcFaultAction.DISCONNECT, match="write_command WRITE"))
    with cell.connect() as dead, pytest.raises(OutcomeUnknownError):
        dead.tools.write(SCRATCH, NEW, expected=None)
    with cell.connect() as next_one:
        with pytest.raises(LeaseHeldError, match="commands the PLC") as refusal:
            next_one.tools.write(3, NEW, expected=None)
        assert f"{cell.owner:08X}" in refusal.value.what
        assert "Close it and wait 10 s" in refusal.value.remedy
        cell.clock.advance(OWNER_SILENCE_S)
        recover(next_one)  # the dead client's leftovers are read first
        next_one.tools.write(3, NEW, expected=None)
    assert (cell.slot_changes(SCRATCH), cell.slot_changes(3)) == (1, 1)


@pytest.mark.fault("F23")
def test_f23_an_owner_that_falls_silent_while_it_moves_is_halted_and_not_displaced(cell):
    with cell.connect() as controller:
        motion = lift(controller)
        cell.clock.advance(0.6)
        with cell.connect() as other, pytest.raises(LeaseHeldError):
            other.take()
        with pytest.raises(
            ControllerFaultError, match="Nobody waited, or PC or network was too slow"
        ):
            motion.wait(timeout_s=10)
    assert cell.movements_started == 1


def test_a_second_client_is_told_who_owns_the_mailbox_and_may_insist(cell):
    with cell.connect() as first, cell.connect() as second:
        first.take()
        with pytest.raises(
            LeaseHeldError, match=rf"Another program \(client {cell.owner:08X}\) commands the PLC"
        ):
            second.tools.select(0)
        second.take(insist=True)
        with pytest.raises(RejectedError) as refusal:
            first.tools.write(SCRATCH, NEW, expected=None)
        assert refusal.value.code == ErrorClass.NOT_OWNER
        assert "Connect again when the other client has ended" in refusal.value.remedy
        with pytest.raises(LeaseLostError, match="another client has taken over the mailbox"):
            first.tools.write(SCRATCH, NEW, expected=None)
        second.tools.write(SCRATCH, NEW, expected=None)
    assert cell.slot_changes(SCRATCH) == 1


def test_a_missing_permit_is_named_whether_it_is_seen_before_or_only_by_the_plc():
    fault = PlcFault(PlcFaultAction.WITHDRAW_PERMIT, match="write_command WRITE_TOOL")
    with plc_with(fault) as cell, cell.connect() as controller:
        with pytest.raises(RejectedError, match="permit") as refusal:
            controller.tools.write(SCRATCH, NEW, expected=None)
        assert refusal.value.code == ErrorClass.NOT_PERMITTED
        assert "xPermit" in refusal.value.remedy
        with pytest.raises(NotReadyError, match="does not permit it now") as held_back:
            controller.tools.write(SCRATCH, NEW, expected=None)
        assert "service state" in held_back.value.remedy
        with pytest.raises(NotReadyError, match="does not permit it now"):
            lift(controller)
        assert (cell.slot_changes(SCRATCH), cell.movements_started) == (0, 0)
        assert cell.open_requests == []


@pytest.mark.fault("F11")
def test_a_can_node_whose_heartbeat_is_lost_leaves_the_movement_unknown(tmp_path):
    simulator = SoftMotionSimulator()
    with serve_canopen(simulator, CanPlace("virtual", tmp_path.name)) as host:
        outcomes = memory_journal(tmp_path.name).log(host.url)
        with robolink.connect(host.url, outcomes=outcomes) as controller:
            motion = lift(controller)
            host.close()
            with pytest.raises(OutcomeUnknownError, match=r"(?s)MOVE_LINEAR.*heartbeat") as unknown:
                motion.wait(timeout_s=30)
    assert "robot stays blocked" in unknown.value.remedy
    assert [marker.request for marker in outcomes.open_markers()] == [unknown.value.request]
    assert simulator.plc.group.movements_started == 1


@pytest.mark.fault("F70")
def test_f70_a_program_that_is_exchanged_during_a_session_is_told_nothing_more(cell):
    with cell.connect() as controller:
        controller.take()
        response = cell.simulator.plc.response
        cell.simulator.plc.response = lambda now_ns: encode_response(
            replace(decode_response(response(now_ns)), version=0x0200)
        )
        for change in (
            lambda: controller.tools.write(SCRATCH, NEW, expected=None),
            lambda: controller.tools.select(0),
            lambda: lift(controller),
        ):
            with pytest.raises((RemoteProtocolError, TransportError)):
                change()
    assert cell.commands == []
    assert cell.slot_changes(SCRATCH) == 0
    assert cell.movements_started == 0
