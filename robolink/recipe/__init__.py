"""Recipes: a nozzle change written down once, as a TOML file, and run as often as needed.

A recipe is checked by pydantic, which is imported when the first one is loaded or one of its
tables is named, and not before. docs/recipes.md explains every key.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.recipe._able import beyond as beyond
    from robolink.recipe._answers import Answers as Answers
    from robolink.recipe._answers import require_answers as require_answers
    from robolink.recipe._loading import LoadedRecipe as LoadedRecipe
    from robolink.recipe._loading import check_recipe as check_recipe
    from robolink.recipe._loading import load_recipe as load_recipe
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
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_able": "beyond",
            "_answers": "Answers require_answers",
            "_loading": "LoadedRecipe check_recipe load_recipe",
            "_past": "RecipePast changes_left_of pasts_of",
            "_run": "RecipeRun",
            "file.method_tables": "MethodTable method_table",
            "file.recipe": "Basis HeightRule Recipe",
            "file.schema": "json_schema",
            "file.tables": (
                "Box FlangePose Output Poses Prompt RefusalTable Speeds StationTable "
                "Tolerances Tool"
            ),
        },
    )
