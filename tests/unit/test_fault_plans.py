"""Fault plans: read from files, drawn from a seed, and counted, never random."""

import hashlib
from pathlib import Path

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.faults import (
    Fault,
    FaultAction,
    FaultNotPossibleError,
    FaultPlan,
    FaultRates,
    LinkKind,
    PlcFault,
    PlcFaultAction,
    drawn_faults,
    drawn_plc_faults,
    fault_as_keys,
    links_of,
    read_fault_file,
)
from robolink_simulators.faults.drawn import ONLY_BY_NAME
from robolink_simulators.faults.stream import EXCEPTION_CODES
from robolink_simulators.hosting.in_process.epson import simulator_named, unregister
from robolink_simulators.softmotion.mailbox.exchange import WireFaults

import robolink
from robolink.errors import ConfigError, OutcomeUnknownError
from robolink.model import ToolOffset
from tests._rows import each_row
from tools.fault_tables import tables

# Fault plans in files: read, refused with line and key, and applied where they can occur.

HEAD = 'schema = "robolink/faults/1"\nlink = "epson+tcp"\n'
PAGE = Path(__file__).parents[2] / "docs" / "fault-plans.md"


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "plan.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_plan_says_what_it_says(written):
    text = """
seed = 9
[[fault]]
action = "split_reply"
match = "TLSet"
on_exchange = 2
seconds = 0.5
position = 3
[[fault]]
action = "estop"
"""
    plan = read_fault_file(written(HEAD + text))
    assert (plan.link, plan.seed) == (LinkKind.EPSON_TCP, 9)
    split = Fault(FaultAction.SPLIT_REPLY, 2, "TLSet", seconds=0.5, position=3)
    assert plan.faults == (split, Fault(FaultAction.ESTOP))
    assert fault_as_keys(split) == {
        "action": "split_reply",
        "on_exchange": 2,
        "match": "TLSet",
        "seconds": 0.5,
        "position": 3,
    }


def test_a_plan_may_leave_the_choice_to_its_seed(written):
    text = """
schema = "robolink/faults/1"
link = "softmotion+can"
seed = 7
[drawn]
rate = 0.05
exchanges = 2000
actions = ["lose_segment", "delay"]
match = "read_response"
"""
    rates = FaultRates(
        0.05, 2000, (PlcFaultAction.LOSE_SEGMENT, PlcFaultAction.DELAY), "read_response"
    )
    plan = read_fault_file(written(text))
    assert plan.faults == drawn_plc_faults(7, LinkKind.CAN, rates)
    assert {type(fault) for fault in plan.faults} == {PlcFault}


@each_row(
    ("text", "told"),
    [
        (
            "[[fault]]\naction = 'drop_reply'\nmach = 'x'",
            "line 5, fault 1, mach: .*did you mean match",
        ),
        ("[[fault]]\naction = 'drop_replay'", "line 4, fault 1, action: .*did you mean drop_reply"),
        (
            "[[fault]]\naction = 'reset'\n\n[[fault]]\nseconds = 1",
            "line 6, fault 2, action: is mis",
        ),
        ("[[fault]]\naction = 'delay'\nseconds = nan", "line 5, fault 1, seconds: must be at most"),
        ("[[fault]]\naction = 'delay'\nseconds = -1", "line 5, fault 1, seconds: must be at least"),
        ("[[fault]]\naction = 'delay'\nposition = true", "line 5, .*position: must be a whole"),
        ("[[fault]]\naction = 'delay'\nevery = -1", "line 5, fault 1, every: must be at least 0"),
        ("[[fault]]\naction = 'modbus_exception'", "modbus_exception cannot happen on epson.tcp"),
        ("[[fault]]\naction = 'garble_reply'\nbit = 8", "line 5, fault 1, bit: must be at most 7"),
        ("[[fault]]\naction = 'delay'\nmatch = 3", "line 5, fault 1, match: must be a text"),
        ("[[fault]]\naction = 'wrong_toggle'", "line 4, .*wrong_toggle cannot happen on epson.tcp"),
        (
            "[[fault]]\naction = 'delay'\norder = 'low_first'",
            "line 5, fault 1, order: is not known",
        ),
        ("fault = 3", "line 3, fault: must be a table"),
        ("fault = [{action = 'x'}]", "fault 1, action: is not known"),
        ("drawn = 3", "line 3, drawn: must be a table"),
        ("[drawn]\nrate = 2", "line 4, drawn, rate: must be at most 1"),
        ("[drawn]\nactions = 'delay'", "line 4, drawn, actions: must be a list"),
        ("[drawn]\nactions = ['echo']", "line 4, drawn, actions: .*echo cannot happen"),
        ("[drawn]\nspeed = 1", "line 4, drawn, speed: is not known"),
        ("faults = 1", "line 3, faults: is not known; did you mean fault"),
        ("seed = 1.5", "line 3, seed: must be a whole number"),
        ("seed = 1 2", "cannot be read: .*line 3"),
    ],
)
def test_what_is_wrong_is_told_with_its_line_and_key(written, text, told):
    with pytest.raises(ConfigError, match=told):
        read_fault_file(written(HEAD + text))


