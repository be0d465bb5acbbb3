"""From a recipe to a pin that a person touches."""

from dataclasses import replace

from robolink import methods
from robolink.calibration import NeedleLimits
from robolink.messages import tr
from robolink.model import Controller
from robolink.procedures import LazySource, SamplingPolicy, TipSource, TouchPlan
from robolink.recipe._recipe import Recipe
from robolink.recipe._sources import OneTouchSource, OperatorSource, PinSource, PivotSource
from robolink.recipe._tables import Tool


def from_pin(source: PinSource, controller: Controller, tool: Tool, recipe: Recipe) -> TipSource:
    """Return what touches the pin.

    Raises:
        CalibrationError: ``rank_deficient``: the robot cannot tilt its tool, and has to.
    """
    touch = TouchPlan(lift_mm=source.lift_mm, clearance_mm=source.clearance_mm)
    if isinstance(source, OneTouchSource):
        return _once(source, touch, controller, tool, recipe)
    sigma_mm, sampling = (
        recipe.tolerances.sigma_mm,
        SamplingPolicy(source.until_mm, retake=source.retake),
    )
    if isinstance(source, PivotSource):
        return _tilted(source, touch, sampling, controller, sigma_mm)
    return _turned(source, touch, sampling, sigma_mm)


def _turned(
    source: OperatorSource, touch: TouchPlan, sampling: SamplingPolicy, sigma_mm: float | None
) -> TipSource:
    if not source.turns_deg:
        return methods.TwoPoseSource(replace(touch, turn_deg=source.turn_deg), sigma_mm)
    return methods.NAngleSource(source.turns_deg, touch, sigma_mm, sampling)


def _tilted(
    source: PivotSource,
    touch: TouchPlan,
    sampling: SamplingPolicy,
    controller: Controller,
    sigma_mm: float | None,
) -> TipSource:
    from robolink.methods import informative_tilts  # numpy, which other recipes do without

    methods.require_tilting(controller, source.kind)
    tilts = informative_tilts(source.count - 1, source.tilt_deg)
    return methods.PivotSource(tilts, touch, sigma_mm=sigma_mm, sampling=sampling)


def _once(
    source: OneTouchSource,
    touch: TouchPlan,
    controller: Controller,
    tool: Tool,
    recipe: Recipe,
) -> TipSource:
    tolerances, station = recipe.tolerances, recipe.station
    if recipe.basis == "absolute":
        from robolink.calibration import Pin  # numpy, which other recipes do without

        pin = Pin(*station.place_mm, station.sigma_mm or 0.0)
        # Whoever does not know how sure the pin is cannot say how sure the tip is.
        sigma_mm = tolerances.sigma_mm if station.sigma_mm else None
        return methods.OneTouchSource(methods.Absolute(pin, sigma_mm), touch)
    limits = NeedleLimits(
        max_change_mm=tolerances.jump_mm,
        tolerance_mm=tolerances.interval_mm or NeedleLimits().tolerance_mm,
        max_changes=source.max_changes,
    )

    def make() -> methods.OneTouchSource:
        solver = methods.difference_from_last(
            controller, tool.number, station.id, sigma_mm=tolerances.sigma_mm, limits=limits
        )
        return methods.OneTouchSource(solver, touch)

    return LazySource(make, sentence=tr("measured on the robot: one pin touched once"))
