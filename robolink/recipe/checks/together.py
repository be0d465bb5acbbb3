"""How the tables of a recipe go together: what no table can tell alone."""

from collections.abc import Callable, Iterator
from typing import Final

from robolink.files.toml import Problem
from robolink.recipe.checks.draft import Draft
from robolink.recipe.checks.moments import answers, moments
from robolink.recipe.checks.places import (
    points,
    room,
    standstill,
    tool_numbers,
    upright,
)
from robolink.recipe.checks.source import both_coordinates, height, orientation, parameters, place
from robolink.recipe.checks.tolerances import refusals, verification

_CHECKS: Final[tuple[Callable[[Draft], Iterator[Problem]], ...]] = (
    parameters,
    place,
    both_coordinates,
    height,
    orientation,
    tool_numbers,
    points,
    standstill,
    upright,
    room,
    verification,
    refusals,
    moments,
    answers,
)


def problems_together(draft: Draft) -> tuple[Problem, ...]:
    """Return everything that is wrong between tables that are right in themselves."""
    return tuple(problem for check in _CHECKS for problem in check(draft))
