"""Where a recipe's station is, when the recipe itself does not say it."""

from collections.abc import Mapping

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.recipe._recipe import Recipe
from robolink.recipe._sources import (
    BeamLine,
    BeamsSource,
    LookingSource,
    OneTouchSource,
    OperatorSource,
    TouchSource,
)
from robolink.stations import (
    BeamStation,
    Station,
    StationKind,
    beam_station,
    camera_station,
    sensor_of,
)


def located(recipe: Recipe, stations: Mapping[str, Station]) -> Recipe:
    """Return the recipe with what the record of its station adds.

    Args:
        recipe: The recipe.
        stations: The stations of the cell, by name.

    Raises:
        ConfigError: Something about the station is needed that neither recipe nor record says.
    """
    source, place = recipe.source, recipe.station
    if isinstance(source, BeamsSource):
        return recipe if source.beams else _with_beams(recipe, source, stations)
    if isinstance(source, LookingSource):
        return _with_camera(recipe, source, stations)
    if isinstance(source, TouchSource) and place.z_mm is None:
        return _with_place(recipe, _known(recipe, stations, StationKind.TOUCH))
    pin_needed = isinstance(source, OneTouchSource) or (
        isinstance(source, OperatorSource) and recipe.z == "measured"
    )
    if pin_needed and recipe.basis == "absolute" and place.z_mm is None:
        return _with_place(recipe, _known(recipe, stations, StationKind.PIN))
    return recipe


def _with_place(recipe: Recipe, station: Station) -> Recipe:
    place = {"x_mm": station.x_mm, "y_mm": station.y_mm, "z_mm": station.z_mm}
    if None in place.values():
        raise _unknown(recipe, tr("its place is not known"))
    given = {**place, "sigma_mm": station.sigma_mm}
    return recipe.model_copy(update={"station": recipe.station.model_copy(update=given)})


def _with_beams(recipe: Recipe, source: BeamsSource, stations: Mapping[str, Station]) -> Recipe:
    found: BeamStation = beam_station(_known(recipe, stations, StationKind.BEAMS))
    lines = tuple(
        BeamLine(input=number, x_mm=beam.x_mm, y_mm=beam.y_mm, direction_deg=beam.direction_deg)
        for number, beam in zip(found.inputs, found.beams, strict=True)
    )
    beams = {"beams": lines, "z_mm": found.z_mm, "off_when_broken": found.off_when_broken}
    return recipe.model_copy(update={"source": source.model_copy(update=beams)})


def _with_camera(recipe: Recipe, source: LookingSource, stations: Mapping[str, Station]) -> Recipe:
    """Return the recipe with what it does not say itself: place, sensor, meaning of a pixel."""
    missing = recipe.station.z_mm is None
    if not missing and recipe.station.id not in stations:
        return recipe
    station = _known(recipe, stations, StationKind.CAMERA)
    located = _with_place(recipe, station) if missing else recipe
    added: dict[str, object] = {"sensor": source.sensor or sensor_of(station) or None}
    model = camera_station(station).model
    if source.model is None and model is not None:
        added |= {"mm_per_px": model.mm_per_px, "origin_mm": model.origin_mm}
    return located.model_copy(update={"source": source.model_copy(update=added)})


def _known(recipe: Recipe, stations: Mapping[str, Station], kind: StationKind) -> Station:
    station = stations.get(recipe.station.id)
    if station is None:
        raise _unknown(recipe, tr("no station of that name is known"))
    if station.kind is not kind:
        raise _unknown(
            recipe, tr("it is of kind {kind}, not {wanted}", kind=station.kind, wanted=kind)
        )
    return station


def _unknown(recipe: Recipe, why: str) -> ConfigError:
    return ConfigError(
        tr("The recipe does not say where {id} is, and {why}.", id=recipe.station.id, why=why),
        remedy=tr(
            "Say it in the recipe or in the cell file, learn it with 'robolink station learn', or "
            "make a full calibration there. Nothing was moved."
        ),
    )
