"""Every command but Execute: preconditions, effects, codes."""

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator, Mode

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
