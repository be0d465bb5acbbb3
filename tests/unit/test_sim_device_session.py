"""Sessions with a simulated EPSON controller: its login, its variables, its options."""

from dataclasses import fields

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.options import option_names, options_from_text

from robolink.errors import ConfigError
from robolink.model import Secret
from robolink.protocols.epson_text import VariableType
from tests._rows import each_row

# The login and its duration, and the log's part of it.

CANARY = "k4nar1e"


def options(**habits):
    return EpsonSimulator(options=EpsonOptions(**habits))


def test_nothing_but_a_login_is_served_before_the_login(connect):
    client = connect(EpsonSimulator())
    assert client.ask("$GetStatus") == "!GetStatus,11"
    assert client.ask("$Login,") == "#Login,0"
    assert client.ask("$GetStatus") == "#GetStatus,00100000001,0000"


def test_a_reply_echoes_the_name_in_the_case_of_the_client(login):
    client = login(EpsonSimulator())
    assert client.ask("$getSTATUS").startswith("#getSTATUS,")
    assert client.ask('$EXECUTE,"Tool 9"') == "!EXECUTE,99"


@pytest.mark.parametrize("given", ["wrong", "", CANARY.upper()])
def test_a_wrong_password_is_13_and_the_right_one_still_opens(connect, given):
    client = connect(EpsonSimulator(password=Secret(CANARY)))
    assert client.ask(f"$Login,{given}") == "!Login,13"
    assert client.ask("$GetStatus") == "!GetStatus,11"
    assert client.ask(f"$Login,{CANARY}") == "#Login,0"


def test_surplus_parameters_of_a_login_are_ignored(connect):
    assert connect(EpsonSimulator()).ask("$Login,,terminator") == "#Login,0"


def test_a_request_may_end_with_silence(connect):
    client = connect(EpsonSimulator())
    client.link.receive(b"$Login,,terminator", 0)
    assert client.wait(0.09) == ""
    assert client.wait(0.02) == "#Login,0"


def test_a_request_may_have_to_end_with_a_line(connect):
    client = connect(options(requests_end_with_silence=False))
    client.link.receive(b"$Login,", 0)
    assert client.wait(5) == ""
    client.link.receive(b"\r", client.simulator.now_ns)
    assert client.heard() == "#Login,0"


def test_no_password_reaches_the_log_or_a_hook(connect):
    simulator = EpsonSimulator(password=Secret(CANARY))
    heard = []
    simulator.on_request = lambda number, text: heard.append(text)
    client = connect(simulator)
    client.ask(f"$Login,{CANARY}")
    client.ask(f"Login,{CANARY}")
    client.ask(f"$Login {CANARY}")
    assert CANARY not in repr(list(simulator.log)) + repr(heard)
    assert "$Login,***" in heard


def test_a_second_client_is_not_heard_while_one_is_logged_in(connect, login):
    simulator = EpsonSimulator()
    first, second = login(simulator), connect(simulator)
    assert second.ask("$Login,") == ""
    assert not second.link.closed
    assert first.ask("$Logout") == "#Logout,0"
    assert second.ask("$Login,") == "#Login,0"


def test_a_second_client_may_be_cut_off_instead(connect, login):
    simulator = options(second_client="closed")
    first = login(simulator)
    assert connect(simulator).link.closed
    assert first.flags() == "00100000001"


def test_a_client_that_vanishes_leaves_its_place(login):
    simulator = EpsonSimulator()
    login(simulator).link.receive(b"", 0)
    assert login(simulator).flags() == "00100000001"


def test_who_does_not_log_in_is_cut_off_after_five_minutes(connect):
    client = connect(EpsonSimulator())
    client.wait(299)
    assert not client.link.closed
    client.wait(1)
    assert client.link.closed


