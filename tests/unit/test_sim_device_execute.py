"""The command window over the wire: output, failures, motion, stops."""

import json

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator

from robolink.errors import ConfigError
from robolink.model import ToolOffset

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
