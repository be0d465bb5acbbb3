"""verify-controller names the device options in effect and leaves no trace."""

import json

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import (
    EpsonOptions,
    option_names,
    options_from_text,
    read_profile,
)
from robolink_simulators.epson.spel.expressions.machine_functions import MACHINE_FUNCTIONS
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.streams.epson import serve_serial, serve_tcp

from robolink.controllers.epson.verify import redacted, verify_epson
from robolink.errors import LoginRefusedError
from robolink.model import Secret, ToolOffset
from robolink.transport import format_dialogue

HABITS = [
    {},
    {"terminator": "cr"},
    {"terminator": "lf"},
    {"status_flags": 10},
    {"print_crlf_inside_quotes": False},
    {"flags_during_execute": "ready"},
    {"point_coordinates": "given"},
    {"true_value": 1},
    {"comma_blank": "always"},
    {"comma_blank": "nothing"},
    {"comma_blank": "comma"},
    {"comma_blank": "tab"},
    {"tool_listing": "padded"},
    {"tool_listing": "four"},
    {"where_width": 8},
    {"extended_queries": False},
    {"rc_plus": 5},
    {"rc_plus": 8},
    {"requests_end_with_silence": False},
    {"requests_end_with_silence": False, "terminator": "cr", "print_crlf_inside_quotes": False},
    {"number_lead_blank": True},
    {"dry_run": True, "virtual_io": True, "maintenance_data": True},
    {"outputs_off_at_estop": False},
    {"abort_reply_first": False},
    {"second_client": "closed"},
    {"execute_on_disconnect": "stops"},
    {"logout_while_running": "refused"},
    {"execute_failure": "text"},
    {"execute_failure_code": 20},
    {"monitoring_refusal": 11},
    {"tlset_of_undefined": "error"},
    {"reset_outputs_off": False},
    {"real_pos_noise_mm": 0.0},
    {"angle_wrap": True},
]

ALWAYS_SETTLED = {
    "comma_blank",
    "extended_queries",
    "flags_during_execute",
    "monitoring_only",
    "number_lead_blank",
    "point_coordinates",
    "print_crlf_inside_quotes",
    "requests_end_with_silence",
    "status_flags",
    "terminator",
    "tool_listing",
    "true_value",
    "where_width",
}


PREFERENCES = {
    "dry_run",
    "maintenance_data",
    "outputs_off_at_estop",
    "reset_outputs_off",
    "virtual_io",
}


@pytest.fixture
def cell(serve_simulator):
    """Makes simulators in this process."""
    return lambda simulator: serve_simulator(simulator).url


@pytest.mark.parametrize("habit", HABITS, ids=lambda habit: ",".join(map(str, habit)) or "defaults")
def test_the_profile_names_exactly_the_option_values_in_force(cell, habit):
    options = EpsonOptions(**habit)
    found = verify_epson(cell(EpsonSimulator(seed=3, options=options))).options
    in_force = {name: getattr(options, name) for name in found}
    if options.rc_plus == 5:
        in_force["extended_queries"] = False  # RC+ 5 has none, whatever the option is
    assert found == in_force
    assert set(found) >= ALWAYS_SETTLED
    told = {"rc_plus", *PREFERENCES} if options.extended_queries else set()
    told = {"rc_plus"} if options.rc_plus == 5 else told
    assert {"rc_plus", *PREFERENCES} & set(found) == told


def test_a_profile_makes_a_simulator_with_the_same_habits(cell, tmp_path):
    options = EpsonOptions(terminator="lf", tool_listing="padded", where_width=8, true_value=1)
    found = verify_epson(cell(EpsonSimulator(options=options)))
    profile = tmp_path / "cell.json"
    profile.write_text(json.dumps(found.profile()))
    assert options_from_text(read_profile(profile)) == options


def test_every_fact_has_a_finding_and_names_an_option_that_exists(cell):
    found = verify_epson(cell(EpsonSimulator()))
    assert all(fact.finding for fact in found.facts)
    named = [fact.option for fact in found.facts if fact.option]
    assert len(named) == len(set(named))
    assert set(named) <= set(option_names())
    ours = {"companion", "blank_before_dollar"}  # which robolink never sends
    of_programs = {"statement_us", "loop_passes", "for_test", "integer_overflow", "undeclared"}
    of_programs |= {"globals_at_start", "ports_of_ended_task", "uncalibrated_robot_result"}
    of_programs |= {"servo_lag_ms", "servo_unrest_pulses"}
    of_programs |= {"vision_acquisition_ms", "vision_object_ms", "vision_not_found"}
    of_programs |= {"input_blank", "old_here", "io_bits"}
    of_programs |= {"background_tasks", "advanced_task_commands", "windows_status"}
    of_robots = {"servo_lag_ms", "servo_unrest_pulses"}
    others = {name for name in option_names() if "." not in name} - set(named)
    serial = {name for name in others if name.startswith("rs232_")}
    assert others - serial == ours | of_programs | of_robots
    assert serial  # asked only on a serial line


@pytest.mark.parametrize("letters", ["documented", "guessed"])
def test_on_a_serial_line_it_finds_out_what_the_manuals_leave_open(letters):
    simulator = EpsonSimulator(options=EpsonOptions(rs232_letters=letters))
    with serve_serial(simulator) as line:
        found = verify_epson(line.url.replace("&letters=guessed", ""))
    settled = {fact.option: fact.value for fact in found.facts if fact.value is not None}
    assert settled["rs232_letters"] == letters
    assert settled["rs232_numbers"] == "binary"
    assert settled["rs232_nak_code"] == "digits"
    assert settled["rs232_status_flags"] == 10
    named = {fact.option for fact in found.facts if fact.option}
    assert {name for name in option_names() if name.startswith("rs232_")} <= named
    sent = [text for _, way, text in simulator.log if way == ">"]
    assert not [text for text in sent if "TLSet " in text or "Go" in text or "Motors" in text]


