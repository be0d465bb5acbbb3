"""A whole tool frame: touches, then the axes shown in the air."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robolink.calibration import rotation_of, solve_six_point, solve_tool_axis, uvw_deg, zyz_deg
from robolink.errors import CalibrationError, ConfigError
from robolink.methods import AxisTeachPlan, informative_tilts, measure_six_point
from robolink.methods.pivot.six_point import SixPointSource
from robolink.model import Path, Pose, ToolOffset
from robolink.runner import TeachPrompt, TouchedAt
from tests.calibration._simulated import (
    assert_honest,
    coverage,
    pivoting,
    refused,
    rotation,
    shaken,
)
from tests.calibration._tilting_person import FRAMES, PIN, PLAN, STORED, Person, tip_mm, turned_deg
from tests.calibration._tilting_person import TIP as SHOWN_TIP

# A whole tool frame, and the direction of one axis.

TIP = (4.2, -7.9, 131.6)
ANGLES = (35.0, 20.0, -50.0)
START = ((40, 30, 0), (-75, -25, 25), (160, 10, -35), (10, 5, 15))
WAY_MM = 120.0


def moved(pose, tool_vector):
    """Return the pose after a move along the tool's own axes."""
    x, y, z = (rotation_of(pose) @ rotation(*ANGLES) @ tool_vector).tolist()
    return replace(pose, x_mm=pose.x_mm + x, y_mm=pose.y_mm + y, z_mm=pose.z_mm + z)


def six(second=(0, 0, WAY_MM)):
    pivot = [pivoting(TIP, angles) for angles in START]
    return [*pivot, moved(pivot[-1], (WAY_MM, 0, 0)), moved(pivot[-1], second)]


def solve(poses, **more):
    return solve_six_point(poses[:-2], poses[-2], poses[-1], **more)


def test_exact_points_give_the_whole_frame():
    result = solve(six())
    assert result.offset.components() == pytest.approx((*TIP, *ANGLES), abs=1e-9)
    assert result.off_square_deg == pytest.approx(0, abs=1e-6)
    assert (result.measured[-1], result.kept) == ("w_deg", ())


def test_a_point_in_the_xz_plane_does_as_well():
    result = solve(six(second=(70, 0, 90)), second_is="xz")
    assert result.offset.components() == pytest.approx((*TIP, *ANGLES), abs=1e-9)
    assert result.off_square_deg is None


def test_the_ways_may_start_where_there_is_room():
    poses = six()
    pivot, start = (
        poses[:-2],
        replace(poses[-3], x_mm=poses[-3].x_mm + 30, z_mm=poses[-3].z_mm + 80),
    )
    ends = (moved(start, (WAY_MM, 0, 0)), moved(start, (0, 0, WAY_MM)))
    result = solve_six_point(pivot, *ends, start=start, sigma_mm=0.05)
    assert result.offset.components() == pytest.approx((*TIP, *ANGLES), abs=1e-9)
    assert result.inputs == (*pivot, start, *ends)
    # The tip is as accurate as before, and each angle to about sigma sqrt2 / way.
    at_pin = solve(poses, sigma_mm=0.05)
    assert result.half_width95[:3] == pytest.approx(at_pin.half_width95[:3])
    assert result.half_width95[3:] == pytest.approx(at_pin.half_width95[3:], rel=0.3)


def test_an_axis_far_from_where_it_is_stored_is_in_doubt():
    near, far = ToolOffset(0, 0, 0, 20, 10, -30), ToolOffset(0, 0, 0, 200, 20, -50)
    assert "turned_from_stored" not in solve(six(), stored=near).warnings
    assert "turned_from_stored" in solve(six(), stored=far).warnings


def test_ways_that_are_not_square_are_refused_beyond_two_degrees():
    lean = math.tan(math.radians(1.5)) * WAY_MM
    assert solve(six(second=(lean, 0, WAY_MM))).off_square_deg == pytest.approx(1.5)
    with refused("axes_not_square"):
        solve(six(second=(2 * lean, 0, WAY_MM)))


