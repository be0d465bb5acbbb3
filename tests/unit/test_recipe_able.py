"""What a recipe asks for and a kind of controller cannot do: not offered, and refused at once."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from robolink.controllers import capabilities_of_kind
from robolink.errors import ConfigError
from robolink.recipe import LoadedRecipe, Recipe, RecipeRun, beyond
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
    able = replace(capabilities_of_kind("softmotion"), tool_write=False)
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
