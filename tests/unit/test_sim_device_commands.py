"""Commands of a simulated EPSON controller: preconditions, effects, codes, the command window."""

import json
from dataclasses import fields

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator, Mode

from robolink.errors import ConfigError
from robolink.model import ToolOffset
from robolink.protocols.epson_text import COMMANDS, StatusFlags

# Every command but Execute: preconditions, effects, codes.

READY, RUNNING, PAUSED = "00100000001", "00100000010", "00100000100"


@pytest.fixture
def simulator():
    return EpsonSimulator()


@pytest.fixture
def client(simulator, login):
    return login(simulator)


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        ("GetStatus", 10),
        ("", 10),
        ("$Nope", 11),
        ("$GetIO", 12),
        ("$GetIO,x", 12),
        ("$GetIO,512", 12),
        ("$GetIO," + "9" * 5000, 12),
        ("$SetIO,0,2", 12),
        ("$SetIOByte,0,256", 12),
        ("$SetIOWord,32,0", 12),
        ("$SetMotorsOn", 12),
        ("$SetMotorsOn,2", 12),
        ("$SetCurRobot,2", 12),
        ("$Start,64", 12),
        ("$Execute,Print 1", 12),
        ('$Execute, "Print 1"', 12),
        ("$ResetAlm,3", 12),
        ("$GetErrMsg,1,7", 12),
        ("$Continue", 20),
        ("$Pause", 20),
    ],
)
def test_what_is_refused(client, request_, code):
    assert client.ask(request_).endswith(f",{code}")
    assert client.flags() == READY


def test_start_pause_continue_and_stop_turn_the_flags(client):
    assert client.ask("$Start,0") == "#Start,0"
    assert client.flags() == RUNNING
    assert client.ask("$Pause") == "#Pause,0"
    assert client.flags() == PAUSED
    assert client.ask("$Continue") == "#Continue,0"
    assert client.flags() == RUNNING
    assert client.ask("$Stop") == "#Stop,0"
    assert client.flags() == READY


@pytest.mark.parametrize(
    "request_",
    [
        "$Start,0",
        "$Reset",
        "$SetMotorsOn,1",
        "$SetMotorsOff,1",
        "$SetCurRobot,1",
        "$Home,1",
        "$SetIO,0,1",
        "$SetMemIO,0,1",
        "$SetVariable,g_Byte,1",
        '$Execute,"Print 1"',
    ],
)
def test_what_needs_ready_is_refused_with_20_while_a_task_runs(client, request_):
    client.ask("$Start,0")
    name = request_[1:].partition(",")[0]
    assert client.ask(request_) == f"!{name},20"
    assert client.flags() == RUNNING


def test_the_flags_that_commands_need_or_forbid_are_flags():
    known = {flag.name for flag in fields(StatusFlags)}
    assert all(command.needs | command.forbids <= known for command in COMMANDS)


@pytest.mark.parametrize("act", ["press_estop", "open_guard"])
@pytest.mark.parametrize("request_", ["$Start,0", "$SetMotorsOn,1", "$Home,1", '$Execute,"Tool 0"'])
def test_nothing_moves_with_the_stop_pressed_or_the_guard_open(simulator, client, act, request_):
    getattr(simulator.panel, act)()
    assert client.ask(request_).endswith(",20")
    assert not simulator.machine.motors_on


@pytest.mark.parametrize(
    ("mode", "flags"), [(Mode.TEACH, "01000000001"), (Mode.TEST, "10000000001")]
)
def test_out_of_auto_only_queries_and_single_outputs_are_served(simulator, client, mode, flags):
    simulator.panel.set_mode(mode)
    assert client.flags() == flags
    assert client.ask("$Stop") == "!Stop,20"
    assert client.ask('$Execute,"Print 1"') == "!Execute,20"
    assert client.ask("$GetIO,0") == "#GetIO,0"
    assert client.ask("$SetIO,0,1") == "#SetIO,0"
    assert client.ask("$SetMemIO,0,1") == "!SetMemIO,20"


