"""Where a recipe's station is: what the recipe says of it, and what its record adds."""

from collections.abc import Mapping
from dataclasses import replace

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.recipe.file.recipe import Recipe
from robolink.stations import Station, StationKind


def located(recipe: Recipe, stations: Mapping[str, Station]) -> tuple[Recipe, Station]:
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


def _place_needed(recipe: Recipe) -> bool:
    method = recipe.source.of_method
    if method.needs.place is not None:
        return True
    measured = method.tells_height and recipe.z == "measured"
    return recipe.basis == "absolute" and (measured or not method.by_reference)


def _record_needed(recipe: Recipe) -> bool:
    needs = recipe.source.of_method.needs
    known_otherwise = needs.station is StationKind.PIN or needs.place is not None
    return not known_otherwise and not recipe.source.parameters.states_station()


def _with_place(recipe: Recipe, station: Station) -> Recipe:
    place = {"x_mm": station.x_mm, "y_mm": station.y_mm, "z_mm": station.z_mm}
    if None in place.values():
        raise _unknown(recipe, tr("Its place is not known."))
    given = {**place, "sigma_mm": station.sigma_mm}
    return recipe.model_copy(update={"station": recipe.station.model_copy(update=given)})


def _as_told(recipe: Recipe, station: Station) -> Station:
    place = recipe.station
    if place.z_mm is None or recipe.source.of_method.needs.station is StationKind.BEAMS:
        return station
    return station.at(place.x_mm, place.y_mm, place.z_mm, sigma_mm=place.sigma_mm)


def _known(recipe: Recipe, stations: Mapping[str, Station]) -> Station:
    kind = recipe.source.of_method.needs.station
    station = stations.get(recipe.station.id)
    if station is None:
        raise _unknown(recipe, tr("No station of that name is known."))
    if station.kind is not kind:
        raise _unknown(
            recipe, tr("It is of kind {kind}, not {wanted}.", kind=station.kind, wanted=kind)
        )
    return station


def _unknown(recipe: Recipe, why: str) -> ConfigError:
    return ConfigError(
        tr("The recipe does not say where {id} is. {why}", id=recipe.station.id, why=why),
        remedy=tr(
            "Say it in the recipe or in the cell file, learn it with "
            "'robolink cell station learn', or "
            "make a full calibration there. Nothing was moved."
        ),
    )
