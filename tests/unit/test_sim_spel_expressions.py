"""Expressions, Print and Wait."""

import math
import os
import random
import socket
import subprocess
import sys
from urllib.parse import urlsplit

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions, SpelNumbers
from robolink_simulators.epson.spel import Interpreter
from robolink_simulators.epson.spel.parser import parse
from robolink_simulators.hosting.streams.epson import serve_tcp

from tests._rows import each_row

# Expressions and Print.

NUMBERS = SpelNumbers()


def interpreter(**habits):
    machine = Machine(find_robot("T6-602S"))
    return Interpreter(machine, EpsonOptions(**habits), random.Random(1))


def printed(expression, **habits):
    execution = interpreter(**habits).start(f"Print {expression}", 0)
    assert execution.error is None
    assert execution.done
    return execution.output.removesuffix("\r\n")


def refused(statement, **habits):
    execution = interpreter(**habits).start(statement, 0)
    assert execution.done
    assert execution.output == ""
    return execution.error.number


@each_row(
    ("expression", "expected"),
    [
        ("-2**2", "-4"),
        ("2**3**2", "64"),
        ("2**-1", "0.5"),
        ("6/4", "1.5"),
        ("8/4/2", "1"),
        ("10 - 4 - 3", "3"),
        ("-7 Mod 3", "-1"),
        ("7.9 Mod 4", "3"),
        ("Not 1 = 2", "-1"),
        ("1 = 1 And 2 = 2", "-1"),
        ("1 < 2 Xor 2 > 1", "0"),
        ("True = 3", "-1"),
        ("True + 1", "0"),
        ("True And 6", "6"),
        ('"a" = "A"', "0"),
        ('"a" <> "A"', "-1"),
        ("(1 + 2) * 3", "9"),
        ("+5, - -5", "5 5"),
        ("&O17, .5, 1E3", "15 0.5 1000"),
        ("Low + High + Off + On", "2"),
    ],
)
def test_operators_follow_the_precedence_of_the_reference(expression, expected):
    assert printed(expression) == expected


@each_row(
    ("expression", "expected"),
    [
        ("Abs(-3.54), Sgn(-2), Sqr(2)", "3.54 -1 1.4142135623731"),
        ("Sin(0), Cos(0), Tan(0)", "0 1 0"),
        ("Tan(45)", "1.6197751905439"),
        ("Asin(1), Acos(1), Atan(0)", "1.5707963267949 0 0"),
        ("RadToDeg(DegToRad(30))", "30"),
        ('Len("abc"), Len("")', "3 0"),
        ('Left$("abcd", 2) + Right$("abcd", 1)', "abd"),
        ('Right$("ab", 5), Right$("ab", 0)', "ab"),
        ('Mid$("abcdef", 4)', "def"),
        ('InStr("abcb", "b")', "2"),
        ('Val(" -2.50 mm"), Val("x")', "-2.5 0"),
        ("Hex$(-1)", "FFFFFFFF"),
        ("Int(2.9), Fix(2.9)", "2 2"),
        ("Str$(25.999)", "25.999"),
        ('FmtStr$(10, "000.00")', "010.00"),
        ('FmtStr$(-1234567.891, "#,##0.##")', "-1,234,567.89"),
        ('FmtStr$(0.5, "#.##")', ".5"),
        ('FmtStr$(2.345, "0.0#")', "2.35"),
    ],
)
def test_functions_give_what_the_reference_says(expression, expected):
    assert printed(expression) == expected


@each_row(
    ("expression", "expected"),
    [
        ("0.1 + 0.2", "0.3"),
        ("100.0", "100"),
        ("-0.0", "0"),
        ("0.000012", "1.200000E-005"),
        ("123456789012345678", "1.234568E+017"),
        ("2147483647", "2147483647"),
    ],
)
def test_numbers_print_without_trailing_zeros_and_with_three_exponent_digits(expression, expected):
    assert printed(expression) == expected


def test_a_comma_puts_a_blank_before_numbers_only():
    assert printed('"B = ", 25, "C = ", -10') == "B =  25C =  -10"
    assert printed('"B = ", 25, "C = ", -10', comma_blank="always") == "B =  25 C =  -10"


def test_true_prints_as_the_option_says():
    assert printed("1 = 1") == "-1"
    assert printed("1 = 1", true_value=1) == "1"
    assert printed("1 = 2", true_value=1) == "0"


def test_a_trailing_comma_leaves_the_line_open():
    execution = interpreter().start('Print "a",; Print "b"; Print', 0)
    assert execution.output == "ab\r\n\r\n"


def test_a_question_mark_prints():
    assert interpreter().start('? len("ABC")', 0).output == "3\r\n"


