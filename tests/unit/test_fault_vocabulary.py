"""The effects of each planned fault on requests, replies, links and devices, seen from the wire."""

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.faults import (
    Fault,
    FaultAction,
    FaultNotPossibleError,
    FaultPlan,
    LinkKind,
    PlcFault,
    PlcFaultAction,
    links_of,
)
from robolink_simulators.hosting.in_process.epson import register, unregister
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.errors import TransportBrokenError, TransportTimeoutError
from robolink.model import Secret, ToolOffset
from robolink.protocols.mailbox import BlockError, Opcode, WordOrder, decode_response
from robolink.transport import open_transport
from tests._rows import each_row
from tests.unit._mailbox_client import owning

ROBOT, STATUS = "#GetCurRobot,1", "#GetStatus,00100000001,0000"
WRITE = '$Execute,"TLSet 3, XY(1,2,3,4)"'


def faulty(action, **fields):
    return EpsonSimulator(faults=[Fault(FaultAction[action.upper()], **fields)])


def test_a_dropped_request_is_not_carried_out(login):
    simulator = faulty("drop_request", match="TLSet")
    client = login(simulator)
    assert client.ask(WRITE) == ""
    assert client.wait(30) == ""
    assert simulator.machine.tools.get(3) is None
    assert client.ask("$GetCurRobot") == ROBOT


def test_a_doubled_request_is_carried_out_and_answered_twice(login):
    simulator = faulty("duplicate_request", match="TLSet", seconds=2)
    client = login(simulator)
    assert client.ask(WRITE) == "#Execute,0"
    assert client.ask('$Execute,"TLSet 3, XY(9,9,9,9)"') == "#Execute,0"
    assert client.wait(1.9) == ""
    assert client.wait(0.2) == "#Execute,0"
    assert simulator.machine.tools.get(3) == ToolOffset(1, 2, 3, 4)


def test_a_bent_request_may_be_another_one_that_is_carried_out(login):
    simulator = faulty(
        "garble_request", match="TLSet", position=len('$Execute,"TLSet 3, XY('), bit=1
    )
    client = login(simulator)
    assert client.ask(WRITE) == "#Execute,0"
    assert simulator.machine.tools.get(3) == ToolOffset(3, 2, 3, 4)


@pytest.mark.parametrize(("silence_ends", "heard"), [(True, "!"), (False, "")])
def test_half_a_request_is_one_where_silence_ends_requests(login, silence_ends, heard):
    options = EpsonOptions(requests_end_with_silence=silence_ends)
    fault = Fault(FaultAction.TRUNCATE_REQUEST, match="TLSet", position=20)
    simulator = EpsonSimulator(options=options, faults=[fault])
    client = login(simulator)
    assert client.ask(WRITE)[:1] == heard
    assert simulator.machine.tools.get(3) is None


def test_a_stalled_link_delivers_what_was_sent_even_after_its_client_has_left(login):
    simulator = faulty("stall", match="TLSet", seconds=12)
    client = login(simulator)
    assert client.ask(WRITE) == ""
    client.link.receive(b"", simulator.now_ns)
    assert client.wait(11.9) == ""
    assert simulator.machine.tools.get(3) is None
    client.wait(0.2)
    assert simulator.machine.tools.get(3) == ToolOffset(1, 2, 3, 4)
    assert client.link.over


def test_what_follows_on_a_stalled_link_keeps_its_place(login):
    client = login(faulty("stall", match="GetCurRobot", seconds=3))
    assert client.ask("$GetCurRobot") == ""
    assert client.ask("$GetStatus") == ""
    assert client.wait(3.1) == f"{ROBOT}\r\n{STATUS}"


@pytest.mark.parametrize(
    ("action", "heard"),
    [
        ("join_reply", f"{ROBOT}\r\n{STATUS}"),
        ("reorder_reply", f"{STATUS}\r\n{ROBOT}"),
    ],
)
def test_a_reply_held_back_leaves_with_the_next_one(login, action, heard):
    client = login(faulty(action, match="GetCurRobot"))
    assert client.ask("$GetCurRobot") == ""
    assert client.ask("$GetStatus") == heard


def test_the_reply_before_may_come_again(login):
    client = login(faulty("repeat_reply", match="GetStatus"))
    client.ask("$GetCurRobot")
    assert client.ask("$GetStatus") == f"{ROBOT}\r\n{STATUS}"


