"""From a recipe to the plan of a nozzle change."""

from dataclasses import replace
from pathlib import Path

from robolink.accuracy import stated_rows
from robolink.config import Cell
from robolink.methods import MethodParameters, Site, fields_of, source_of
from robolink.model import AnsweredBy, Controller, TipSensor
from robolink.nozzle_change import AcceptanceCriteria, ChangePlan, Limits, ToolPlan
from robolink.pose_tables import ReadingChoices
from robolink.procedures import TipSource
from robolink.recipe.file.recipe import Recipe
from robolink.recipe.file.tables import Tool
from robolink.stations import Station, StationKind
from robolink.ways import Way, way


def plan_of(
    recipe: Recipe,
    station: Station,
    controller: Controller,
    *,
    folder: Path,
    ask_before_write: bool = True,
    agreed_by: AnsweredBy = AnsweredBy.PROGRAM,
    accepted_change_mm: float | None = None,
    sensor: str | TipSensor | None = None,
    stated: Station | None = None,
    cell: Cell | None = None,
) -> ChangePlan:
    """Return what a recipe asks for, on one controller.

    Args:
        recipe: The recipe.
        station: Its station, with what its record adds.
        controller: The controller; only read, and only where the robot has to tilt.
        folder: Where the recipe lies: files that it names are looked for there.
        ask_before_write: Whether a person accepts the proposals.
        agreed_by: How the write was agreed to beforehand, where nobody is asked.
        accepted_change_mm: A larger jump than the recipe's that an engineer accepts this time.
        sensor: The camera, or its name or URL, in place of the recipe's.
        stated: The station as the cell file has it, ``None`` where it says nothing.
        cell: The cell, whose file may state rows of the budget.

    Raises:
        CalibrationError: ``rank_deficient``: this robot cannot tilt its tool.
        ConfigError: This kind of controller has no taught points, or no camera is named.
    """
    tolerances, parameters = recipe.tolerances, parameters_of(recipe)
    criteria = AcceptanceCriteria(
        max_change_mm=tolerances.jump_mm,
        rms_mm=tolerances.rms_mm,
        max_residual_mm=tolerances.max_mm,
        interval_mm=tolerances.interval_mm,
        drift_tolerance_mm=tolerances.drift_mm,
        accepted_change_mm=accepted_change_mm,
        accepted_with=way(Way.ACCEPT_JUMP),
        unattended=not ask_before_write,
        stated=frozenset(("rms_mm", "max_residual_mm", "interval_mm")),
    )
    rows = stated_rows(cell, station, recipe=recipe.accuracy.stated, recipe_name=recipe.name)
    safe, needs = recipe.poses.safe, recipe.source.of_method.needs
    return ChangePlan(
        tuple(
            ToolPlan(
                tool.number,
                _source(
                    recipe,
                    parameters,
                    station=station,
                    controller=controller,
                    tool=tool,
                    sensor=sensor,
                    folder=folder,
                ),
                criteria,
                verify=recipe.verifies,
                attempts=recipe.attempts,
                approach=tool.approach.pose if tool.approach else None,
                retreat=tool.retreat.pose if tool.retreat else None,
                pin=_pin(recipe),
                stated_pin=stated if _pin(recipe) else None,
                gauge=station.gauge_on_record(),
                length=parameters.length_rule(),
                method=recipe.source.of_method.name,
                station="" if needs.finds_pin or not station.learnt else station.id,
                at=station.id,
                rows=rows,
            )
            for tool in recipe.tools
        ),
        limits=_limits(recipe, parameters),
        ask_before_write=ask_before_write,
        agreed_by=agreed_by,
        safe=safe.pose if safe else None,
    )


def parameters_of(recipe: Recipe) -> MethodParameters:
    """Return the parameters, with what stands at the top of the recipe."""
    parameters = recipe.source.parameters
    for one in fields_of(type(parameters)):
        if one.option.from_recipe:
            value = getattr(recipe, one.option.from_recipe)
            parameters = replace(parameters, **{one.name: value})
    return parameters


def _source(
    recipe: Recipe,
    parameters: MethodParameters,
    *,
    station: Station,
    controller: Controller,
    tool: Tool,
    sensor: str | TipSensor | None,
    folder: Path,
) -> TipSource:
    tolerances = recipe.tolerances
    site = Site(
        controller=controller,
        tool=tool.number,
        station=station,
        points=tool.points or (),
        pose_file=_pose_file(tool, folder),
        sigma_mm=tolerances.sigma_mm,
        max_change_mm=tolerances.jump_mm,
        interval_mm=tolerances.interval_mm,
        sensor=sensor,
    )
    return source_of(recipe.source.of_method, parameters, site)


def _pose_file(tool: Tool, folder: Path) -> tuple[Path, ReadingChoices] | None:
    given = tool.poses
    if given is None:
        return None
    return folder / given.file, ReadingChoices(given.columns, given.length, given.euler)


def _pin(recipe: Recipe) -> str:
    """Return the name of the pin whose place is kept, empty where none is touched."""
    needs = recipe.source.of_method.needs
    return recipe.station.id if needs.motion and needs.station is StationKind.PIN else ""


def _limits(recipe: Recipe, parameters: MethodParameters) -> Limits:
    """Return where the robot may go; higher where the method has to and nobody said how high."""
    box, speeds = recipe.box, recipe.speeds
    higher_mm = 0.0 if "up_mm" in box.model_fields_set else parameters.height_mm()
    return Limits(
        box.reach.larger(up_mm=higher_mm),
        speed_percent=speeds.percent,
        speed_mm_s=speeds.mm_s,
    )
