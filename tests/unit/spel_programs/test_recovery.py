"""Recover after the safeguard, and motions that were broken off (docs/reference/spel.md 4.5)."""

import math

import pytest
from robolink_simulators.epson.arm.kinematics import forward
from robolink_simulators.epson.arm.robots import Joints

GUARDED = """
Function main
  Motor On
  Xqt 9, monitor, NoPause
  Move Here -X(60)
  Print "arrived"
Fend
Function monitor
  Wait SafetyOn
  Wait SafetyOn = False
  Print CtrlInfo(1) And &H2000, RobotInfo(1), CX(RecoverPos) = CX(Here)
  {recover}
  Print Motor, CX(RecoverPos), Dist(RecoverPos, Here) > 1, RobotInfo(1)
  Cont
Fend
"""


def advanced(made, seconds):
    made.simulator.advance(made.simulator.now_ns + round(seconds * 1e9))


def place(made, joints):
    return forward(made.simulator.machine.model, joints).coordinates()[:3]


def ends_after(made, number):
    """Return where the motions end that came after so many."""
    return [motion.flange_mm for motion in made.simulator.motions(number)]


SEEN = "  Print CtrlInfo(1) And &H6000, RobotInfo(1)\n"


def broken_off(cell, recover):
    return broken_off_of(cell, GUARDED.format(recover=recover))


def broken_off_of(cell, program):
    """Start a motion, open the safeguard on the way, move the arm by hand, close it."""
    made = cell(program)
    made.runner.start("main", 0)
    advanced(made, 0.5)
    arm = made.simulator.machine.arm
    assert arm.moving
    made.simulator.panel.open_guard()
    kept = arm.joints
    advanced(made, 0.1)
    j1, *rest = kept
    arm.place(Joints(j1 + 2, *rest), made.simulator.now_ns)
    made.simulator.panel.close_guard()
    return made, kept


@pytest.mark.parametrize("recover", ["Recover All", "Recover 1, WithMove", "Print Recover"])
def test_the_robot_goes_back_to_where_the_safeguard_opened_and_then_on(cell, recover):
    made, kept = broken_off(cell, recover)
    began = made.simulator.machine.arm.moves_started
    advanced(made, 20)
    assert made.simulator.machine.robot.power_high is False
    back, on = ends_after(made, began)
    assert back == pytest.approx(place(made, kept), abs=1e-6)
    assert math.dist(on, back) > 5
    printed = "".join(made.runner.console).splitlines()
    assert printed[0] == "8192 2 0"
    assert printed[-2:] == ["1 0 -1 0", "arrived"]
    assert printed[1:-2] == (["-1"] if recover.startswith("Print") else [])
    assert made.runner.failure is None


def test_a_program_sees_that_the_robot_is_on_its_way_back(cell):
    watched = GUARDED.replace("  Cont\n", "  Cont\nFend\nFunction watch\n  Wait 0.02\n" + SEEN)
    made, _ = broken_off_of(cell, watched.format(recover="Xqt 10, watch, NoPause\n  Recover All"))
    advanced(made, 20)
    printed = "".join(made.runner.console).splitlines()
    assert printed[:2] == ["8192 2 0", "16384 4"]
    assert printed[-2:] == ["1 0 -1 0", "arrived"]


def test_without_move_only_the_motors_come_on(cell):
    made, kept = broken_off(cell, "Recover 1, WithoutMove")
    began = made.simulator.machine.arm.moves_started
    advanced(made, 20)
    (on,) = ends_after(made, began)
    assert math.dist(on, place(made, kept)) > 5


def test_a_motion_goes_on_after_the_safeguard_with_motors_on_alone(cell):
    made, _ = broken_off(cell, "Motor Off")
    began = made.simulator.machine.arm.moves_started
    advanced(made, 20)
    assert made.runner.failure.number == made.simulator.options.numbers.motors_off
    assert ends_after(made, began) == []
    assert "arrived" not in "".join(made.runner.console)


def test_nothing_is_recovered_while_the_safeguard_is_open(cell):
    text = """Function main
  Xqt 9, monitor, NoPause
  Wait 100
Fend
Function monitor
  Wait SafetyOn
  Recover All
Fend
"""
    made = cell(text)
    made.runner.start("main", 0)
    advanced(made, 0.1)
    made.simulator.panel.open_guard()
    advanced(made, 1)
    assert made.runner.failure.number == made.simulator.options.numbers.guard_open
    assert not made.simulator.machine.motors_on
    assert made.simulator.machine.arm.moves_started == 0


JUMPS = """
Function main
  Motor On
  P1 = Here :Z(-40)
  Go P1
  P2 = P1 -X(40)
  Print JT
  Jump P2 LimZ -10
  Print JT = &H70007
  Sense Sw(3) = Off
  Jump P1 LimZ -10 Sense
  Print JS, JT = &H30003
  Till Sw(3) = Off And CZ(CurPos) < -20
  Jump P1 LimZ -10
  Jump P2 LimZ -10 C0 Till
  Print TillOn, JT And 4
Fend
"""


def test_jt_tells_which_parts_of_a_jump_began_and_ended(cell):
    printed = cell(JUMPS).run()
    assert printed[:3] == ["0", "-1", "-1 -1"]


def test_rot_may_stand_where_the_tool_turns_and_names_of_places_are_told(printed):
    assert printed(
        "P1 = Here +X(1)",
        "P2 = P1 +U(5)",
        "Print ROTOK(P1), ROTOK(P2), ROTOK(P2, P2), ROTOK(P1, P2)",
        "Print CX(Align(P1)) = CX(P1), CU(AlignECP(P2, 1)) = CU(P2)",
        "Print WindowsStatus, ProjectName$, CX(RecoverPos)",
    ) == ["0 -1 0 -1", "-1 -1", "0robolink 0"]