def test_two_bytes_may_change_places(login):
    client = login(faulty("swap_bytes", match="GetCurRobot", position=1))
    assert client.ask("$GetCurRobot") == "#eGtCurRobot,1"


def test_nobody_is_told_of_a_half_open_link(login, connect):
    simulator = faulty("half_open", match="TLSet")
    client = login(simulator)
    assert client.ask(WRITE) == ""
    assert client.ask("$GetStatus") == ""
    client.link.receive(b"", simulator.now_ns)
    assert simulator.machine.tools.get(3) is not None
    other = connect(simulator)
    assert other.ask("$Login,") == ""  # the first one still has the only place
    simulator.advance(simulator.now_ns + 61_000_000_000)  # until the remote time-out
    assert other.ask("$Login,") == "#Login,0"
    assert simulator._links._links == [other.link]  # nothing of the dead one is kept


@each_row("action", ["reset", "half_open", "restart"])
def test_a_driver_meets_the_ends_of_a_connection(action):
    simulator = faulty(action, match="GetCurRobot")
    transport = open_transport(register("fault-ends", simulator))
    try:
        deadline = robolink.timing.Deadline.after(transport.clock, 2.0)
        transport.send(b"$Login,\r\n", deadline=deadline)
        assert transport.receive(deadline=deadline) == b"#Login,0\r\n"
        transport.send(b"$GetCurRobot\r\n", deadline=deadline)
        if action == "restart":
            assert transport.receive(deadline=deadline) == b""
            return
        wanted = TransportBrokenError if action == "reset" else TransportTimeoutError
        with pytest.raises(wanted):
            transport.receive(deadline=deadline)
    finally:
        transport.close()
        unregister("fault-ends")


@pytest.mark.parametrize(
    ("action", "after"),
    [
        ("lose_login", "!GetCurRobot,11"),
        ("teach_mode", "#GetStatus,01000000001,0000"),
        ("serious_error", "#GetStatus,00101001001,9001"),
    ],
)
def test_the_controller_may_change_under_a_client(login, action, after):
    client = login(faulty(action, match="GetVariable", seconds=1))
    client.ask("$GetVariable,x")
    client.wait(1.1)
    asked = "$GetCurRobot" if action == "lose_login" else "$GetStatus"
    assert client.ask(asked) == after


def test_a_bent_login_shows_its_password_nowhere():
    password = "canary-of-bits"
    for position in range(len("$Login,")):
        for bit in (0, 4, 6):
            fault = Fault(FaultAction.GARBLE_REQUEST, match="Login", position=position, bit=bit)
            simulator = EpsonSimulator(password=Secret(password), faults=[fault])
            url = register("bent-login", simulator)
            try:
                with pytest.raises(robolink.RobolinkError) as refused:
                    robolink.connect(url, password=password).close()
            finally:
                unregister("bent-login")
            error = refused.value
            told = [str(error), repr(error), repr(getattr(error, "raw", "")), repr(error.__cause__)]
            told += [line for *_, line in simulator.log]
            assert not any(password in text or password[2:] in text for text in told)


# The mailbox


def planned(action, **fields):
    client, simulator = owning()
    simulator.faults.add(PlcFault(PlcFaultAction[action.upper()], **fields))
    return client, simulator


def test_a_dropped_command_never_reaches_the_plc():
    client, simulator = planned("drop_request", match="SELECT_TOOL")
    with pytest.raises(TransportTimeoutError):
        client.write(client.command(Opcode.SELECT_TOOL, 0))
    assert simulator.plc.tools.selected == 1


def test_a_command_that_arrives_twice_is_carried_out_once():
    client, simulator = planned("duplicate_request", match="MOVE_LINEAR", seconds=1.0)
    client.end_of(client.move(z=-1.0).ack_head)
    client.wait(2.0)
    assert simulator.plc.group.movements_started == 1


def test_a_stalled_command_is_carried_out_after_its_sender_gave_up():
    client, simulator = planned("stall", match="SELECT_TOOL", seconds=5)
    with pytest.raises(TransportTimeoutError):
        client.write(client.command(Opcode.SELECT_TOOL, 0))
    assert simulator.plc.tools.selected == 1
    simulator.advance(simulator.now_ns + 3_000_000_000)
    assert simulator.plc.tools.selected == 0


def test_a_write_that_is_overtaken_lands_behind_the_next():
    client, _ = planned("reorder_write", match="SELECT_TOOL")
    command = client.command(Opcode.SELECT_TOOL, 0)
    client.write(command)
    client.link.clock.sleep(0.1)
    assert client.now().ack_head != command.sequence
    client.beat()
    assert client.acknowledged(command).tool_slot == 0


