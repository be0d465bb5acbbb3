"""From a recipe to the plan of a nozzle change: where its station is, and what is done there."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from robolink.accuracy import stated_rows
from robolink.calibration_run._acceptance import AcceptanceCriteria
from robolink.calibration_run._plan import ChangePlan, Limits, ToolPlan
from robolink.config import Cell
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.methods import MethodParameters, Site, source_of
from robolink.model import AnsweredBy, Controller, TipSensor
from robolink.pose_tables import ReadingChoices
from robolink.procedures import TipSource
from robolink.stations import Station, StationKind
from robolink.ways import Way, way

if TYPE_CHECKING:
    from robolink.recipe import Recipe, Tool


def plan_of(
    recipe: "Recipe",
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
    tolerances, parameters = recipe.tolerances, recipe.parameters
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


def _source(
    recipe: "Recipe",
    parameters: MethodParameters,
    *,
    station: Station,
    controller: Controller,
    tool: "Tool",
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


def _pose_file(tool: "Tool", folder: Path) -> tuple[Path, ReadingChoices] | None:
    given = tool.poses
    if given is None:
        return None
    return folder / given.file, ReadingChoices(given.columns, given.length, given.euler)


def _pin(recipe: "Recipe") -> str:
    """Return the name of the pin whose place is kept, empty where none is touched."""
    needs = recipe.source.of_method.needs
    return recipe.station.id if needs.motion and needs.station is StationKind.PIN else ""


def _limits(recipe: "Recipe", parameters: MethodParameters) -> Limits:
    """Return where the robot may go; higher where the method has to and nobody said how high."""
    box, speeds = recipe.box, recipe.speeds
    higher_mm = 0.0 if "up_mm" in box.model_fields_set else parameters.height_mm()
    return Limits(
        box.reach.larger(up_mm=higher_mm),
        speed_percent=speeds.percent,
        speed_mm_s=speeds.mm_s,
    )


def located(recipe: "Recipe", stations: Mapping[str, Station]) -> tuple["Recipe", Station]:
    """Return the recipe with the place of its station, and the station as the method is told it.

    What the recipe says goes before the record.

    Args:
        recipe: The recipe.
        stations: The stations of the cell, by name.

    Raises:
        ConfigError: Something about the station is needed that neither recipe nor record says.
    """
    place, needs = recipe.station, recipe.source.of_method.needs
    if place.z_mm is None and _place_needed(recipe):
        known = _known(recipe, stations)
        recipe = _with_place(recipe, known)
    elif _record_needed(recipe) or (needs.sensor and place.id in stations):
        known = _known(recipe, stations)
    else:
        recorded = stations.get(place.id)
        fits = recorded is not None and recorded.kind is needs.station and needs.place is not None
        known = recorded if recorded and fits else Station(id=place.id, kind=needs.station)
        if recorded is not None and not fits:
            # Where it is does not matter to the method; what stands there goes on record.
            known = replace(known, gauge=recorded.gauge, gauge_due=recorded.gauge_due)
    return recipe, _as_told(recipe, known)


def _place_needed(recipe: "Recipe") -> bool:
    method = recipe.source.of_method
    if method.needs.place is not None:
        return True
    measured = method.tells_height and recipe.z == "measured"
    return recipe.basis == "absolute" and (measured or not method.by_reference)


def _record_needed(recipe: "Recipe") -> bool:
    needs = recipe.source.of_method.needs
    known_otherwise = needs.station is StationKind.PIN or needs.place is not None
    return not known_otherwise and not recipe.source.parameters.states_station()


def _with_place(recipe: "Recipe", station: Station) -> "Recipe":
    place = {"x_mm": station.x_mm, "y_mm": station.y_mm, "z_mm": station.z_mm}
    if None in place.values():
        raise _unknown(recipe, tr("Its place is not known."))
    given = {**place, "sigma_mm": station.sigma_mm}
    return recipe.model_copy(update={"station": recipe.station.model_copy(update=given)})


def _as_told(recipe: "Recipe", station: Station) -> Station:
    place = recipe.station
    if place.z_mm is None or recipe.source.of_method.needs.station is StationKind.BEAMS:
        return station
    return station.at(place.x_mm, place.y_mm, place.z_mm, sigma_mm=place.sigma_mm)


def _known(recipe: "Recipe", stations: Mapping[str, Station]) -> Station:
    kind = recipe.source.of_method.needs.station
    station = stations.get(recipe.station.id)
    if station is None:
        raise _unknown(recipe, tr("No station of that name is known."))
    if station.kind is not kind:
        raise _unknown(
            recipe, tr("It is of kind {kind}, not {wanted}.", kind=station.kind, wanted=kind)
        )
    return station


def _unknown(recipe: "Recipe", why: str) -> ConfigError:
    return ConfigError(
        tr("The recipe does not say where {id} is. {why}", id=recipe.station.id, why=why),
        remedy=tr(
            "Say it in the recipe or in the cell file, learn it with "
            "'robolink cell station learn', or "
            "make a full calibration there. Nothing was moved."
        ),
    )
