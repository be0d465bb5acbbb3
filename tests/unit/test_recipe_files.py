"""Recipe files: their reading, and the messages about wrong keys."""

import copy
import hashlib
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.calibration_run import AcceptanceCriteria, Limits, Moment, RecipeRun
from robolink.config import Cell
from robolink.controllers import SimpleController
from robolink.errors import ConfigError
from robolink.methods import (
    BeamsParameters,
    BoardParameters,
    CameraAffineParameters,
    CameraParameters,
    NAngleParameters,
    OneTouchParameters,
    PivotParameters,
    PointsParameters,
    TwoPoseParameters,
    ZTouchParameters,
)
from robolink.procedures import TWO_ANGLES_DEG, LookPlan, TouchPlan
from robolink.recipe import LoadedRecipe, Output, Prompt, Recipe, check_recipe, load_recipe
from robolink.recipe._loading import _checked
from tests._rows import each_row

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "recipes").iterdir())
KINDS = (
    'must be one of "beams", "board", "camera", "camera-affine", "n-angle", "one-touch", "pivot", '
    '"plane-touch", "points", "runout-table", "six-point", "sphere-touch", "two-pose", "z-touch"'
)
LEAST = """\
schema = "robolink/recipe/1"
name = "Needle"
basis = "absolute"
z = "kept"
source = { kind = "two-pose" }
station = { id = "PIN" }
tools = [{ number = 1 }]
"""


def without(key):
    return "".join(line for line in LEAST.splitlines(True) if not line.startswith(key))


@pytest.fixture
def problems(tmp_path):
    """Writes a recipe and returns its faults, by path."""

    def look(text):
        path = tmp_path / "recipe.toml"
        path.write_text(text, encoding="utf-8")
        return {problem.where: problem.what for problem in check_recipe(path)}

    return look


@each_row("path", EXAMPLES)
def test_every_example_loads(path):
    assert check_recipe(path) == ()
    loaded = load_recipe(path)
    assert loaded.path == path
    assert loaded.name == loaded.recipe.name
    assert loaded.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def example(name):
    (path,) = (path for path in EXAMPLES if path.stem == name)
    return path


def test_the_examples_are_those_that_the_page_describes():
    assert [path.name for path in EXAMPLES] == [
        "five-axes-pivot.toml",
        "gantry-touch-probe.toml",
        "held-board.toml",
        "leaning-plate.toml",
        "needle-beams.toml",
        "needle-one-touch.toml",
        "nozzle-and-camera.toml",
        "pendant-points.toml",
        "pick-nozzle-camera.toml",
        "scara-pin.toml",
        "sphere.toml",
        "two-nozzles.toml",
    ]
    pivot, gantry, board, _plate, beams, one_touch, affine, points, camera, pin, _ball, nozzles = (
        load_recipe(path).recipe for path in EXAMPLES
    )
    source = pivot.source.parameters
    assert isinstance(source, PivotParameters)
    assert (pivot.z, source.count, source.tilt_deg) == ("measured", 6, 20)
    source = board.source.parameters
    assert isinstance(source, BoardParameters)
    assert source.drawing
    assert len(source.drawing.fiducials_mm) == 4
    source = affine.source.parameters
    assert isinstance(source, CameraAffineParameters)
    assert source.model is None
    source = gantry.source.parameters
    assert isinstance(source, ZTouchParameters)
    assert (gantry.z, source.proof_turn_deg) == ("measured", 0.0)
    source = camera.source.parameters
    assert isinstance(source, CameraParameters)
    assert source.model is not None
    assert source.model.mirrored
    assert isinstance(one_touch.source.parameters, OneTouchParameters)
    assert (one_touch.z, one_touch.basis) == ("measured", "difference")
    source = beams.source.parameters
    assert isinstance(source, BeamsParameters)
    assert ([beam.input for beam in source.beams or ()], beams.attempts) == ([3, 4], 2)
    assert isinstance(points.source.parameters, PointsParameters)
    assert (points.basis, points.verifies, points.tools[0].points) == (
        "difference",
        False,
        (901, 902),
    )
    source = pin.source.parameters
    assert isinstance(source, TwoPoseParameters)
    assert (pin.basis, pin.z, pin.verifies, pin.attempts) == ("absolute", "kept", True, 1)
    assert source.turn_deg == 180
    source = nozzles.source.parameters
    assert isinstance(source, NAngleParameters)
    assert source.turns_deg == (180, 90, 270)
    assert ([tool.number for tool in nozzles.tools], nozzles.attempts) == ([1, 2], 2)


