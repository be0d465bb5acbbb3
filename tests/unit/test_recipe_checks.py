"""The tables of a recipe in combination."""

import tomllib

import pytest

from robolink.recipe._loading import _checked
from tests._rows import each_row

PIN = """\
schema = "robolink/recipe/1"
name = "Needle"
basis = "absolute"
z = "kept"
[station]
id = "PIN"
[source]
kind = "two-pose"
[[tools]]
number = 3
"""
POINTS = """\
schema = "robolink/recipe/1"
name = "Needle"
basis = "absolute"
z = "kept"
[station]
id = "PIN"
[source]
kind = "points"
[[tools]]
number = 3
points = [1, 2]
"""
BEAMS = (
    PIN.replace('"two-pose"', '"beams"\nz_mm = -60')
    + """\
[[source.beams]]
input = 3
x_mm = 300
y_mm = 80
direction_deg = 3
[[source.beams]]
input = 4
x_mm = 300
y_mm = 80
direction_deg = 88
"""
)
UNCHECKED = ("repeats = 1", "shaft_mm = 0")
"""Four crossings, and none of the shaft that would check them."""

TOUCH = (
    PIN.replace('"two-pose"', '"z-touch"\ninput = 5')
    .replace('"kept"', '"measured"')
    .replace('id = "PIN"', 'id = "PLATE"\nx_mm = 300\ny_mm = 80\nz_mm = -90')
)
ANGLES = PIN.replace('"two-pose"', '"n-angle"')


def at(x_mm, z_mm):
    return f"{{ x_mm = {x_mm}, y_mm = 0, z_mm = {z_mm}, u_deg = 0 }}"


def problems(text):
    return {problem.where: problem.what for problem in _checked(tomllib.loads(text))[1]}


def with_(text, header, *lines):
    """Add lines below an existing header, or add both."""
    body = "\n".join(lines)
    if f"{header}\n" in text:
        return text.replace(f"{header}\n", f"{header}\n{body}\n")
    return f"{text}{header}\n{body}\n"


@each_row("text", [PIN, POINTS, BEAMS, TOUCH, with_(ANGLES, "[source]", "count = 3")])
def test_the_recipes_that_are_varied_here_are_right(text):
    assert problems(text) == {}


@each_row(
    ("text", "where", "what"),
    [
        (with_(PIN, "[source]", "count = 4"), "source.count", "is not known"),
        (
            with_(PIN, "[source]", "angles_deg = [0, 90, 180]"),
            "source.angles_deg",
            "is not known",
        ),
        (
            with_(ANGLES, "[source]", "count = 4", "turn_deg = 180"),
            "source.turn_deg",
            "is not known",
        ),
        (
            with_(ANGLES, "[source]", "count = 4", "angles_deg = [0, 90, 180]"),
            "source.count",
            "excludes angles_deg",
        ),
        (
            with_(ANGLES, "[source]", "angles_deg = [90, 180, 270]"),
            "source.angles_deg#1",
            "must be 0",
        ),
        (
            with_(ANGLES, "[source]", "angles_deg = [0, 180, 360]"),
            "source.angles_deg",
            "must not hold the same angle twice",
        ),
        (
            with_(ANGLES, "[source]", "angles_deg = [0, -14, 15]"),
            "source.angles_deg",
            "must spread over at least 30 degrees",
        ),
    ],
)
def test_the_angles_are_those_of_the_method(text, where, what):
    found = problems(text)
    assert list(found) == [where]
    assert found[where].startswith(what)


