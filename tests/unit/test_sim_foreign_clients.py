"""Third-party clients: their requests, and the answers of real controllers."""

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.options import options_from_text

from robolink.model import Secret
from robolink.protocols import Role
from robolink.protocols.epson_binary import EpsonBinaryCodec
from robolink.protocols.epson_text import (
    EpsonTextCodec,
    Preference,
    Refusal,
    Reply,
    Request,
    parse_preferences,
)
from tests._rows import each_row

# Requests of third-party clients, and the answers of real controllers.
# The requests are those of public clients and transcripts (docs/reference/epson.md 1.10, 5).

READY = "00100000001"


@pytest.fixture
def simulator():
    return EpsonSimulator()


@pytest.fixture
def client(simulator, login):
    return login(simulator)


def test_a_client_that_sends_no_line_end_at_all(simulator, connect):
    """The transcript of an RC700-A: the literal word is in the place of a line end."""
    client = connect(simulator)

    def said(request):
        client.link.receive(request.encode(), simulator.now_ns)
        return client.wait(0.2)

    assert said("$Login,,terminator") == "#Login,0"
    simulator.panel.start_production()
    assert said("$GetStatus,,terminator") == "#GetStatus,00100000010,0000"
    assert said("$GetStatus,1,terminator") == "#GetStatus,00100000010,0000"
    assert said("$Reset,,terminator") == "!Reset,20"
    assert said("$SetMotorsOn,1,terminator") == "!SetMotorsOn,20"
    assert said("$SetMotorsOff,1,terminator") == "!SetMotorsOff,20"
    assert said("$GetVariable,VERSION$,String") == "#GetVariable,SIMULATED"
    assert said("$Pause,,terminator") == "#Pause,0"
    assert said("$Stop,,terminator") == "#Stop,0"
    assert said("$Logout,,terminator") == "#Logout,0"


def test_requests_without_a_line_end_are_told_apart_by_their_beginnings(simulator, connect):
    client = connect(simulator)
    client.link.receive(b'$Login,$GetStatus,$Execute,"Print "$", 1"$GetCurRobot', 0)
    said = client.wait(0.2).splitlines()
    assert said[0] == "#Login,0"
    assert said[1] == f"#GetStatus,{READY},0000"
    assert said[-1] == "#GetCurRobot,1"


def test_a_line_end_that_comes_late_belongs_to_the_request_before_it(simulator, connect):
    client = connect(simulator)
    client.link.receive(b"$Login,", 0)
    assert client.wait(0.2) == "#Login,0"
    client.link.receive(b"\r", simulator.now_ns)
    client.link.receive(b"\n$GetCurRobot\r\n", simulator.now_ns)
    assert client.heard() == "#GetCurRobot,1"


@pytest.mark.parametrize("end", ["\r", "\n", "\r\n"])
def test_every_line_end_is_taken_whatever_the_setup_says(connect, end):
    simulator = EpsonSimulator(options=EpsonOptions(terminator="cr"))
    client = connect(simulator)
    client.link.receive(f"$Login,{end}$GetCurRobot{end}".encode(), 0)
    assert client.link.outgoing() == b"#Login,0\r#GetCurRobot,1\r"


def test_letters_in_place_of_a_line_end_do_not_upset_the_reading(simulator, client):
    client.link.receive(b"$GetStatus\\n", simulator.now_ns)
    assert client.wait(0.2).endswith(",11")
    assert client.flags() == READY


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("$Login,,CLRF", "#Login,0"),
        ("$GetStatus,CLRF", f"#GetStatus,{READY},0000"),
        ("$GetStatus,0", f"#GetStatus,{READY},0000"),
        ("$GetStatus,", f"#GetStatus,{READY},0000"),
        ("$GetCurRobot,CLRF", "#GetCurRobot,1"),
        ("$SetMotorsOn,1,CLRF", "#SetMotorsOn,0"),
        ("$SetMotorsOn, 1", "#SetMotorsOn,0"),
        ("$SetMotorsOFF,0", "#SetMotorsOFF,0"),
        ("$Reset,CLRF", "#Reset,0"),
        ("$Reset,0", "#Reset,0"),
        ("$Stop,0", "#Stop,0"),
        ("$Abort,CLRF", "#Abort,0"),
        ("$SetIO,11,1", "#SetIO,0"),
        ("$GetVariable,g_Long,Long,1", "#GetVariable,0"),
        ("$GetVariable, g_Long , Long", "#GetVariable,0"),
        ("$Logout,CLRF", "#Logout,0"),
    ],
)
def test_surplus_parameters_and_blanks_are_no_fault(client, request_, answer):
    assert client.ask(request_) == answer


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        ("$SetIO,11", 12),
        ("$SetIO,11,", 12),
        ("$SetIO,11,on", 12),
        ("$SetVariable,g_Long,1,Long,more", 12),
        ("$SetMotorsOn", 12),
        ("$SetMotorsOff,", 12),
        ("$Home", 12),
        ("$GetVariable,g_Long,String", 14),
        ("$GetVariable,VERSION$,Long", 14),
        ("$GetVariable,g_Long_table(0,0),String,1", 14),
    ],
)
def test_what_is_needed_and_missing_or_does_not_fit_is_refused(client, request_, code):
    name = request_[1:].partition(",")[0]
    assert client.ask(request_) == f"!{name},{code}"


