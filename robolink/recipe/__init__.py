"""Recipes: a nozzle change written down once, as a TOML file, and run as often as needed.

A recipe is checked by pydantic, which is imported when the first one is loaded or one of its
tables is named, and not before. docs/recipes.md explains every key.
"""

from robolink.recipe._able import beyond
from robolink.recipe._answers import Answers, require_answers
from robolink.recipe._loading import LoadedRecipe, check_recipe, load_recipe
from robolink.recipe._past import RecipePast, changes_left_of, pasts_of
from robolink.recipe._run import RecipeRun
from robolink.recipe.file.method_tables import MethodTable, method_table
from robolink.recipe.file.recipe import Basis, HeightRule, Recipe
from robolink.recipe.file.schema import json_schema
from robolink.recipe.file.tables import (
    Box,
    FlangePose,
    Output,
    Poses,
    Prompt,
    RefusalTable,
    Speeds,
    StationTable,
    Tolerances,
    Tool,
)

__all__ = [
    "Answers",
    "Basis",
    "Box",
    "FlangePose",
    "HeightRule",
    "LoadedRecipe",
    "MethodTable",
    "Output",
    "Poses",
    "Prompt",
    "Recipe",
    "RecipePast",
    "RecipeRun",
    "RefusalTable",
    "Speeds",
    "StationTable",
    "Tolerances",
    "Tool",
    "beyond",
    "changes_left_of",
    "check_recipe",
    "json_schema",
    "load_recipe",
    "method_table",
    "pasts_of",
    "require_answers",
]
