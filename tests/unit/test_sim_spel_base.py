"""A base that is not the robot's own (docs/reference/spel.md 5.4)."""

import json
import random
from math import cos, radians, sin

import pytest
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import HIGHEST_LOCAL
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel import Interpreter

from tests.unit.test_sim_spel_points import NUMBERS, Window


class Cell(Window):
    """A command window that waits for each movement."""

    def __init__(self, robot="T6-602S"):
        self.machine = Machine(find_robot(robot))
        self.machine.switch_motors(True)
        self._interpreter = Interpreter(self.machine, EpsonOptions(), random.Random(1))
        self.now_ns = 0

    def __call__(self, statement):
        execution = self._interpreter.start(statement, self.now_ns)
        while (change := execution.next_change()) is not None:
            self.now_ns = change
            execution.advance(change)
        assert execution.error is None, execution.error
        return execution.output

    def error(self, statement):
        error = self._interpreter.start(statement, self.now_ns).error
        assert error is not None
        return error.number

    def heights(self, statement):
        """Return how high the flange is in the middle of a movement, and at its end."""
        execution, began = self._interpreter.start(statement, self.now_ns), self.now_ns
        self.now_ns = execution.next_change() or began
        self.machine.arm.advance((began + self.now_ns) // 2)
        middle = flange(self).z_mm
        execution.advance(self.now_ns)
        assert execution.error is None, execution.error
        return middle, flange(self).z_mm


@pytest.fixture
def window():
    return Cell()


def coordinates(window, point="Here"):
    return [round(float(window(f"Print C{axis}({point})")), 3) for axis in "XYZU"]


def flange(window):
    return window.machine.arm.flange()


def test_what_is_told_of_the_place_counts_from_the_base_and_nothing_moves(window):
    x, y, z, u = coordinates(window)
    joints = window.machine.arm.joints
    window("Base XY(100, 50, -10, 90)")
    assert coordinates(window) == [round(y - 50, 3), round(100 - x, 3), z + 10, u - 90]
    assert window.machine.arm.joints == joints
    assert coordinates(window, "CurPos") == coordinates(window)
    assert coordinates(window, "JA(45, 60, 0, -105)") == coordinates(window)
    assert f"{y - 50:.3f} mm" in window("Where").splitlines()[0]


def test_a_movement_ends_where_the_base_sees_its_target(window):
    window("Base XY(100, 50, 0, 30); P1 = XY(200, 200, -20, 15)")
    window("Go P1")
    # 100 + 200 cos 30 - 200 sin 30, 50 + 200 sin 30 + 200 cos 30, turned by 30 more.
    at = flange(window)
    assert (at.x_mm, at.y_mm) == pytest.approx((173.205, 323.205), abs=1e-3)
    assert (at.z_mm, at.u_deg) == pytest.approx((-20, 45), abs=1e-6)
    assert coordinates(window) == [200, 200, -20, 15]
    window("Move Here +X(10)")
    assert flange(window).y_mm - at.y_mm == pytest.approx(5, abs=1e-6)
    window("BGo XY(0, 10, 0, 0)")
    assert flange(window).x_mm - at.x_mm == pytest.approx(3.660254, abs=1e-5)
    window("Here P2; Jump P1 LimZ 0")
    assert coordinates(window, "P2") == [210, 210, -20, 15]


def test_a_tool_is_the_same_in_every_base(window):
    window("TLSet 1, XY(10, 5, -30, 0); Tool 1")
    before = coordinates(window)
    window("Base XY(0, 0, 0, 40); P1 = Here; TGo XY(20, 0, 0, 0)")
    there = flange(window)
    window("Base XY(0, 0, 0, 0); Print CX(Here)")
    moved = [a - b for a, b in zip(coordinates(window), before, strict=True)]
    u = before[3]
    assert moved[:2] == pytest.approx([20 * cos(radians(u)), 20 * sin(radians(u))], abs=2e-3)
    assert window("Print CX(TLSet(1)), CZ(TLSet(1))") == "10 -30\r\n"
    assert there == flange(window)


def test_locals_have_to_be_defined_anew_and_count_from_the_new_base(window):
    window("Local 1, XY(10, 0, 0, 0); Local 15, XY(0, 0, 0, 0)")
    window("Base XY(100, 0, 0, 90)")
    for number in (1, HIGHEST_LOCAL):
        assert window(f"Print LocalDef({number})") == "0\r\n"
        assert window.error(f"P1 = Here @{number}") == NUMBERS.local_undefined
    window("Local 1, XY(10, 0, 0, 0); Go XY(200, 0, 0, 0) /1")
    # X of the local is X of the base, which is Y of the robot.
    assert (flange(window).x_mm, flange(window).y_mm) == pytest.approx((100, 210), abs=1e-6)
    window("Base XY(100, 0, 0, 90)")  # the same again changes nothing
    assert window("Print LocalDef(1)") == "-1\r\n"
    window("Base XY(0, 0, 0, 0)")
    assert window("Print LocalDef(1)") == "0\r\n"


def test_areas_and_points_of_pallets_lie_in_the_base(window):
    window("Base XY(0, 300, 0, 0); P1 = Here; P2 = Here -X(10); P3 = Here -Y(10)")
    x, y, z, _ = coordinates(window)
    window(f"Box 1, {x - 1}, {x + 1}, {y - 1}, {y + 1}, {z - 1}, {z + 1}")
    assert window("Print InsideBox(1)") == "-1\r\n"
    window("Pallet 1, P1, P2, P3, 2, 2; Motor On; Go Pallet(1, 4)")
    assert coordinates(window)[:2] == [round(x - 10, 3), round(y - 10, 3)]
    assert window("Print InsideBox(1)") == "0\r\n"


@pytest.mark.parametrize(("word", "u_deg"), [("", 30), (", X", 30), (", Y", 10)])
def test_three_points_make_a_base(window, word, u_deg):
    window("P1 = XY(100, 200, 5, 0); P2 = P1 +X(86.60254) +Y(50)")
    window("P3 = P1 -X(17.364818) +Y(98.480775)")
    window(f"Base P1, P2, P3{word}")
    assert window("Base").startswith("Base: 100.000, 200.000, 5.000, ")
    turn = float(window("Base").split(",")[3])
    assert turn == pytest.approx(u_deg, abs=1e-3)


def test_points_of_a_base_are_where_the_base_in_force_has_them(window):
    window("Base XY(50, 0, 0, 0); P1 = XY(0, 0, 0, 0); P2 = P1 +X(10); P3 = P1 +Y(10)")
    window("Base P1, P2, P3")
    assert window("Base") == "Base: 50.000, 0.000, 0.000, 0.000, 0.000, 0.000\r\n"


def test_what_is_no_base_is_refused_and_changes_nothing(window):
    window("Base XY(1, 2, 3, 4)")
    assert window.error("Base XY(0, 0, 0, 0, 10, 0)") == NUMBERS.value_out_of_range
    assert window.error("Base 1, 2") == NUMBERS.syntax
    assert window.error("P1 = Here; P2 = Here; P3 = Here; Base P1, P2, P3, 5") == NUMBERS.syntax
    assert window.error("Base P1, P2, P3") == NUMBERS.value_out_of_range
    assert window("Base") == "Base: 1.000, 2.000, 3.000, 4.000, 0.000, 0.000\r\n"


def test_six_axes_have_a_base_that_leans_and_arcs_lie_in_its_plane():
    window = Cell("C4-A601S")
    before = flange(window)
    window("Base XY(0, 0, 0, 0, 0, 90); P0 = Here; P1 = P0 +X(20) +Y(20); P2 = P0 +X(40)")
    # Y of this base is Z of the robot: halfway round the tip is as much higher.
    for arc in ("P1, P2", "P2, -180", "P2, 20, ARC_SHORT, ARC_MINUS"):
        assert window.heights(f"Arc {arc}") == pytest.approx(
            (before.z_mm + 20, before.z_mm), abs=0.01
        ), arc
        window("Go P0")
    assert flange(window).coordinates() == pytest.approx(before.coordinates(), abs=1e-6)


def test_an_external_control_point_stands_in_the_base(window):
    window("P1 = Here; ECPSet 1, P1 +X(50); ECP 1")
    window("Move P1 +U(20) ROT ECP")
    plain = flange(window)
    window("Go P1; Base XY(30, 20, 0, 25); P1 = Here; ECPSet 1, P1")
    # The same place as before, told in the other base: 50 mm along X of the robot.
    window(f"ECPSet 1, P1 +X({50 * cos(radians(25))}) -Y({50 * sin(radians(25))})")
    window("Move P1 +U(20) ROT ECP")
    assert flange(window).coordinates() == pytest.approx(plain.coordinates(), abs=1e-6)


def test_a_base_outlives_power_off_and_locals_do_not(window):
    window("Base XY(1, 2, 3, 4); Local 1, XY(0, 0, 0, 0)")
    window.machine.forget_volatile(0)
    state = json.loads(json.dumps(window.machine.kept.to_state()))
    again = Cell()
    again.machine.kept.restore(state)
    for one in (window, again):
        assert one("Print LocalDef(1)") == "0\r\n"
        assert one("Base") == "Base: 1.000, 2.000, 3.000, 4.000, 0.000, 0.000\r\n"
    del state["base"]  # as a file of before there was any
    Cell().machine.kept.restore(state)
