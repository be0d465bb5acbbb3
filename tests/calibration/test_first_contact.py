"""The first contact of a turn test after a break: where it is, and whether the tool is upright."""

from dataclasses import replace
from typing import Any

import pytest

from robolink.calibration import TouchedPlane
from robolink.methods import SphereSurvey
from robolink.methods.pivot.procedure import TiltTest
from robolink.methods.surface_touch.plane_procedure import PlaneTest
from robolink.methods.surface_touch.sphere_procedure import SphereTest, TouchedSphere
from robolink.model import Hand, Pose, ToolOffset
from robolink.procedures import TouchPlan, TurnTest
from robolink.runner import Ask, Consider, TouchedAt

UPRIGHT = Pose(310.0, 95.0, -40.0, 30.0, 0.0, 180.0, tool=1)
"""Of the new tool, whose frame is where its tip is: at the pin, on the plane, atop the ball."""

OF_ALL: dict[str, Any] = {
    "tool": 1,
    "written": ToolOffset(12.0, -4.0, -20.0),
    "tip": ToolOffset(12.0, -4.0, -20.0),
    "tolerance_mm": 0.2,
    "touch": TouchPlan(),
    "u_mm": 0.02,
    "upright": UPRIGHT,
}
TILTED = {
    "pin": TiltTest(**OF_ALL, pin_mm=(310.0, 95.0, -40.0), tilt_deg=20.0),
    "plane": PlaneTest(**OF_ALL, plane=TouchedPlane((0, 0, 1), -40.0), tilt_deg=20.0, axes=6),
    "sphere": SphereTest(
        **OF_ALL,
        survey=SphereSurvey(10.0),
        sphere=TouchedSphere((310.0, 95.0, -50.0), 10.0),
        axes=6,
    ),
}

TURNED = {name: value for name, value in OF_ALL.items() if name != "upright"}
TESTS = TILTED | {
    "turned": TurnTest(**TURNED, contact=replace(UPRIGHT, hand=Hand.RIGHT), angles_deg=(120.0,))
}


def first_contact(test, pose):
    """Answer the first question of a proof after a break; return the steps, and the next one."""
    steps = test.steps_after_a_break(*(() if isinstance(test, TurnTest) else (UPRIGHT,)))
    assert isinstance(next(steps), Ask)
    lift = steps.send(TouchedAt.of(pose))
    assert lift.target == replace(pose, z_mm=pose.z_mm + test.touch.lift_mm)
    return steps, lift


@pytest.mark.parametrize(
    ("kind", "aside"),
    [
        ("pin", {"x_mm": 313.0}),
        ("turned", {"x_mm": 313.0}),
        ("turned", {"z_mm": -37.0}),
        ("plane", {"z_mm": -37.0}),
        ("sphere", {"z_mm": -37.0}),
        # On the ball all the same, but so far down that straight up from there it is in the way.
        ("sphere", {"x_mm": 319.0, "z_mm": -50.0 + 19.0**0.5}),
    ],
)
@pytest.mark.parametrize("tolerance_mm", [0.2, 5.0], ids="tolerance {}".format)
def test_a_first_contact_that_is_elsewhere_ends_it_before_anything_tilts(kind, aside, tolerance_mm):
    """Also where the process could bear it: the robot would come down too near."""
    test = replace(TESTS[kind], tolerance_mm=tolerance_mm)
    steps, lift = first_contact(test, replace(UPRIGHT, **aside))
    with pytest.raises(StopIteration) as ended:
        steps.send(lift.target)
    assert not ended.value.value.passed
    assert ended.value.value.max_drift_mm > 2.9


def test_a_turn_test_keeps_the_hand_in_which_the_person_left_the_arm():
    left = replace(UPRIGHT, hand=Hand.LEFT)
    steps, lift = first_contact(TESTS["turned"], left)
    assert lift.target.hand is Hand.LEFT
    step = steps.send(lift.target)
    assert isinstance(step, Consider)
    assert {move.target.hand for move in step.moves} == {Hand.LEFT}


@pytest.mark.parametrize("kind", TILTED)
def test_a_first_contact_that_is_right_leads_on_to_the_tilts(kind):
    steps, lift = first_contact(TILTED[kind], replace(UPRIGHT, x_mm=310.3, u_deg=-80.0))
    assert isinstance(steps.send(lift.target), Consider)


def test_a_tool_that_leans_is_not_taken_for_the_first_contact():
    ask = next(TILTED["pin"].steps_after_a_break(UPRIGHT))
    assert isinstance(ask, Ask)
    assert ask.judge
    turned = replace(UPRIGHT, u_deg=170.0)
    assert ask.judge(TouchedAt.of(turned)) is None
    told = ask.judge(TouchedAt.of(replace(turned, v_deg=6.0)))
    assert told
    assert told.code == "not_upright"
    assert "The tool leans 6 deg. Jog it upright first" in told.sentence