def test_monitoring_serves_queries_while_production_runs(simulator, client):
    simulator.panel.set_monitoring_only(True)
    simulator.panel.start_production()
    assert client.flags() == "00000000010"
    for request in ("$GetIO,0", "$GetMemIOWord,0", "$GetVariable,g_Byte", "$GetCurRobot"):
        assert client.ask(request).startswith("#")
    for request in ("$Stop", "$Pause", "$Reset", "$SetIO,0,1", "$Abort", '$Execute,"Print 1"'):
        assert client.ask(request).endswith(",20")
    assert simulator.status_flags().running


def test_losing_a_monitoring_client_does_not_stop_production(simulator, client):
    simulator.panel.set_monitoring_only(True)
    simulator.panel.start_production()
    client.link.receive(b"", simulator.now_ns)
    client.wait(1000)
    assert simulator.status_flags().running


def test_the_flag_word_of_rc_plus_5_has_ten_digits(login):
    client = login(EpsonSimulator(options=EpsonOptions(status_flags=10)))
    assert client.flags() == "0100000001"


def test_reset_clears_errors_parameters_and_outputs(simulator, client):
    machine = simulator.machine
    machine.power_high = True
    client.ask("$SetIO,3,1")
    simulator.panel.raise_error(4002)
    assert client.ask("$GetStatus") == "#GetStatus,00100001001,4002"
    assert client.ask("$Reset") == "#Reset,0"
    assert client.ask("$GetStatus") == "#GetStatus,00100000001,0000"
    assert not machine.power_high
    assert not machine.outputs.get(3)


def test_reset_may_leave_the_outputs(login):
    simulator = EpsonSimulator(options=EpsonOptions(reset_outputs_off=False))
    client = login(simulator)
    client.ask("$SetIO,3,1")
    client.ask("$Reset")
    assert simulator.machine.outputs.get(3)


def test_a_serious_error_outlives_reset_and_not_a_restart(simulator, client, login):
    simulator.panel.raise_serious_error()
    assert client.flags() == "00101001001"
    assert client.ask("$Reset") == "!Reset,20"
    simulator.restart()
    assert client.link.closed
    assert login(simulator).flags() == READY


def test_an_emergency_stop_stays_until_it_is_released_and_reset(simulator, client):
    simulator.panel.press_estop()
    assert client.flags() == "00100010001"
    assert client.ask("$Reset") == "#Reset,0"
    assert client.flags() == "00100010001"
    simulator.panel.release_estop()
    assert client.flags() == "00100010001"
    client.ask("$Reset")
    assert client.flags() == READY
    assert client.ask("$SetMotorsOn,1") == "#SetMotorsOn,0"


def test_an_open_guard_pauses_a_task_and_closing_it_continues_nothing(simulator, client):
    client.ask("$Start,0")
    simulator.panel.open_guard()
    assert client.flags() == "00100100100"
    simulator.panel.close_guard()
    assert client.flags() == PAUSED


def test_a_warning_shows_its_number_and_stops_nothing(simulator, client):
    client.ask("$Start,0")
    simulator.panel.raise_warning(517)
    assert client.ask("$GetStatus") == "#GetStatus,00110000010,0517"


def test_motors_on_resets_the_motion_parameters(simulator, client):
    client.ask('$Execute,"SpeedS 77"')
    assert simulator.machine.parameters.speed_s[0] == 77
    assert client.ask("$SetMotorsOff,0") == "#SetMotorsOff,0"
    assert not simulator.machine.motors_on
    assert client.ask("$SetMotorsOn,1") == "#SetMotorsOn,0"
    assert simulator.machine.motors_on
    assert simulator.machine.parameters.speed_s[0] != 77


