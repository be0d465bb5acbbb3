"""Typed statements of SPEL+: text sent, refusals, shapes, and the page that lists them."""

import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.condition import SpelRefusal
from robolink_simulators.epson.spel.expressions.functions import PLAIN_FUNCTIONS
from robolink_simulators.epson.spel.expressions.machine_functions import (
    MACHINE_FUNCTIONS,
    OF_POINT_NUMBERS,
    POINT_FUNCTIONS,
)
from robolink_simulators.epson.spel.expressions.state_functions import STATE_FUNCTIONS
from robolink_simulators.epson.spel.parser import (
    UNSIMULATED,
    UNSIMULATED_FAMILIES,
    UNSIMULATED_FUNCTIONS,
    WINDOW_ONLY,
    _read,
    _shape,
    filler,
    marked,
    parse,
)
from robolink_simulators.epson.spel.programs.text_statements import FUNCTIONS_OF_ARRAYS
from robolink_simulators.epson.spel.tasks.task_functions import TASK_FUNCTIONS
from robolink_simulators.epson.spel.tree import Print

from robolink.errors import ConfigError, LocalProtocolError
from robolink.model import Hand, Pose, ToolOffset
from robolink.protocols import Role, spel
from robolink.protocols.epson_text import EpsonTextCodec, Request
from tests._rows import each_row

# Typed statements: the text sent, and refusals before it is sent.

TOOL = ToolOffset(12.0, -3.25, -0.0001, 45.0)
POSE = Pose(350.0, -100.0, -20.0004, 90.0)


@each_row(
    ("statement", "text"),
    [
        (spel.set_tool(1, TOOL, six_axes=False), "TLSet 1, XY(12.000, -3.250, 0.000, 45.000)"),
        (
            spel.set_tool(15, ToolOffset(1, 2, 3, 4, 5, 6), six_axes=True),
            "TLSet 15, XY(1.000, 2.000, 3.000, 4.000, 5.000, 6.000)",
        ),
        (spel.clear_tool(3), "TLClr 3"),
        (spel.select_tool(0), "Tool 0"),
        (spel.go(POSE, six_axes=False), "Go XY(350.000, -100.000, -20.000, 90.000) /0"),
        (
            spel.move(Pose(1, 2, 3, 4, hand=Hand.LEFT), six_axes=False),
            "Move XY(1.000, 2.000, 3.000, 4.000) /L /0",
        ),
        (
            spel.go(Pose(1, 2, 3, 4, 5, 6, hand=Hand.RIGHT), six_axes=True),
            "Go XY(1.000, 2.000, 3.000, 4.000, 5.000, 6.000) /R /0",
        ),
        (spel.power_low(), "Power Low"),
        (spel.power_high(), "Power High"),
        (spel.speed(5), "Speed 5"),
        (spel.speed(100, 1, 50), "Speed 100, 1, 50"),
        (spel.speed_s(20), "SpeedS 20.000"),
        (spel.speed_s(0.1, 2000, 50.5), "SpeedS 0.100, 2000.000, 50.500"),
        (spel.print_selected_tool(), "Print Tool"),
        (spel.print_tool_defined(1), "Print TLDef(1)"),
        (spel.print_tool(15), "Print TLSet(15)"),
        (spel.list_tools(), "TLSet"),
        (spel.print_real_position(), "Print RealPos"),
        (spel.print_here(), "Print Here"),
        (spel.print_robot(), "Print Robot"),
        (spel.print_robot_type(), "Print RobotType"),
        (spel.print_motor(), "Print Motor"),
        (spel.print_power(), "Print Power"),
        (spel.print_speed(1), "Print Speed(1)"),
        (spel.print_speed_s(3), "Print SpeedS(3)"),
        (spel.print_joint_angle(6), "Print Agl(6)"),
        (spel.where(), "Where"),
    ],
)
def test_a_statement_is_written_as_documented_and_fits_execute(statement, text):
    assert statement == text
    sent = EpsonTextCodec(Role.HOST).send(Request("Execute", (statement,)))
    assert sent == f'$Execute,"{text}"\r\n'.encode()