def test_keywords_are_read_in_any_case_and_comments_are_skipped():
    assert interpreter().start("pRINT hEX$(&hff) ' Print 2", 0).output == "FF\r\n"


@each_row(
    ("expression", "number"),
    [
        ("1 / 0", NUMBERS.division),
        ("1 Mod 0", NUMBERS.division),
        ("Sqr(-1)", NUMBERS.square_root),
        ("Acos(2)", NUMBERS.arc_cosine),
        ("10 ** 400", NUMBERS.value_out_of_range),
        ("1E400", NUMBERS.overflow),
        ("1E300 * 1E300", NUMBERS.overflow),
        ("Int(1E300)", NUMBERS.overflow),
        ("(-8) ** .5", NUMBERS.value_out_of_range),
        ("Chr$(0)", NUMBERS.value_out_of_range),
        ('Mid$("a", 0)', NUMBERS.value_out_of_range),
        ('Left$("a", -1)', NUMBERS.value_out_of_range),
        ('FmtStr$(1, "yyyy")', NUMBERS.format),
        (f'"{"x" * 200}" + "{"x" * 200}"', NUMBERS.text_length),
        (f'"{"x" * 200}", "{"x" * 200}"', NUMBERS.value_out_of_range),
        ('1 + "a"', NUMBERS.type_mismatch),
        ('"a" < "b"', NUMBERS.type_mismatch),
        ("Abs(P1)", NUMBERS.point_undefined),
        ("Abs(Here)", NUMBERS.type_mismatch),
        ("CX(1)", NUMBERS.type_mismatch),
        ("nothing", NUMBERS.name_undefined),
        ("Abs(1, 2)", NUMBERS.syntax),
        ("XY(1, 2)", NUMBERS.syntax),
        ("1 +", NUMBERS.syntax),
        ("1 2", NUMBERS.syntax),
    ],
)
def test_a_value_that_cannot_be_had_is_an_error(expression, number):
    assert refused(f"Print {expression}") == number


@each_row("statement", ["If 1 = 1 Then On 1", "VRun seq", "Pause", "On 1; For i = 1 To 2"])
def test_statements_for_programs_only_are_refused_before_anything_runs(statement):  # 40
    runner = interpreter()
    execution = runner.start(statement, 0)
    assert execution.error.number == NUMBERS.not_allowed_here
    assert runner.start("Print Oport(1)", 0).output == "0\r\n"


def test_a_keyword_inside_a_string_is_no_statement():
    assert refused('Print "; If x" Then') == NUMBERS.syntax


def test_a_literal_that_is_still_open_at_the_end_ends_there():
    assert printed('"open') == "open"


def test_a_variable_that_no_project_declares_is_named_as_that():
    assert refused("a = 1; b = 2") == NUMBERS.name_undefined


def test_error_numbers_come_from_the_options():
    assert refused("Print 1 +", numbers=SpelNumbers(syntax=1234)) == 1234


@each_row("text", ["Print " + "(" * 2000 + "1" + ")" * 2000, "", " ", ";;", "'"])
def test_odd_but_legal_lines_are_carried_out(text):
    execution = interpreter().start(text, 0)
    assert execution.done
    assert execution.error is None


def test_an_expression_nested_beyond_reason_is_a_syntax_error():
    assert refused("Print " + "-" * 4000 + "1") == NUMBERS.syntax


WORDS = """
    Print ? P1 P( ) , ; + - * / ** Mod Not And = <> "a" " 1 .5 &HF XY( Here TLSet Tool Go Move Jump
    /R /1 @2 +X(1) :Z(2) CX( True On Off Wait LimZ Local PList 1E308 Str$( Chr$(
"""


@settings(max_examples=100, deadline=None)
@given(st.lists(st.sampled_from(WORDS.split()), max_size=12).map(" ".join) | st.text(max_size=40))
def test_whatever_is_sent_ends_in_an_answer(text):
    execution = interpreter().start(text, 0)
    if not execution.done:
        execution.advance(execution.next_change() + 10**20)
    assert execution.done


def test_importing_the_language_builds_no_parser():
    script = (
        "import sys; import robolink_simulators.epson.spel; "
        "from robolink_simulators.epson.spel import parser; "
        "print(parser._parser.cache_info().misses)"
    )
    paths = os.pathsep.join(filter(None, sys.path))
    ran = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=True,
    )
    assert ran.stdout.strip() == "0"


def test_a_line_that_was_parsed_is_not_parsed_again():
    assert parse("Print 123456") is parse("Print 123456")


def test_a_place_is_not_kept_once_it_was_gone_to():
    assert parse("Go XY(1.5, 2.5, 3.5, 4.5)") is not parse("Go XY(1.5, 2.5, 3.5, 4.5)")