def test_a_silent_client_is_cut_off_with_error_19(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    client.wait(59)
    assert client.flags() == "00100000001"
    client.wait(59)
    assert not client.link.closed
    client.wait(1)
    assert client.link.closed
    assert simulator.condition.code == 19
    assert simulator.status_flags().error


def test_a_remote_timeout_of_zero_waits_for_ever(login):
    client = login(options(remote_timeout_s=0))
    client.wait(1e6)
    assert client.flags() == "00100000001"


def test_a_logout_while_a_task_runs_raises_an_error_that_ends_it(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    client.ask("$Start,0")
    assert client.ask("$Logout") == "#Logout,0"
    flags = simulator.status_flags()
    assert flags.error
    assert not flags.running


def test_a_logout_while_a_task_runs_may_be_refused_as_well(login):
    client = login(options(logout_while_running="refused"))
    client.ask("$Start,0")
    assert client.ask("$Logout") == "!Logout,20"
    assert client.flags() == "00100001001"


@pytest.mark.fault("F23")
def test_what_runs_without_its_client_ends_with_the_remote_timeout(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    client.ask("$Start,0")
    client.link.receive(b"", simulator.now_ns)
    client.wait(59)
    assert simulator.status_flags().running
    client.wait(1)
    assert not simulator.status_flags().running
    assert simulator.condition.code == 19


def test_an_old_silence_is_forgotten_when_nothing_runs(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    client.link.receive(b"", simulator.now_ns)
    client.wait(100)
    simulator.panel.start_production()
    client.wait(1)
    assert simulator.status_flags().running


@pytest.mark.parametrize(("habit", "goes_on"), [("continues", True), ("stops", False)])
def test_a_motion_goes_on_or_not_when_its_client_vanishes(login, habit, goes_on):
    simulator = options(execute_on_disconnect=habit)
    client = login(simulator)
    client.send('$Execute,"Move Here +X(-50)"')
    client.wait(0.2)
    client.link.receive(b"", simulator.now_ns)
    at_mm = simulator.machine.arm.flange().x_mm
    client.wait(0.2)
    assert (simulator.machine.arm.flange().x_mm < at_mm) is goes_on


def test_the_next_client_may_abort_what_the_last_one_left(login):
    simulator = EpsonSimulator()
    first = login(simulator)
    first.send('$Execute,"Move Here +X(-50)"')
    first.link.receive(b"", 0)
    client = login(simulator)
    assert client.ask('$Execute,"Print 1"') == "!Execute,21"
    assert client.ask("$Abort") == "#Abort,0"
    assert client.ask('$Execute,"Print Tool"') == '#Execute,"1\r\n"'


def test_hooks_hear_each_request_and_its_answer(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    heard = []
    simulator.on_request = lambda number, text: heard.append(("request", number, text))
    simulator.on_reply = lambda number, text: heard.append(("reply", number, text))
    client.ask("$GetCurRobot")
    assert heard == [("request", 2, "$GetCurRobot"), ("reply", 2, "#GetCurRobot,1")]
    assert simulator.exchanges == 2


@pytest.mark.parametrize("hook", ["on_request", "on_reply"])
def test_an_interrupt_in_a_hook_stops_neither_the_act_nor_the_answer(login, hook):
    simulator = EpsonSimulator()
    client = login(simulator)

    def interrupt(number, text):
        raise KeyboardInterrupt

    setattr(simulator, hook, interrupt)
    with pytest.raises(KeyboardInterrupt):
        client.send('$Execute,"TLSet 4, XY(1,2,3,4)"')
    assert simulator.machine.tools.get(4) is not None
    assert client.heard() == "#Execute,0"


def test_a_line_without_end_cuts_the_link(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    client.link.receive(b"$" + b"x" * 70_000, 0)
    assert client.link.closed
    assert login(simulator).flags() == "00100000001"


def test_requests_in_pieces_and_in_one_piece_are_the_same(login):
    client = login(EpsonSimulator())
    for byte in b"$GetCurRobot\r\n":
        client.link.receive(bytes([byte]), 0)
    assert client.heard() == "#GetCurRobot,1"
    client.link.receive(b"$GetCurRobot\r\n$GetIO,0\r\n", 0)
    assert client.heard() == "#GetCurRobot,1\r\n#GetIO,0"


def test_bytes_nobody_asked_for_can_be_pushed(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    simulator.push(b"#GetStatus,00000000000,0000\r\n")
    assert client.heard() == "#GetStatus,00000000000,0000"


# Global Preserve variables over the wire.


@pytest.fixture
def simulator():
    return EpsonSimulator()


@pytest.fixture
def client(simulator, login):
    return login(simulator)


@pytest.mark.parametrize(
    ("kind", "written", "read"),
    [
        (VariableType.BOOLEAN, "True", "-1"),
        (VariableType.BYTE, "-128", "-128"),
        (VariableType.INTEGER, "32767", "32767"),
        (VariableType.LONG, "-2147483648", "-2147483648"),
        (VariableType.REAL, "1.23456789", "1.23457"),
        (VariableType.DOUBLE, "1.23456789", "1.23456789"),
    ],
)
def test_a_variable_keeps_what_its_type_can_hold(client, kind, written, read):
    assert client.ask(f"$SetVariable,g_{kind},{written},{kind}") == "#SetVariable,0"
    assert client.ask(f"$GetVariable,G_{kind}") == f"#GetVariable,{read}"
    assert client.ask(f"$GetVariable,g_{kind},{kind}") == f"#GetVariable,{read}"


@pytest.mark.parametrize(
    ("rest", "code"),
    [
        ("g_Byte,128", 12),
        ("g_Byte,1.5", 12),
        ("g_Boolean,maybe", 12),
        ("g_Real,nan", 12),
        ("g_Real,1e999", 12),
        ("g_Long,99999999999999999999", 12),
        ("g_Nothing,1", 15),
        ("g_Byte,1,Long", 14),
        ("g_Byte_table(16,0),1,Byte", 15),
        ("g_Byte_table,1,Byte", 15),
    ],
)
def test_a_value_that_does_not_fit_is_refused(client, rest, code):
    assert client.ask(f"$SetVariable,{rest}") == f"!SetVariable,{code}"


def test_elements_are_read_along_the_last_subscript(client):
    for j in range(3):
        client.ask(f"$SetVariable,g_Byte_table(3,{j}),{10 + j},Byte")
    assert client.ask("$GetVariable,g_Byte_table(3,0),Byte,3") == "#GetVariable,10,11,12"


@pytest.mark.parametrize(
    ("rest", "code"),
    [
        ("g_Byte_table(3,0)", 14),
        ("g_Byte_table(3,0),Byte", 14),
        ("g_Byte_table(3,0),Byte,0", 14),
        ("g_Byte_table(3,0),Byte,101", 14),
        ("g_Byte_table(3,0),Byte,x", 14),
        ("names$(0),String,1", 14),
        ("g_Byte_table(3,4),Byte,3", 15),
        ("g_Byte_table(3),Byte,1", 15),
        ("g_Byte,Long", 14),
        ("g_Nothing", 15),
        ("1bad", 15),
    ],
)
def test_a_query_that_fits_no_variable_is_refused(simulator, client, rest, code):
    simulator.variables.declare("names$", VariableType.STRING, 3)
    assert client.ask(f"$GetVariable,{rest}") == f"!GetVariable,{code}"


def test_a_text_keeps_its_blanks_and_its_255_characters(simulator, client):
    simulator.variables.declare("note$", VariableType.STRING)
    assert client.ask("$SetVariable,note$, a b ,String") == "#SetVariable,0"
    assert client.ask("$GetVariable,note$") == "#GetVariable, a b "
    assert client.ask("$SetVariable,note$," + "x" * 256) == "!SetVariable,12"


def test_an_array_is_declared_without_a_value(simulator):
    with pytest.raises(ConfigError, match="no single value"):
        simulator.variables.declare("table", VariableType.LONG, 3, value=1)


# Options of the simulator, written as text.


def test_nothing_given_is_the_defaults():
    assert options_from_text({}) == EpsonOptions()


@each_row("field", fields(EpsonOptions))
def test_every_option_can_be_written_as_text(field):
    if field.name == "numbers":
        assert options_from_text({"numbers.aborted": "77"}).numbers.aborted == 77
    else:
        text = str(field.default)
        assert field.name in option_names()
        assert options_from_text({field.name: text}) == EpsonOptions()


def test_values_take_the_type_of_their_option():
    options = options_from_text(
        {
            "terminator": "lf",
            "status_flags": "10",
            "monitoring_only": "yes",
            "remote_timeout_s": "2.5",
            "execute_failure_code": "20",
        }
    )
    assert (options.terminator, options.status_flags) == ("lf", 10)
    assert options.monitoring_only is True
    assert (options.remote_timeout_s, options.execute_failure_code) == (2.5, 20)


def test_an_unknown_option_lists_the_known_ones():
    with pytest.raises(ConfigError, match=r"no option 'colour'. Choose one of [0-9]+: terminator"):
        options_from_text({"colour": "red"})


@each_row(
    ("name", "text"),
    [
        ("terminator", "tab"),
        ("status_flags", "12"),
        ("monitoring_only", "perhaps"),
        ("remote_timeout_s", "soon"),
        ("remote_timeout_s", "nan"),
        ("remote_timeout_s", "-1"),
        ("execute_failure_code", "2.5"),
        ("numbers.aborted", "x"),
    ],
)
def test_a_value_that_does_not_fit_is_named(name, text):
    with pytest.raises(ConfigError, match=f"{name} cannot be '{text}'"):
        options_from_text({name: text})
