"""Locals by two pairs and three points, pallets beyond their edges (docs/reference/spel.md 5.4)."""

import pytest
from robolink_simulators.epson import EpsonOptions

from tests.unit.test_sim_spel_points import NUMBERS, Window

PAIRS = "P1 = XY(0, 0, 0, 0) /1; P2 = XY(100, 0, 0, 0) /1; P11 = XY(150, 150, 10, 0); "
"""Two places 100 mm apart in the local, which the base sees 120 mm apart along Y."""


@pytest.fixture
def window():
    window = Window()
    window(PAIRS + "P12 = XY(150, 270, 10, 0)")
    return window


def seen(window, point):
    return [round(float(window(f"Print C{axis}({point} @0)")), 6) for axis in "XYZU"]


@pytest.mark.parametrize(
    ("words", "at_y", "turn"),
    [("", 160, 90), (", L", 150, 90), (", R", 170, 90), (", L, BaseU", 150, 0)],
)
def test_two_pairs_lie_on_each_other_as_the_letters_say(window, words, at_y, turn):
    window(f"Local 1, (P1:P11), (P2:P12){words}")
    assert seen(window, "P1") == [150, at_y, 10, turn]
    assert seen(window, "P2") == [150, at_y + 100, 10, turn]
    window("P3 = P12 @1")
    assert seen(window, "P3") == [150, 270, 10, 0]


@pytest.mark.parametrize(("word", "u_deg"), [("", 30), (", X", 30), (", Y", 10)])
def test_three_points_give_the_axis_that_the_letter_says(window, word, u_deg):
    # X at 30 degrees, Y at 100: not square to each other, as taught points are.
    window("P1 = XY(100, 200, 5, 0); P2 = P1 +X(86.60254) +Y(50)")
    window("P3 = P1 -X(17.364818) +Y(98.480775)")
    window(f"Local 2, P1, P2, P3{word}")
    assert float(window("Print CU(Local(2))")) == pytest.approx(u_deg, abs=1e-4)
    assert window("Print CX(Local(2)), CZ(Local(2)), LocalDef(2), LocalDef(3)") == "100 5 -1 0\r\n"


def test_points_of_different_heights_lean_on_six_axes_alone(window):
    leaning = "P1 = XY(0, 0, 0, 0); P2 = XY(100, 0, 0, 0); P3 = XY(0, 100, 100, 0); "
    assert window.error(leaning + "Local 2, P1, P2, P3") == NUMBERS.value_out_of_range
    six = Window("C4-A601S")
    six(leaning + "Local 2, P1, P2, P3")
    assert float(six("Print CW(Local(2))")) == pytest.approx(45)
    assert float(six("P4 = XY(0, 10, 0, 0) /2; Print CZ(P4 @0)")) == pytest.approx(7.0710678)


def test_points_on_one_line_give_no_local(window):
    line = "P1 = XY(0, 0, 0, 0); P2 = XY(1, 0, 0, 0); P3 = XY(2, 0, 0, 0); "
    assert window.error(line + "Local 2, P1, P2, P3") == NUMBERS.value_out_of_range
    assert window.error("Local 1, (P1:P11), (P1:P12)") == NUMBERS.value_out_of_range
    assert window.error("Local 1, (P1:P11), (P2:P12), X") == NUMBERS.syntax


def test_a_pallet_with_outside_goes_on_beyond_its_edges(window):
    corners = "XY(0, 0, 0, 0), XY(20, 0, 0, 0), XY(0, 30, 0, 0), 3, 4"
    window(f"Pallet Outside, 1, {corners}; Pallet 2, {corners}")
    assert window("Print CX(Pallet(1, 0, -1)), CY(Pallet(1, 4, 6))") == "-10 50\r\n"
    assert window.error("Print Pallet(2, 0, 1)") == NUMBERS.value_out_of_range
    assert window.error("Print Pallet(1, 13)") == NUMBERS.value_out_of_range
    assert window("Pallet") == "Pallet 1: 3, 4\r\nPallet 2: 3, 4\r\n"


def test_points_have_descriptions_until_they_are_forgotten(window):
    window('PDescription P1, "pin"; PLabel P1, "post"')
    assert window("Print PDescription$(P1), PDescription$(post), PNumber(post)") == "pinpin 1\r\n"
    window("PDel 1; P1 = XY(1, 2, 3, 4)")
    assert window("Print PDescription$(1), PLabel$(1)") == "post\r\n"
    assert window.error('PDescription P9, "no"') == NUMBERS.point_undefined


def test_axes_that_the_robot_has_not_are_another_robots(window):
    for statement in ("CR(P1) = 1", "Print CT(P1)", "P3 = P1 +S(1)", "P3 = P1 :T(2)"):
        assert window.error(statement) == NUMBERS.other_robot
    assert EpsonOptions().numbers == NUMBERS