def test_all_that_is_wrong_is_told_at_once(written):
    text = "[[fault]]\naction = 'dely'\nsecond = 1\n[[fault]]\naction = 'reset'\nbit = 9"
    with pytest.raises(ConfigError, match=r"(?s)3 errors.*line 4.*line 5.*line 8"):
        read_fault_file(written(HEAD + text))


@pytest.mark.parametrize(
    ("head", "told"),
    [
        ('schema = "robolink/faults/2"\nlink = "epson+tcp"', 'line 1, schema: must be one of "rob'),
        ('schema = "robolink/faults/1"\nlink = "epson"', 'line 2, link: must be one of "epson.tcp'),
        ('schema = "robolink/faults/1"', "(?m)^    link: must be one of"),
    ],
)
def test_the_head_says_what_the_plan_is_for(written, head, told):
    with pytest.raises(ConfigError, match=told):
        read_fault_file(written(head))


def test_a_plan_has_a_size(written):
    with pytest.raises(ConfigError, match=r"longer than 0\.25 MB"):
        read_fault_file(written(HEAD + "#" * 300_000))
    with pytest.raises(ConfigError, match="at most 2000"):
        read_fault_file(written(HEAD + "[[fault]]\naction='delay'\n" * 2001))


def test_a_plan_for_another_link_is_refused_whole():
    simulator = EpsonSimulator()
    faults = [Fault(FaultAction.DELAY), Fault(FaultAction.RESET)]
    with pytest.raises(FaultNotPossibleError, match=r"reset .*epson\+serial"):
        simulator.faults.plan(faults, 1, {LinkKind.EPSON_SERIAL})
    assert simulator.faults.pending == ()


def test_a_simulator_in_the_process_takes_a_plan_by_its_url(written):
    plan = written(HEAD + "[[fault]]\naction = 'drop_reply'\nmatch = 'TLSet 2, XY'")
    try:
        with robolink.connect(f"epson+sim://planned?faults={plan}") as controller:
            with pytest.raises(OutcomeUnknownError):
                controller.tools.write(2, robolink.ToolOffset(1, 2, 3), expected=None)
        assert len(simulator_named("planned").faults.fired) == 1
    finally:
        unregister("planned")


def test_the_page_shows_the_vocabulary_as_it_is():
    page = PAGE.read_text(encoding="utf-8")
    command = "python -m tools.fault_tables"
    assert page.endswith(tables()), f"run: {command}, and put it at the end of {PAGE.name}"


def test_the_example_of_the_page_is_a_plan(written):
    text = PAGE.read_text(encoding="utf-8").partition("```toml\n")[2].partition("```")[0]
    plan = read_fault_file(written(text))
    assert plan.faults == (Fault(FaultAction.DROP_REPLY, match="TLSet 2, XY"),)


# One seed is one plan.

