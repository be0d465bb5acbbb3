"""Jog steps and poses as a person types them: what is refused before anything moves."""

import pytest

from robolink.errors import ConfigError, LimitError
from robolink.model import Path, Pose, WorkBox
from robolink.runner import RunSettings, jog_target, parse_steps
from robolink.runner._jog_steps import typed_pose

HERE = Pose(300.0, 100.0, -60.0, 30.0, tool=0)
SETTINGS = RunSettings(WorkBox(), max_jog_mm=5.0, max_jog_deg=10.0)


@pytest.mark.parametrize(
    ("steps", "path", "coordinates"),
    [
        ("x+5 y-5, z+0.1", Path.STRAIGHT, (305.0, 95.0, -59.9, 30.0)),
        ("u-10", Path.JOINT, (300.0, 100.0, -60.0, 20.0)),
        ("x+1 u+8", Path.JOINT, (301.0, 100.0, -60.0, 38.0)),
    ],
)
def test_where_steps_lead_and_that_a_turn_is_no_straight_move(steps, path, coordinates):
    target, way = jog_target(HERE, steps, SETTINGS)
    assert way is path
    assert target.coordinates()[:4] == pytest.approx(coordinates)


@pytest.mark.parametrize("steps", ["x+5.1", "x-5.1", "z-6", "u+10.5", "u-11", "x+1 y-7"])
def test_a_step_too_long_is_refused_either_way(steps):
    with pytest.raises(LimitError):
        jog_target(HERE, steps, SETTINGS)


@pytest.mark.parametrize("axis", "xyzu")
@pytest.mark.parametrize("sign", "+-")
def test_a_decimal_comma_is_refused_at_each_axis_and_said_how_to_write_it(axis, sign):
    """Taken for two steps it would move by the first digit alone."""
    with pytest.raises(ConfigError) as refused:
        parse_steps(f"{axis}{sign}0,5")
    assert f"{axis}{sign}0.5" in refused.value.what


@pytest.mark.parametrize(
    "text",
    ["300.2 100 -60 30", "300 100 -60 31.5", "300 100 -60 30 1.5 0", "301.1 100 -60 30"],
    ids=["outside the box", "turned too far", "leans too far", "too far away"],
)
def test_a_typed_pose_is_about_where_the_frame_is_and_in_its_box(text):
    settings = RunSettings(WorkBox(x_max_mm=300.1))
    assert typed_pose("300.05 100 -60 30", HERE, settings).x_mm == 300.05
    with pytest.raises(LimitError):
        typed_pose(text, HERE, settings)
