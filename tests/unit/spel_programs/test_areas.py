"""Box and Plane watch the tip, in the middle of motions too (docs/reference/spel.md 5.5)."""

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions

HERE = "P1 = XY(0, 492, -100, 0)"
"""In the middle of the way that the tests take along X."""


def numbers(lines):
    return [[float(part) for part in line.split()] for line in lines]


def test_a_box_is_listed_and_told_as_it_was_given(printed):
    shown = printed(
        "Box 1, -200, 300, 0, 500, -100, 0",
        "Local 2, XY(0, 0, 0, 30)",
        "Box 2, 1, 1, 2, 3, 4, 0, 0, Off /LOCAL2",
        "Box; Box 1, 1",
        "Print CX(Box(1, 1)), CZ(Box(1, 1, 2)), PLocal(Box(2, 1)), BoxDef(1), BoxDef(3)",
        "BoxClr 1; Print BoxDef(1)",
    )
    first = "Box 1: 1, -200.000, 300.000, 0.000, 500.000, -100.000, 0.000, ON /LOCAL0"
    second = "Box 2: 1, 1.000, 2.000, 3.000, 4.000, 0.000, 0.000, OFF /LOCAL2"
    assert shown == [first, second, first, "-200 0 2 -1 0", "0"]


def test_an_axis_with_two_zeros_is_not_looked_at(printed):
    shown = printed(
        HERE + "; Go P1",
        "Box 1, -1, 1, 0, 0, 0, 0; Print InsideBox(1), InsideBox(1, All), GetRobotInsideBox(1)",
        "Box 1, -1, 1, 0, 0, -9, -8; Print InsideBox(1)",
        "Box 1, 0, 0, 0, 0, 0, 0; Print InsideBox(1)",
    )
    assert shown == ["-1 -1 1", "0", "0"]


def test_a_box_of_a_local_is_where_the_local_sees_it(printed):
    shown = printed(
        HERE + "; Go P1",
        "Local 1, XY(0, 0, 0, 90)",
        "Box 1, 491, 493, -1, 1, 0, 0; Print InsideBox(1)",
        "Box 1, 491, 493, -1, 1, 0, 0 /LOCAL1; Print InsideBox(1)",
    )
    assert shown == ["0", "-1"]


def test_the_tip_of_the_selected_tool_counts_without_a_motion(printed):
    shown = printed(
        "Tool 0; " + HERE + "; Go P1; TLSet 1, XY(50, 0, 0, 0)",
        "Box 1, 40, 60, 0, 0, 0, 0; Print InsideBox(1); Tool 1; Print InsideBox(1)",
    )
    assert shown == ["0", "-1"]


def test_a_plane_has_its_inside_on_the_side_of_its_z(printed):
    shown = printed(
        HERE + "; Go P1",
        "Plane 1, XY(0, 0, -90, 0, 0, 0); Print InsidePlane(1)",
        "Plane 1, XY(0, 0, -90, 0, 0, 180); Print InsidePlane(1), GetRobotInsidePlane(1)",
        "P2 = XY(0, 0, -90, 0); P3 = XY(1, 0, -90, 0); P4 = XY(0, 1, -90, 0)",
        "Plane 2, P2, P4, P3; Print InsidePlane(2); Plane 2, 1, P2, P3, P4; Print InsidePlane(2)",
        "Plane; Print CZ(Plane(2)), PlaneDef(2); PlaneClr 2; Print PlaneDef(2)",
    )
    plane = "Plane {}: 1, 0.000, 0.000, -90.000, 0.000, 0.000, {}"
    assert shown[:4] == ["0", "-1 1", "-1", "0"]
    assert shown[4:6] == [plane.format(1, "180.000"), plane.format(2, "0.000")]
    assert shown[6:] == ["-90 -1", "0"]


@pytest.mark.parametrize(
    ("line", "number"),
    [
        ("Box 16, 0, 1, 0, 1, 0, 1", 2216),
        ("Print InsideBox(3)", 2217),
        ("BoxClr 0", 2216),
        ("Plane 0, XY(0, 0, 0, 0)", 2218),
        ("Print InsidePlane(3)", 2219),
        ("Box 1, 2, 0, 1, 0, 1, 0, 1", 2262),
        ("Box 1, 0, 1, 0, 1, 0, 1, Off", 2262),
        ("Box 1, 1, 0, 0, 1, 0, 1", 4002),
        ("P2 = XY(1, 0, 0, 0); Plane 1, P2, P2, P2", 4002),
    ],
)
def test_what_cannot_be_has_its_own_number(failure, line, number):
    assert failure(line).number == number


def test_a_wait_beside_a_motion_sees_the_tip_come_in(printed):
    shown = printed(
        HERE + " :X(150); Go P1",
        "Box 1, -40, 40, 0, 0, 0, 0",
        "Move P1 :X(-150) !D0; Wait GetRobotInsideBox(1) = 1; On 1; Print CX(RealPos)!",
        "Print Oport(1), InsideBox(1)",
        real_pos_noise_mm=0.0,
    )
    at_mm, after = numbers(shown)
    assert 30 < at_mm[0] <= 40
    assert after == [1, 0]


def test_a_trap_and_till_stop_where_the_tip_comes_in(printed):
    shown = printed(
        HERE + " :X(150); Go P1",
        "Box 1, -40, 40, 0, 0, 0, 0",
        "Trap 1, GetRobotInsideBox(1) = 1 GoTo inside",
        "Move P1 :X(-150)",
        "inside:",
        "Print CX(Here)",
        "Go P1",
        "Move P1 :X(-150) Till GetRobotInsideBox(1) = 1",
        "Print CX(Here), TillOn",
        "Move P1 Find GetRobotInsideBox(1) = 0",
        "Print CX(FindPos), CX(Here)",
    )
    trapped, till, found = numbers(shown)
    assert 30 < trapped[0] <= 40
    assert 20 < till[0] < 40
    assert till[1] == -1
    assert found[0] == pytest.approx(40, abs=0.01)
    assert found[1] == pytest.approx(150)


def test_another_task_sees_it_and_each_robot_has_its_bit(cell):
    made = cell(
        "\n".join(
            [
                "Function main",
                "Box 1, 1, -40, 40, 0, 0, 0, 0",
                HERE + " :X(150); Go P1",
                "Xqt watch",
                "Move P1 :X(-150)",
                "Fend",
                "Function watch",
                "Wait GetRobotInsideBox(1) = 1",
                "Print CX(CurPos)",
                "Wait GetRobotInsideBox(1) = 0, 5",
                "Print CX(CurPos), TW",
                "Fend",
            ]
        )
    )
    entered, left = numbers(made.run())
    assert 30 < entered[0] <= 40
    assert -50 < left[0] < -40
    assert left[1] == 0


def test_areas_outlive_the_power_and_older_states_have_none(tmp_path):
    state = tmp_path / "state.json"
    first = EpsonSimulator(state_path=state, options=EpsonOptions())
    kept = first.machine.kept.areas
    link = first.connect(0)
    link.receive(b'$Login,\r\n$Execute,"Box 3, 1, 2, 3, 4, 5, 6"\r\n', 0)
    link.receive(b'$Execute,"Plane 2, XY(1, 2, 3, 4)"\r\n', 1)
    again = EpsonSimulator(state_path=state, options=EpsonOptions()).machine.kept.areas
    assert again.boxes.all() == kept.boxes.all() != {}
    assert again.planes.all() == kept.planes.all() != {}
    state.write_text(state.read_text().replace('"areas"', '"unknown"'))
    assert not EpsonSimulator(state_path=state).machine.kept.areas.boxes.all()
