"""From a recipe to the plan of a nozzle change."""

from robolink import methods
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Controller, Pose
from robolink.nozzle_change import AcceptanceCriteria, ChangePlan, Limits, ToolPlan
from robolink.procedures import SamplingPolicy, TipSource
from robolink.recipe._camera_plans import from_camera
from robolink.recipe._pin_plans import from_pin
from robolink.recipe._recipe import Recipe
from robolink.recipe._sources import (
    BeamsSource,
    LookingSource,
    PinSource,
    PointsSource,
    TouchSource,
)
from robolink.recipe._tables import Station, Tool
from robolink.stations import BeamStation, TouchStation
from robolink.ways import Way, way


def plan_of(
    recipe: Recipe,
    controller: Controller,
    *,
    ask_before_write: bool = True,
    accepted_change_mm: float | None = None,
    sensor: str | None = None,
) -> ChangePlan:
    """Return what a recipe asks for, on one controller.

    Args:
        recipe: The recipe.
        controller: The controller; only read, and only where the robot has to tilt.
        ask_before_write: Whether a person accepts the proposals.
        accepted_change_mm: A larger jump than the recipe's that an engineer accepts this time.
        sensor: The camera, in place of the recipe's.

    Raises:
        CalibrationError: ``rank_deficient``: this robot cannot tilt its tool.
        ConfigError: This kind of controller has no taught points, or no camera is named.
    """
    tolerances = recipe.tolerances
    criteria = AcceptanceCriteria(
        max_change_mm=tolerances.jump_mm,
        rms_mm=tolerances.rms_mm,
        max_residual_mm=tolerances.max_mm,
        interval_mm=tolerances.interval_mm,
        drift_tolerance_mm=tolerances.drift_mm,
        accepted_change_mm=accepted_change_mm,
        accepted_with=way(Way.ACCEPT_JUMP),
    )
    box, speeds, safe = recipe.box, recipe.speeds, recipe.poses.safe
    return ChangePlan(
        tuple(
            ToolPlan(
                tool.number,
                _source(recipe, controller, tool, sensor),
                criteria,
                verify=recipe.verifies,
                attempts=recipe.attempts,
                approach=tool.approach.pose if tool.approach else None,
                retreat=tool.retreat.pose if tool.retreat else None,
                pin=_pin(recipe),
            )
            for tool in recipe.tools
        ),
        limits=Limits(
            box_mm=box.sideways_mm,
            box_down_mm=box.down_mm,
            box_up_mm=box.up_mm,
            speed_percent=speeds.percent,
            speed_mm_s=speeds.mm_s,
        ),
        ask_before_write=ask_before_write,
        safe=safe.pose if safe else None,
    )


def _source(recipe: Recipe, controller: Controller, tool: Tool, sensor: str | None) -> TipSource:
    source, tolerances = recipe.source, recipe.tolerances
    if isinstance(source, PinSource):
        return from_pin(source, controller, tool, recipe)
    if isinstance(source, LookingSource):
        return from_camera(source, recipe.station, sensor, tolerances.sigma_mm)
    if isinstance(source, BeamsSource):
        return _from_beams(source, tolerances.sigma_mm)
    if isinstance(source, TouchSource):
        return _from_touch(source, recipe.station, tolerances.sigma_mm)
    return _from_points(source, controller, tool, recipe)


def _pin(recipe: Recipe) -> str:
    """Return the name of the pin whose place is kept, empty where none is touched."""
    return recipe.station.id if isinstance(recipe.source, PinSource) else ""


def _from_beams(source: BeamsSource, sigma_mm: float | None) -> TipSource:
    from robolink.calibration import Beam  # numpy, which recipes without beams do without

    assert source.beams is not None  # noqa: S101 - the recipe was checked and located
    assert source.z_mm is not None  # noqa: S101
    first, second = source.beams
    station = BeamStation(
        (
            Beam(first.x_mm, first.y_mm, first.direction_deg),
            Beam(second.x_mm, second.y_mm, second.direction_deg),
        ),
        source.z_mm,
        (first.input, second.input),
        off_when_broken=source.off_when_broken,
    )
    plan = methods.CrossingPlan(
        search_mm=source.search_mm,
        aside_mm=source.aside_mm,
        dip_mm=source.dip_mm,
        lift_mm=source.lift_mm,
        speed_mm_s=source.crossing_mm_s,
        repeats=source.repeats,
        shaft_mm=source.shaft_mm,
        max_lean_deg=source.max_lean_deg,
    )
    sampling = SamplingPolicy(source.until_mm, retake=source.retake)
    return methods.BeamsSource(
        station, plan, turn_deg=source.turn_deg, sigma_mm=sigma_mm, sampling=sampling
    )


def _from_touch(source: TouchSource, place: Station, sigma_mm: float | None) -> TipSource:
    station = TouchStation(*place.place_mm, source.input, off_when_touched=source.off_when_touched)
    plan = methods.ZTouchPlan(
        clearance_mm=source.clearance_mm,
        beyond_mm=source.beyond_mm,
        back_off_mm=source.back_off_mm,
        lift_mm=source.lift_mm,
        speeds_mm_s=source.speeds_mm_s,
    )
    sampling = SamplingPolicy(source.until_mm, retake=source.retake)
    return methods.ZTouchSource(
        station, plan, sigma_mm=sigma_mm, proof_turn_deg=source.proof_turn_deg, sampling=sampling
    )


def _from_points(
    source: PointsSource, controller: Controller, tool: Tool, recipe: Recipe
) -> TipSource:
    points = getattr(controller, "points", None)
    numbers = tool.points or ()
    if points is None:
        raise ConfigError(
            tr("{controller} has no taught points.", controller=controller.identity),
            remedy=tr('Use a recipe with source.kind = "operator".'),
        )

    def read() -> tuple[Pose, ...]:
        return methods.taught_poses(points, numbers)

    names = ", ".join(f"P{number}" for number in numbers)
    sigma_mm = recipe.tolerances.sigma_mm
    method = (
        methods.ManyTouches(sigma_mm)
        if source.method == "n_angle"
        else methods.TwoTouches(sigma_mm)
    )
    return methods.PointsSource(
        read,
        method,
        taught_tool=source.taught_tool,
        plausible_mm=recipe.tolerances.jump_mm,
        sentence=tr(
            "points {names} taught on the pendant with tool {tool}",
            names=names,
            tool=source.taught_tool,
        ),
    )
