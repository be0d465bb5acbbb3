"""What is stated of the rows: by the recipe, for a station, for the cell; the narrower wins."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from robolink.calibration import ACCURACY_ROWS, RowFact
from robolink.messages import tr
from robolink.stations import Station, StationKind

if TYPE_CHECKING:
    from robolink.config import Cell


def stated_rows(
    cell: "Cell | None",
    station: Station | str,
    *,
    recipe: Mapping[str, float] | None = None,
    recipe_name: str = "",
) -> dict[str, RowFact]:
    """Return what is stated of the rows of a measurement.

    A recipe is for one job at one station, a station stands in one cell: what the recipe states
    goes before what is stated for its station, and that before what is stated for the cell.

    Args:
        cell: The cell; ``None`` where none is named.
        station: Where it is measured, with what is on record; its name alone where nothing is.
        recipe: Half widths that the recipe states, by key.
        recipe_name: How the recipe is called.

    Example:
        >>> from robolink.accuracy import stated_rows
        >>> rows = stated_rows(None, "PIN-07", recipe={"touch_mm": 0.02}, recipe_name="needle")
        >>> rows["touch_mm"].half_width, rows["touch_mm"].basis
        (0.02, 'stated')
    """
    name = station if isinstance(station, str) else station.id
    rows: dict[str, RowFact] = {}
    if cell is not None:
        told = tr("cell file, cell {cell}", cell=cell.name)
        rows |= _facts(cell.settings.accuracy, told)
    if isinstance(station, Station):
        rows |= _height_of(station)
    rows |= rows_of_station(cell, name)
    if recipe:
        told = tr("recipe {name}", name=recipe_name)
        rows |= {key: RowFact(value, "stated", told=told) for key, value in recipe.items()}
    return rows


def rows_of_station(cell: "Cell | None", station: str) -> dict[str, RowFact]:
    """Return what the cell file states for a station itself."""
    said = None if cell is None else (cell.settings.stations or {}).get(station)
    if said is None:
        return {}
    return _facts(said, tr("cell file, station {station}", station=station))


def _height_of(station: Station) -> dict[str, RowFact]:
    """Return how sure the height of a surface is whose standard deviation is stated.

    One that was learnt is as sure as its learning, which the record tells.
    """
    if station.kind is not StationKind.TOUCH or station.learnt or not station.sigma_mm:
        return {}
    told = tr("standard deviation stated for station {station}", station=station.id)
    return {"plate_mm": RowFact(math.sqrt(3) * station.sigma_mm, "stated", told=told)}


def _facts(said: object, told: str) -> dict[str, RowFact]:
    values = {key: getattr(said, key, None) for key in ACCURACY_ROWS}
    return {
        key: RowFact(float(value), "stated", told=told)
        for key, value in values.items()
        if value is not None
    }
