"""From a recipe to an up-looking camera."""

from robolink import methods
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.procedures import LookPlan, TipSource
from robolink.recipe._sources import BoardSource, CameraAffineSource, LookingSource
from robolink.recipe._tables import Station
from robolink.stations import CameraStation
from robolink.ways import Way, way


def from_camera(
    source: LookingSource, place: Station, sensor: str | None, sigma_mm: float | None
) -> TipSource:
    """Return what looks at the tip, or at the board.

    Args:
        source: What the recipe says of the camera, and how it looks.
        place: Where it is.
        sensor: The camera, in place of the recipe's.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.

    Raises:
        ConfigError: No camera is named.
    """
    sensor = sensor or source.sensor
    if sensor is None:
        raise ConfigError(
            tr("The recipe does not say which camera sees the tip."),
            remedy=tr("Give {sensor}, or write source.sensor.", sensor=way(Way.SENSOR)),
        )
    station = CameraStation(*place.place_mm, source.model)
    look = LookPlan(
        turns_deg=source.turns_deg,
        pictures=source.pictures,
        lift_mm=source.lift_mm,
        beside_mm=source.beside_mm,
    )
    if isinstance(source, CameraAffineSource):
        plan = methods.PatternPlan(look, source.span_mm)
        return methods.CameraAffineSource(sensor, station, plan, sigma_mm=sigma_mm, name=place.id)
    if isinstance(source, BoardSource):
        drawing = source.drawing
        assert drawing is not None  # noqa: S101 - the recipe was checked
        return methods.BoardSource(sensor, station, drawing, look, sigma_mm=sigma_mm)
    return methods.CameraSource(sensor, station, look, sigma_mm=sigma_mm)