def test_what_is_left_out_is_as_in_a_calibration_by_hand():
    recipe = Recipe.model_validate(tomllib.loads(LEAST))
    source, limits = recipe.source.parameters, Limits()
    assert source == TwoPoseParameters()
    assert TwoPoseParameters().touch == TouchPlan()
    assert recipe.box.reach == limits.box
    assert recipe.speeds.model_dump() == {
        "percent": limits.speed_percent,
        "mm_s": limits.speed_mm_s,
    }
    assert recipe.tolerances.jump_mm == AcceptanceCriteria().max_change_mm
    assert recipe.tolerances.drift_mm == AcceptanceCriteria().drift_tolerance_mm
    assert (recipe.verifies, recipe.attempts) == (True, 1)


def test_what_is_left_out_is_as_in_the_procedures():
    assert CameraParameters().look == LookPlan()
    assert BoardParameters().look == LookPlan(turns_deg=TWO_ANGLES_DEG)
    assert NAngleParameters().touch == PivotParameters().touch == TouchPlan()


OLD_NAMES = [
    ('kind = "operator"', TwoPoseParameters(), "two-pose"),
    ('kind = "operator"\nmethod = "two_pose"\nturn_deg = 90', TwoPoseParameters(turn_deg=90), ""),
    ('kind = "operator"\nmethod = "n_angle"\ncount = 4', NAngleParameters(count=4), "n-angle"),
    ('kind = "touch"\ninput = 5', ZTouchParameters(input=5), "z-touch"),
    ('kind = "one_touch"', OneTouchParameters(), "one-touch"),
    ('kind = "camera_affine"', CameraAffineParameters(), "camera-affine"),
    ('kind = "points"\nmethod = "n_angle"', PointsParameters(method="n-angle"), "n-angle"),
]


@pytest.mark.parametrize(("source", "meant", "name"), OLD_NAMES)
def test_a_name_of_before_is_read_and_its_name_of_now_is_told(tmp_path, source, meant, name):
    path = tmp_path / "old.toml"
    text = without("source").replace('z = "kept"', 'z = "measured"' if "touch" in source else "")
    text = text if "touch" in source else text.replace("name =", 'z = "kept"\nname =')
    points = "points = [1, 2, 3]\n" if "points" in source else ""
    tools = f"[[tools]]\nnumber = 1\n{points}"
    text = "".join(line for line in text.splitlines(True) if not line.startswith("tools"))
    path.write_text(f"{text}\n[source]\n{source}\n{tools}")
    loaded = load_recipe(path)
    assert loaded.recipe.source.parameters == meant
    (note,) = loaded.notes
    assert "old name" in note
    assert name in note


def test_a_name_of_now_needs_no_note():
    assert all(load_recipe(path).notes == () for path in EXAMPLES)


def test_an_output_can_be_switched_at_every_moment_of_a_nozzle_change():
    assert get_args(Output.model_fields["at"].annotation) == tuple(Moment)
    assert {*get_args(Prompt.model_fields["at"].annotation)} < {*Moment}


def test_a_pose_of_the_flange_is_a_pose_in_tool_0():
    pose = load_recipe(example("scara-pin")).recipe.poses.safe
    assert pose is not None
    assert pose.pose.coordinates() == (158.6, 495.4, -64.0, 0.0, 0.0, 0.0)
    assert pose.pose.tool == 0


