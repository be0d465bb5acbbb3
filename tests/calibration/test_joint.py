"""Several tools on one pin, one tool on several pins."""

import numpy as np
import pytest

from robolink.calibration import JointTouch, solve_joint, solve_n_angle, solve_pivot
from robolink.model import ToolOffset
from tests.calibration._simulated import (
    PIN,
    assert_honest,
    pivoting,
    refused,
    shaken,
    touching,
)

TIPS = {1: (12.3, -3.9), 2: (-20.1, 4.4)}
ANGLES = (-150.0, -30.0, 60.0)
TILTS = [(0, 0, 0), (40, 30, 0), (-75, -15, 25), (120, 10, -30)]


def planar(rng=None, sigma_mm=0.0, tools=(1, 2)):
    found = []
    for tool in tools:
        poses = [touching(TIPS[tool], angle) for angle in ANGLES]
        poses = shaken(poses, rng, sigma_mm) if rng else poses
        found += [JointTouch(pose, tool) for pose in poses]
    return found


def xy(result):
    return (result.offset.x_mm, result.offset.y_mm)


def test_several_tools_on_one_pin():
    result = solve_joint(planar(), stored={1: ToolOffset(0, 0, -20, 5)})
    assert {tool: pytest.approx(xy(r)) for tool, r in result.tools.items()} == TIPS
    assert result.pins_mm == {0: pytest.approx(PIN[:2])}
    assert (result.tools[1].offset.z_mm, result.tools[2].offset.z_mm) == (-20, 0)
    assert result.tools[1].dof == 12 - 6


def test_one_tool_on_several_pins_in_space():
    tip, pins = (4.2, -7.9, 131.6), {5: PIN, 6: (250.0, 20.0, -10.0)}
    touches = [
        JointTouch(pivoting(tip, angles, pin=place), 3, pin)
        for pin, place in pins.items()
        for angles in TILTS
    ]
    result = solve_joint(touches)
    assert result.tools[3].offset.components()[:3] == pytest.approx(tip)
    assert {pin: pytest.approx(place) for pin, place in result.pins_mm.items()} == pins
    assert result.tools[3].measured == ("x_mm", "y_mm", "z_mm")


def test_one_tool_on_one_pin_is_the_usual_fit():
    flat = planar(np.random.default_rng(1), 0.05, tools=(1,))
    alone = solve_n_angle([touch.flange for touch in flat])
    joint = solve_joint(flat).tools[1]
    assert xy(joint) == pytest.approx(xy(alone))
    assert np.array(joint.covariance) == pytest.approx(np.array(alone.covariance), abs=1e-9)
    assert np.array(joint.residuals_mm) == pytest.approx(np.array(alone.residuals_mm), abs=1e-9)
    poses = shaken(
        [pivoting((4, -8, 130), t) for t in TILTS], np.random.default_rng(2), 0.1, axes=3
    )
    space = solve_joint([JointTouch(pose, 1) for pose in poses]).tools[1]
    assert space.half_width95 == pytest.approx(solve_pivot(poses).half_width95)


def test_a_tool_with_one_touch_is_found_through_the_pin_of_another():
    touches = [*planar(tools=(1,)), JointTouch(touching(TIPS[2], 45.0), 2)]
    assert xy(solve_joint(touches).tools[2]) == pytest.approx(TIPS[2])


def test_the_difference_of_tools_is_known_better_than_each():
    touches = planar(np.random.default_rng(1), 0.05)
    # All angles near each other: the pin mixes with both offsets alike.
    near = [JointTouch(touching(TIPS[t], a), t) for t in TIPS for a in (0.0, 25.0, 50.0)]
    result = solve_joint(near, sigma_mm=0.05)
    difference = result.difference(1, 2)
    assert difference.vector_mm == pytest.approx((32.4, -8.3))
    # Six placements at three angles: what is left is three differences of two.
    assert difference.half_width95_mm == pytest.approx([1.959964 * 0.05 * (2 / 3) ** 0.5] * 2)
    assert max(difference.half_width95_mm) < 0.7 * max(result.tools[1].half_width95)
    assert solve_joint(touches).difference(2, 1).vector_mm == pytest.approx((-32.4, 8.3), abs=0.2)


def test_without_residual_or_sigma_a_difference_has_no_interval():
    touches = [JointTouch(touching(TIPS[1], a), 1) for a in (0.0, 180.0)]
    result = solve_joint([*touches, JointTouch(touching(TIPS[2], 0.0), 2)])
    assert result.difference(1, 2).half_width95_mm == ()
    assert result.tools[2].half_width95 == ()


def test_what_cannot_be_told_apart_is_refused():
    with refused("rank_deficient"):
        solve_joint([JointTouch(touching(TIPS[t], 30.0), t) for t in (1, 2, 1)])
    with refused("insufficient_rotation"):
        solve_joint([JointTouch(touching(TIPS[1], a), 1) for a in (0.0, 0.2, 0.4)])
    with refused("too_few_poses"):
        solve_joint([JointTouch(touching(TIPS[t], 0.0), t) for t in (1, 2)])


def test_the_intervals_of_offsets_and_difference_hold_the_truth(trials):
    rng, hits = np.random.default_rng(4), np.zeros(6)
    truth = np.array([*TIPS[1], *TIPS[2], 32.4, -8.3])
    for _ in range(trials):
        result = solve_joint(planar(rng, 0.05))
        difference = result.difference(1, 2)
        found = [*xy(result.tools[1]), *xy(result.tools[2]), *difference.vector_mm]
        halves = [
            *result.tools[1].half_width95,
            *result.tools[2].half_width95,
            *difference.half_width95_mm,
        ]
        hits += np.abs(np.array(found) - truth) <= np.array(halves)
    assert_honest(hits / trials, trials)