def test_a_turn_or_a_short_way_is_refused():
    poses = six()
    with refused("turned_on_the_way"):
        solve([*poses[:-1], replace(poses[-1], u_deg=poses[-1].u_deg + 0.1)])
    with refused("short_axis"):
        solve(six(second=(0, 0, 4)))


def test_the_intervals_of_all_six_hold_the_truth(trials):
    exact = six()

    def measure(rng):
        return solve(shaken(exact, rng, 0.05, axes=3))

    assert_honest(coverage(measure, (*TIP, *ANGLES), trials), trials)


def test_a_stated_sigma_takes_the_place_of_the_scatter():
    poses = shaken(six(), np.random.default_rng(1), 0.05, axes=3)
    free, stated = solve(poses), solve(poses, sigma_mm=0.05)
    scale = (0.05 / free.sigma_mm) ** 2
    assert np.array(stated.covariance) == pytest.approx(np.array(free.covariance) * scale)
    assert stated.half_width95[5] == pytest.approx(1.959964 * stated.covariance[5][5] ** 0.5)


def test_two_touches_along_an_axis_show_its_direction():
    start = pivoting(TIP, (10, 5, 15))
    axis = solve_tool_axis(start, moved(start, (0, 0, 80)), sigma_mm=0.04)
    assert axis.direction == pytest.approx(rotation(*ANGLES)[:, 2])
    assert axis.tilt_deg == pytest.approx(math.degrees(math.acos(rotation(*ANGLES)[2, 2])))
    assert axis.sigma_deg == pytest.approx(math.degrees(math.sqrt(2) * 0.04 / 80))
    assert solve_tool_axis(start, moved(start, (0, 0, 80))).sigma_deg is None
    with refused("short_axis"):
        solve_tool_axis(start, start)
    for sigma_mm in (0.0, -0.04, math.inf):
        with pytest.raises(ConfigError, match="sigma_mm"):
            solve_tool_axis(start, moved(start, (0, 0, 80)), sigma_mm=sigma_mm)


CASES = [ANGLES, (0, 0, 0), (170, -89, 20), (-100, 45, 179), (30, 90, 0), (30, -90, 0), (180, 0, 0)]


@pytest.mark.parametrize("angles", CASES)
def test_angles_are_read_off_a_matrix_and_lead_back_to_it(angles):
    matrix = rotation(*angles)
    assert rotation_of(Pose(0, 0, 0, *uvw_deg(matrix))) == pytest.approx(matrix, abs=1e-9)


def test_who_changes_a_rotation_changes_no_other_and_each_is_that_of_its_own_angles():
    changed = rotation_of(Pose(0, 0, 0, 10, 20, 30))
    changed[0, 0] = 7.0
    again = rotation_of(Pose(5, 6, 7, 10, 20, 30))
    assert again == pytest.approx(
        Rotation.from_euler("ZYX", [10, 20, 30], degrees=True).as_matrix()
    )
    # Where the arm hangs, 0 and -0 lead to 180 and -180.
    for zero in (0.0, -0.0):
        assert math.copysign(1.0, rotation_of(Pose(0, 0, 0, zero))[1, 0]) == math.copysign(1, zero)


@pytest.mark.parametrize("angles", [*CASES, (25, 0, 180), (-40, 180, 0)])
def test_codesys_angles_are_the_same_matrix(angles):
    matrix = rotation(*angles)
    a, b, c = zyz_deg(matrix)
    assert Rotation.from_euler("ZYZ", [a, b, c], degrees=True).as_matrix() == pytest.approx(
        matrix, abs=1e-9
    )
    if abs(math.sin(math.radians(b))) < 1e-9:
        assert c == 0
    assert 0 <= b <= 180


def test_random_rotations_survive_both_ways():
    for matrix in Rotation.random(200, rng=np.random.default_rng(1)).as_matrix():
        assert rotation(*uvw_deg(matrix)) == pytest.approx(matrix, abs=1e-9)
        back = Rotation.from_euler("ZYZ", zyz_deg(matrix), degrees=True).as_matrix()
        assert back == pytest.approx(matrix, abs=1e-9)


# Six points with a person: touches, then the axes shown in the air; errors are reported at once.

