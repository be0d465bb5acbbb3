"""Six points with a person: touches, then the axes shown in the air; what is wrong said at once."""

from dataclasses import replace

import numpy as np
import pytest

from robolink.calibration import rotation_of
from robolink.errors import CalibrationError
from robolink.methods import AxisTeachPlan, informative_tilts, measure_six_point
from robolink.methods.pivot.six_point import SixPointSource
from robolink.model import Path, Pose, ToolOffset
from robolink.runner import TeachPrompt, TouchedAt
from tests.calibration._tilting_person import (
    FRAMES,
    PIN,
    PLAN,
    STORED,
    TIP,
    Person,
    tip_mm,
    turned_deg,
)

TURN_DEG = (15.0, 8.0, -5.0)
TOOL = ToolOffset(*TIP.components()[:3], *TURN_DEG)
AXES = rotation_of(Pose(0.0, 0.0, 0.0, *TURN_DEG))
X, Y, Z = AXES.T
WAYS = {TeachPrompt.ALONG_X: X, TeachPrompt.ALONG_Z: Z}
ANY_Z = {TeachPrompt.ALONG_X: X, TeachPrompt.ALONG_Z: 0.7 * X + 0.7 * Z}


class Guide(Person):
    """Shows axes too: each time the next of ``shows``, and in the end as is right.

    A step to show is a vector in the flange's axes, mm, and by how much the tool is turned. Where a
    way begins is sighted with an error just as where it ends.
    """

    def __init__(self, start=FRAMES[0], *, shows=(), ways=WAYS, **more):
        super().__init__(start, **more)
        self._shows, self._ways = list(shows), ways
        self.asked = []

    def _shown(self, step):
        self.asked.append(step.shown)
        here = self._here
        if step.shown is TeachPrompt.ROOM:
            # A flange that points down needs the room of a way below it.
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
    assert guide.offers[0].startswith("This move leads 163 degrees away from +X")
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
    for seed in range(100, 140):
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
    assert np.linalg.norm(np.subtract(before.offset.components()[:3], TIP.components()[:3])) > 0.01
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
