"""The accuracy that each shipped recipe states for an exact run with the usual scatter.

``python -m tests.calibration._recipe_statements`` prints the table of
docs/reference/recipe-rules.md 4.
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robolink.accuracy import stated_rows
from robolink.calibration import (
    AccuracyFacts,
    Beam,
    BoardDrawing,
    CalibrationResult,
    CameraModel,
    PixelSighting,
    assessed,
    carrying,
    pin_touched,
    solve_camera_affine,
    solve_one_touch,
    solve_two_pose,
)
from robolink.methods import (
    BeamsParameters,
    PlaneSurvey,
    SphereSurvey,
    informative_tilts,
    measure_beams,
    measure_board,
    measure_camera,
    measure_n_angle,
    measure_pivot,
    measure_plane_touch,
    measure_sphere_touch,
    measure_two_pose,
    measure_z_touch,
)
from robolink.model import Pose, ToolOffset
from robolink.procedures import LookPlan, TouchPlan
from robolink.recipe import load_recipe
from robolink.runner import Procedure
from robolink.stations import BeamStation, CameraStation, TouchStation
from robolink.testing import PaperCell

EXAMPLES = Path(__file__).parents[2] / "examples" / "recipes"
PERSON_MM, PROBE_MM, BEAMS_MM, CAMERA_MM = 0.01, 0.005, 0.003, 0.002
"""Scatter of one look in the simulated cells; a camera's is 0.1 pixels of 0.02 mm."""

HERE, PIN_MM = Pose(300, 100, 20, 0), (310.0, 95.0, -40.0)
TIP, STORED = ToolOffset(12.3, -3.9, -20.6), ToolOffset(12, -4, -20)
PIXELS = CameraModel(((0.02, 0.0), (0.0, -0.02)), (293.6, 84.8))
"""A camera whose pixel (320, 240) sees the middle of its image, X 300, Y 80."""


def _pin(course: Procedure[CalibrationResult]) -> CalibrationResult:
    return PaperCell(HERE, TIP, PIN_MM).run(course)


def _two_pose(recipe: Any, sigma_mm: float) -> CalibrationResult:
    return _pin(measure_two_pose(TouchPlan(seed=1), stored=STORED, sigma_mm=sigma_mm))


def _n_angle(recipe: Any, sigma_mm: float) -> CalibrationResult:
    turns = (90.0, 180.0, 270.0)[: recipe.source.count - 1]
    return _pin(
        measure_n_angle(TouchPlan(seed=1), turns_deg=turns, stored=STORED, sigma_mm=sigma_mm)
    )


def _points(recipe: Any, sigma_mm: float) -> CalibrationResult:
    poses = Pose(297.7, 98.9, -19.4, 0), Pose(322.3, 91.1, -19.4, 180)
    return solve_two_pose(*poses, sigma_mm=sigma_mm)


def _one_touch(recipe: Any, sigma_mm: float) -> CalibrationResult:
    pin = pin_touched(Pose(300, 100, -60, 0), STORED, sigma_mm=sigma_mm)
    return solve_one_touch(Pose(299.7, 100.2, -60.1, 0), pin, sigma_mm=sigma_mm)


def _pivot(recipe: Any, sigma_mm: float) -> CalibrationResult:
    tilts = informative_tilts(recipe.source.count, tilt_deg=recipe.source.tilt_deg)
    return _pin(measure_pivot(TouchPlan(seed=1), tilts=tilts, stored=STORED, sigma_mm=sigma_mm))


def _plane(recipe: Any, sigma_mm: float) -> CalibrationResult:
    source = recipe.source
    survey = PlaneSurvey(count=source.count, tilt_deg=source.tilt_deg, spread_mm=source.spread_mm)
    falls = math.tan(math.radians(20))
    cell = PaperCell(HERE, TIP, lambda at: (at[0], at[1], falls * (at[1] - PIN_MM[1]) - 40.0))
    course = measure_plane_touch(
        TouchPlan(seed=1), survey, stored=STORED, axes=5, sigma_mm=sigma_mm
    )
    return cell.run(course)


def _sphere(recipe: Any, sigma_mm: float) -> CalibrationResult:
    source, centre = recipe.source, (310.0, 95.0, -60.0)

    def onto_the_ball(at: tuple[float, float, float]) -> tuple[float, float, float]:
        share = source.radius_mm / math.dist(at, centre)
        x, y, z = (c + share * (a - c) for a, c in zip(at, centre, strict=True))
        return x, y, z

    survey = SphereSurvey(count=source.count, tilt_deg=source.tilt_deg, radius_mm=source.radius_mm)
    course = measure_sphere_touch(
        TouchPlan(seed=1), survey, stored=STORED, axes=5, sigma_mm=sigma_mm
    )
    return PaperCell(Pose(298, 99, 20, 0), TIP, onto_the_ball).run(course)


def _beams(recipe: Any, sigma_mm: float) -> CalibrationResult:
    beams = BeamStation((Beam(300, 80, 0), Beam(300, 80, 90)), -30, inputs=(3, 4))
    broken = {3: lambda at: abs(at[1] - 80) < 0.4, 4: lambda at: abs(at[0] - 300) < 0.4}
    plan = BeamsParameters(repeats=recipe.source.repeats)
    cell = PaperCell(HERE, ToolOffset(12.3, -3.9, -20), switches=broken)
    return cell.run(measure_beams(beams, plan, here=HERE, stored=STORED, sigma_mm=sigma_mm))