def test_inputs_outputs_and_memory_are_three_things(simulator, client):
    simulator.machine.inputs.set_byte(0, 0xFF)
    simulator.machine.inputs.set(8, True)
    assert client.ask("$GetIO,1") == "#GetIO,1"
    assert client.ask("$GetIOByte,0") == "#GetIOByte,FF"
    assert client.ask("$GetIOWord,0") == "#GetIOWord,01FF"
    assert client.ask("$SetIOWord,1,513") == "#SetIOWord,0"
    assert simulator.machine.outputs.get(16)
    assert simulator.machine.outputs.get(25)
    assert client.ask("$GetMemIOWord,0") == "#GetMemIOWord,0000"
    assert client.ask("$SetMemIOByte,1,128") == "#SetMemIOByte,0"
    assert client.ask("$GetMemIO,15") == "#GetMemIO,1"


def test_alarms_are_listed_and_reset(simulator, client):
    assert client.ask("$GetAlm") == "#GetAlm,0"
    simulator.panel.raise_alarm(7)
    simulator.panel.raise_alarm(9)
    assert client.ask("$GetAlm") == "#GetAlm,2,7,9"
    assert client.ask("$ResetAlm,7") == "#ResetAlm,0"
    assert client.ask("$GetAlm") == "#GetAlm,1,9"


def test_rc_plus_5_knows_neither_alarms_nor_the_extended_queries(login):
    client = login(EpsonSimulator(options=EpsonOptions(rc_plus=5)))
    assert client.ask("$GetAlm") == "!GetAlm,11"
    assert client.ask("$GetContVer") == "!GetContVer,11"


def test_older_firmware_lacks_the_extended_queries_only(login):
    client = login(EpsonSimulator(options=EpsonOptions(extended_queries=False)))
    assert client.ask("$GetContVer") == "!GetContVer,11"
    assert client.ask("$GetAlm") == "#GetAlm,0"


def test_the_extended_queries(simulator, client):
    assert client.ask("$GetRobotInfo") == "#GetRobotInfo,1,3,T6-602S"
    assert client.ask("$GetMotor,0") == "#GetMotor,1,1,0"
    assert client.ask("$GetErrMsg,2230,0") == "#GetErrMsg,Tool undefined"
    assert client.ask("$GetErrFunc,2230") == "#GetErrFunc,0"
    assert client.ask("$GetHealthRB,1,0,1") == "#GetHealthRB,-1"
    assert client.ask("$GetRobotName,2") == "!GetRobotName,12"
    for name in ("GetContName", "GetContType", "GetContMacAdd", "GetContSettings"):
        assert client.ask(f"${name}").startswith(f"#{name},")


def test_home_without_a_home_position_is_error_2228(client):
    assert client.ask("$Home,1") == "!Home,99"
    assert client.code() == 2228


# The command window over the wire: output, failures, motion, stops.

LONG_MOVE = '$Execute,"Move Here +X(-50)"'


def simulator_with(**habits):
    return EpsonSimulator(options=EpsonOptions(**habits))


def test_a_statement_that_prints_nothing_answers_0(login):
    assert login(EpsonSimulator()).ask('$Execute,"Tool 0"') == "#Execute,0"


@pytest.mark.parametrize(("inside", "text"), [(True, '"1\r\n"'), (False, '"1"')])
def test_the_line_end_of_print_stands_inside_the_quotes_or_not(login, inside, text):
    client = login(simulator_with(print_crlf_inside_quotes=inside))
    assert client.ask('$execute,"Print Tool"') == f"#execute,{text}"


def test_lines_end_as_the_setup_says(login):
    client = login(simulator_with(terminator="cr"))
    client.send("$GetCurRobot")
    assert client.link.outgoing() == b"#GetCurRobot,1\r"


def test_a_failed_statement_puts_the_controller_into_error_until_reset(login):
    client = login(EpsonSimulator())
    assert client.ask('$Execute,"Tool 9"') == "!Execute,99"
    assert client.ask("$GetStatus") == "#GetStatus,00100001001,2230"
    assert client.ask('$Execute,"Print 1"') == "!Execute,20"
    client.ask("$Reset")
    assert client.ask('$Execute,"Print Tool"').startswith('#Execute,"')