def test_no_value_can_be_changed_after_loading():
    recipe = load_recipe(EXAMPLES[0]).recipe
    with pytest.raises(ValueError, match="frozen"):
        recipe.tolerances.jump_mm = 100


@each_row(
    ("key", "words"),
    [
        ("basis", 'write "difference" where taught points have to stay right'),
        ("z", 'is missing: write "kept"'),
        ("schema", 'begin the file with schema = "robolink/recipe/1"'),
        ("tools", "one [[tools]] table for each tool"),
        ("name", "is missing"),
        ("source", "is missing"),
        ("station", "is missing"),
    ],
)
def test_a_required_key_that_is_missing_is_explained(problems, key, words):
    found = problems(without(key))
    assert list(found) == [key]
    assert words in found[key]


@each_row(
    ("lines", "where", "what"),
    [
        (
            '[source]\nkind = "laser"',
            "source.kind",
            KINDS,
        ),
        (
            "[source]\nlift_mm = 5",
            "source.kind",
            KINDS,
        ),
        ('[source]\nkind = "two-pose"\nlift_mm = 0.5', "source.lift_mm", "must be at least 1"),
        ('[source]\nkind = "two-pose"\nturn_deg = 350', "source.turn_deg", "must be at most 330"),
        ('[source]\nkind = "n-angle"\ncount = 2', "source.count", "must be at least 3"),
        (
            '[source]\nkind = "n-angle"\nangles_deg = [0, 90]',
            "source.angles_deg",
            "must hold at least 3",
        ),
        (
            '[source]\nkind = "n-angle"\nangles_deg = [0, 90, "180"]',
            "source.angles_deg#3",
            "must be a number",
        ),
        ('[station]\nid = ""', "station.id", "must not be empty"),
        ("[station]\nid = 7", "station.id", "must be a text in quotes"),
        ('[station]\nid = "a\\u001b[2J"', "station.id", "must not hold control characters"),
        (f'[station]\nid = "{"a" * 201}"', "station.id", "must be at most 200 characters long"),
        ("[[tools]]\nnumber = 0", "tools#1.number", "must be at least 1"),
        ("[[tools]]\nnumber = true", "tools#1.number", "must be a whole number"),
        ("[[tools]]\nnumber = 1\npoints = 3", "tools#1.points", "must be a list in brackets"),
        (
            "[[tools]]\nnumber = 1\n[[tools]]\nnumber = 2\napproach = { x_mm = 1, y_mm = 2, "
            "z_mm = nan, u_deg = 0 }",
            "tools#2.approach.z_mm",
            "must be a finite number",
        ),
        ("[speeds]\npercent = 5.5", "speeds.percent", "must be a whole number"),
        ("speeds = 5", "speeds", "must be a table"),
        ("verify = 1", "verify", "must be true or false"),
        (
            "[refusal]\naction = 'again'",
            "refusal.action",
            'must be "stop" or "measure_again"',
        ),
        ("[tolerances]\njump_mm = 0", "tolerances.jump_mm", "must be at least 0.001"),
        (
            "[tolerances]\ndrfit_mm = 1",
            "tolerances.drfit_mm",
            "is not known; did you mean drift_mm?",
        ),
        ("[box]\nq = 1", "box.q", "is not known; these are: sideways_mm, down_mm, up_mm"),
        ("nots = ''", "nots", "is not known; did you mean notes?"),
        ("[box]\nverify = false", "box.verify", "must be at the top of the file, above the first"),
    ],
)
def test_a_key_that_is_wrong_is_told_by_its_path(problems, lines, where, what):
    top = lines.partition("\n")[0].strip("[]").split(" ")[0]
    found = problems(f"{without(top)}{lines}\n")
    assert list(found) == [where]
    assert found[where].startswith(what)