def test_nothing_is_written_and_nothing_moves(cell):
    simulator = EpsonSimulator()
    before = simulator.machine.tools.to_state()
    verify_epson(cell(simulator))
    assert simulator.machine.tools.to_state() == before
    assert simulator.machine.flash_writes == 0
    assert simulator.machine.arm.moves_started == 0
    assert simulator.condition.code == 0
    asked = [text for _, direction, text in simulator.log if direction == ">"]
    assert asked[-1] == "$Logout"
    changing = ("$Set", "$Reset", "$Start", "$Stop", "$Abort", '$Execute,"TLSet ')
    assert not any(text.startswith(changing) for text in asked)


@pytest.mark.parametrize(
    ("monitoring_only", "running"), [(True, True), (True, False), (False, True)]
)
def test_where_production_may_run_only_queries_are_sent(cell, monitoring_only, running):
    simulator = EpsonSimulator(options=EpsonOptions(monitoring_only=monitoring_only))
    url = cell(simulator)
    if running:
        simulator.panel.start_production()
    found = verify_epson(url)
    assert simulator.status_flags().running is running
    assert simulator.condition.code == 0
    asked = [text for _, direction, text in simulator.log if direction == ">"]
    assert not any("Execute" in text or "Logout" in text for text in asked)
    always = {"status_flags", "extended_queries", "rc_plus", "terminator"}
    assert set(found.options) == always | PREFERENCES
    why = {fact.option: fact.finding for fact in found.facts}
    assert "program" in why["requests_end_with_silence"]


def test_without_a_tool_what_tools_show_is_not_settled(cell):
    simulator = EpsonSimulator()
    for tool in simulator.machine.tools.defined():
        simulator.machine.tools.select(0)
        simulator.machine.tools.clear(tool)
    found = verify_epson(cell(simulator))
    assert {"tool_listing", "true_value"}.isdisjoint(found.options)
    assert "where_width" in found.options


def test_a_tool_turned_beyond_180_degrees_shows_that_angles_are_kept(cell):
    simulator = EpsonSimulator()
    simulator.machine.tools.set(5, ToolOffset(1, 2, 3, 200))
    assert verify_epson(cell(simulator)).options["angle_wrap"] is False


@pytest.mark.parametrize("failure", ["refusal", "text"])
def test_a_fault_ends_the_statements_and_is_named(cell, failure):
    fault = Fault(FaultAction.DEVICE_FAULT, match="Where", code=4711)
    simulator = EpsonSimulator(options=EpsonOptions(execute_failure=failure), faults=[fault])
    found = verify_epson(cell(simulator))
    assert "point_coordinates" in found.options
    assert "comma_blank" not in found.options
    (why,) = [fact.finding for fact in found.facts if fact.option == "comma_blank"]
    assert "4711" in why
    statements = [text for _, _, text in simulator.log if text.startswith("$Execute")]
    assert statements[-1] == '$Execute,"Where"'


def test_a_text_that_nobody_knows_is_reported_and_not_guessed(cell, monkeypatch):
    simulator = EpsonSimulator()
    monkeypatch.setitem(MACHINE_FUNCTIONS, "tldef", (range(1, 2), lambda *_: "Yes"))
    found = verify_epson(cell(simulator))
    (fact,) = [fact for fact in found.facts if fact.option == "true_value"]
    assert not fact.settled
    assert "Yes" in fact.finding


def test_the_login_is_in_no_transcript_and_one_attempt_is_made(cell):
    simulator = EpsonSimulator(password=Secret("hush-4711"))
    url = cell(simulator)
    found = verify_epson(url, password=Secret("hush-4711"))
    assert "hush" not in format_dialogue(found.dialogue)
    with pytest.raises(LoginRefusedError):
        verify_epson(url, password=Secret("canary-wrong"))
    logins = [text for _, _, text in simulator.log if text.startswith("$Login")]
    assert len(logins) == 2


@pytest.mark.parametrize("extended", [True, False])
def test_a_redacted_transcript_names_no_serial_number_and_no_address(cell, extended):
    simulator = EpsonSimulator(options=EpsonOptions(extended_queries=extended))
    found = verify_epson(cell(simulator))
    assert simulator.machine.serial in format_dialogue(found.dialogue)
    shown = format_dialogue(redacted(found.dialogue)) + json.dumps(found.profile(redact=True))
    for hidden in (simulator.machine.serial, "SIMULATED", simulator.url):
        assert hidden not in shown


def test_a_controller_on_a_socket_is_verified_as_well():
    options = EpsonOptions(terminator="cr", requests_end_with_silence=True)
    with serve_tcp(EpsonSimulator(options=options)) as host:
        found = verify_epson(host.url).options
    assert found["terminator"] == "cr"
    assert found["requests_end_with_silence"] is True
    assert found["flags_during_execute"] == "running"


def test_a_redacted_transcript_can_be_replayed(cell, tmp_path, epson_replay):
    options = EpsonOptions(true_value=1, tool_listing="padded")
    found = verify_epson(cell(EpsonSimulator(options=options)))
    said = tmp_path / "said.jsonl"
    said.write_text(format_dialogue(redacted(found.dialogue)))
    again = verify_epson(epson_replay(said))
    assert again.options == found.options
    assert again.about.robot_serials == ("***",)