@each_row(
    ("text", "where", "what"),
    [
        (BEAMS.replace("= 88", "= 15"), "source.beams", "must cross at 20 degrees"),
        (with_(BEAMS, "[source]", "aside_mm = 2"), "source.aside_mm", "must be larger than"),
        (
            with_(BEAMS, "[source]", "test_turn_deg = 90", "turn_deg = 180"),
            "source.test_turn_deg",
            "goes without turn_deg",
        ),
        (
            with_(BEAMS, "[source]", "test_turn_deg = 80"),
            "source.test_turn_deg",
            "must be at least 90",
        ),
        (BEAMS + "[poses]\nturn_back = false\n", "poses.turn_back", "has no effect without safe"),
        (
            with_(BEAMS, "[box]", "down_mm = 5", "up_mm = 5"),
            "source.lift_mm",
            "must leave room",
        ),
        (BEAMS.replace('z = "kept"', 'z = "measured"'), "z", 'cannot be "measured" with beams'),
        (
            with_(with_(BEAMS, "[source]", *UNCHECKED), "[tolerances]", "rms_mm = 0.1"),
            "tolerances.rms_mm",
            "cannot be judged: crossings",
        ),
        (
            with_(with_(BEAMS, "[source]", *UNCHECKED), "[tolerances]", "interval_mm = 0.1"),
            "tolerances.sigma_mm",
            "is missing: the measurement cannot check itself",
        ),
        (
            with_(BEAMS, "[source]", *UNCHECKED, "retake = true"),
            "source.retake",
            "has no effect: nothing is repeated",
        ),
        (
            with_(BEAMS, "[source]", "until_mm = 0.01"),
            "source.until_mm",
            "has nothing to leave out; give 3 repeats",
        ),
        (BEAMS + "points = [1, 2]\n", "source.beams#2.points", "is not known"),
        (BEAMS.replace("input = 4", "input = -4"), "source.beams#2.input", "must be at least 0"),
    ],
)
def test_the_beams_can_be_crossed_one_at_a_time_and_judged(text, where, what):
    found = problems(text)
    assert list(found) == [where]
    assert found[where].startswith(what)


def test_a_second_angle_leaves_residuals_too():
    turned = with_(BEAMS, "[source]", "repeats = 1", "turn_deg = 180")
    assert problems(with_(turned, "[tolerances]", "rms_mm = 0.1", "interval_mm = 0.1")) == {}


def test_crossings_that_check_each_other_may_end_early_and_be_made_again():
    course = ("until_mm = 0.01", "retake = true")
    assert problems(with_(BEAMS, "[source]", "repeats = 3", *course)) == {}
    stated = with_(BEAMS, "[tolerances]", "sigma_mm = 0.01")
    assert problems(with_(stated, "[source]", *course)) == {}


@each_row(
    ("text", "where", "what"),
    [
        (TOUCH.replace('"measured"', '"kept"'), "z", 'must be "measured"'),
        (TOUCH.replace("z_mm = -90\n", ""), "station.z_mm", "is missing"),
        (
            TOUCH.replace("z_mm = -90\n", "").replace("absolute", "difference"),
            "station.z_mm",
            "is missing",
        ),
        (TOUCH.replace("x_mm = 300\ny_mm = 80\n", ""), "station.x_mm", "is missing: with kind"),
        (TOUCH.replace("x_mm = 300\n", ""), "station.x_mm", "is missing: give x_mm and y_mm"),
        (with_(TOUCH, "[source]", "speeds_mm_s = [2, 2]"), "source.speeds_mm_s", "must differ"),
        (
            with_(TOUCH, "[source]", "until_mm = 0.01"),
            "source.until_mm",
            "has nothing to leave out; give 7 speeds_mm_s",
        ),
        (with_(TOUCH, "[source]", "lift_mm = 2"), "source.clearance_mm", "must be smaller"),
        (
            with_(with_(TOUCH, "[source]", "speeds_mm_s = [2, 1]"), "[tolerances]", "rms_mm = 1"),
            "tolerances.rms_mm",
            "cannot be judged: two touches",
        ),
    ],
)
def test_a_touch_has_a_surface_and_two_speeds(text, where, what):
    found = problems(text)
    assert list(found) == [where]
    assert found[where].startswith(what)


CAMERA = """\
schema = "robolink/recipe/1"
name = "Nozzle"
basis = "absolute"
z = "kept"
[station]
id = "CAM"
x_mm = 300
y_mm = 80
z_mm = -60
[source]
kind = "camera"
mm_per_px = [[0.02, 0.001], [0.001, -0.02]]
origin_mm = [287, 90]
[[tools]]
number = 3
"""
ONE_LOOK = "turns_deg = [0]"