# Wait for a condition, times after which bits switch back, and the input of Sense.

NS_PER_S = 1_000_000_000


@pytest.fixture
def simulator():
    return EpsonSimulator(options=EpsonOptions(remote_timeout_s=0))


@pytest.fixture
def client(simulator, login):
    return login(simulator)


def begin(client, statement):
    """Send a statement that does not end at once."""
    assert client.ask(f'$Execute,"{statement}"') == ""


@pytest.mark.parametrize(
    "condition", ["Sw(1) = On", "Sw(1)", "Sw(1) <> 0", "In(0) Mask 2 = 2", "Sw(1) Or Sw(2)"]
)
def test_a_wait_for_an_input_ends_when_it_is_switched_and_not_before(simulator, client, condition):
    begin(client, f"Wait {condition}; Print TW")
    assert client.wait(3600) == ""
    simulator.panel.switch_input(1, True)
    assert client.wait(0.001) == '#Execute,"0\r\n"'


def test_a_wait_for_a_condition_is_no_time_in_seconds(client):
    """Evaluated as a number, ``Sw(1) = On`` is 0 and ``Sw(1) = Off`` is one second."""
    begin(client, "Wait Sw(1) = On")
    assert client.wait(10) == ""
    client.ask("$Abort")
    assert client.ask('$Execute,"Wait Sw(1) = Off"') == "#Execute,0"


def test_a_wait_with_a_time_ends_with_it_and_tw_tells(simulator, client):
    began_ns = simulator.now_ns
    begin(client, "Wait Sw(1) = On, 5; Print TW")
    assert client.wait(4.999) == ""
    assert client.wait(0.001) == '#Execute,"-1\r\n"'
    assert simulator.now_ns - began_ns == 5 * NS_PER_S
    begin(client, "Wait Sw(1) = On, 5; Print TW")
    client.wait(1)
    simulator.panel.switch_input(1, True)
    assert client.wait(0.001) == '#Execute,"0\r\n"'


def test_tmout_limits_a_wait_without_a_time_and_is_error_2280(simulator, client):
    assert client.ask('$Execute,"TMOut 2"') == "#Execute,0"
    begin(client, "Wait MemSw(9) = On")
    assert client.wait(1.999) == ""
    assert client.wait(0.001) == "!Execute,99"
    assert client.code() == 2280
    client.ask("$Reset")
    begin(client, "Wait MemSw(9) = On, 3")
    assert client.wait(3) == "#Execute,0"


def test_a_restart_forgets_tmout_and_stored_conditions(simulator, client, login):
    client.ask('$Execute,"TMOut 2; Till Sw(5) = On"')
    simulator.restart()
    again = login(simulator)
    assert again.ask('$Execute,"TMOut"') == '#Execute,"0\r\n"'
    assert again.ask('$Execute,"Till"') == '#Execute,"Sw(0) = On\r\n"'


def test_a_wait_on_a_socket_ends_when_the_input_is_switched():
    simulator = EpsonSimulator()
    with serve_tcp(simulator) as host:
        address = urlsplit(host.url)
        with socket.create_connection((address.hostname, address.port), timeout=5) as client:
            client.sendall(b'$Login,\r\n$Execute,"Wait Sw(1) = On"\r\n')
            assert client.recv(100) == b"#Login,0\r\n"
            client.settimeout(0.05)
            with pytest.raises(TimeoutError):
                client.recv(100)
            client.settimeout(5)
            simulator.panel.switch_input(1, True)
            assert client.recv(100) == b"#Execute,0\r\n"


def test_memory_that_the_host_sets_meanwhile_ends_a_wait(client):
    begin(client, "Wait MemSw(7) = On")
    assert client.wait(60) == ""
    client.send("$SetMemIO,7,1")
    assert "#Execute,0" in client.wait(0.01)


def test_an_aborted_wait_leaves_no_error(client):
    begin(client, "Wait Sw(1) = On")
    assert client.flags() == "00100000010"
    assert "!Execute,99" in client.ask("$Abort")
    assert client.flags() == "00100000001"


def test_an_emergency_stop_ends_a_wait(simulator, client):
    begin(client, "Wait Sw(1) = On")
    simulator.panel.press_estop()
    assert client.heard() == "!Execute,99"
    assert client.code() == 4025