TURN_DEG = (15.0, 8.0, -5.0)
TOOL = ToolOffset(*SHOWN_TIP.components()[:3], *TURN_DEG)
AXES = rotation_of(Pose(0.0, 0.0, 0.0, *TURN_DEG))
X, Y, Z = AXES.T
WAYS = {TeachPrompt.ALONG_X: X, TeachPrompt.ALONG_Z: Z}
ANY_Z = {TeachPrompt.ALONG_X: X, TeachPrompt.ALONG_Z: 0.7 * X + 0.7 * Z}


class Guide(Person):
    """Shows axes too: the next of ``shows`` each time, and in the end the right one.

    A shown step is a vector in the flange's axes, mm, and the turn of the tool. Both ends of a move
    are sighted with an error.
    """

    def __init__(self, start=FRAMES[0], *, shows=(), ways=WAYS, **more):
        super().__init__(start, **more)
        self._shows, self._ways = list(shows), ways
        self.asked = []

    def _shown(self, step):
        self.asked.append(step.shown)
        here = self._here
        if step.shown is TeachPrompt.ROOM:
            # A flange that points down needs room for the move below it.
            down_mm = min(0.0, *(60 * (rotation_of(here) @ way)[2] for way in self._ways.values()))
            way, turn_deg, error = (0.0, 0.0, -down_mm), 0.0, self._error()
            self._aside = error
        else:
            right = 60.0 * self._ways[step.shown], 0.0
            own, turn_deg = self._shows.pop(0) if self._shows else right
            way, error = rotation_of(here) @ own, np.subtract(self._error(), self._aside)
        x, y, z = np.add(way, error).tolist()
        self._here = replace(
            here,
            x_mm=here.x_mm + x,
            y_mm=here.y_mm + y,
            z_mm=here.z_mm + z,
            u_deg=here.u_deg + turn_deg,
        )
        return self._here


def measured(guide, **more):
    return guide.run(
        measure_six_point(
            PLAN, AxisTeachPlan(**more), tilts=informative_tilts(5, 20.0), stored=STORED
        )
    )


@pytest.mark.parametrize("start", FRAMES)
@pytest.mark.parametrize(("second_is", "ways"), [("z", WAYS), ("xz", ANY_Z)])
def test_exact_poses_give_all_six_whichever_way_the_flange_points(start, second_is, ways):
    guide = Guide(start, sigma_mm=0.0, ways=ways)
    result = measured(guide, second_is=second_is)
    assert result.method == "six-point"
    assert result.offset.components() == pytest.approx(TOOL.components(), abs=1e-8)
    assert guide.asked == [TeachPrompt.ROOM, TeachPrompt.ALONG_X, TeachPrompt.ALONG_Z]
    assert result.inputs[-1].u_deg == pytest.approx(start.u_deg)


@pytest.mark.parametrize("start", FRAMES)
def test_the_robot_only_goes_straight_back_and_ends_above_the_pin_as_it_began(start):
    guide = Guide(start)
    measured(guide)
    shown = [move for move in guide.steps if "where the move began" in move[0].purpose]
    assert [step.path for step, _, _ in shown] == [Path.STRAIGHT] * 2
    assert all(turned_deg(here, there) < 1e-4 for _, here, there in shown)
    for _, _, there in guide.steps:
        assert tip_mm(there)[2] > PIN[2] + PLAN.clearance_mm - 1.0
    end = guide.steps[-1][2]
    assert tip_mm(end) == pytest.approx(np.add(PIN, (0, 0, PLAN.lift_mm)), abs=1.5)
    assert turned_deg(end, guide.touches[0]) < 1e-4


@pytest.mark.parametrize(
    ("shows", "what", "remedy"),
    [
        ([(8.0 * X, 0.0)], "The move along the axis is 8.0", "Move 50 mm or more"),
        (
            [(60.0 * X, 0.5), (0.0 * X, -0.5)],
            "The tool turned during the move",
            "Keep the orientation",
        ),
        (
            [(60.0 * X + 4.0 * Z, 0.0)],
            "degrees off a right angle",
            "start both moves at the same pose",
        ),
    ],
)
def test_a_way_that_cannot_be_used_is_said_at_once_and_shown_again(shows, what, remedy):
    guide = Guide(sigma_mm=0.0, shows=shows)
    result = measured(guide)
    (told,) = [text for text in guide.told if what in text and remedy in text]
    assert told
    assert result.offset.components() == pytest.approx(TOOL.components(), abs=1e-6)
    assert any("U, V and W: repeatable to" in text for text in guide.told)


