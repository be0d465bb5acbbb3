"""Recipes: a nozzle change written down once, as a TOML file, and run as often as needed.

A recipe is checked by pydantic, which is imported when the first one is loaded or one of its
tables is named, and not before. docs/recipes.md explains every key.
"""

from typing import TYPE_CHECKING

from robolink.recipe._loading import LoadedRecipe as LoadedRecipe
from robolink.recipe._loading import check_recipe as check_recipe
from robolink.recipe._loading import load_recipe as load_recipe

if TYPE_CHECKING:
    from robolink.recipe._answers import Answers as Answers
    from robolink.recipe._answers import require_answers as require_answers
    from robolink.recipe._recipe import Basis as Basis
    from robolink.recipe._recipe import HeightRule as HeightRule
    from robolink.recipe._recipe import Recipe as Recipe
    from robolink.recipe._run import RecipeRun as RecipeRun
    from robolink.recipe._schema import json_schema as json_schema
    from robolink.recipe._sources import BeamLine as BeamLine
    from robolink.recipe._sources import BeamsSource as BeamsSource
    from robolink.recipe._sources import BoardSource as BoardSource
    from robolink.recipe._sources import CameraAffineSource as CameraAffineSource
    from robolink.recipe._sources import CameraSource as CameraSource
    from robolink.recipe._sources import OneTouchSource as OneTouchSource
    from robolink.recipe._sources import OperatorSource as OperatorSource
    from robolink.recipe._sources import PivotSource as PivotSource
    from robolink.recipe._sources import PointsSource as PointsSource
    from robolink.recipe._sources import TouchSource as TouchSource
    from robolink.recipe._tables import Box as Box
    from robolink.recipe._tables import FlangePose as FlangePose
    from robolink.recipe._tables import Output as Output
    from robolink.recipe._tables import Poses as Poses
    from robolink.recipe._tables import Prompt as Prompt
    from robolink.recipe._tables import Refusal as Refusal
    from robolink.recipe._tables import Speeds as Speeds
    from robolink.recipe._tables import Station as Station
    from robolink.recipe._tables import Tolerances as Tolerances
    from robolink.recipe._tables import Tool as Tool

_LOADED_LATER = {
    "Answers": "_answers",
    "require_answers": "_answers",
    "RecipeRun": "_run",
    "Basis": "_recipe",
    "HeightRule": "_recipe",
    "Recipe": "_recipe",
    "json_schema": "_schema",
    "BeamLine": "_sources",
    "BeamsSource": "_sources",
    "BoardSource": "_sources",
    "CameraAffineSource": "_sources",
    "CameraSource": "_sources",
    "OneTouchSource": "_sources",
    "OperatorSource": "_sources",
    "PivotSource": "_sources",
    "PointsSource": "_sources",
    "TouchSource": "_sources",
    "Box": "_tables",
    "FlangePose": "_tables",
    "Output": "_tables",
    "Poses": "_tables",
    "Prompt": "_tables",
    "Refusal": "_tables",
    "Speeds": "_tables",
    "Station": "_tables",
    "Tolerances": "_tables",
    "Tool": "_tables",
}


def __getattr__(name: str) -> object:
    """Load what needs pydantic from its module (PEP 562)."""
    if name not in _LOADED_LATER:
        raise AttributeError(f"module 'robolink.recipe' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"robolink.recipe.{_LOADED_LATER[name]}"), name)
