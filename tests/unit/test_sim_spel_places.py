"""Locals, pallets, bases and added arms (docs/reference/spel.md 5.4, 6.2)."""

import json
import math
import random
from math import cos, radians, sin

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.arm.robots import Joints, find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import HIGHEST_LOCAL
from robolink_simulators.epson.spel import Interpreter
from robolink_simulators.epson.spel.legs import go_leg

from tests._rows import each_row
from tests.unit.test_sim_spel_motion import Cell as CellWithArms
from tests.unit.test_sim_spel_points import NUMBERS, Window

# Locals by two pairs and three points, pallets beyond their edges (docs/reference/spel.md 5.4).

PAIRS = "P1 = XY(0, 0, 0, 0) /1; P2 = XY(100, 0, 0, 0) /1; P11 = XY(150, 150, 10, 0); "
"""Two places 100 mm apart in the local, which are 120 mm apart along Y in the base."""


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


# A base that is not the robot's own (docs/reference/spel.md 5.4).


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
        """Return the height of the flange in the middle of a movement, and at its end."""
        execution, began = self._interpreter.start(statement, self.now_ns), self.now_ns
        self.now_ns = execution.next_change() or began
        self.machine.arm.advance((began + self.now_ns) // 2)
        middle = flange(self).z_mm
        execution.advance(self.now_ns)
        assert execution.error is None, execution.error
        return middle, flange(self).z_mm


@pytest.fixture
def window_on_base():
    return Cell()


def coordinates(window, point="Here"):
    return [round(float(window(f"Print C{axis}({point})")), 3) for axis in "XYZU"]


def flange(window):
    return window.machine.arm.flange()


def test_what_is_told_of_the_place_counts_from_the_base_and_nothing_moves(window_on_base):
    x, y, z, u = coordinates(window_on_base)
    joints = window_on_base.machine.arm.joints
    window_on_base("Base XY(100, 50, -10, 90)")
    assert coordinates(window_on_base) == [round(y - 50, 3), round(100 - x, 3), z + 10, u - 90]
    assert window_on_base.machine.arm.joints == joints
    assert coordinates(window_on_base, "CurPos") == coordinates(window_on_base)
    assert coordinates(window_on_base, "JA(45, 60, 0, -105)") == coordinates(window_on_base)
    assert f"{y - 50:.3f} mm" in window_on_base("Where").splitlines()[0]


def test_a_movement_ends_where_the_base_sees_its_target(window_on_base):
    window_on_base("Base XY(100, 50, 0, 30); P1 = XY(200, 200, -20, 15)")
    window_on_base("Go P1")
    # 100 + 200 cos 30 - 200 sin 30, 50 + 200 sin 30 + 200 cos 30, turned by 30 more.
    at = flange(window_on_base)
    assert (at.x_mm, at.y_mm) == pytest.approx((173.205, 323.205), abs=1e-3)
    assert (at.z_mm, at.u_deg) == pytest.approx((-20, 45), abs=1e-6)
    assert coordinates(window_on_base) == [200, 200, -20, 15]
    window_on_base("Move Here +X(10)")
    assert flange(window_on_base).y_mm - at.y_mm == pytest.approx(5, abs=1e-6)
    window_on_base("BGo XY(0, 10, 0, 0)")
    assert flange(window_on_base).x_mm - at.x_mm == pytest.approx(3.660254, abs=1e-5)
    window_on_base("Here P2; Jump P1 LimZ 0")
    assert coordinates(window_on_base, "P2") == [210, 210, -20, 15]


def test_a_tool_is_the_same_in_every_base(window_on_base):
    window_on_base("TLSet 1, XY(10, 5, -30, 0); Tool 1")
    before = coordinates(window_on_base)
    window_on_base("Base XY(0, 0, 0, 40); P1 = Here; TGo XY(20, 0, 0, 0)")
    there = flange(window_on_base)
    window_on_base("Base XY(0, 0, 0, 0); Print CX(Here)")
    moved = [a - b for a, b in zip(coordinates(window_on_base), before, strict=True)]
    u = before[3]
    assert moved[:2] == pytest.approx([20 * cos(radians(u)), 20 * sin(radians(u))], abs=2e-3)
    assert window_on_base("Print CX(TLSet(1)), CZ(TLSet(1))") == "10 -30\r\n"
    assert there == flange(window_on_base)


def test_locals_have_to_be_defined_anew_and_count_from_the_new_base(window_on_base):
    window_on_base("Local 1, XY(10, 0, 0, 0); Local 15, XY(0, 0, 0, 0)")
    window_on_base("Base XY(100, 0, 0, 90)")
    for number in (1, HIGHEST_LOCAL):
        assert window_on_base(f"Print LocalDef({number})") == "0\r\n"
        assert window_on_base.error(f"P1 = Here @{number}") == NUMBERS.local_undefined
    window_on_base("Local 1, XY(10, 0, 0, 0); Go XY(200, 0, 0, 0) /1")
    # X of the local is X of the base, which is Y of the robot.
    assert (flange(window_on_base).x_mm, flange(window_on_base).y_mm) == pytest.approx(
        (100, 210), abs=1e-6
    )
    window_on_base("Base XY(100, 0, 0, 90)")  # repeating it changes nothing
    assert window_on_base("Print LocalDef(1)") == "-1\r\n"
    window_on_base("Base XY(0, 0, 0, 0)")
    assert window_on_base("Print LocalDef(1)") == "0\r\n"


def test_areas_and_points_of_pallets_lie_in_the_base(window_on_base):
    window_on_base("Base XY(0, 300, 0, 0); P1 = Here; P2 = Here -X(10); P3 = Here -Y(10)")
    x, y, z, _ = coordinates(window_on_base)
    window_on_base(f"Box 1, {x - 1}, {x + 1}, {y - 1}, {y + 1}, {z - 1}, {z + 1}")
    assert window_on_base("Print InsideBox(1)") == "-1\r\n"
    window_on_base("Pallet 1, P1, P2, P3, 2, 2; Motor On; Go Pallet(1, 4)")
    assert coordinates(window_on_base)[:2] == [round(x - 10, 3), round(y - 10, 3)]
    assert window_on_base("Print InsideBox(1)") == "0\r\n"


@pytest.mark.parametrize(("word", "u_deg"), [("", 30), (", X", 30), (", Y", 10)])
def test_three_points_make_a_base(window_on_base, word, u_deg):
    window_on_base("P1 = XY(100, 200, 5, 0); P2 = P1 +X(86.60254) +Y(50)")
    window_on_base("P3 = P1 -X(17.364818) +Y(98.480775)")
    window_on_base(f"Base P1, P2, P3{word}")
    assert window_on_base("Base").startswith("Base: 100.000, 200.000, 5.000, ")
    turn = float(window_on_base("Base").split(",")[3])
    assert turn == pytest.approx(u_deg, abs=1e-3)


def test_points_of_a_base_are_where_the_base_in_force_has_them(window_on_base):
    window_on_base("Base XY(50, 0, 0, 0); P1 = XY(0, 0, 0, 0); P2 = P1 +X(10); P3 = P1 +Y(10)")
    window_on_base("Base P1, P2, P3")
    assert window_on_base("Base") == "Base: 50.000, 0.000, 0.000, 0.000, 0.000, 0.000\r\n"


def test_what_is_no_base_is_refused_and_changes_nothing(window_on_base):
    window_on_base("Base XY(1, 2, 3, 4)")
    assert window_on_base.error("Base XY(0, 0, 0, 0, 10, 0)") == NUMBERS.value_out_of_range
    assert window_on_base.error("Base 1, 2") == NUMBERS.syntax
    assert (
        window_on_base.error("P1 = Here; P2 = Here; P3 = Here; Base P1, P2, P3, 5")
        == NUMBERS.syntax
    )
    assert window_on_base.error("Base P1, P2, P3") == NUMBERS.value_out_of_range
    assert window_on_base("Base") == "Base: 1.000, 2.000, 3.000, 4.000, 0.000, 0.000\r\n"


def test_six_axes_have_a_base_that_leans_and_arcs_lie_in_its_plane():
    window = Cell("C4-A601S")
    before = flange(window)
    window("Base XY(0, 0, 0, 0, 0, 90); P0 = Here; P1 = P0 +X(20) +Y(20); P2 = P0 +X(40)")
    # Y of this base is Z of the robot: halfway round the tip is higher by that much.
    for arc in ("P1, P2", "P2, -180", "P2, 20, ARC_SHORT, ARC_MINUS"):
        assert window.heights(f"Arc {arc}") == pytest.approx(
            (before.z_mm + 20, before.z_mm), abs=0.01
        ), arc
        window("Go P0")
    assert flange(window).coordinates() == pytest.approx(before.coordinates(), abs=1e-6)


def test_an_external_control_point_stands_in_the_base(window_on_base):
    window_on_base("P1 = Here; ECPSet 1, P1 +X(50); ECP 1")
    window_on_base("Move P1 +U(20) ROT ECP")
    plain = flange(window_on_base)
    window_on_base("Go P1; Base XY(30, 20, 0, 25); P1 = Here; ECPSet 1, P1")
    # The same place as before, in the other base: 50 mm along X of the robot.
    window_on_base(f"ECPSet 1, P1 +X({50 * cos(radians(25))}) -Y({50 * sin(radians(25))})")
    window_on_base("Move P1 +U(20) ROT ECP")
    assert flange(window_on_base).coordinates() == pytest.approx(plain.coordinates(), abs=1e-6)


def test_a_base_outlives_power_off_and_locals_do_not(window_on_base):
    window_on_base("Base XY(1, 2, 3, 4); Local 1, XY(0, 0, 0, 0)")
    window_on_base.machine.forget_volatile(0)
    state = json.loads(json.dumps(window_on_base.machine.kept.to_state()))
    again = Cell()
    again.machine.kept.restore(state)
    for one in (window_on_base, again):
        assert one("Print LocalDef(1)") == "0\r\n"
        assert one("Base") == "Base: 1.000, 2.000, 3.000, 4.000, 0.000, 0.000\r\n"
    del state["base"]  # as a file from before there were any
    Cell().machine.kept.restore(state)


# Added arms are reported, listed, kept and moved (docs/reference/spel.md 6.2).


@pytest.fixture
def cell():
    return CellWithArms()


def test_arms_are_listed_as_the_sample_shows(cell):
    cell.run("ArmSet 1, 300, -12, -30; ArmSet 3, 1, 2, 3, 4, 5")
    assert cell.run("ArmSet").splitlines() == [
        "Arm 0: 275.000, 0.000, 0.000, 325.000, 0.000",
        "Arm 1: 300.000, -12.000, -30.000, 325.000, 0.000",
        "Arm 3: 1.000, 2.000, 3.000, 4.000, 5.000",
    ]
    assert cell.run("ArmSet 1") == "Arm 1: 300.000, -12.000, -30.000, 325.000, 0.000\r\n"
    assert cell.run("Print ArmSet(1, 2), ArmSet(3, 5), ArmSet(0, 4)") == "-12 5 325\r\n"


def test_a_cleared_arm_is_gone(cell):
    cell.run("ArmSet 2, 300, 0, 0")
    assert cell.run("Print ArmDef(0), ArmDef(2), ArmDef(3)") == "-1 -1 0\r\n"
    cell.run("ArmClr 2; ArmClr 2")
    assert cell.run("Print ArmDef(2)") == "0\r\n"
    assert cell.error("ArmSet 2") == 2227


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("ArmSet 0, 1, 2, 3", 2205),
        ("ArmClr 0", 2205),
        ("ArmSet 16, 1, 2, 3", 2226),
        ("ArmSet 1, 2, 3", 2100),
        ("ArmSet 1, 1, 2, 3, 4, 5, 6", 2100),
        ("Print ArmSet(0, 6)", 4002),
        ("Print ArmSet(4, 1)", 2227),
        ("Arm 4", 2227),
        ("Arm 16", 2226),
    ],
)
def test_what_cannot_be_is_refused_by_its_number(cell, statement, number):
    assert cell.error(statement) == number


