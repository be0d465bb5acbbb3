"""Areas, arcs, the clock and settings of drives in programs."""

import math

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel.source_text import ProgramRefused

# Box and Plane watch the tip, in the middle of motions too (docs/reference/spel.md 5.5).

HERE = "P1 = XY(0, 492, -100, 0)"
"""The middle of the tests' move along X."""


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
        HERE + " :X(60); Go P1",
        "Box 1, -40, 40, 0, 0, 0, 0",
        "Move P1 :X(-60) !D0; Wait GetRobotInsideBox(1) = 1; On 1; Print CX(RealPos)!",
        "Print Oport(1), InsideBox(1)",
        real_pos_noise_mm=0.0,
    )
    at_mm, after = numbers(shown)
    assert 30 < at_mm[0] <= 40
    assert after == [1, 0]


def test_a_trap_and_till_stop_where_the_tip_comes_in(printed):
    shown = printed(
        HERE + " :X(60); Go P1",
        "Box 1, -40, 40, 0, 0, 0, 0",
        "Trap 1, GetRobotInsideBox(1) = 1 GoTo inside",
        "Move P1 :X(-60)",
        "inside:",
        "Print CX(Here)",
        "Go P1",
        "Move P1 :X(-60) Till GetRobotInsideBox(1) = 1",
        "Print CX(Here), TillOn",
        "Move P1 Find GetRobotInsideBox(1) = 0",
        "Print CX(FindPos), CX(Here)",
    )
    trapped, till, found = numbers(shown)
    assert 30 < trapped[0] <= 40
    assert 20 < till[0] < 40
    assert till[1] == -1
    assert found[0] == pytest.approx(40, abs=0.01)
    assert found[1] == pytest.approx(60)