@pytest.mark.parametrize(
    ("habit", "answer"), [("empty_password", "#Login,0"), ("error_12", "!Login,12")]
)
def test_a_bare_login(connect, habit, answer):
    options = EpsonOptions(login_without_parameter=habit)
    assert connect(EpsonSimulator(options=options)).ask("$Login") == answer


def test_a_bare_login_is_the_empty_password_where_one_is_set(connect):
    client = connect(EpsonSimulator(password=Secret("canary-123")))
    assert client.ask("$Login") == "!Login,13"
    assert client.ask("$Login,canary-123,CLRF") == "#Login,0"


@pytest.mark.parametrize("habit", ["current", "all"])
def test_a_robot_that_is_not_numbered_may_be_the_one_there_is(login, habit):
    simulator = EpsonSimulator(options=EpsonOptions(missing_robot_number=habit))
    client = login(simulator)
    assert client.ask("$SetMotorsOff") == "#SetMotorsOff,0"
    assert not simulator.machine.motors_on
    assert client.ask("$SetMotorsOn,") == "#SetMotorsOn,0"
    assert simulator.machine.motors_on


@pytest.mark.parametrize(
    ("habit", "answer"), [("keeps", "#SetCurRobot,0"), ("error_12", "!SetCurRobot,12")]
)
def test_robot_0(login, habit, answer):
    client = login(EpsonSimulator(options=EpsonOptions(robot_zero=habit)))
    assert client.ask("$SetCurRobot,0") == answer
    assert client.ask("$GetCurRobot") == "#GetCurRobot,1"


def test_the_preferences_are_one_field_of_which_the_last_digit_is_bit_0(login):
    options = EpsonOptions(dry_run=True, outputs_off_at_estop=False)
    _, field = login(EpsonSimulator(options=options)).ask("$GetContSettings").split(",")
    assert len(field) == 23
    assert set(field) <= {"0", "1"}
    assert field[::-1][Preference.DRY_RUN] == "1"
    assert field[::-1][Preference.VIRTUAL_IO] == "0"
    assert field[::-1][Preference.OUTPUTS_OFF_AT_ESTOP] == "0"
    assert field[::-1][Preference.RESET_OUTPUTS_OFF] == "1"
    assert field[::-1][Preference.INDEPENDENT_MODE] == "1"  # inverted, and off
    assert parse_preferences(field) == {
        Preference.DRY_RUN,
        Preference.RESET_OUTPUTS_OFF,
        Preference.ADVANCED_TASK_COMMANDS,
        Preference.GLOBALS_CLEARED_AT_START,
    }


def test_an_emergency_stop_switches_outputs_off_where_it_is_set_so(login):
    for off in (True, False):
        simulator = EpsonSimulator(options=EpsonOptions(outputs_off_at_estop=off))
        login(simulator).ask("$SetIO,3,1")
        simulator.panel.press_estop()
        assert simulator.machine.outputs.get(3) is not off


def test_the_queries_of_the_makers_own_client(simulator, client):
    version = client.ask("$GetContVer").split(",")[1]
    assert ". " in version
    assert client.ask("$GetContDev") == "#GetContDev,26"
    assert client.ask("$GetCameraModel") == "#GetCameraModel,0"
    assert client.ask("$GetForceSerial") == "#GetForceSerial,0"
    assert client.ask("$GetPartWarning,1") == "#GetPartWarning,0,0,0,0,0,0"
    assert client.ask("$GetHealthCont") == "#GetHealthCont,-1"
    assert client.ask("$GetErrMsg,19,6").startswith("#GetErrMsg,")
    assert client.ask("$GetHofs,1").count(",") == 6
    simulator.panel.set_monitoring_only(True)
    assert client.ask("$GetContDev") != "#GetContDev,26"


def test_maintenance_data_are_told_where_they_are_kept(login):
    client = login(EpsonSimulator(options=EpsonOptions(maintenance_data=True)))
    assert client.ask("$GetHealthCont").count(",") == 3
    assert client.ask("$GetHealthRB,1,4,1").count(",") == 3


def test_where_a_program_failed_is_told_and_an_error_without_one_is_not(simulator, client):
    simulator.panel.raise_error(4005)
    assert client.ask("$GetErrFunc,4005") == "#GetErrFunc,0"
    client.ask("$Reset")
    client.ask("$Start,0")
    simulator.panel.raise_error(4002)
    name, *rest = client.ask("$GetErrFunc,4002").removeprefix("#GetErrFunc,").split(",")
    assert (len(name), name.strip(), rest[:3]) == (64, "main", ["1", "1", "1"])
    assert client.ask("$GetErrFunc,4005") == "#GetErrFunc,0"


