"""How the tables of a recipe go together: what no table can tell alone."""

from collections.abc import Callable, Iterator
from typing import Final

from robolink.config import Problem
from robolink.recipe._check_beams import beams, beams_height
from robolink.recipe._check_board import fiducials
from robolink.recipe._check_camera import camera_looks, camera_pixels, camera_place
from robolink.recipe._check_course import course
from robolink.recipe._check_measuring import (
    angles,
    clearance,
    height,
    station,
)
from robolink.recipe._check_moments import answers, moments
from robolink.recipe._check_places import (
    points,
    room,
    standstill,
    tool_numbers,
    upright,
)
from robolink.recipe._check_tolerances import intervals, refusals, residuals, verification
from robolink.recipe._check_touch import surface, touches
from robolink.recipe._draft import Draft

_CHECKS: Final[tuple[Callable[[Draft], Iterator[Problem]], ...]] = (
    angles,
    clearance,
    course,
    beams,
    beams_height,
    surface,
    touches,
    camera_place,
    camera_pixels,
    camera_looks,
    fiducials,
    station,
    height,
    tool_numbers,
    points,
    standstill,
    upright,
    room,
    residuals,
    intervals,
    verification,
    refusals,
    moments,
    answers,
)


def problems_together(draft: Draft) -> tuple[Problem, ...]:
    """Return everything that is wrong between tables that are right in themselves."""
    return tuple(problem for check in _CHECKS for problem in check(draft))
