"""Recipes: a nozzle change written down once, as a TOML file, and run as often as needed.

A recipe is checked by pydantic, which is imported when the first one is loaded or one of its
tables is named, and not before. docs/recipes.md explains every key.
"""

from typing import TYPE_CHECKING

from robolink.recipe._loading import LoadedRecipe as LoadedRecipe
from robolink.recipe._loading import check_recipe as check_recipe
from robolink.recipe._loading import load_recipe as load_recipe

if TYPE_CHECKING:
    from robolink.recipe._able import beyond as beyond
    from robolink.recipe._answers import Answers as Answers
    from robolink.recipe._answers import require_answers as require_answers
    from robolink.recipe._past import RecipePast as RecipePast
    from robolink.recipe._past import changes_left_of as changes_left_of
    from robolink.recipe._past import pasts_of as pasts_of
    from robolink.recipe._run import RecipeRun as RecipeRun
    from robolink.recipe.file.method_tables import MethodTable as MethodTable
    from robolink.recipe.file.method_tables import method_table as method_table
    from robolink.recipe.file.recipe import Basis as Basis
    from robolink.recipe.file.recipe import HeightRule as HeightRule
    from robolink.recipe.file.recipe import Recipe as Recipe
    from robolink.recipe.file.schema import json_schema as json_schema
    from robolink.recipe.file.tables import Box as Box
    from robolink.recipe.file.tables import FlangePose as FlangePose
    from robolink.recipe.file.tables import Output as Output
    from robolink.recipe.file.tables import Poses as Poses
    from robolink.recipe.file.tables import Prompt as Prompt
    from robolink.recipe.file.tables import RefusalTable as RefusalTable
    from robolink.recipe.file.tables import Speeds as Speeds
    from robolink.recipe.file.tables import StationTable as StationTable
    from robolink.recipe.file.tables import Tolerances as Tolerances
    from robolink.recipe.file.tables import Tool as Tool

_LOADED_LATER = {
    "beyond": "_able",
    "Answers": "_answers",
    "require_answers": "_answers",
    "RecipePast": "_past",
    "changes_left_of": "_past",
    "pasts_of": "_past",
    "RecipeRun": "_run",
    "MethodTable": "file.method_tables",
    "method_table": "file.method_tables",
    "Basis": "file.recipe",
    "HeightRule": "file.recipe",
    "Recipe": "file.recipe",
    "json_schema": "file.schema",
    "Box": "file.tables",
    "FlangePose": "file.tables",
    "Output": "file.tables",
    "Poses": "file.tables",
    "Prompt": "file.tables",
    "RefusalTable": "file.tables",
    "Speeds": "file.tables",
    "StationTable": "file.tables",
    "Tolerances": "file.tables",
    "Tool": "file.tables",
}


def __getattr__(name: str) -> object:
    """Load what needs pydantic from its module (PEP 562)."""
    if name not in _LOADED_LATER:
        raise AttributeError(f"module 'robolink.recipe' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"robolink.recipe.{_LOADED_LATER[name]}"), name)