def test_an_added_arm_counts_from_the_joints_that_carry_it(cell):
    """Help on ArmSet: L2 and its angle at joint 2, L1, Z and the zero of U."""
    cell.run("ArmSet 1, 300, -12, -30, 310, 5; Arm 1")
    j1, j2, j3, j4 = cell.machine.arm.joints
    inner, outer = math.radians(j1), math.radians(j1 + j2 - 12)
    assert cell.tip() == pytest.approx(
        (
            310 * math.cos(inner) + 300 * math.cos(outer),
            310 * math.sin(inner) + 300 * math.sin(outer),
            j3 - 30,
            j1 + j2 + j4 + 5,
        )
    )
    assert cell.run("Arm; Print Arm") == "1\r\n1\r\n"


@each_row("robot", ["T6-602S", "RS4-C351S"])
@each_row("verb", ["Go", "Move", "Jump"])
def test_motions_bring_the_added_axis_to_the_same_point(robot, verb):
    cell = CellWithArms()
    if robot != "T6-602S":
        cell.machine = Machine(find_robot(robot))
        cell.machine.switch_motors(True)
        cell.interpreter = Interpreter(cell.machine, EpsonOptions(), random.Random(1))
    own = cell.machine.arm
    cell.run("P1 = Here; ArmSet 2, 150, 20, -15, ArmSet(0, 4), 40; TLSet 1, XY(3, 4, -10, 30)")
    cell.run("Arm 2; Tool 1; LimZ 0")
    cell.run("P2 = Here -X(15) -Z(8) +U(10)")
    cell.run(f"{verb} P2")
    assert float(cell.run("Print Dist(Here, P2)")) == pytest.approx(0, abs=1e-6)
    assert float(cell.run("Print CU(Here) - CU(P2)")) == pytest.approx(0, abs=1e-6)
    assert cell.run("Print TargetOK(P2)") == "-1\r\n"
    z_mm = own.flange().z_mm
    assert float(cell.run("Print CZ(Here)")) == pytest.approx(z_mm - 15 - 10, abs=1e-6)
    cell.run("Arm 0; Tool 0; Go P1")
    assert float(cell.run("Print Dist(Here, P1)")) == pytest.approx(0, abs=1e-6)


