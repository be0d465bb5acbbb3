"""The fault plan counts, and never rolls."""

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction, FaultPlan

from robolink.model import ToolOffset

REPLY = b"#GetStatus,00100000001,0000\r\n"


def test_a_fault_fires_once_on_the_request_it_counts_to():
    fault = Fault(FaultAction.DROP_REPLY, on_exchange=1, match="Execute")
    plan = FaultPlan([fault])
    taken = [plan.take(text) for text in ("Execute a", "GetStatus", "Execute b", "Execute c")]
    assert taken == [(), (), (fault,), ()]
    assert plan.fired == [fault]
    assert plan.pending == ()


def test_the_count_of_an_added_fault_starts_when_it_is_added():
    plan = FaultPlan()
    plan.take("GetStatus")
    plan.add(Fault(FaultAction.DELAY))
    assert [fault.action for fault in plan.take("GetStatus")] == [FaultAction.DELAY]


def test_a_fault_goes_on_in_its_steps_until_it_is_removed():
    slow = Fault(FaultAction.DELAY, on_exchange=1, match="Execute", seconds=0.3, every=2)
    plan = FaultPlan([slow])
    asked = ("Execute a", "Execute b", "GetStatus", "Execute c", "Execute d", "Execute e")
    assert [len(plan.take(text)) for text in asked] == [0, 1, 0, 0, 1, 0]
    assert (plan.pending, plan.times_fired) == ((slow,), 2)
    plan.clear()
    assert plan.take("Execute f") == plan.pending == ()


@pytest.mark.parametrize(
    ("fault", "left"),
    [
        (Fault(FaultAction.DELAY, seconds=2.0), [(2.0, REPLY)]),
        (Fault(FaultAction.DROP_REPLY), []),
        (Fault(FaultAction.TRUNCATE_REPLY, position=5), [(0.0, REPLY[:5])]),
        (Fault(FaultAction.DUPLICATE_REPLY), [(0.0, REPLY + REPLY)]),
        (
            Fault(FaultAction.SPLIT_REPLY, position=3, seconds=0.5),
            [(0.0, REPLY[:3]), (0.5, REPLY[3:])],
        ),
        (Fault(FaultAction.DISCONNECT), [(0.0, b""), (0.0, None)]),
        (Fault(FaultAction.DISCONNECT, position=7), [(0.0, REPLY[:7]), (0.0, None)]),
        (Fault(FaultAction.ESTOP), [(0.0, REPLY)]),
    ],
    ids=lambda value: value.action.name if isinstance(value, Fault) else "",
)
def test_what_leaves_instead_of_a_reply(fault, left):
    assert FaultPlan().departures(REPLY, [fault]) == left


def test_garbling_flips_one_bit_and_the_same_one_for_the_same_seed():
    fault = Fault(FaultAction.GARBLE_REPLY)
    ((_, first),) = FaultPlan(seed=3).departures(REPLY, [fault])
    ((_, again),) = FaultPlan(seed=3).departures(REPLY, [fault])
    assert first == again
    assert isinstance(first, bytes)
    flipped = int.from_bytes(first, "big") ^ int.from_bytes(REPLY, "big")
    assert flipped.bit_count() == 1
    assert len(first) == len(REPLY)


def test_two_faults_can_meet_one_reply():
    faults = [Fault(FaultAction.DELAY, seconds=1), Fault(FaultAction.DUPLICATE_REPLY)]
    assert FaultPlan().departures(REPLY, faults) == [(1.0, REPLY + REPLY)]


def test_a_dropped_reply_was_carried_out(login):
    simulator = EpsonSimulator(faults=[Fault(FaultAction.DROP_REPLY, match="TLSet")])
    client = login(simulator)
    assert client.ask('$Execute,"TLSet 3, XY(1,2,3,4)"') == ""
    assert simulator.machine.tools.get(3) == ToolOffset(1, 2, 3, 4)


def test_an_ignored_write_is_acknowledged_and_not_applied(login):
    simulator = EpsonSimulator(faults=[Fault(FaultAction.IGNORE_WRITE, match="TLSet")])
    client = login(simulator)
    assert client.ask('$Execute,"TLSet 3, XY(1,2,3,4)"') == "#Execute,0"
    assert simulator.machine.tools.get(3) is None
    assert simulator.machine.flash_writes == 0


def test_a_cut_before_leaves_the_request_undone(login):
    simulator = EpsonSimulator(faults=[Fault(FaultAction.DISCONNECT_BEFORE, match="TLSet")])
    client = login(simulator)
    assert client.ask('$Execute,"TLSet 3, XY(1,2,3,4)"') == ""
    assert client.link.closed
    assert simulator.machine.tools.get(3) is None


def test_a_cut_after_leaves_the_request_done(login):
    simulator = EpsonSimulator(faults=[Fault(FaultAction.DISCONNECT, match="TLSet")])
    client = login(simulator)
    assert client.ask('$Execute,"TLSet 3, XY(1,2,3,4)"') == ""
    assert client.link.closed
    assert simulator.machine.tools.get(3) is not None


def test_a_delayed_reply_keeps_its_place_in_the_stream(login):
    simulator = EpsonSimulator(faults=[Fault(FaultAction.DELAY, match="GetCurRobot", seconds=2)])
    client = login(simulator)
    assert client.ask("$GetCurRobot") == ""
    assert client.ask("$GetStatus") == ""
    assert client.wait(1.9) == ""
    assert client.wait(0.1) == "#GetCurRobot,1\r\n#GetStatus,00100000001,0000"


def test_a_planned_stop_comes_in_the_middle_of_a_motion(login):
    simulator = EpsonSimulator(faults=[Fault(FaultAction.ESTOP, match="Move", seconds=0.2)])
    client = login(simulator)
    before = simulator.machine.arm.flange().x_mm
    client.send('$Execute,"Move Here +X(-50)"')
    assert client.wait(0.1) == ""
    assert client.wait(5.0) == "!Execute,99"
    stood = simulator.machine.arm.flange().x_mm
    assert before - 50 < stood < before
    assert not simulator.machine.motors_on


def test_a_planned_error_without_delay_comes_before_the_request(login):
    simulator = EpsonSimulator(
        faults=[Fault(FaultAction.DEVICE_FAULT, match="GetStatus", code=4002)]
    )
    client = login(simulator)
    assert client.ask("$GetStatus") == "#GetStatus,00100001001,4002"


def test_an_opened_guard_is_shown(login):
    simulator = EpsonSimulator(faults=[Fault(FaultAction.GUARD_OPEN, match="GetStatus")])
    assert login(simulator).flags() == "00100100001"


def test_what_leaves_late_is_told_before_what_leaves_at_once_was_taken(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    simulator.faults.add(Fault(FaultAction.SPLIT_REPLY, position=2, seconds=0.5))
    simulator.advance(3_000_000_000)
    client.send("$GetStatus")
    simulator.advance(3_000_000_000)
    assert simulator.next_change() == 3_500_000_000
    assert client.heard() == "#G"
    assert simulator.next_change() == 3_500_000_000