RATES = FaultRates(rate=0.05, exchanges=2000)
STREAMS = (LinkKind.EPSON_TCP, LinkKind.EPSON_SERIAL, LinkKind.PLC_RTU)
MAILBOXES = (LinkKind.MODBUS_TCP, LinkKind.MODBUS_RTU, LinkKind.CAN, LinkKind.MAILBOX_SIM)


def test_a_seed_draws_the_same_plan_on_every_machine():
    """The digest is stored here, so that another Python, or another order of a set, shows."""
    drawn = (*drawn_faults(7, LinkKind.EPSON_TCP, RATES), *drawn_plc_faults(7, LinkKind.CAN, RATES))
    assert hashlib.sha256(repr(drawn).encode()).hexdigest()[:16] == "464a8a8679b527eb"


def test_another_seed_draws_another_plan():
    assert drawn_faults(1, LinkKind.EPSON_TCP, RATES) != drawn_faults(2, LinkKind.EPSON_TCP, RATES)


@each_row("kind", STREAMS)
def test_all_that_a_stream_can_have_is_drawn_and_nothing_else(kind):
    drawn = {fault.action for fault in drawn_faults(3, kind, FaultRates(0.5, 2000))}
    possible = {action for action in FaultAction if kind in links_of(action)}
    assert drawn == possible - ONLY_BY_NAME


@each_row("kind", MAILBOXES)
def test_all_that_a_mailbox_can_have_is_drawn_and_nothing_else(kind):
    drawn = {fault.action for fault in drawn_plc_faults(3, kind, FaultRates(0.5, 2000))}
    possible = {action for action in PlcFaultAction if kind in links_of(action)}
    assert drawn == possible - ONLY_BY_NAME


def test_modbus_exceptions_are_drawn_by_name_with_codes_that_there_are():
    asked = FaultRates(0.5, 2000, (FaultAction.MODBUS_EXCEPTION,))
    assert {it.code for it in drawn_faults(3, LinkKind.PLC_RTU, asked)} == {*EXCEPTION_CODES}
    asked = FaultRates(0.5, 2000, (PlcFaultAction.MODBUS_EXCEPTION,))
    assert {it.code for it in drawn_plc_faults(3, LinkKind.MODBUS_TCP, asked)} == {*EXCEPTION_CODES}


def test_as_many_as_the_rate_says():
    count = len(drawn_faults(5, LinkKind.EPSON_TCP, FaultRates(0.01, 100_000)))
    assert 900 < count < 1100  # three standard deviations are 95


def test_the_actions_do_not_move_the_exchanges():
    few = FaultRates(0.05, 2000, actions=(FaultAction.DELAY,))
    all_of_them = [fault.on_exchange for fault in drawn_faults(7, LinkKind.EPSON_TCP, RATES)]
    assert [it.on_exchange for it in drawn_faults(7, LinkKind.EPSON_TCP, few)] == all_of_them


def test_a_plan_is_drawn_ready_to_be_taken_from():
    plan = FaultPlan.drawn(7, LinkKind.EPSON_TCP, RATES)
    assert plan.pending == drawn_faults(7, LinkKind.EPSON_TCP, RATES)
    fired = [len(plan.take("$GetStatus")) for _ in range(2000)]
    assert sum(fired) == len(plan.fired) > 50
    assert plan.pending == ()
    assert WireFaults.drawn(7, LinkKind.CAN, RATES).pending


def test_what_a_link_cannot_have_is_not_drawn_for_it():
    wanted = FaultRates(actions=(PlcFaultAction.ECHO,))
    with pytest.raises(FaultNotPossibleError, match="echo"):
        drawn_plc_faults(1, LinkKind.MODBUS_TCP, wanted)


@each_row("numbers", [{"rate": 1.1}, {"rate": -0.1}, {"exchanges": -1}, {"exchanges": 10**7}])
def test_rates_have_limits(numbers):
    with pytest.raises(ConfigError):
        FaultRates(**numbers)


# The fault plan counts, and is never random.

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


@each_row(
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