@each_row(
    "build",
    [
        lambda: spel.set_tool(0, TOOL, six_axes=False),
        lambda: spel.set_tool(16, TOOL, six_axes=False),
        lambda: spel.set_tool(True, TOOL, six_axes=False),
        lambda: spel.set_tool(1, ToolOffset(v_deg=0.001), six_axes=False),
        lambda: spel.set_tool(1, ToolOffset(w_deg=-90.0), six_axes=False),
        lambda: spel.clear_tool(0),
        lambda: spel.select_tool(-1),
        lambda: spel.select_tool(16),
        lambda: spel.go(Pose(1, 2, 3, 4, 5, 0), six_axes=False),
        lambda: spel.go(Pose(1, 2, 3, 4, local=1), six_axes=False),
        lambda: spel.move(Pose(1, 2, 3, 4, w_deg=180), six_axes=False),
        lambda: spel.move(Pose(1, 2, 3, 4, local=2), six_axes=True),
        lambda: spel.speed(0),
        lambda: spel.speed(101),
        lambda: spel.speed(5, 5),
        lambda: spel.speed(5, approach=5),
        lambda: spel.speed(5, 5, 0),
        lambda: spel.speed_s(0.05),
        lambda: spel.speed_s(2001),
        lambda: spel.speed_s(20, 20),
        lambda: spel.print_tool(0),
        lambda: spel.print_tool_defined(16),
        lambda: spel.print_speed(0),
        lambda: spel.print_speed_s(4),
        lambda: spel.print_joint_angle(7),
    ],
)
def test_what_the_controller_would_refuse_is_not_written(build: Callable[[], str]):
    with pytest.raises(LocalProtocolError) as caught:
        build()
    assert caught.value.remedy


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_not_finite_reaches_no_statement(value):
    for build in (
        lambda: spel.speed_s(value),
        lambda: spel.go(Pose(value, 0, 0, 0), six_axes=False),
        lambda: spel.move(Pose(0, 0, 0, 0, 0, value), six_axes=True),
    ):
        with pytest.raises(ConfigError):
            build()


def test_an_angle_that_rounds_to_nothing_is_no_tilt():
    tool = ToolOffset(1.0, v_deg=0.0004, w_deg=-0.0004)
    assert spel.set_tool(2, tool, six_axes=False) == "TLSet 2, XY(1.000, 0.000, 0.000, 0.000)"


NUMBERS = st.floats(-1e6, 1e6)


@settings(max_examples=80, deadline=None)
@given(st.builds(Pose, *[NUMBERS] * 6, hand=st.sampled_from([None, *Hand])))
@pytest.mark.fault("F72")
def test_no_pose_can_turn_into_another_statement(pose):
    text = spel.go(pose, six_axes=True)
    assert set(text) <= set("Go XY(0123456789.,-) /RL")
    assert text.count("(") == text.count(")") == 1


@pytest.mark.parametrize("query", [spel.print_output, spel.print_input])
def test_two_bytes_carry_the_number_of_a_bit(query):
    assert "65535" in query(65535)
    for bit in (-1, 65536):
        with pytest.raises(LocalProtocolError):
            query(bit)


# docs/reference/spel_statements.md is true: its rows are sent, and the answers compared.

PAGE = Path(__file__).parents[2] / "docs/reference/spel_statements.md"
_ROW = re.compile(r"^\| `(?P<statement>[^|]+)` \| (?P<who>[^|]+) \| (?P<answer>[^|]+) \|$")
_LONGEST_S = 120


def rows():
    tables = PAGE.read_text(encoding="utf-8").partition("\n## Sent by public clients\n")[2]
    answered = tables.partition("\n## Not carried out\n")[0]
    found = map(_ROW.match, answered.splitlines())
    return [(row["statement"], row["answer"]) for row in found if row]