def test_all_problems_are_told_at_once_those_between_tables_too(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(
        without("basis") + "verify = 3\n[tolerances]\nrms_mm = 0.1\n[refusal]\nattempts = 3\n"
        '[[prompts]]\nat = "before_measure"\ntext = "?"\ntool = 2\n'
    )
    with pytest.raises(ConfigError) as caught:
        load_recipe(path)
    assert f"{path} has 5 errors:\n" in caught.value.what
    for where in ("basis", "verify", "tolerances.rms_mm", "refusal.attempts", "prompts#1.tool"):
        assert f"\n    {where}: " in caught.value.what
    assert "Nothing was sent" in caught.value.remedy


def test_a_single_problem_is_not_counted(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(without("name"))
    with pytest.raises(ConfigError) as caught:
        load_recipe(path)
    assert caught.value.what == f"The recipe {path} has an error:\n    name: is missing"


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b"[tools\n", "at line 1"),
        (b"\xff\xfe", "not UTF-8"),
        (b"a = " + b"[" * 100_000, "nested too deeply"),
        (b"a = " + b"1" * 5000, "digits"),
    ],
    ids=["no TOML", "not text", "deep", "long number"],
)
def test_a_file_that_is_no_toml_is_told(tmp_path, content, cause):
    path = tmp_path / "recipe.toml"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=cause) as caught:
        load_recipe(path)
    assert str(path) in caught.value.what
    assert caught.value.remedy


def test_a_file_that_is_not_there_is_told(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read: No such file"):
        check_recipe(tmp_path / "absent.toml")


def test_the_hash_is_of_the_bytes_and_a_byte_order_mark_does_not_matter(tmp_path):
    content = b"\xef\xbb\xbf" + LEAST.encode()
    path = tmp_path / "recipe.toml"
    path.write_bytes(content)
    assert load_recipe(path).sha256 == hashlib.sha256(content).hexdigest()


def test_pydantic_waits_for_the_first_recipe():
    code = (
        "import sys, robolink.recipe\n"
        "assert 'pydantic' not in sys.modules\n"
        "sys.modules['pydantic'] = None\n"  # whoever imports it now fails
        "try:\n    robolink.recipe.Recipe\n"
        "except ImportError:\n    sys.exit()\n"
        "sys.exit('Recipe did without pydantic')"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=20)


def _places(node, path=()):
    yield path
    keys = range(len(node)) if isinstance(node, list) else node if isinstance(node, dict) else ()
    for key in keys:
        yield from _places(node[key], (*path, key))


DOCUMENTS = [tomllib.loads(path.read_text(encoding="utf-8")) for path in EXAMPLES]
VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.sampled_from(["points", "operator", "n_angle", "measured", "difference", "end", "\x1b"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=4,
)


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_whatever_stands_in_a_place_is_accepted_or_told(data):
    document = copy.deepcopy(data.draw(st.sampled_from(DOCUMENTS)))
    *way, last = data.draw(st.sampled_from([path for path in _places(document) if path]))
    parent = document
    for key in way:
        parent = parent[key]
    parent[last] = data.draw(VALUES)
    recipe, problems = _checked(document)
    assert (recipe is None) <= bool(problems)
    assert all(problem.where and problem.what for problem in problems)


def of_cells(*cells):
    return Recipe.model_validate({**tomllib.loads(LEAST), "cells": cells})


def test_a_recipe_that_names_no_cell_is_for_every_cell():
    assert of_cells().is_for("")
    assert of_cells().is_for("mixer")
    assert of_cells("line3", "mixer").is_for("mixer")


def test_a_recipe_for_another_cell_is_refused_before_anything_is_looked_at():
    loaded: Any = LoadedRecipe(of_cells("line3", "line4"), Path("a.toml"), "")
    nobody: Any = None
    with pytest.raises(ConfigError, match="is for line3, line4; no cell is named"):
        RecipeRun(SimpleController(), loaded, operator=nobody)
    mixer = Cell("mixer", "memory://", settings=nobody, origins={})
    with pytest.raises(ConfigError, match="is for line3, line4, not for mixer"):
        RecipeRun(SimpleController(), loaded, operator=nobody, cell=mixer)