def test_hands_are_told_by_the_bend_of_the_arm_in_force(cell):
    cell.run("ArmSet 1, 300, -80, 0; Print Hand")
    assert cell.run("Arm 1; Print Hand, Hand(Here)") == "2 2\r\n"


def test_the_arm_in_force_cannot_be_cleared(cell):
    """Help: 2204."""
    cell.run("ArmSet 1, 300, 0, 0; Arm 1")
    assert cell.error("ArmClr 1") == 2204
    cell.run("Arm 0; ArmClr 1")


def test_what_is_mounted_stays_on_the_own_arm():
    simulator = EpsonSimulator()
    machine, world = simulator.machine, simulator.world
    machine.kept.arms.set(1, (200, 30, -40))
    before = world.tip_mm()
    machine.robot.put_in_force(1)
    assert world.tip_mm() == before
    own = machine.arm
    leg = go_leg(machine, own.joints, Joints(*(joint - 5 for joint in own.joints)))
    end_ns = own.start([leg], 0)
    assert own.true_flange_at(end_ns).z_mm == pytest.approx(own.flange().z_mm - 5)


def test_no_added_arm_of_six_axes_is_put_in_force():
    machine = Machine(find_robot("C4-A601S"))
    interpreter = Interpreter(machine, EpsonOptions(), random.Random(1))
    twelve = ", ".join(map(str, range(1, 13)))
    for line, number in ((f"ArmSet 1, {twelve}; Arm 1", 2199), ("Arm 2", 2227)):
        error = interpreter.start(line, 0).error
        assert error is not None
        assert error.number == number
    assert interpreter.start("Arm 0; Print Arm", 0).output == "0\r\n"


def test_six_axes_take_twelve_values():
    interpreter = Interpreter(Machine(find_robot("C4-A601S")), EpsonOptions(), random.Random(1))
    twelve = ", ".join(str(n) for n in range(1, 13))
    told = interpreter.start(f"ArmSet 1, {twelve}; Print ArmSet(1, 12), ArmSet(0, 1)", 0)
    told.advance(1)
    assert (told.error, told.output) == (None, "12 320\r\n")
    assert interpreter.start("ArmSet 1, 1, 2, 3", 2).error is not None


def test_an_added_arm_outlives_a_power_cycle(tmp_path):
    kept = tmp_path / "flash.json"
    first = EpsonSimulator(state_path=kept)
    first.machine.kept.arms.set(2, (300, 1, 2))
    first.machine.robot.put_in_force(2)
    first.advance(1)
    reborn = EpsonSimulator(state_path=kept)
    assert reborn.machine.kept.arms.values(2) == (300, 1, 2, 325, 0)
    assert reborn.machine.tip() == first.machine.tip()
    for state in ({"in_force": 3}, {"2": [1, 2]}):
        with pytest.raises(ValueError, match="arm"):
            reborn.machine.kept.arms.restore(state)