def test_another_task_sees_it_and_each_robot_has_its_bit(cell):
    made = cell(
        "\n".join(
            [
                "Function main",
                "Box 1, 1, -40, 40, 0, 0, 0, 0",
                HERE + " :X(60); Go P1",
                "Xqt watch",
                "Move P1 :X(-60)",
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


# Arc and Arc3 in all forms, counters of inputs, the clock, and Eval.

NS = 1_000_000_000


@pytest.fixture
def travelled(cell):
    """Return the tip's path during one motion, from Here at (x, y, z) on."""

    def run(motion):
        made = cell(f"Function main\nP0 = Here\n{motion}\nFend\n")
        machine = made.simulator.machine
        start = machine.tip().coordinates()[:3]
        made.runner.start("main", 0)
        places = []
        while made.runner.tasks and made.simulator.now_ns < 100 * NS:
            made.simulator.advance(made.simulator.now_ns + 20_000_000)
            places.append(machine.tip().coordinates()[:3])
        assert made.runner.failure is None, made.runner.failure
        return [tuple(a - b for a, b in zip(place, start, strict=True)) for place in places]

    return run


@pytest.mark.parametrize(
    ("motion", "centre", "farthest"),
    [
        # From (0, 0): the chord is 20 mm toward -X. The side of the bulge shows the sense.
        ("Arc P0 -X(10) +Y(10), P0 -X(20)", (-10, 0), (-10, 10)),
        ("Arc P0 -X(20), 180", (-10, 0), (-10, 10)),
        ("Arc P0 -X(20), -180", (-10, 0), (-10, -10)),
        ("Arc P0 -X(20), -90", (-10, 10), (-10, 10 - math.sqrt(200))),
        ("Arc P0 -X(20), 10, ARC_SHORT, ARC_PLUS", (-10, 0), (-10, 10)),
        ("Arc P0 -X(20), 26, ARC_SHORT, ARC_MINUS", (-10, 24), (-10, -2)),
        ("Arc P0 -X(20), 26, ARC_LONG, ARC_MINUS", (-10, -24), (-10, -50)),
        ("Arc P0 -X(20), P0 -X(10) -Y(24), ARC_SHORT", (-10, -24), (-10, 2)),
        ("Arc P0 -X(20), P0 -X(10) -Y(24), ARC_LONG", (-10, -24), (-10, -50)),
        ("Real a\na = 180\nArc P0 -X(20), a", (-10, 0), (-10, 10)),
    ],
)
def test_an_arc_runs_on_its_circle_in_its_sense(travelled, motion, centre, farthest):
    places = travelled(motion)
    radius = math.hypot(*centre)
    assert {round(math.dist(centre, place[:2]), 4) for place in places} == {round(radius, 4)}
    assert places[-1] == pytest.approx((-20, 0, 0), abs=1e-6)
    nearest = min(math.dist(place[:2], farthest) for place in places)
    assert nearest < radius * 0.1


@pytest.mark.parametrize(
    "motion",
    [
        "Arc3 P0 -X(10) -Z(10), P0 -X(20)",
        "Arc3 P0 -X(10) -Z(10), P0 -X(10), ARC_SHORT\nArc3 P0 -X(20), P0 -X(10), ARC_SHORT",
    ],
)
def test_an_arc_in_space_takes_the_height_of_its_mid_point(travelled, motion):
    places = travelled(motion)
    assert {round(math.dist((-10, 0, 0), place), 4) for place in places} == {10}
    assert min(z for _, _, z in places) == pytest.approx(-10, abs=0.1)
    assert places[-1] == pytest.approx((-20, 0, 0), abs=1e-6)


def test_an_arc_of_six_axes_by_its_angle(login):
    from robolink_simulators.epson import EpsonOptions, EpsonSimulator

    simulator = EpsonSimulator("C8-C901S", options=EpsonOptions(remote_timeout_s=0))
    client = login(simulator)
    for statement in ("P0 = Here", "Arc P0 -X(20), 180", "Arc3 P0, P0 -X(10), ARC_LONG"):
        reply = client.ask(f'$Execute,"{statement}"') or client.wait(60)
        # Opposite ends define no plane: the way round is not given.
        assert reply == ("!Execute,99" if "Arc3" in statement else "#Execute,0")
    assert client.ask('$Execute,"Print Dist(P0, Here)"').startswith(("!", "#"))


@pytest.mark.parametrize(
    "arc",
    [
        "Arc P0 -X(20), 0",
        "Arc P0 -X(20), 360",
        "Arc P0, 90",
        "Arc P0 -X(20), 9.9, ARC_SHORT, ARC_PLUS",
        "Arc P0 -X(20), P0 -X(5), ARC_SHORT",
        "Arc P0 -X(20), P0 -X(10), ARC_SHORT",
        "Arc3 P0 -X(10), P0 -X(20)",
    ],
)
def test_what_is_no_circle_is_refused_before_anything_moves(cell, arc):
    made = cell(f"Function main\nP0 = Here\n{arc}\nFend\n")
    made.run()
    assert made.runner.failure.number == made.simulator.options.numbers.value_out_of_range
    assert made.simulator.machine.arm.moves_started == 0


@pytest.mark.parametrize("arc", ["Arc P0, 1, 2", "Arc 5, P0", "Arc P0", "Arc3 P0, 90"])
def test_what_is_no_form_of_an_arc_is_refused(failure, arc):
    assert failure("P0 = Here", arc).number == 2100


def test_a_counter_counts_how_often_an_input_comes_on(cell):
    """P. 257: 16 counters, rising edges."""
    made = cell(
        "Function main\nCTReset 3\nWait 1\nPrint Ctr(3), Ctr(4)\nCTReset 3\nPrint Ctr(3)\nFend\n"
    )
    made.runner.start("main", 0)
    made.simulator.advance(NS // 2)
    for on in (True, True, False, True, False, True):
        made.simulator.panel.switch_input(3, on)
        made.simulator.panel.switch_input(4, on)
    made.simulator.advance(2 * NS)
    assert "".join(made.runner.console).split("\r\n")[:2] == ["3 0", "0"]


def test_a_counter_ends_a_wait_and_there_are_sixteen(cell, failure):
    made = cell("Function main\nCTReset 3\nWait Ctr(3) >= 2, 5\nPrint TW\nFend\n")
    made.runner.start("main", 0)
    for on in (True, False, True):
        made.simulator.advance(made.simulator.now_ns + NS // 10)
        made.simulator.panel.switch_input(3, on)
    made.simulator.advance(NS)
    assert list(made.runner.console) == ["0\r\n"]
    told = failure("Integer i", "For i = 0 To 16", "CTReset i", "Next")
    assert told.number == 2507


def test_the_clock_goes_with_simulated_time(printed):
    """P. 277, 834."""
    lines = ("Print Date$", "Print Time$", "Wait 75", "Print Time$", "Date", "Time")
    shown = printed(*lines)
    assert shown == ["2026/01/01", "08:00:00", "08:01:15", "2026/01/01", "08:01:15"]


def test_eval_runs_a_line_of_the_command_window_and_never_fails(printed):
    """P. 316."""
    lines = (
        "String r$",
        "Integer e",
        'Print Eval("Print 2 + 3", r$), r$',
        'e = Eval("Go P900", r$)',
        "Print e",
        "Print r$",
        'Print Eval("For i = 1 To 3", r$)',
        'Print Eval("P1 = Here; TLSet 3, XY(1, 2, 3, 4)"), TLDef(3)',
        'Print Eval("Go Here -X(30); Print 7", r$), r$, Dist(P1, Here) > 29.9',
        'Eval "Speed 30"',
        "Print Speed(1)",
        'Print Eval("Print Space$(255)", r$), Len(r$)',
    )
    shown = printed(*lines)
    assert shown == [
        "05",
        "7007",
        "!Error: 7007",
        "2353",
        "0 -1",
        "07 -1",
        "30",
        "0 255",
    ]


# Settings of drives and added arms in programs (docs/reference/spel.md 6.2, 7.2).


def test_two_arms_go_to_one_point(printed):
    """Help on Arm: a single point is moved to by two arms."""
    shown = printed(
        "ArmSet 1, 250, -25, -30",
        "P1 = Here",
        "Arm 1",
        "Print Arm, ArmDef(1), Dist(Here, P1) > 100",
        "Go P1 :Z(CZ(Here))",
        "Print Dist(Here, P1 :Z(CZ(Here))) < 0.001, TargetOK(XY(590, 0, CZ(Here), 0))",
        "Arm 0",
        "Print TargetOK(XY(590, 0, CZ(Here), 0))",
        "Go P1",
        "Print Dist(Here, P1) < 0.001",
    )
    # With its own 250 mm the added arm reaches 575 mm, the robot's 600 mm.
    assert shown == ["1 -1 -1", "-1 0", "-1", "-1"]


def test_a_locals_pallet_is_served_by_an_added_arm(printed):
    shown = printed(
        "ArmSet 2, 250, 10, 0; Arm 2",
        "P1 = Here; P2 = Here -X(20); P3 = Here -Y(20)",
        "Pallet 1, P1, P2, P3, 3, 3",
        "Move Pallet(1, 9)",
        "Print CX(Here) - CX(P1), CY(Here) - CY(P1)",
    )
    assert [float(value) for value in shown[0].split()] == pytest.approx([-20, -20])


def test_a_program_catches_that_fine_is_not_reached(printed):
    """P. 330, 332: 4024 after about two seconds."""
    shown = printed(
        "OnErr GoTo missed",
        "TmReset 0",
        "FineDist 0.001",
        "Go Here -X(5)",
        "Exit Function",
        "missed:",
        "Print Err, Tmr(0) > 2, Tmr(0) < 4",
        "FineDist 5",
        "EResume",
        servo_unrest_pulses=100,
    )
    assert shown == ["4024 -1 -1"]


def test_a_program_boosts_what_is_short(printed):
    """Help on PTPBoostOK: its sample."""
    shown = printed(
        "Power High; Speed 100; Accel 50, 50",
        "P1 = Here -X(3); P2 = Here",
        "TmReset 0; Go P1; Go P2",
        "Real before; before = Tmr(0)",
        "If PTPBoostOK(P1) Then",
        "PTPBoost 100",
        "EndIf",
        "TmReset 0; Go P1; Go P2",
        "Print Tmr(0) < 0.75 * before, Tmr(0) > 0.6 * before",
    )
    assert shown == ["-1 -1"]


@pytest.mark.parametrize("statement", ["VDefTool 1", "VGoCenter 1", "VStatsReset s", "VTeach s"])
def test_vision_statements_of_which_only_the_name_is_known_are_refused(failure, statement):
    assert failure(statement).number == 2199


# Zeros of joints and brakes in whole programs (docs/reference/spel.md 7.2).


def test_programs_set_zeros_and_open_no_brake(cell):
    text = "Function main\n  CalPls 1, 2, 3, 4\n  Print CalPls(2), MHour >= 0\nFend\n"
    assert cell(text).run() == ["2 -1"]
    with pytest.raises(ProgramRefused, match="brake"):
        cell("Function main\n  Brake Off, 1\nFend\n")


def test_a_task_that_goes_on_through_a_stop_calibrates_nothing(cell):
    text = """Function main
  Xqt 2, watch, NoEmgAbort
  TaskWait 2
Fend
Function watch
  Calib 1
Fend
"""
    made = cell(text)
    made.run()
    assert made.runner.failure.number == made.simulator.options.numbers.not_in_this_task


LATCHING = """Function main
  Motor On
  SetLatch 24, SETLATCH_TRIGGERMODE_LEADINGEDGE, 2
  LatchEnable On
  Xqt switch
  Move Here -X(60) CP
  Wait LatchState = True
  Print Dist(LatchPos(WithToolArm, 1), LatchPos(WithToolArm, 2)) > 1
  Print Dist(LatchPos, Here) > 1
  LatchEnable Off
Fend
Function switch
  Wait 0.3
  SetSw 24, 1
  SetSw 24, 0
  Wait 0.2
  SetSw 24, 1
Fend
"""


def test_a_program_waits_for_the_latch_and_asks_where_it_was(cell):
    assert cell(LATCHING, virtual_io=True).run() == ["-1", "-1"]
