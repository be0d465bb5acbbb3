"""Settings of drives and added arms in programs (docs/reference/spel.md 6.2, 7.2)."""

import pytest


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
    # With 250 mm of its own the added arm comes to 575 mm, the robot's to 600 mm.
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
