"""A loaded program as a remote client meets it (docs/reference/epson.md 1.2)."""

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator

from robolink.errors import ConfigError

S = 1_000_000_000
READY, RUNNING, PAUSED = "00100000001", "00100000010", "00100000100"


@pytest.fixture
def loaded(tmp_path, login):
    """Return a maker of clients of a controller with a program in it."""

    def make(text, **options):
        path = tmp_path / "main.prg"
        path.write_text(text)
        simulator = EpsonSimulator(options=EpsonOptions(**options), serial="SIM00001")
        simulator.load([path])
        return login(simulator)

    return make


def test_start_runs_the_function_of_its_number(loaded):
    client = loaded('Function main\nPrint "0"\nWait 2\nFend\nFunction main7\nPrint "7"\nFend\n')
    assert client.ask("$Start,0") == "#Start,0"
    assert client.flags() == RUNNING
    assert client.ask('$Execute,"Print 1"') == "!Execute,20"
    client.wait(3)
    assert client.flags() == READY
    assert client.ask("$Start,7") == "#Start,0"
    client.wait(0.1)
    assert list(client.simulator.program.console) == ["0\r\n", "7\r\n"]
    assert client.ask("$Start,8") == "!Start,12"
    assert client.flags() == READY


def test_stop_pause_and_continue_hold_its_motion(loaded):
    client = loaded("Function main\nMotor On\nMove Here -X(40)\nMove Here +X(40)\nFend\n")
    arm = client.simulator.machine.arm
    client.ask("$Start,0")
    client.wait(0.3)
    assert arm.moving
    client.ask("$Pause")
    client.wait(0.01)
    assert client.flags() == PAUSED
    stood = arm.joints
    client.wait(5)
    assert arm.joints == stood
    client.ask("$Continue")
    client.wait(0.1)
    assert arm.moving
    client.ask("$Stop")
    client.wait(0.01)
    assert not arm.moving
    assert client.flags() == READY
    assert client.simulator.program.tasks == {}


def test_an_error_shows_in_its_status_and_text_until_reset(loaded):
    client = loaded("Function main\nWait 0.1\nGo P900\nFend\n")
    client.ask("$Start,0")
    client.wait(1)
    assert client.ask("$GetStatus") == "#GetStatus,00100001001,7007"
    text = client.ask("$GetErrMsg,7007,0")
    assert "Point P900 is not defined" in text
    assert "main.prg:3" in text
    assert client.ask("$Reset") == "#Reset,0"
    assert client.flags() == READY
    assert "main.prg" not in client.ask("$GetErrMsg,7007,0")


def test_its_preserved_variables_are_those_of_the_client(loaded):
    client = loaded(
        "Global Preserve Long count\nGlobal Preserve Double table(3)\nGlobal Integer hidden\n"
        "Function main\nDo\nWait 0.01\nIf count = 5 Then table(2) = 2.5; count = 6\nLoop\nFend\n"
    )
    assert client.ask("$SetVariable,count,5,Long") == "#SetVariable,0"
    client.ask("$Start,0")
    client.wait(0.1)
    assert client.ask("$GetVariable,count,Long") == "#GetVariable,6"
    assert client.ask("$GetVariable,table(0),Double,4") == "#GetVariable,0,0,2.5,0"
    assert client.ask("$GetVariable,hidden,Integer") == "!GetVariable,15"


def test_an_emergency_stop_ends_it_where_it_is(loaded):
    client = loaded("Function main\nMove Here -X(40)\nFend\n")
    client.ask("$Start,0")
    client.wait(0.3)
    client.simulator.panel.press_estop()
    client.wait(0.1)
    assert client.simulator.program.tasks == {}
    assert not client.simulator.machine.arm.moving


def test_a_restart_forgets_what_ran(loaded):
    client = loaded("Function main\nDo\nWait 1\nLoop\nFend\n")
    client.ask("$Start,0")
    client.wait(2)
    client.simulator.restart()
    client.simulator.advance(client.simulator.now_ns + S)
    assert client.simulator.program.tasks == {}


def test_a_program_that_cannot_be_built_leaves_the_controller_as_it_was(loaded, tmp_path):
    client = loaded('Function main\nPrint "first"\nFend\n')
    bad = tmp_path / "bad.prg"
    bad.write_text("Function main\nPrint (\nFend\n")
    with pytest.raises(ConfigError, match=r"bad.prg:2:8"):
        client.simulator.load([bad])
    client.ask("$Start,0")
    client.wait(0.1)
    assert list(client.simulator.program.console) == ["first\r\n"]


PAST = "Function main\nMotor On\nQP {}\nMove Here -X(40)\nOn 5\nMove Here +X(40)\nFend\n"


@pytest.mark.parametrize("quick", [True, False])
def test_qp_says_whether_a_pause_lets_the_movement_end(loaded, quick):
    client = loaded(PAST.format("On" if quick else "Off"))
    machine = client.simulator.machine
    x_mm = machine.tip().x_mm
    client.ask("$Start,0")
    client.wait(0.3)
    assert machine.arm.moving
    client.ask("$Pause")
    client.wait(0.01)
    assert client.flags() == PAUSED
    assert machine.arm.moving is not quick
    client.wait(5)
    way_mm = x_mm - machine.tip().x_mm
    assert way_mm < 39 if quick else way_mm == pytest.approx(40)
    assert not machine.outputs.get(5)
    assert (client.flags(), machine.arm.moves_started) == (PAUSED, 1)
    client.ask("$Continue")
    client.wait(10)
    assert machine.outputs.get(5)
    assert machine.tip().x_mm == pytest.approx(x_mm)
    assert client.flags() == READY


def test_with_qp_off_what_belongs_to_the_movement_ends_with_it(loaded):
    client = loaded(
        "Function main\nMotor On\nQP Off\nMove Here -X(40) Till Sw(3) = On\nOn 5\nFend\n"
    )
    machine = client.simulator.machine
    x_mm = machine.tip().x_mm
    client.ask("$Start,0")
    client.wait(0.3)
    client.ask("$Pause")
    client.wait(0.05)
    client.simulator.panel.switch_input(3, True)
    client.wait(5)
    assert not machine.arm.moving
    assert 1 < x_mm - machine.tip().x_mm < 39
    assert machine.till_met
    assert not machine.outputs.get(5)


def test_with_qp_off_continue_before_the_end_changes_nothing(loaded):
    client = loaded(PAST.format("Off"))
    machine = client.simulator.machine
    client.ask("$Start,0")
    client.wait(0.3)
    client.ask("$Pause")
    client.wait(0.05)
    end_ns = machine.arm.next_change()
    client.ask("$Continue")
    client.wait(0.05)
    assert (machine.arm.next_change(), machine.arm.moves_started) == (end_ns, 1)
    client.wait(10)
    assert machine.outputs.get(5)
    assert machine.arm.moves_started == 2


def test_with_qp_off_an_open_door_stops_it_at_once(loaded):
    client = loaded(PAST.format("Off"))
    client.ask("$Start,0")
    client.wait(0.3)
    client.simulator.panel.open_guard()
    client.wait(0.01)
    assert not client.simulator.machine.arm.moving
    stood = client.simulator.machine.arm.joints
    client.wait(5)
    assert client.simulator.machine.arm.joints == stood
    assert not client.simulator.machine.outputs.get(5)