def test_a_failure_may_be_told_in_words(login):
    client = login(simulator_with(execute_failure="text"))
    assert client.ask('$Execute,"Tool 9"').startswith('#Execute,"Error 2230: ')
    assert client.code() == 2230


def test_a_result_over_4060_bytes_is_refused_and_ends_nothing(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    statement = ";".join(["TLSet"] * 600)
    for tool in range(2, 12):
        simulator.machine.tools.set(tool, ToolOffset(tool))
    assert client.ask(f'$Execute,"{statement}"') == "!Execute,99"
    assert client.flags() == "00100000001"


def test_a_statement_over_4060_bytes_is_malformed(login):
    client = login(EpsonSimulator())
    assert client.ask('$Execute,"Print ' + "1" * 4060 + '"') == "!Execute,12"


def test_a_motion_answers_when_it_has_ended(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    assert client.ask(LONG_MOVE) == ""
    assert client.flags() == "00100000010"
    change = simulator.next_change()
    assert change is not None
    simulator.advance(change - 1)
    assert client.heard() == ""
    simulator.advance(change)
    assert client.heard() == "#Execute,0"
    assert client.flags() == "00100000001"


def test_time_may_jump_over_the_end_of_a_motion(login):
    client = login(simulator_with(remote_timeout_s=0))
    client.send(LONG_MOVE)
    assert client.wait(10_000) == "#Execute,0"


def test_an_execute_may_be_hidden_from_the_flags(login):
    client = login(simulator_with(flags_during_execute="ready"))
    client.send(LONG_MOVE)
    assert client.flags() == "00100000001"
    assert client.ask(LONG_MOVE) == "!Execute,21"


@pytest.mark.parametrize("request_", [LONG_MOVE, "$GetIO,0", "$Reset", "$Stop", "$Logout"])
def test_most_requests_are_21_while_a_statement_runs(login, request_):
    client = login(EpsonSimulator())
    client.send(LONG_MOVE)
    assert client.ask(request_).endswith(",21")


@pytest.mark.parametrize(("rc_plus", "answer"), [(5, "!SetIO,21"), (7, "#SetIO,0")])
def test_outputs_during_a_statement_came_with_rc_plus_7(login, rc_plus, answer):
    client = login(simulator_with(rc_plus=rc_plus))
    client.send(LONG_MOVE)
    assert client.ask("$SetIO,0,1") == answer


@pytest.mark.parametrize(
    ("first", "answers"),
    [(True, "#Abort,0\r\n!Execute,99"), (False, "!Execute,99\r\n#Abort,0")],
)
def test_abort_ends_the_motion_where_it_is_without_an_error(login, first, answers):
    simulator = simulator_with(abort_reply_first=first)
    client = login(simulator)
    start_mm = simulator.machine.arm.flange().x_mm
    client.send(LONG_MOVE)
    client.wait(0.5)
    assert client.ask("$Abort") == answers
    stood_mm = simulator.machine.arm.flange().x_mm
    client.wait(5)
    assert simulator.machine.arm.flange().x_mm == stood_mm
    assert start_mm - 50 < stood_mm < start_mm
    assert client.flags() == "00100000001"


def test_abort_with_nothing_to_end_is_fine(login):
    assert login(EpsonSimulator()).ask("$Abort") == "#Abort,0"


@pytest.mark.parametrize(
    ("act", "flags", "number"),
    [("press_estop", "00100011001", 4025), ("open_guard", "00100101001", 4026)],
)
def test_a_stop_ends_the_motion_and_fails_the_statement(login, act, flags, number):
    simulator = EpsonSimulator()
    client = login(simulator)
    client.send(LONG_MOVE)
    client.wait(0.5)
    getattr(simulator.panel, act)()
    assert client.heard() == "!Execute,99"
    assert client.ask("$GetStatus") == f"#GetStatus,{flags},{number}"
    stood = simulator.machine.arm.joints
    client.wait(5)
    assert simulator.machine.arm.joints == stood
    assert simulator.machine.arm.moves_started == 1


def test_turning_the_selector_ends_a_motion(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    client.send(LONG_MOVE)
    simulator.panel.teach()
    assert client.heard() == "!Execute,99"
    assert client.flags() == "01000000001"


def test_a_planned_act_happens_at_the_present_time_of_the_host(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    client.send(LONG_MOVE)
    simulator.present_ns = lambda: 500_000_000
    simulator.panel.press_estop()
    assert simulator.now_ns == 500_000_000
    assert simulator.machine.arm.flange().x_mm < 170.6


def test_watchers_are_told_of_each_act():
    simulator, woken = EpsonSimulator(), []
    simulator.watchers.append(lambda: woken.append(True))
    simulator.panel.open_guard()
    assert woken == [True]


def test_a_silent_client_has_its_motion_ended(login):
    simulator = simulator_with(remote_timeout_s=1.0)
    client = login(simulator)
    client.send('$Execute,"Speed 1; Go Here :U(170)"')
    client.wait(1.0)
    assert client.link.closed
    assert not simulator.machine.arm.moving
    assert simulator.condition.code == 19


@pytest.fixture
def state(tmp_path):
    return tmp_path / "cell.json"


def test_tools_and_the_selection_outlive_the_simulator(login, state):
    simulator = EpsonSimulator(state_path=state)
    client = login(simulator)
    # Who was seen once is the same after a restart.
    assert EpsonSimulator(state_path=state).machine.serial == simulator.machine.serial
    client.ask('$Execute,"TLSet 3, XY(1,2,3,4)"')
    client.ask('$Execute,"Tool 3"')
    reborn = EpsonSimulator(state_path=state)
    assert reborn.machine.serial == simulator.machine.serial
    assert reborn.machine.tools.get(3) == ToolOffset(1, 2, 3, 4)
    assert reborn.machine.tools.selected == 3
    assert [name.name for name in state.parent.iterdir()] == ["cell.json"]


def test_only_a_change_of_the_tools_is_written(login, state):
    client = login(EpsonSimulator(state_path=state))
    state.unlink()
    client.ask('$Execute,"Move Here +X(-1)"')
    client.wait(5)
    client.ask("$SetIO,0,1")
    assert not state.exists()


@pytest.mark.parametrize("text", ["", "{}", '{"schema": "robolink/sim-state/1"}', "[1]"])
def test_a_state_that_fits_nothing_is_refused_and_kept(state, text):
    state.write_text(text)
    with pytest.raises(ConfigError, match="not a saved state"):
        EpsonSimulator(state_path=state)
    assert state.read_text() == text


def test_the_state_of_another_robot_is_refused(login, state):
    login(EpsonSimulator(state_path=state)).ask('$Execute,"TLSet 3, XY(1,2,3,4)"')
    assert json.loads(state.read_text())["robot"] == "T6-602S"
    with pytest.raises(ConfigError, match="GX4-C251S"):
        EpsonSimulator("GX4-C251S", state_path=state)


def test_a_restart_keeps_the_flash_and_forgets_the_rest(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    client.ask('$Execute,"TLSet 3, XY(1,2,3,4)"')
    client.ask('$Execute,"P7 = Here"')
    client.ask("$SetMemIO,5,1")
    simulator.restart()
    client = login(simulator)
    assert simulator.machine.tools.get(3) is not None
    assert simulator.machine.tools.selected == 1
    assert not simulator.machine.motors_on
    assert client.ask("$GetMemIO,5") == "#GetMemIO,0"
    assert client.ask('$Execute,"Print P7"') == "!Execute,99"


def test_the_same_seed_gives_the_same_answers(login):
    def dialogue(seed):
        client = login(EpsonSimulator(seed=seed))
        return [client.ask('$Execute,"Print RealPos"') for _ in range(3)]

    assert dialogue(3) == dialogue(3)
    assert len(set(dialogue(3))) > 1
    assert dialogue(3) != dialogue(4)