def _probe(recipe: Any, sigma_mm: float) -> CalibrationResult:
    plate = TouchStation(x_mm=320, y_mm=60, z_mm=-50, input=5)
    cell = PaperCell(HERE, ToolOffset(12, -4, -20.4), switches={5: lambda at: at[2] < -50})
    plan = recipe.source.parameters
    return cell.run(measure_z_touch(plate, plan, here=HERE, stored=STORED, sigma_mm=sigma_mm))


def _camera(recipe: Any, sigma_mm: float) -> CalibrationResult:
    camera = CameraStation(x_mm=300, y_mm=80, z_mm=-30, model=PIXELS)
    plan = LookPlan(turns_deg=recipe.source.turns_deg)
    course = measure_camera(camera, plan, here=HERE, stored=STORED, sigma_mm=sigma_mm)
    return PaperCell(HERE, ToolOffset(12.3, -3.9, -20)).run(course)


def _camera_affine(recipe: Any, sigma_mm: float) -> CalibrationResult:
    seen = []
    for dx, dy, turn_deg in recipe.source.parameters.places:
        x_mm, y_mm = 300 + dx, 80 + dy
        flange = carrying(Pose(0, 0, 0, turn_deg), TIP, (x_mm, y_mm, -30.0))
        px, py = (x_mm - PIXELS.origin_mm[0]) / 0.02, (PIXELS.origin_mm[1] - y_mm) / 0.02
        seen.append(PixelSighting(flange, px, py))
    return solve_camera_affine(seen, stored=STORED, sigma_mm=sigma_mm)


def _board(recipe: Any, sigma_mm: float) -> CalibrationResult:
    board = BoardDrawing(tuple((x, y) for x, y in recipe.source.fiducials_mm))
    held = ToolOffset(2, -1, -20, 8)
    camera = CameraStation(x_mm=300, y_mm=80, z_mm=-30, model=PIXELS)
    cell = PaperCell(HERE, held, marks=dict(enumerate(board.seen_from(held), start=1)))
    plan = LookPlan(turns_deg=recipe.source.turns_deg)
    stored = ToolOffset(0, 0, -20)
    course = measure_board(camera, plan, board, here=HERE, stored=stored, sigma_mm=sigma_mm)
    return cell.run(course)


_COURSES: dict[str, tuple[Callable[[Any, float], CalibrationResult], float]] = {
    "two-pose": (_two_pose, PERSON_MM),
    "n-angle": (_n_angle, PERSON_MM),
    "points": (_points, PERSON_MM),
    "one-touch": (_one_touch, PERSON_MM),
    "pivot": (_pivot, PERSON_MM),
    "plane-touch": (_plane, PERSON_MM),
    "sphere-touch": (_sphere, PERSON_MM),
    "beams": (_beams, BEAMS_MM),
    "z-touch": (_probe, PROBE_MM),
    "camera": (_camera, CAMERA_MM),
    "camera-affine": (_camera_affine, CAMERA_MM),
    "board": (_board, CAMERA_MM),
}


@dataclass(frozen=True, slots=True)
class Statement:
    """The statement of a recipe, and its limit.

    Attributes:
        name: The file's name.
        limit_mm: The recipe's own limit, ``None`` for none.
        by_default: The statement with default rows and a station learnt just now.
        in_two_months: The same two months later.
        by_recipe: The statement with the rows that the recipe states.
        stated: These rows.
    """

    name: str
    limit_mm: float | None
    by_default: CalibrationResult
    in_two_months: CalibrationResult
    by_recipe: CalibrationResult
    stated: dict[str, float]

    @property
    def row(self) -> list[str]:
        """The recipe's line of the table."""
        limit = "-" if self.limit_mm is None else f"{self.limit_mm:g}"
        states = ", ".join(f"`{key} = {value:g}`" for key, value in self.stated.items()) or "-"
        return [
            f"`{self.name}`",
            limit,
            f"{self.by_default.repeatable_to_mm:.3f}",
            f"{self.by_default.accurate_to_mm:.3f}",
            f"{self.in_two_months.accurate_to_mm:.3f}",
            states,
            f"{self.by_recipe.accurate_to_mm:.3f}",
        ]


def statement(name: str) -> Statement:
    """Return the accuracy that one shipped recipe states, with a station learnt just now."""
    recipe = load_recipe(EXAMPLES / f"{name}.toml").recipe
    course, usual_mm = _COURSES[recipe.source.of_method.name]
    result = course(recipe, recipe.tolerances.sigma_mm or usual_mm)
    stated = recipe.accuracy.stated
    rows = stated_rows(None, recipe.station.id, recipe=stated, recipe_name=recipe.name)
    return Statement(
        name,
        recipe.tolerances.interval_mm,
        assessed(result, AccuracyFacts(months=0.0)),
        assessed(result, AccuracyFacts(months=2.0)),
        assessed(result, AccuracyFacts(rows=rows, months=0.0)),
        stated,
    )


def names() -> list[str]:
    """Return the names of the shipped recipes."""
    return sorted(file.stem for file in EXAMPLES.glob("*.toml"))


if __name__ == "__main__":
    for one in map(statement, names()):
        sys.stdout.write(f"| {' | '.join(one.row)} |\n")
