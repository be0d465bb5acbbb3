"""The accuracy of a result: its rows, their sources, and the largest one."""

import math
from dataclasses import replace

import pytest
from scipy.special import chndtr, ndtr

from robolink.calibration import (
    ACCURACY_ROWS,
    Accuracy,
    AccuracyFacts,
    Beam,
    CalibrationResult,
    Crossing,
    ErrorSource,
    Pin,
    RowFact,
    Touch,
    assessed,
    solve_crossed_beams,
    solve_n_angle,
    solve_one_touch,
    solve_two_pose,
    solve_z_touch,
)
from robolink.model import Pose, ToolOffset

TOUCHES = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
BEAMS = Beam(300, 80, 0), Beam(300, 80, 90)
CROSSINGS = [
    Crossing(0, Pose(288, 83.0, -60, 0), Pose(288, 84.0, -60, 0)),
    Crossing(0, Pose(288, 84.0, -60, 0), Pose(288, 83.0, -60, 0)),
    Crossing(1, Pose(287.5, 83.5, -60, 0), Pose(288.5, 83.5, -60, 0)),
    Crossing(1, Pose(288.5, 83.5, -60, 0), Pose(287.5, 83.5, -60, 0)),
] * 2


def judged(result, facts):
    return assessed(result, facts)


def one_touched(*given, **stated):
    return solve_one_touch(*given, **stated)


def crossed(*given, **stated):
    return solve_crossed_beams(*given, **stated)


def two_pose(sigma_mm=0.02):
    return solve_two_pose(*TOUCHES, sigma_mm=sigma_mm)


def test_a_touch_by_eye_is_accurate_to_what_a_person_sees():
    found = judged(two_pose(sigma_mm=0.0001), AccuracyFacts())

    assert found.repeatable_to_mm < 0.001
    assert found.accurate_to_mm == pytest.approx(0.071, abs=0.0005)  # evidence 19
    assert found.accuracy.largest.key == "touch_mm"
    assert found.accuracy.largest.basis == "default"


def test_the_scatter_is_one_row_beside_the_others():
    found = judged(two_pose(), AccuracyFacts())

    assert found.repeatable_to_mm == pytest.approx(0.0346, abs=0.0005)
    assert found.accurate_to_mm == pytest.approx(0.079, abs=0.0005)
    assert found.accuracy.without_defaults_mm == pytest.approx(found.repeatable_to_mm)
    assert {row.key for row in found.accuracy.rows} == {"scatter", "touch_mm"}


def test_what_the_cell_states_takes_the_place_of_the_default():
    rows = {"touch_mm": RowFact(0.025, "stated", told="recipe")}

    found = judged(two_pose(), AccuracyFacts(rows=rows))

    assert found.accurate_to_mm < 0.05
    assert found.accuracy.largest_default is None


def test_an_input_that_showed_each_touch_needs_no_eye():
    found = judged(two_pose(), AccuracyFacts(by_contact=True))

    assert found.accurate_to_mm == pytest.approx(found.repeatable_to_mm)


def region_mm(sigma_mm, gain=0.5**0.5):
    return math.sqrt(5.991) * sigma_mm * gain


def test_a_person_aims_at_a_pin_whose_contact_an_input_shows():
    """The input shows contact and height: sideways a person aims by eye."""
    bare = two_pose(sigma_mm=None)
    by_person = judged(bare, AccuracyFacts(by_contact=True))
    by_program = judged(bare, AccuracyFacts(by_contact=True, by_program=True))

    assert [row.key for row in by_person.accuracy.rows] == ["scatter"]
    assert by_person.accurate_to_mm == pytest.approx(region_mm(0.03), rel=0.001)
    assert by_program.accurate_to_mm == pytest.approx(region_mm(0.005), rel=0.001)


def test_touches_that_agree_by_luck_do_not_make_an_aim_sure():
    poses = [Pose(298, 99, -60, 0), Pose(322, 91, -60, 180), Pose(306.001, 83, -60, 90)]
    facts = AccuracyFacts(by_contact=True)
    found = judged(solve_n_angle(poses), facts)

    assert found.repeatable_to_mm < 0.01
    assert found.accurate_to_mm == pytest.approx(region_mm(0.03, found.sigma_gain), rel=0.001)
    assert found.accuracy.largest_default.key == "scatter"
    for told in (
        judged(solve_n_angle(poses, sigma_mm=0.004), facts),
        judged(solve_n_angle(poses), AccuracyFacts(by_contact=True, look_sigma_mm=0.004)),
        judged(solve_n_angle(poses), AccuracyFacts(by_contact=True, by_program=True)),
    ):
        assert told.accurate_to_mm == pytest.approx(told.repeatable_to_mm)