@pytest.mark.parametrize(
    ("show", "code", "asked"),
    [
        ((2.0 * X, 0.0), "short_axis", 4),
        ((60.0 * X, 0.5), "turned_on_the_way", 4),
        ((60.0 * (X + Z), 0.0), "axes_not_square", 7),
    ],
)
def test_after_the_third_time_it_ends_with_the_name_of_what_is_wrong(show, code, asked):
    guide = Guide(shows=[show] * 6)
    if code == "axes_not_square":
        guide = Guide(ways={TeachPrompt.ALONG_X: X + Z, TeachPrompt.ALONG_Z: Z})
    with pytest.raises(CalibrationError) as refused:
        measured(guide)
    assert refused.value.code == code
    assert len(guide.asked) == asked


@pytest.mark.parametrize("accepts", [0, 1])
def test_a_way_to_the_wrong_side_is_offered_again_or_stays_in_doubt(accepts):
    guide = Guide(sigma_mm=0.0, shows=[(-60.0 * X, 0.0)], accepts=accepts)
    result = measured(guide)
    assert guide.offers[0].startswith("This move is 163 degrees off the stored +X")
    assert ("turned_from_stored" in result.warnings) is (not accepts)
    right = result.offset.components() == pytest.approx(TOOL.components(), abs=1e-6)
    assert right is bool(accepts)


def test_ways_that_are_less_square_than_the_touches_scatter_are_offered_again():
    askew = (60.0 * X + 0.4 * Z, 0.0)
    doubted = Guide(shows=[askew])
    assert "ways_askew" in measured(doubted).warnings
    (told,) = [text for text in doubted.told if "right angle" in text]
    assert "The touches explain less than that" in told
    again = Guide(shows=[askew], accepts=1)
    assert measured(again).warnings == ()
    assert again.offers == ["Show both moves again?"]
    assert len(again.asked) == 5


def test_the_truth_of_place_and_orientation_lies_in_the_interval():
    held = total = 0
    for seed in range(100, 125):
        result = measured(Guide(seed=seed))
        errors = np.abs(np.subtract(result.offset.components(), TOOL.components()))
        held += int((errors <= result.half_width95).sum())
        total += 6
        assert "ways_askew" not in result.warnings
        assert (errors < 4 * np.array(result.half_width95)).all()
    assert 0.90 < held / total < 0.99


@pytest.mark.parametrize("again", [0, 3])
def test_from_the_values_one_touch_is_made_again_and_the_ways_stay(again):
    class Slips(Guide):
        def _error(self):
            slipped = len(self.touches) == again and not self.asked
            return [0.1 if slipped else 0.0, 0.0, 0.0]

    guide = Slips()
    before = measured(guide)
    assert (
        np.linalg.norm(np.subtract(before.offset.components()[:3], SHOWN_TIP.components()[:3]))
        > 0.01
    )
    taken = [TouchedAt.of(pose) for pose in before.inputs]
    result = guide.run(
        SixPointSource(informative_tilts(5, 20.0), PLAN, ways=AxisTeachPlan()).further_steps(
            guide.steps[-1][2], taken, again, STORED
        )
    )
    assert result.offset.components() == pytest.approx(TOOL.components(), abs=1e-6)
    assert guide.asked == [TeachPrompt.ROOM, TeachPrompt.ALONG_X, TeachPrompt.ALONG_Z]
    kept = [pose for number, pose in enumerate(before.inputs) if number != again]
    assert [pose for number, pose in enumerate(result.inputs) if number != again] == kept
    assert tip_mm(guide.steps[-1][2])[2] == pytest.approx(PIN[2] + PLAN.lift_mm, abs=0.1)
    assert turned_deg(guide.steps[-1][2], guide.touches[0]) < 1e-6