def test_an_output_that_is_on_for_a_time_switches_back(simulator, client):
    begin(client, "On 11, 0.5; Print Oport(11)")
    assert simulator.machine.outputs.get(11)
    assert client.wait(0.499) == ""
    assert client.wait(0.001) == '#Execute,"0\r\n"'
    assert client.ask('$Execute,"On 12, 0.5, 0; Print Oport(12)"') == '#Execute,"1\r\n"'
    client.wait(0.499)
    assert simulator.machine.outputs.get(12)
    client.wait(0.001)
    assert not simulator.machine.outputs.get(12)


def test_a_timed_off_of_what_is_off_switches_on(simulator, client):
    assert client.ask('$Execute,"Off 3, 0.2, 0"') == "#Execute,0"
    client.wait(0.2)
    assert simulator.machine.outputs.get(3)


def test_a_wait_sees_an_output_switch_back(simulator, client):
    client.ask('$Execute,"On 12, 0.5, 0"')
    began_ns = simulator.now_ns
    begin(client, "Wait Oport(12) = Off")
    assert client.wait(0.6) == "#Execute,0"
    assert simulator.now_ns >= began_ns
    assert not simulator.machine.outputs.get(12)


def test_a_reset_forgets_what_was_to_switch_on(simulator, client):
    client.ask('$Execute,"Off 3, 5, 0"')
    client.ask("$Reset")
    client.wait(10)
    assert not simulator.machine.outputs.get(3)


def test_sense_is_looked_at_once_before_the_descent(simulator, client):
    machine = simulator.machine
    client.ask('$Execute,"P1 = Here -X(20); Sense Sw(3) = On"')
    begin(client, "Jump P1 Sense; Print JS")
    highest_mm = machine.tip().z_mm
    while machine.tip().z_mm >= highest_mm:
        highest_mm = machine.tip().z_mm
        assert client.wait(0.005) == ""
    simulator.panel.switch_input(3, True)  # too late: the descent has begun
    assert client.wait(60) == '#Execute,"0\r\n"'
    low_mm = machine.tip().z_mm
    begin(client, "Jump P1 +X(5) Sense; Print JS")
    assert client.wait(60) == '#Execute,"-1\r\n"'
    assert machine.tip().z_mm > low_mm + 10


def test_an_arc_runs_on_the_circle_through_its_points(simulator, client):
    client.ask('$Execute,"P1 = Here -X(10) -Y(10); P2 = Here -X(20)"')
    start = simulator.machine.tip()
    centre = (start.x_mm - 10, start.y_mm)
    begin(client, "Arc P1, P2")
    lowest = start.y_mm
    while not client.wait(0.02):
        tip = simulator.machine.tip()
        assert math.dist(centre, (tip.x_mm, tip.y_mm)) == pytest.approx(10, abs=1e-6)
        lowest = min(lowest, tip.y_mm)
    assert lowest == pytest.approx(start.y_mm - 10, abs=0.1)
    assert simulator.machine.tip().x_mm == pytest.approx(start.x_mm - 20)


def test_places_of_a_pallet_run_along_the_first_side(client):
    client.ask('$Execute,"P0 = XY(0,400,-100,0); P1 = XY(20,400,-100,0); P2 = XY(0,410,-100,0)"')
    client.ask('$Execute,"Pallet 1, P0, P1, P2, 3, 2"')
    for place, x, y in (("1", 0, 400), ("2", 10, 400), ("4", 0, 410), ("3, 2", 20, 410)):
        said = client.ask(f'$Execute,"Print CX(Pallet(1, {place})), CY(Pallet(1, {place}))"')
        assert said == f'#Execute,"{x} {y}\r\n"'
    client.ask('$Execute,"P3 = XY(24,414,-100,0); Pallet 2, P0, P1, P2, P3, 3, 3"')
    assert client.ask('$Execute,"Print CX(Pallet(2, 2, 2))"') == '#Execute,"11\r\n"'
    assert client.ask('$Execute,"Print CX(Pallet(1, 7))"') == "!Execute,99"


def test_home_goes_where_homeset_says_over_the_wire_too(simulator, client):
    assert client.ask("$Home,1") == "!Home,99"
    assert client.code() == 2228
    client.ask("$Reset")
    client.ask('$Execute,"HomeSet 102400, 136533, -300000, -100000"')
    assert client.ask("$Home,1") == ""
    assert client.wait(60) == "#Home,0"
    assert client.ask('$Execute,"Print AtHome"') == '#Execute,"-1\r\n"'


def test_speed_factor_makes_a_motion_slower(simulator, client):
    def duration_ns(statement):
        began_ns = simulator.now_ns
        begin(client, statement)
        while not client.wait(0.001):
            pass
        return simulator.now_ns - began_ns

    plain = duration_ns("Move Here -X(10)")
    client.ask('$Execute,"SpeedFactor 25"')
    assert duration_ns("Move Here +X(10)") > 1.9 * plain