def test_of_a_tool_whose_axes_were_shown_the_angles_stay_as_sure_as_they_are():
    measured = ("x_mm", "y_mm", "z_mm", "u_deg")
    sure = [0.001**2] * 3 + [0.02**2]
    bare = CalibrationResult(
        "six-point", ToolOffset(1, 2, 3, 4), measured, (), (), 0.8, (), TOUCHES,
        covariance=tuple(tuple(s if i == j else 0.0 for j in range(4)) for i, s in enumerate(sure)),
        half_width95=(0.002, 0.002, 0.002, 0.05),
        region95_radius_mm=0.003,
        interval_from="residuals",
        dof=12,
        sources=(ErrorSource.of_lengths("touch_mm", 3),),
    )  # fmt: skip
    found = judged(bare, AccuracyFacts(by_contact=True))

    assert found.accurate_to_mm == pytest.approx(2.795 * 0.03 * 0.8, rel=0.001)
    assert found.accuracy.half_width95[3] == pytest.approx(0.05)


def test_what_no_person_aimed_is_not_held_to_their_aim():
    """A hand-written case may claim an input for a camera, but nobody aimed a camera."""
    seen = replace(
        two_pose(sigma_mm=None), half_width95=(0.01, 0.01), region95_radius_mm=0.0125,
        covariance=((0.0051**2, 0.0), (0.0, 0.0051**2)), dof=6, interval_from="residuals",
        sources=(ErrorSource.of_lengths("tip_image_px", 2, gain=0.0),),
    )  # fmt: skip
    assert judged(seen, AccuracyFacts(by_contact=True)).accurate_to_mm == pytest.approx(0.0125)


def test_an_input_tells_the_height_of_a_touch_better_than_a_person_aims_it():
    bare = one_touched(Pose(300, 100, -60, 0), Pin(312, 96.5, -80))
    rows = {"place_mm": RowFact(0.0, "stated")}
    found = judged(bare, AccuracyFacts(rows, by_contact=True))

    x_mm, y_mm, z_mm = found.accuracy.half_width95
    assert (x_mm, y_mm) == pytest.approx((1.96 * 0.03, 1.96 * 0.03), rel=0.001)
    assert z_mm == pytest.approx(1.96 * 0.005, rel=0.001)


def held_at(found, sigma_mm, shift_mm):
    """Return the share of truths within U for a constant error."""
    return chndtr((found.accurate_to_mm / sigma_mm) ** 2, 2, (shift_mm / sigma_mm) ** 2)


@pytest.mark.parametrize("half_width", [0.2, 0.6, 1.0, 1.6, 3.0])
def test_an_error_at_the_end_of_a_row_of_one_number_is_held(half_width):
    """With a / sqrt(3) alone it was held in 93 %, where it is about as large as the scatter."""
    sigma_mm = 0.01
    bare = replace(
        two_pose(sigma_mm=sigma_mm * math.sqrt(2)),
        sources=(ErrorSource("camera_scale_percent", ((0.006,), (0.008,)), "as_offset"),),
    )
    rows = {"camera_scale_percent": RowFact(half_width, "stated")}
    found = judged(bare, AccuracyFacts(rows))

    assert held_at(found, sigma_mm, 0.01 * half_width) > 0.9499
    # Never wider than the error together with its scatter.
    assert found.accurate_to_mm < 0.01 * half_width + 2.45 * sigma_mm
    for half_mm, gain in zip(found.accuracy.half_width95, (0.006, 0.008), strict=True):
        off = gain * half_width / sigma_mm
        inside = ndtr(half_mm / sigma_mm - off) - ndtr(-half_mm / sigma_mm - off)
        assert inside > 0.9499


