"""Requests of a recipe: unsupported by a controller, unanswerable, and the proposed values."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from robolink_cli.commands.shipped.recipe import copy_recipe, models

import robolink
from robolink.calibration import CalibrationResult
from robolink.calibration_run import Proposal, RecipeRun
from robolink.calibration_run._recipe_plan import Reference, proposed
from robolink.calibration_run._records import touch_details
from robolink.controller_outcome import outcome_after
from robolink.controllers import SimpleController, capabilities_of_kind
from robolink.errors import ConfigError, DeclinedError, LimitError
from robolink.model import Pose, ToolOffset
from robolink.recipe import Answers, LoadedRecipe, Recipe, beyond, load_recipe, require_answers
from robolink.recipe._loading import _checked
from tests._rows import each_row

# Requests of a recipe that a kind of controller does not support: not offered, and refused at once.

RECIPES = Path(__file__).parents[2] / "examples" / "recipes"
KINDS = ("epson", "softmotion", "plc")


def written(name, **more):
    document = tomllib.loads((RECIPES / f"{name}.toml").read_text(encoding="utf-8"))
    source = document["source"] | more.pop("source", {})
    return Recipe.model_validate({**document, "source": source, **more})


CASES = {
    "moves": (written("scara-pin"), {"plc": "moves the robot"}),
    "taught": (written("pendant-points"), {"softmotion": "taught points", "plc": "taught points"}),
    "own camera": (
        written("pick-nozzle-camera", source={"sensor": "vision-guide?program=3"}),
        {"softmotion": "Vision Guide", "plc": "Vision Guide"},
    ),
    "other camera": (
        written("pick-nozzle-camera", source={"sensor": "folder:pictures"}),
        {"plc": "moves the robot"},
    ),
    "outputs": (
        written("scara-pin", outputs=[{"at": "start", "output": 3, "on": True}]),
        {"plc": "switches outputs"},
    ),
}


@each_row("kind", KINDS)
@each_row("case", CASES)
def test_what_a_kind_cannot_do_is_told_and_nothing_else(case, kind):
    recipe, refused = CASES[case]
    able: Any = capabilities_of_kind(kind)
    said = " ".join(beyond(recipe, able))
    assert (refused[kind] in said) if kind in refused else not said


def test_another_camera_and_a_run_that_writes_nothing_ask_for_less():
    able: Any = capabilities_of_kind("softmotion")
    able = replace(able, tool_write=False)
    recipe, _ = CASES["own camera"]
    assert len(beyond(recipe, able)) == 2
    assert beyond(recipe, able, other_sensor=True, writes=False) == ()


@each_row("case", ["taught", "own camera", "outputs"])
def test_a_run_refuses_by_the_same_sentences_before_anything_is_asked(case):
    recipe, _ = CASES[case]
    nobody: Any = None
    with SimpleController() as controller:
        before = controller.exchanges
        with pytest.raises(ConfigError) as refused:
            RecipeRun(controller, LoadedRecipe(recipe, Path("a.toml"), ""), operator=nobody)
        listed = "".join(f"\n    {one}" for one in beyond(recipe, controller.capabilities))
        assert refused.value.what == f"This controller lacks what the recipe needs:{listed}"
        assert controller.exchanges == before


def test_a_kind_that_only_a_connected_one_tells_is_held_against_nobody():
    assert capabilities_of_kind("gantry") is None


def copied(**more):
    return LoadedRecipe(written("scara-pin", numbers="simulated", **more), Path("a.toml"), "")


def run_of(controller, loaded):
    nobody: Any = None
    return RecipeRun(controller, loaded, operator=nobody)


def test_a_copy_with_simulated_numbers_is_refused_by_a_real_controller():
    with SimpleController() as controller:
        with pytest.raises(ConfigError, match=r"numbers in a\.toml are for a simulated cell"):
            run_of(controller, copied()).preflight()
        # A user who has put in their own deletes the line; something else is refused then.
        with pytest.raises(LimitError):
            run_of(controller, replace(copied(), recipe=written("scara-pin"))).preflight()


def test_a_copy_with_simulated_numbers_runs_on_a_simulated_controller():
    with robolink.connect("epson+sim://recipe-able?seed=1") as controller:
        with pytest.raises(LimitError):
            run_of(controller, copied(box={"sideways_mm": 1})).preflight()


def test_a_run_that_nobody_looked_ahead_of_refuses_all_the_same():
    with SimpleController() as controller:
        before = controller.tools.selected()
        with pytest.raises(ConfigError, match="simulated cell") as refused:
            run_of(controller, copied()).run()
        assert outcome_after(refused.value).untouched
        assert controller.tools.selected() == before


@pytest.mark.parametrize("name", models())
def test_each_copy_is_right_and_marks_the_numbers_of_the_cell(name, tmp_path):
    path = tmp_path / "copy.toml"
    copy_recipe(name, path)
    loaded = load_recipe(path)
    assert loaded.recipe.numbers == "simulated"
    assert loaded.recipe.model_copy(update={"numbers": None}) == load_recipe(models()[name]).recipe
    lines = path.read_text(encoding="utf-8").splitlines()
    places = [line for line in lines if re.match(r"[^#]*\bx_mm =", line)]
    marked = [line for line in lines if line.endswith("# SIMULATED")]
    assert marked
    assert set(places) <= set(marked)


# Where nobody can be asked, a recipe that asks is refused before anything is sent.

RECIPE = """\
schema = "robolink/recipe/1"
name = "Needle"
basis = "absolute"
z = "{z}"
[station]
id = "PIN"
[source]
kind = "points"
[[tools]]
number = 3
points = [1, 2]
[[tools]]
number = 4
points = [3, 4]
"""
PROMPT = """\
[[prompts]]
at = "start"
text = "Which lot?"
answer = "lot"
"""


def recipe(z, more=""):
    found, problems = _checked(tomllib.loads(RECIPE.format(z=z) + more))
    assert not problems
    return found


@each_row(
    ("z", "more", "answers"),
    [
        ("kept", "", Answers(yes=True)),
        ("typed", "", Answers(z_mm={3: -20.0, 4: -21.0})),
        ("kept", PROMPT, Answers(yes=True, lot="L 7")),
    ],
)
def test_what_was_answered_beforehand_is_not_missing(z, more, answers):
    require_answers(answers, recipe(z, more))


@each_row(
    ("z", "more", "answers", "missing"),
    [
        ("kept", "", Answers(), "yes=True"),
        ("kept", PROMPT, Answers(yes=True), "lot=ID"),
        ("typed", "", Answers(yes=True, z_mm={3: -20.0}), "z_mm={4: MM}"),
    ],
)
def test_what_nobody_answered_is_named(z, more, answers, missing):
    with pytest.raises(DeclinedError) as refused:
        require_answers(answers, recipe(z, more))
    assert missing in refused.value.remedy
    assert refused.value.remedy.count("Answers(") == 1


# A recipe's proposal from a measurement that shows more than X and Y.

PIVOT = Path(__file__).parents[2] / "examples" / "recipes" / "five-axes-pivot.toml"

STORED = ToolOffset(12.0, -3.5, -20.0, 30.0, 5.0, 0.0)
WAS = ToolOffset(12.2, -3.4, -20.3, 30.0, 5.0, 0.0)
NOW = ToolOffset(12.5, -3.9, -19.9, 30.0, 5.0, 0.0)


def proposal_of(basis, z, typed=None):
    """Return the pivot recipe's proposal, with other rules, for a tip found at NOW."""
    text = PIVOT.read_text().replace('"absolute"', f'"{basis}"').replace('"measured"', f'"{z}"')
    recipe, problems = _checked(tomllib.loads(text))
    assert recipe, problems
    result = CalibrationResult(
        method="pivot",
        offset=NOW,
        measured=("x_mm", "y_mm", "z_mm"),
        kept=("u_deg", "v_deg", "w_deg"),
        reference_point_mm=(0.0, 0.0, 0.0),
        sigma_gain=1.0,
        warnings=(),
        inputs=(Pose(0.0, 0.0, 0.0, 0.0),),
    )
    reference = Reference(WAS, STORED, None, "yesterday", 7) if basis == "difference" else None
    return proposed(recipe, Proposal(1, STORED, result), reference=reference, typed_z_mm=typed)