def before():
    (block,) = re.findall(r"```\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    return block.strip().splitlines()


def answer(client, statement):
    """Send a statement and wait for its end; return its output, 0, or the error number."""
    said = client.ask(f'$Execute,"{statement}"')
    waited = 0
    while not said and waited < _LONGEST_S:
        said = client.wait(1.0)
        waited += 1
    if said == "#Execute,0":
        return "0"
    if said == "!Execute,99":
        return str(client.code())
    assert said.startswith('#Execute,"'), said
    return "`" + said.removeprefix('#Execute,"').removesuffix('"').removesuffix("\r\n") + "`"


BEFORE = before()


@each_row(("statement", "expected"), rows())
def test_a_statement_is_answered_as_the_page_says(login, statement, expected):
    client = login(EpsonSimulator(serial="SIM00001", options=EpsonOptions(remote_timeout_s=0)))
    for line in BEFORE:
        assert answer(client, line) == "0"
    said = answer(client, statement)
    pattern = re.escape(expected).replace(re.escape("..."), ".*")
    assert re.fullmatch(pattern, said, re.DOTALL), said


def test_the_page_has_all_its_rows():
    assert len(rows()) > 120


def test_if_runs_where_the_option_says_so(login):
    client = login(EpsonSimulator(options=EpsonOptions(single_line_if="runs")))
    assert answer(client, "If Error On Then Reset") == "0"
    assert answer(client, "If Sw(1)=Off Then Print 1; Print 2 Else Print 3") == "`1\r\n2`"
    assert answer(client, "If Sw(1)=On Then Print 1 Else Print 3") == "`3`"


def test_an_assigned_variable_is_read_over_the_wire_and_back(login):
    client = login(EpsonSimulator())
    assert answer(client, "g_Long = 2 * 3") == "0"
    assert client.ask("$GetVariable,g_Long,Long") == "#GetVariable,6"
    assert answer(client, "Print g_Long + 1") == "`7`"
    refusing = login(EpsonSimulator(options=EpsonOptions(variable_assignment="refused")))
    assert answer(refusing, "g_Long = 1") == "2353"


def refused_words():
    """Return the statements and functions that a program may contain and the simulator refuses."""
    known = {"pdef", *PLAIN_FUNCTIONS, *MACHINE_FUNCTIONS, *POINT_FUNCTIONS, *STATE_FUNCTIONS}
    known |= {*TASK_FUNCTIONS, *FUNCTIONS_OF_ARRAYS, *OF_POINT_NUMBERS}
    return UNSIMULATED - WINDOW_ONLY, UNSIMULATED_FUNCTIONS - known


def test_what_is_refused_is_listed_by_name():
    section = PAGE.read_text(encoding="utf-8").partition("## Not carried out")[2]
    _, statements, functions = re.split(r"^Statements:$|^Functions:$", section, flags=re.MULTILINE)
    functions, families = functions.split("begin so")
    listed = [set(re.findall(r"`([^`]+)`", part)) for part in (statements, functions, families)]
    families = {f"{word}..." for word in UNSIMULATED_FAMILIES}
    assert listed == [*refused_words(), families]


# Lines that differ only in their numbers: filling a shape gives the text that would be parsed.

LINES = [
    "Go XY(172.331, -477.810, -96.529, 0.000) /R /0",
    "Move XY(172.331, 477.810, 0.5, 30.000) /L /1 Till Sw(3) = On",
    "TLSet 1, XY(12.328, -3.056, -20.000, 0.000)",
    "Print XY(1.25, 2.50, 3, 4.0) -TLZ(10.5) +X50.5 :Z(1.5)",
    "Wait 0.25; Print 2.5 * -1.5e3, .5, 5., 0.987654321",
    "P1 = XY(1.5, 1.5, 2.5, 3.5); Print CX(P1) / 1.5",
    'Print "1.5", 1.5',
    "Print 1.5 ' 2.5",
    "Box 1, 0.5, 10.25, -5.5, 5.5, -100.5, 0.5",
    "Arc XY(1.5, 2.5, 3.5, 4.5), XY(5.5, 6.5, 7.5, 8.5) CP",
    "Go P1 !D50.5; On 3!",
    "Print Tool, Motor, Power, Speed(1), SpeedS(1), 57",
    "Print 1, 22, 335",
    "Print RealPos, &H5, 5",
    "Print Tool, 1.5, 005",
    "Print 5; Speed 5, 15, 25",
    "Box 1, 0.5, 10.25, -5.5, 5.5, -100.5, 5",
    "On 5, 0.5, 5",
    "Go P5, 5",
    "Print 5, -5",
    "Print 5 , 5 ",
]


def ended(read, line):
    try:
        return repr(read(line))  # 57 and 57.0 are equal, and printed otherwise
    except SpelRefusal as refusal:
        return str(refusal)


@each_row("line", LINES)
def test_a_filled_line_is_the_line_that_was_read(line):
    assert ended(parse, line) == ended(_read, line)
    # And with other numbers, when its shape is known.
    other = line.replace("5", "7")
    assert ended(parse, other) == ended(_read, other)


def test_a_question_with_another_number_is_not_read_anew():
    (first,) = parse("Print Tool, Speed(1), 1")
    assert isinstance(first, Print)
    known = _shape.cache_info().misses
    for number in range(10, 100):
        (asked,) = parse(f"Print Tool, Speed(1), {number}")
        assert isinstance(asked, Print)
        assert repr(asked.items[-1]) == f"Literal(value={number})"
        assert asked.items[0] is first.items[0]
    assert _shape.cache_info().misses == known


def test_a_line_that_is_wrong_is_refused_by_its_own_text():
    for line in ("Go XY(1.5, 2.5", "Go XY(1.5, 2.5, 3.5, 4.5) 6.25"):
        with pytest.raises(SpelRefusal) as told:
            parse(line)
        assert str(told.value) == ended(_read, line)
        assert "987654321" not in str(told.value)


def test_a_mark_that_does_not_come_back_just_once_fills_nothing():
    shape, numbers = marked("Print 1.5, 2.5")
    tree = _read(shape)
    assert filler(tree, len(numbers)) is not None
    assert filler(tree, 3) is None
    assert filler((*tree, *tree), 2) is None