@each_row(
    ("text", "where", "what"),
    [
        (CAMERA.replace('"kept"', '"measured"'), "z", 'cannot be "measured" by a camera'),
        (CAMERA.replace("x_mm = 300\ny_mm = 80\n", ""), "station.x_mm", "is missing: with kind"),
        (CAMERA.replace("z_mm = -60\n", ""), "station.z_mm", "is missing: with kind"),
        (CAMERA.replace("origin_mm = [287, 90]\n", ""), "source.origin_mm", "is missing: give"),
        (CAMERA.replace("mm_per_px = ", "# "), "source.mm_per_px", "is missing: give"),
        (CAMERA.replace("[287, 90]", "[287, 90, 0]"), "source.origin_mm", ""),
        (
            CAMERA.replace("[[0.02, 0.001], [0.001, -0.02]]", "[[0.02, 0.02], [0.01, 0.01]]"),
            "source.mm_per_px",
            "maps all pixels onto one line",
        ),
        (
            with_(CAMERA, "[source]", "test_turns_deg = [90, 119]"),
            "source.test_turns_deg#2",
            "must be at least 5 degrees from each of turns_deg",
        ),
        (
            with_(CAMERA, "[source]", "turns_deg = [0, 20]"),
            "source.turns_deg",
            "must spread over at least 30 degrees",
        ),
        (with_(CAMERA, "[box]", "down_mm = 4", "up_mm = 4"), "source.lift_mm", "must leave room"),
        (
            with_(with_(CAMERA, "[source]", ONE_LOOK), "[tolerances]", "rms_mm = 0.1"),
            "tolerances.rms_mm",
            "cannot be judged: looks at one or two",
        ),
        (
            with_(with_(CAMERA, "[source]", ONE_LOOK), "[tolerances]", "interval_mm = 0.1"),
            "tolerances.sigma_mm",
            "is missing: the measurement cannot check itself",
        ),
    ],
)
def test_a_camera_has_a_place_and_a_meaning_and_is_judged(text, where, what):
    found = problems(text)
    assert list(found) == [where]
    assert found[where].startswith(what)


AFFINE = CAMERA.replace('"camera"', '"camera-affine"')
BOARD = CAMERA.replace('"camera"', '"board"\nspacing_mm = 40')
MARKS = BOARD.replace("spacing_mm = 40", "fiducials_mm = [[20, 0], [-20, 0], [-20, 3]]")
PIVOT = PIN.replace('"two-pose"', '"pivot"')


@each_row(
    "text",
    [
        AFFINE,
        with_(AFFINE, "[source]", "turns_deg = [60]"),
        BOARD,
        with_(BOARD, "[source]", ONE_LOOK),
        MARKS.replace("[-20, 3]", "[-20, 5]"),
        PIVOT,
        PIVOT.replace('"kept"', '"measured"'),
        PIVOT.replace("number = 3", f"number = 3\napproach = {at(1, 2)[:-1]}, w_deg = 180 }}"),
    ],
)
def test_what_these_kinds_can_measure_is_accepted(text):
    judged = with_(text, "[tolerances]", "interval_mm = 0.1", "sigma_mm = 0.01")
    assert problems(judged) == {}


@each_row(
    ("text", "where", "what"),
    [
        (AFFINE.replace('"kept"', '"measured"'), "z", 'cannot be "measured" by a camera'),
        (BOARD.replace('"kept"', '"measured"'), "z", 'cannot be "measured" by a camera'),
        (AFFINE.replace("z_mm = -60\n", ""), "station.z_mm", 'is missing: with kind = "camera-aff'),
        (
            BOARD.replace("x_mm = 300\ny_mm = 80\n", ""),
            "station.x_mm",
            'is missing: with kind = "b',
        ),
        (with_(AFFINE, "[source]", "span_mm = 0.1"), "source.span_mm", "must be at least 0.2"),
        (with_(AFFINE, "[source]", ONE_LOOK), "source.turns_deg", "must spread over at least 30"),
        (with_(CAMERA, "[source]", "span_mm = 3"), "source.span_mm", "is not known"),
        (with_(AFFINE, "[box]", "down_mm = 4", "up_mm = 4"), "source.lift_mm", "must leave room"),
        (BOARD.replace("spacing_mm = 40", ""), "source.fiducials_mm", "is missing: say where"),
        (BOARD.replace("= 40", "= 4"), "source.spacing_mm", "must be at least 5"),
        (
            with_(BOARD, "[source]", "fiducials_mm = [[20, 0], [-20, 0]]"),
            "source.spacing_mm",
            "excludes fiducials_mm",
        ),
        (MARKS, "source.fiducials_mm#3", "is 3 mm from fiducial 2"),
        (
            with_(with_(BOARD, "[source]", ONE_LOOK), "[tolerances]", "rms_mm = 0.1"),
            "tolerances.rms_mm",
            "cannot be judged: two fiducials",
        ),
        (with_(PIVOT, "[source]", "count = 3"), "source.count", "must be at least 4"),
        (with_(PIVOT, "[source]", "tilt_deg = 50"), "source.tilt_deg", "must be at most 45"),
        (
            with_(PIVOT, "[source]", "lift_mm = 2"),
            "source.clearance_mm",
            "must be more than 1.8 below lift_mm",
        ),
        (
            PIN.replace("number = 3", f"number = 3\nretreat = {at(1, 2)[:-1]}, v_deg = 5 }}"),
            "tools#1.retreat.v_deg",
            'must be 0 with kind = "two-pose", which measures upright',
        ),
        (
            f"{PIN}[poses]\nsafe = {at(1, 2)[:-1]}, w_deg = 180 }}\n",
            "poses.safe.w_deg",
            "must be 0 with kind",
        ),
    ],
)
def test_what_these_kinds_cannot_measure_is_refused_by_path(text, where, what):
    found = problems(text)
    assert list(found) == [where]
    assert found[where].startswith(what)