@each_row(
    ("basis", "z", "written"),
    [
        ("absolute", "measured", (12.5, -3.9, -19.9)),
        ("absolute", "kept", (12.5, -3.9, -20.0)),
        ("absolute", "typed", (12.5, -3.9, -21.0)),
        ("difference", "measured", (12.3, -4.0, -19.6)),
        ("difference", "kept", (12.3, -4.0, -20.0)),
        ("difference", "typed", (12.3, -4.0, -21.0)),
    ],
)
def test_a_pivot_writes_z_as_the_recipe_says(basis, z, written):
    made = proposal_of(basis, z, -21.0)
    assert made.offset.components()[:3] == pytest.approx(written)
    assert made.offset.components()[3:] == STORED.components()[3:]
    assert made.tip == NOW
    assert made.z_from == z


def test_a_difference_names_the_components_that_it_moved():
    assert (
        "moved by X +0.300 Y -0.500 Z +0.400 mm" in proposal_of("difference", "measured").notes[0]
    )


def test_the_next_needle_is_compared_with_the_touch_that_stood_upright():
    """The written value puts the pin at a place that depends on the tool's orientation there."""
    kept = proposal_of("absolute", "kept")
    tilted = Pose(0.0, 0.0, 0.0, -60.0, 20.0, 0.0)
    upright = Pose(0.0, 0.0, 0.0, 90.0)
    off = replace(kept.offset, x_mm=kept.tip.x_mm + 0.5)
    for inputs in ((upright, tilted), (tilted, upright)):
        result = replace(kept.result, offset=off, inputs=inputs)
        details = touch_details("PIN", replace(kept, result=result))
        place = [details[name] for name in ("x_mm", "y_mm", "z_mm")]
        assert place == pytest.approx([0.0, 0.5, -0.1])
        assert details["u_deg"] == 90.0


def test_the_example_is_the_one_that_is_varied_here():
    recipe = load_recipe(PIVOT).recipe
    assert (recipe.basis, recipe.z) == ("absolute", "measured")
