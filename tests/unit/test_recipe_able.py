"""What a recipe asks for and a kind of controller cannot do: not offered, and refused at once."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from robolink_cli.commands.shipped.recipe import copy_recipe, models

import robolink
from robolink.calibration_run import RecipeRun
from robolink.controllers import capabilities_of_kind
from robolink.errors import ConfigError, LimitError
from robolink.recipe import LoadedRecipe, Recipe, beyond, load_recipe
from robolink.standing import standing_after
from robolink.testing import MemoryController

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


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", CASES)
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


@pytest.mark.parametrize("case", ["taught", "own camera", "outputs"])
def test_a_run_refuses_by_the_same_sentences_before_anything_is_asked(case):
    recipe, _ = CASES[case]
    nobody: Any = None
    with MemoryController() as controller:
        before = controller.exchanges
        with pytest.raises(ConfigError) as refused:
            RecipeRun(controller, LoadedRecipe(recipe, Path("a.toml"), ""), operator=nobody)
        assert refused.value.what == " ".join(beyond(recipe, controller.capabilities))
        assert controller.exchanges == before


def test_a_kind_that_only_a_connected_one_tells_is_held_against_nobody():
    assert capabilities_of_kind("gantry") is None


def copied(**more):
    return LoadedRecipe(written("scara-pin", numbers="simulated", **more), Path("a.toml"), "")


def run_of(controller, loaded):
    nobody: Any = None
    return RecipeRun(controller, loaded, operator=nobody)


def test_a_copy_with_simulated_numbers_is_refused_by_a_real_controller():
    with MemoryController() as controller:
        with pytest.raises(ConfigError, match=r"numbers of a\.toml are those of a simulated cell"):
            run_of(controller, copied()).preflight()
        # Whoever has put in their own deletes the line; what is refused then is something else.
        with pytest.raises(LimitError):
            run_of(controller, replace(copied(), recipe=written("scara-pin"))).preflight()


def test_a_copy_with_simulated_numbers_runs_on_a_simulated_controller():
    with robolink.connect("epson+sim://recipe-able?seed=1") as controller:
        with pytest.raises(LimitError):
            run_of(controller, copied(box={"sideways_mm": 1})).preflight()


def test_a_run_that_nobody_looked_ahead_of_refuses_all_the_same():
    with MemoryController() as controller:
        before = controller.tools.selected()
        with pytest.raises(ConfigError, match="simulated cell") as refused:
            run_of(controller, copied()).run()
        assert standing_after(refused.value).untouched
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