def test_the_place_of_a_camera_may_be_left_to_its_record():
    assert problems(CAMERA.replace("x_mm = 300\ny_mm = 80\nz_mm = -60\n", "")) == {}


def test_a_camera_that_answers_in_millimetres_needs_no_meaning():
    bare = CAMERA.replace("mm_per_px = ", "# ").replace("origin_mm = ", "# ")
    assert problems(bare) == problems(with_(bare, "[source]", ONE_LOOK)) == {}


def test_a_tool_has_no_points_where_beams_measure_it():
    found = problems(BEAMS.replace("number = 3", "number = 3\npoints = [1, 2]"))
    assert list(found) == ["tools#1.points"]


@each_row("angles", ["0, 120, 240", "0, -15, 15", "0, 170, 340"])
def test_angles_that_spread_are_accepted(angles):
    assert problems(with_(ANGLES, "[source]", f"angles_deg = [{angles}]")) == {}


def test_the_clearance_stays_below_the_lift():
    found = problems(with_(PIN, "[source]", "lift_mm = 3.8"))
    assert list(found) == ["source.clearance_mm"]
    assert found["source.clearance_mm"].startswith("must be more than 1.8 below lift_mm")
    assert problems(with_(PIN, "[source]", "lift_mm = 3.9")) == {}


def test_the_lift_has_room_in_the_box():
    text = with_(with_(PIN, "[source]", "lift_mm = 50"), "[box]", "down_mm = 20", "up_mm = 29")
    assert list(problems(text)) == ["source.lift_mm"]
    assert problems(text.replace("29", "30")) == {}


def test_half_a_place_of_the_pin_is_refused():
    assert list(problems(with_(PIN, "[station]", "x_mm = 1"))) == ["station.y_mm"]
    assert list(problems(with_(PIN, "[station]", "y_mm = 1"))) == ["station.x_mm"]
    assert problems(with_(PIN, "[station]", "y_mm = 1", "x_mm = 1")) == {}


def test_a_measured_height_may_count_from_the_record_of_the_pin():
    measured = PIN.replace('"kept"', '"measured"')
    assert problems(measured) == {}
    assert problems(with_(measured, "[station]", "z_mm = -100")) == {}
    assert problems(measured.replace('"absolute"', '"difference"')) == {}


@pytest.mark.parametrize("basis", ["absolute", "difference"])
def test_a_height_cannot_be_measured_from_taught_points(basis):
    text = POINTS.replace('"kept"', '"measured"').replace('"absolute"', f'"{basis}"')
    assert list(problems(text)) == ["z"]


def test_each_tool_stands_there_once():
    assert list(problems(PIN + "[[tools]]\nnumber = 3\n")) == ["tools#2.number"]
    assert problems(PIN + "[[tools]]\nnumber = 4\n") == {}


