"""Expressions and Print."""

import os
import random
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions, SpelNumbers
from robolink_simulators.epson.spel import Interpreter
from robolink_simulators.epson.spel.parser import parse

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


@pytest.mark.parametrize(
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


@pytest.mark.parametrize(
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


@pytest.mark.parametrize(
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


@pytest.mark.parametrize(
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


@pytest.mark.parametrize(
    "statement", ["If 1 = 1 Then On 1", "VRun seq", "Pause", "On 1; For i = 1 To 2"]
)
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


@pytest.mark.parametrize("text", ["Print " + "(" * 2000 + "1" + ")" * 2000, "", " ", ";;", "'"])
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
    parse("Print 123456")
    before = parse.cache_info().hits
    parse("Print 123456")
    assert parse.cache_info().hits == before + 1