def test_a_failed_statement_may_leave_no_error_behind(login):
    client = login(EpsonSimulator(options=EpsonOptions(error_state_after_failed_execute=False)))
    assert client.ask('$Execute,"Tool 9"') == "!Execute,99"
    assert client.flags() == READY
    assert client.ask('$Execute,"Tool 1"') == "#Execute,0"


@pytest.mark.parametrize(("habit", "text"), [(False, "1"), (True, " 1")])
def test_a_printed_number_may_begin_with_a_blank(login, habit, text):
    client = login(EpsonSimulator(options=EpsonOptions(number_lead_blank=habit)))
    assert client.ask('$Execute,"Print Tool, 2"') == f'#Execute,"{text} 2\r\n"'
    assert client.ask('$Execute,"Print Here"').startswith('#Execute," X:')


CLEARED = {
    "selects_zero": (0, "#Execute,0"),
    "keeps": (1, "#Execute,0"),
    "error": (1, "!Execute,99"),
}


@pytest.mark.parametrize("habit", CLEARED)
def test_what_clearing_the_tool_in_force_does(login, tmp_path, habit):
    selected, answer = CLEARED[habit]
    state = tmp_path / "flash.json"
    options = EpsonOptions(clear_selected_tool=habit)
    simulator = EpsonSimulator(options=options, state_path=state)
    client = login(simulator)
    assert client.ask('$Execute,"TLClr 1"') == answer
    assert simulator.machine.tools.selected == selected
    assert (simulator.machine.tools.get(1) is None) is (habit != "error")
    if habit != "error":
        reborn = EpsonSimulator(options=options, state_path=state)
        assert reborn.machine.tools.selected == selected
        assert reborn.machine.offset is None


# Requests as third-party clients send them: a blank first, a letter of no manual.

NS = 1_000_000_000


class Line:
    """A line to a simulated controller whose time the test steps."""

    def __init__(self, *, serial=False, **options):
        self.simulator = EpsonSimulator(options=options_from_text(options))
        connect = self.simulator.connect_serial if serial else self.simulator.connect
        self.link, self.now_ns = connect(0), 0

    def say(self, data):
        """Send bytes; return those received within a fifth of a second."""
        self.link.receive(data, self.now_ns)
        self.now_ns += NS // 5
        self.simulator.advance(self.now_ns)
        return self.link.outgoing()


def frame(letter, data=b""):
    body = letter + data + b"\x03"
    checksum = 0
    for byte in body:
        checksum ^= byte
    return b"\x02" + body + bytes([checksum])


@each_row("blanks", [b" ", b"\t", b"   "])
def test_a_blank_before_the_dollar_sign_is_one_refusal_or_is_skipped(blanks):
    line = Line()
    assert line.say(b"$Login\r\n") == b"#Login,0\r\n"
    answer = line.say(blanks + b"$GetStatus\r\n")
    assert answer.count(b"\r\n") == 1
    assert answer.startswith(b"!")
    assert answer.endswith(b",10\r\n")
    line = Line(blank_before_dollar="skipped")
    line.say(b"$Login\r\n")
    assert line.say(blanks + b"$GetStatus\r\n").startswith(b"#GetStatus,")


def test_requests_without_line_ends_are_still_told_apart():
    device = EpsonTextCodec(Role.DEVICE, unterminated=True)
    device.receive_data(b"$GetStatus$Stop\r\n")
    events = [device.next_event() for _ in range(2)]
    assert events == [Request("GetStatus"), Request("Stop")]


@each_row("letter", [b"D", b"z", b"?", b"\xe9"])
def test_a_letter_of_no_manual_is_refused_with_that_letter(letter):
    line = Line(serial=True)
    line.say(b"\x04")
    line.say(frame(b"L"))
    answer = line.say(frame(letter))
    assert answer[:2] == b"\x15" + letter
    host = EpsonBinaryCodec(Role.HOST)
    host.receive_data(answer)
    assert host.next_event() == Refusal("", 11)
    assert not line.link.closed


@each_row(
    ("options", "flags"),
    [({}, 11), ({"rc_plus": "5"}, 10), ({"rc_plus": "5", "status_flags": "11"}, 11)],
)
def test_rc_plus_5_has_ten_flags_unless_it_is_said_otherwise(options, flags):
    line = Line(**options)
    line.say(b"$Login\r\n")
    host = EpsonTextCodec(Role.HOST)
    host.receive_data(line.say(b"$GetStatus\r\n"))
    reply = host.next_event()
    assert isinstance(reply, Reply)
    assert len(reply.fields[0]) == flags