@each_row(
    ("method", "points", "where"),
    [
        ("two-pose", "points = [1, 2, 3]", "tools#1.points"),
        ("n-angle", "points = [1, 2]", "tools#1.points"),
        ("n-angle", "points = [1, 2, 3]", None),
        ("two-pose", "", "tools#1.points"),
        ("two-pose", "points = [1, 1]", "tools#1.points#2"),
        ("two-pose", "points = [1, 2]\n[[tools]]\nnumber = 4\npoints = [3, 2]", "tools#2.points#2"),
    ],
)
def test_each_tool_has_its_own_points_as_many_as_the_method_needs(method, points, where):
    text = with_(POINTS, "[source]", f'method = "{method}"').replace("points = [1, 2]", points)
    assert list(problems(text)) == ([where] if where else [])


def test_a_file_of_poses_stands_in_place_of_points():
    file = 'poses = { file = "a.csv", euler = "kuka" }'
    assert problems(POINTS.replace("points = [1, 2]", file)) == {}
    assert list(problems(f"{POINTS}{file}\n")) == ["tools#1.points"]
    assert list(problems(f"{PIN}{file}\n")) == ["tools#1.poses"]
    assert list(problems(POINTS.replace("points = [1, 2]", 'poses = { length = "ft" }'))) == [
        "tools#1.poses.file",
        "tools#1.poses.length",
    ]


def test_points_mean_nothing_where_a_person_measures():
    assert list(problems(PIN + "points = [1, 2]\n")) == ["tools#1.points"]


@each_row(
    ("text", "where"),
    [
        (with_(POINTS, "[poses]", f"safe = {at(1, 2)}"), "poses"),
        (with_(POINTS, "[speeds]", "percent = 5"), "speeds"),
        (with_(POINTS, "[box]", "up_mm = 50"), "box"),
        (POINTS + f"approach = {at(1, 2)}\n", "tools#1.approach"),
        (POINTS + f"retreat = {at(1, 2)}\n", "tools#1.retreat"),
        ("verify = true\n" + POINTS, "verify"),
        (with_(POINTS, "[refusal]", 'action = "measure_again"'), "refusal.action"),
        (with_(POINTS, "[tolerances]", "drift_mm = 0.2"), "tolerances.drift_mm"),
    ],
)
def test_what_says_how_to_move_is_refused_where_nothing_moves(text, where):
    assert list(problems(text)) == [where]


def test_saying_that_points_are_not_verified_is_fine():
    assert problems("verify = false\n" + POINTS) == {}


def test_a_drift_is_judged_only_where_one_is_measured():
    text = with_(PIN, "[tolerances]", "drift_mm = 0.1")
    assert problems(text) == {}
    assert list(problems("verify = false\n" + text)) == ["tolerances.drift_mm"]


@each_row(
    ("approach", "inside"),
    [((60, -30), True), ((61, 0), False), ((0, -31), False), ((0, 51), False), ((-60, 50), True)],
)
def test_from_the_safe_pose_every_pose_of_a_tool_is_within_the_box(approach, inside):
    text = with_(PIN, "[box]", "sideways_mm = 60") + f"[poses]\nsafe = {at(0, 0)}\n"
    text = text.replace("number = 3\n", f"number = 3\napproach = {at(*approach)}\n")
    assert list(problems(text)) == ([] if inside else ["tools#1.approach"])


@each_row(("retreat", "inside"), [((120, 80), True), ((121, 0), False), ((0, 81), False)])
def test_without_a_safe_pose_one_box_can_hold_all_poses(retreat, inside):
    text = PIN + f"approach = {at(0, 0)}\nretreat = {at(*retreat)}\n[box]\nsideways_mm = 60\n"
    assert list(problems(text)) == ([] if inside else ["box"])


@each_row("key", ["rms_mm", "max_mm"])
@each_row("text", [PIN, POINTS])
def test_residuals_of_two_poses_are_not_judged_and_the_reason_is_told(text, key):
    found = problems(with_(text, "[tolerances]", f"{key} = 0.1"))
    assert list(found) == [f"tolerances.{key}"]
    assert "two poses cannot check each other" in found[f"tolerances.{key}"]


def test_the_largest_residual_may_not_be_smaller_than_the_rms():
    text = with_(with_(ANGLES, "[source]", "count = 4"), "[tolerances]", "rms_mm = 0.2")
    assert list(problems(text + "max_mm = 0.1\n")) == ["tolerances.max_mm"]
    assert problems(text + "max_mm = 0.2\n") == {}