def test_a_stale_answer_is_the_one_before_and_waits_for_it():
    client, simulator = owning()
    simulator.faults.add(PlcFault(PlcFaultAction.STALE_REPLY, match="read_slot 9"))
    client.slot(9)
    assert simulator.faults.fired == []
    client.done(Opcode.WRITE_TOOL, 9, pose=(1.5, 0.0, 0.0, 0.0, 0.0, 0.0), name="a")
    assert not client.slot(9).defined
    assert client.slot(9).defined


def test_an_answer_of_zeros_is_no_block():
    client, _ = planned("zero_reply", match="read_response")
    assert not any(client.link.read_response())


@each_row("order", ["high_first", "pairs_swapped", "halves_swapped"])
def test_values_may_be_laid_in_another_order_after_an_online_change(order):
    client, _ = planned("word_order", match="read_head", order=order)
    usual = client.link.read_response()[84:88]
    client.link.read_head()
    client.link.clock.sleep(0.01)
    laid = client.link.read_response()[84:88]
    assert laid != usual
    assert WordOrder[order.upper()].arrange(laid) == usual


def test_all_may_stand_a_word_further_on():
    client, _ = planned("shift_map", match="read_head")
    before = client.link.read_response()
    client.link.read_head()
    client.link.clock.sleep(0.01)
    after = client.link.read_response()
    assert after[10] == before[11]
    with pytest.raises(BlockError):
        decode_response(after)


def test_the_heartbeat_may_stand_still_alone():
    client, simulator = planned("freeze_heartbeat", match="read_head")
    client.link.read_head()
    client.link.clock.sleep(0.5)
    before = client.now().plc_heartbeat
    assert client.done(Opcode.SELECT_TOOL, 0).tool_slot == 0
    assert client.now().plc_heartbeat == before
    simulator.panel.restart()
    client.link.clock.sleep(0.1)
    first = client.now().plc_heartbeat
    client.link.clock.sleep(0.1)
    assert client.now().plc_heartbeat != first


def test_somebody_else_may_insist_on_the_mailbox():
    client, simulator = planned("take_ownership", match="read_head")
    client.link.read_head()
    client.link.clock.sleep(0.01)
    client.now()
    assert simulator.plc.program.ownership.holder not in (0, client.owner)


# Where what is possible


def test_every_fault_can_happen_somewhere():
    assert all(links_of(action) for action in (*FaultAction, *PlcFaultAction))


@pytest.mark.parametrize(
    ("action", "device", "words"),
    [
        (PlcFaultAction.WRONG_TOGGLE, EpsonSimulator, r"wrong_toggle .*epson\+tcp"),
        (FaultAction.LOSE_LOGIN, SoftMotionSimulator, r"lose_login .*softmotion"),
    ],
)
def test_a_fault_of_another_kind_of_controller_is_refused_by_name(action, device, words):
    simulator = device()
    fault = PlcFault(action) if isinstance(action, PlcFaultAction) else Fault(action)
    with pytest.raises(FaultNotPossibleError, match=words) as refused:
        simulator.faults.add(fault)
    assert refused.value.action is action
    assert simulator.faults.pending == ()


def test_a_fault_counts_only_requests_of_links_that_can_have_it():
    simulator = SoftMotionSimulator()
    simulator.faults.add(PlcFault(PlcFaultAction.LOSE_SEGMENT, match="read_head"))
    assert simulator.faults.take("read_head", LinkKind.MODBUS_TCP) == ()
    with pytest.raises(FaultNotPossibleError, match="lose_segment"):
        simulator.faults.require_possible({LinkKind.MODBUS_TCP, LinkKind.MODBUS_RTU})
    simulator.faults.require_possible({LinkKind.MODBUS_TCP, LinkKind.CAN})
    assert len(simulator.faults.take("read_head", LinkKind.CAN)) == 1


def test_a_line_cannot_be_reset():
    with pytest.raises(FaultNotPossibleError, match="reset"):
        FaultPlan([Fault(FaultAction.RESET)], links={LinkKind.EPSON_SERIAL})
    simulator = EpsonSimulator(faults=[Fault(FaultAction.RESET)])  # for one on a network
    assert simulator.faults.take("$GetStatus", LinkKind.EPSON_SERIAL) == ()
    assert len(simulator.faults.take("$GetStatus", LinkKind.EPSON_TCP)) == 1
