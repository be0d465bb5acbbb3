"""Fault plans in files: read, refused with line and key, and applied where they can happen."""

from pathlib import Path

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.faults import (
    Fault,
    FaultAction,
    FaultNotPossibleError,
    FaultRates,
    LinkKind,
    PlcFault,
    PlcFaultAction,
    drawn_plc_faults,
    fault_as_keys,
    read_fault_file,
)
from robolink_simulators.hosting.in_process.epson import simulator_named, unregister

import robolink
from robolink.errors import ConfigError, OutcomeUnknownError
from tools.fault_tables import tables

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


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[[fault]]\naction = 'drop_reply'\nmach = 'x'", "line 5, fault 1, mach: .*is match meant"),
        ("[[fault]]\naction = 'drop_replay'", "line 4, fault 1, action: .*is drop_reply meant"),
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
        ("faults = 1", "line 3, faults: is not known; is fault meant"),
        ("seed = 1.5", "line 3, seed: must be a whole number"),
        ("seed = 1 2", "cannot be read: .*line 3"),
    ],
)
def test_what_is_wrong_is_told_with_its_line_and_key(written, text, told):
    with pytest.raises(ConfigError, match=told):
        read_fault_file(written(HEAD + text))


def test_all_that_is_wrong_is_told_at_once(written):
    text = "[[fault]]\naction = 'dely'\nsecond = 1\n[[fault]]\naction = 'reset'\nbit = 9"
    with pytest.raises(ConfigError, match=r"(?s)3 places.*line 4.*line 5.*line 8"):
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