@pytest.mark.parametrize("text", [PIN, POINTS])
def test_the_interval_of_two_poses_needs_a_stated_sigma(text):
    text = with_(text, "[tolerances]", "interval_mm = 0.1")
    assert list(problems(text)) == ["tolerances.sigma_mm"]
    assert problems(text + "sigma_mm = 0.01\n") == {}


def test_the_interval_of_many_angles_comes_from_the_residuals_as_well():
    text = with_(ANGLES, "[source]", "count = 4")
    assert problems(with_(text, "[tolerances]", "interval_mm = 0.1")) == {}


@each_row(
    ("text", "reached"),
    [
        (PIN, "0.139"),  # 1.96 x 0.1 / sqrt 2
        (with_(PIN, "[source]", "turn_deg = 90"), "0.196"),
        (with_(ANGLES, "[source]", "count = 4"), "0.098"),
    ],
)
def test_an_interval_that_no_measurement_reaches_is_refused_beforehand(text, reached):
    low = with_(text, "[tolerances]", "sigma_mm = 0.1", f"interval_mm = {float(reached) - 0.001}")
    found = problems(low)
    assert list(found) == ["tolerances.interval_mm"]
    assert reached in found["tolerances.interval_mm"]
    high = with_(text, "[tolerances]", "sigma_mm = 0.1", f"interval_mm = {float(reached) + 0.001}")
    assert problems(high) == {}


def test_an_interval_of_unknown_angles_is_not_judged():
    wrong = with_(ANGLES, "[source]", "count = 2")
    text = with_(wrong, "[tolerances]", "sigma_mm = 0.1", "interval_mm = 0.001")
    assert list(problems(text)) == ["source.count"]


def test_attempts_belong_to_measuring_again():
    assert list(problems(with_(PIN, "[refusal]", "attempts = 3"))) == ["refusal.attempts"]
    again = with_(PIN, "[refusal]", 'action = "measure_again"')
    recipe, found = _checked(tomllib.loads(again))
    assert (recipe and recipe.attempts, found) == (2, ())
    recipe, found = _checked(tomllib.loads(again + "attempts = 5\n"))
    assert (recipe and recipe.attempts, found) == (5, ())


@each_row("kind", ["prompts", "outputs"])
@each_row(
    ("at_", "tool", "what"),
    [
        ("before_measure", 3, None),
        ("before_measure", 4, "is not a tool of this recipe"),
        ("start", 3, 'has no effect here: "start" comes once'),
        ("before_write", 4, 'has no effect here: "before_write" comes once'),
    ],
)
def test_prompts_and_outputs_name_tools_of_the_recipe_where_one_is_measured(kind, at_, tool, what):
    rest = {"prompts": 'text = "?"', "outputs": "output = 1\non = true"}[kind]
    found = problems(with_(PIN, f"[[{kind}]]", f'at = "{at_}"', f"tool = {tool}", rest))
    if what is None:
        assert found == {}
    else:
        assert list(found) == [f"{kind}#1.tool"]
        assert found[f"{kind}#1.tool"].startswith(what)


def test_an_output_may_be_switched_after_the_measurement_of_one_tool():
    lines = ('at = "after_measure"', "tool = 3", "output = 1", "on = false")
    assert problems(with_(PIN, "[[outputs]]", *lines)) == {}


@each_row("answer", ["nozzle", "lot"])
@each_row("moment", ["before_write", "end"])
def test_a_nozzle_and_its_lot_are_asked_before_they_go_on_record(answer, moment):
    lines = (f'at = "{moment}"', 'text = "?"', f'answer = "{answer}"')
    assert list(problems(with_(PIN, "[[prompts]]", *lines))) == ["prompts#1.at"]


@each_row(
    ("first", "second", "twice"),
    [("", "", True), ("tool = 3", "tool = 3", True), ("", "tool = 3", True), (None, "", False)],
)
def test_a_nozzle_is_asked_once(first, second, twice):
    ask = '[[prompts]]\nat = "before_measure"\ntext = "?"\nanswer = "nozzle"\n'
    text = PIN + ("" if first is None else f"{ask}{first}\n") + f"{ask}{second}\n"
    assert list(problems(text)) == (["prompts#2.answer"] if twice else [])
