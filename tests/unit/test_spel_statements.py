"""Typed statements: what is written, and what is refused before it is."""

import math
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import ConfigError, LocalProtocolError
from robolink.model import Hand, Pose, ToolOffset
from robolink.protocols import Role, spel
from robolink.protocols.epson_text import EpsonTextCodec, Request

TOOL = ToolOffset(12.0, -3.25, -0.0001, 45.0)
POSE = Pose(350.0, -100.0, -20.0004, 90.0)


@pytest.mark.parametrize(
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


@pytest.mark.parametrize(
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