def test_a_height_that_is_wrong_by_all_that_is_stated_of_it_is_held():
    seen = [Touch(-60.0, v) for v in (1.0, 2.0) * 3]
    rows = {"plate_mm": RowFact(0.02, "stated")}
    found = judged(solve_z_touch(seen, -80.0, sigma_mm=0.01), AccuracyFacts(rows))

    assert found.accurate_to_mm > 0.02 + 1.64 * found.repeatable_to_mm / 1.96
    assert found.accuracy.half_width95 == pytest.approx((found.accurate_to_mm,))


def test_without_a_scatter_of_its_own_a_usual_one_counts_as_a_default():
    found = judged(two_pose(sigma_mm=None), AccuracyFacts())

    assert found.repeatable_to_mm is None
    assert found.accurate_to_mm == pytest.approx(
        math.sqrt(5.991 * ((0.03 / math.sqrt(2)) ** 2 + 0.05**2 / 3)), abs=0.001
    )
    scatter = next(row for row in found.accuracy.rows if row.key == "scatter")
    assert scatter.basis == "default"


def test_a_method_that_says_nothing_of_its_errors_and_scatter_is_accurate_to_nothing():
    bare = CalibrationResult(
        "own", ToolOffset(1, 2, 3), ("x_mm", "y_mm"), ("z_mm",), (), 1.0, (), TOUCHES
    )

    assert assessed(bare, AccuracyFacts()).accuracy is None


@pytest.mark.parametrize(
    ("months", "within_mm"), [(0, 0.028), (1, 0.042), (2, 0.057), (8, 0.141), (30, 0.141)]
)
def test_the_place_of_beams_is_known_worse_the_longer_ago_it_was_learnt(months, within_mm):
    solved = solve_crossed_beams(CROSSINGS, BEAMS, sigma_mm=0.0005)

    found = judged(solved, AccuracyFacts(months=months))

    assert found.accurate_to_mm == pytest.approx(within_mm, abs=0.001)


def test_a_stated_place_does_not_grow():
    rows = {"place_mm": RowFact(0.01, "stated")}

    found = judged(
        solve_crossed_beams(CROSSINGS, BEAMS, sigma_mm=0.0005), AccuracyFacts(rows, months=30)
    )

    assert found.accurate_to_mm == pytest.approx(0.0142, abs=0.0005)


def test_beams_whose_places_are_solved_for_rely_on_none():
    turned = [
        *CROSSINGS[:4],
        *(
            Crossing(
                one.beam,
                Pose(624 - one.entry.x_mm, 153 - one.entry.y_mm, -60, 180),
                Pose(624 - one.exit.x_mm, 153 - one.exit.y_mm, -60, 180),
            )
            for one in CROSSINGS[:4]
        ),
    ]

    found = crossed(turned, BEAMS, sigma_mm=0.002, beams_may_have_moved=True)

    assert [source.row for source in found.sources] == []


def test_one_touch_relies_on_the_place_of_the_pin_and_on_the_eye():
    found = one_touched(Pose(300, 100, -60, 0), Pin(312, 96.5, -80), sigma_mm=0.02)

    assert {source.row: source.turning for source in found.sources} == {
        "touch_mm": "with_tool",
        "place_mm": "in_base",
    }


def test_a_row_in_one_direction_widens_that_direction():
    found = two_pose(sigma_mm=0.001)
    askew = ErrorSource("camera_turn_deg", ((0.2,), (0.0,)), "as_offset")
    turned = judged(
        CalibrationResult(
            **{
                **{name: getattr(found, name) for name in CalibrationResult.__dataclass_fields__},
                "sources": (askew,),
            }
        ),
        AccuracyFacts(),
    )

    x, y = turned.accuracy.half_width95
    assert x == pytest.approx(1.96 * 0.1 / math.sqrt(3), rel=0.01)
    assert y == pytest.approx(1.96 * 0.001 * found.sigma_gain, rel=0.01)


def test_json_goes_back_and_forth():
    poses = [Pose(298, 99, -60, 0), Pose(322, 91, -60, 180), Pose(306.001, 83, -60, 90)]
    accuracy = judged(solve_n_angle(poses), AccuracyFacts()).accuracy

    again = Accuracy.from_json(accuracy.as_json(("x_mm", "y_mm")))

    assert again == accuracy


def test_every_row_has_a_unit_in_its_name_and_a_positive_default():
    for key, row in ACCURACY_ROWS.items():
        assert key == row.key
        assert key.endswith("_" + {"percent": "percent"}.get(row.unit, row.unit))
        assert row.default > 0
