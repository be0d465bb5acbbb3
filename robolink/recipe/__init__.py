"""Recipes: a nozzle change written as a TOML file; what one states, asks and needs.

A recipe is checked by pydantic, which is imported when the first one is loaded or one of its
tables is named, and not before. docs/recipes.md explains every key.
:class:`~robolink.calibration_run.RecipeRun` carries one out.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports, old_names

if TYPE_CHECKING:
    from robolink.recipe._loading import LoadedRecipe as LoadedRecipe
    from robolink.recipe._loading import check_recipe as check_recipe
    from robolink.recipe._loading import load_recipe as load_recipe
    from robolink.recipe._past import RecipePast as RecipePast
    from robolink.recipe._past import changes_left_of as changes_left_of
    from robolink.recipe._past import pasts_of as pasts_of
    from robolink.recipe._recipe import Basis as Basis
    from robolink.recipe._recipe import HeightRule as HeightRule
    from robolink.recipe._recipe import Recipe as Recipe
    from robolink.recipe._recipe import json_schema as json_schema
    from robolink.recipe._requirements import Answers as Answers
    from robolink.recipe._requirements import beyond as beyond
    from robolink.recipe._requirements import require_answers as require_answers
    from robolink.recipe._tables import Box as Box
    from robolink.recipe._tables import FlangePose as FlangePose
    from robolink.recipe._tables import MethodTable as MethodTable
    from robolink.recipe._tables import Output as Output
    from robolink.recipe._tables import Poses as Poses
    from robolink.recipe._tables import Prompt as Prompt
    from robolink.recipe._tables import RefusalTable as RefusalTable
    from robolink.recipe._tables import Speeds as Speeds
    from robolink.recipe._tables import StationTable as StationTable
    from robolink.recipe._tables import Tolerances as Tolerances
    from robolink.recipe._tables import Tool as Tool
    from robolink.recipe._tables import method_table as method_table
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_loading": "LoadedRecipe check_recipe load_recipe",
            "_past": "RecipePast changes_left_of pasts_of",
            "_recipe": "Basis HeightRule Recipe json_schema",
            "_requirements": "Answers beyond require_answers",
            "_tables": (
                "Box FlangePose MethodTable Output Poses Prompt RefusalTable Speeds "
                "StationTable Tolerances Tool method_table"
            ),
        },
        old_names(__name__),
    )
