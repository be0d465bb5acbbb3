"""The part of a check in which the robot moves: tips measured by a sensor, nothing written."""

from dataclasses import dataclass
from pathlib import Path

from robolink.calibration_run import RecipeRun
from robolink.config import Cell
from robolink.errors import ConfigError, DeclinedError
from robolink.inspection import InspectionFinding, measured_findings
from robolink.messages import tr
from robolink.model import Controller
from robolink.recipe import LoadedRecipe, load_recipe
from robolink_cli.prompts.operator import terminal
from robolink_cli.prompts.questions import on_terminal
from robolink_cli.session.motion_consent import agree_to_motion, motion_question


@dataclass(frozen=True, slots=True)
class SensorCheck:
    """Measures as a recipe says.

    Attributes:
        loaded: The recipe.
    """

    loaded: LoadedRecipe

    @classmethod
    def of(cls, recipe: Path, *, cells: int) -> "SensorCheck":
        """Return the check by a recipe.

        Raises:
            ConfigError: The recipe is wrong, or several cells are to be measured at a time.
            DeclinedError: Nobody is there to say yes; nothing was asked of a controller.
        """
        if cells != 1:
            raise ConfigError(
                tr("One cell is measured at a time, because somebody has to watch it."),
                remedy=tr("Name the cell."),
            )
        loaded = load_recipe(recipe)
        if not on_terminal():
            raise DeclinedError(
                tr("The robot would move, but there is nobody to ask."),
                remedy=tr("A check moves nothing without a person: run it on a terminal."),
            )
        return cls(loaded)

    def findings(self, controller: Controller, cell: Cell | None) -> tuple[InspectionFinding, ...]:
        """Ask, measure, compare.

        Raises:
            DeclinedError: The answer was no; nothing moved.
            RobolinkError: Nothing can move, or the robot could not finish.
        """
        run = RecipeRun(controller, self.loaded, operator=terminal(), cell=cell, measure_only=True)
        run.preflight()
        limits = run.plan.limits
        purpose = tr("to measure as {recipe!r} says; nothing is written", recipe=self.loaded.name)
        question = motion_question(
            controller, purpose, speed_mm_s=limits.speed_mm_s, box_mm=limits.box.x_max_mm
        )
        agree_to_motion(question, yes=False)
        return measured_findings(run)
