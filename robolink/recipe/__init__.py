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
    from robolink.recipe._method_tables import MethodTable as MethodTable
    from robolink.recipe._method_tables import method_table as method_table
    from robolink.recipe._recipe import Basis as Basis
    from robolink.recipe._recipe import HeightRule as HeightRule
    from robolink.recipe._recipe import Recipe as Recipe
    from robolink.recipe._run import RecipeRun as RecipeRun
    from robolink.recipe._schema import json_schema as json_schema
    from robolink.recipe._tables import Box as Box
    from robolink.recipe._tables import FlangePose as FlangePose
    from robolink.recipe._tables import Output as Output
    from robolink.recipe._tables import Poses as Poses
    from robolink.recipe._tables import Prompt as Prompt
    from robolink.recipe._tables import RefusalTable as RefusalTable
    from robolink.recipe._tables import Speeds as Speeds
    from robolink.recipe._tables import StationTable as StationTable
    from robolink.recipe._tables import Tolerances as Tolerances
    from robolink.recipe._tables import Tool as Tool

_LOADED_LATER = {
    "Answers": "_answers",
    "require_answers": "_answers",
    "RecipeRun": "_run",
    "MethodTable": "_method_tables",
    "method_table": "_method_tables",
    "Basis": "_recipe",
    "HeightRule": "_recipe",
    "Recipe": "_recipe",
    "json_schema": "_schema",
    "Box": "_tables",
    "FlangePose": "_tables",
    "Output": "_tables",
    "Poses": "_tables",
    "Prompt": "_tables",
    "RefusalTable": "_tables",
    "Speeds": "_tables",
    "StationTable": "_tables",
    "Tolerances": "_tables",
    "Tool": "_tables",
}


def __getattr__(name: str) -> object:
    """Load what needs pydantic from its module (PEP 562)."""
    if name not in _LOADED_LATER:
        raise AttributeError(f"module 'robolink.recipe' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"robolink.recipe.{_LOADED_LATER[name]}"), name)
