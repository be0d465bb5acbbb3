"""Which rows apply where in a cell, and how much each contributes to a result."""

import math
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from robolink.accuracy._cell_rows import CellRecord, KnownRow, rows_at, stated_rows
from robolink.accuracy._repeats import months_at
from robolink.calibration import ACCURACY_ROWS, NORMAL_95, chi_square_quantile
from robolink.config import Cell
from robolink.messages import tr
from robolink.methods import all_methods
from robolink.stations import Station, StationKind, camera_station, find_stations

_AT: Final[Mapping[StationKind, tuple[str, ...]]] = {
    StationKind.PIN: ("touch_mm", "place_mm"),
    StationKind.BEAMS: ("place_mm", "bend_deg"),
    StationKind.TOUCH: ("plate_mm",),
    StationKind.CAMERA: (
        "place_mm",
        "camera_turn_deg",
        "camera_scale_percent",
        "tip_image_px",
        "print_mm",
    ),
}


@dataclass(frozen=True, slots=True)
class RowsAt:
    """The rows at one place of a cell.

    Attributes:
        station: The station; ``None`` for what needs none.
        methods: Names of the methods that measure there.
        months: How long ago it was learnt, or used first; ``None`` where nothing says it.
        rows: Its rows, as they count now.
        mm_per_px: Length of a pixel of a camera, ``None`` where that is unknown.
    """

    station: Station | None
    methods: tuple[str, ...]
    months: float | None
    rows: tuple[KnownRow, ...]
    mm_per_px: float | None = None

    def alone_mm(self, row: KnownRow) -> float | None:
        """Return the 95 % distance of a tip if this were the only row.

        Turn and scale of a camera count for a tip 1 mm from the middle. ``None`` where it depends
        on the measurement.
        """
        unit = ACCURACY_ROWS[row.key].unit
        mm = {
            "mm": 1.0,
            "deg": math.radians(1.0) if row.key.startswith("camera") else None,
            "percent": 0.01,
            "px": self.mm_per_px,
        }[unit]
        if mm is None:
            return None
        u_mm = row.half_width * mm / math.sqrt(3)
        return NORMAL_95 * u_mm if row.key == "plate_mm" else math.sqrt(_PLANE) * u_mm


_PLANE: Final = chi_square_quantile(0.95, 2)


def rows_of_cell(cell: Cell | None, record: CellRecord) -> tuple[RowsAt, ...]:
    """Return all rows of a cell: first those without a station, then station by station.

    Args:
        cell: The cell; ``None`` where none is named.
        record: What is on record.

    Example:
        >>> from robolink.accuracy import CellRecord, rows_of_cell
        >>> (touching,) = rows_of_cell(None, CellRecord(lambda *, kinds: iter(())))
        >>> row = touching.rows[0]
        >>> row.key, row.fact.basis, round(touching.alone_mm(row), 3)
        ('touch_mm', 'default', 0.071)
    """
    stations = find_stations(cell, record.stations)
    return (
        RowsAt(None, _by_touch(), None, _rows(cell, record, None, ("touch_mm",))),
        *(_rows_at(cell, record, station) for station in stations.values()),
    )


def _rows_at(cell: Cell | None, record: CellRecord, station: Station) -> RowsAt:
    months = months_at(station.id, stations=record.stations, calibrations=record.all_calibrations)
    methods = tuple(method.name for method in all_methods() if method.needs.station is station.kind)
    rows = _rows(cell, record, station, _AT[station.kind])
    return RowsAt(station, methods, months, rows, mm_per_px(station))


def _rows(
    cell: Cell | None, record: CellRecord, station: Station | None, keys: Iterable[str]
) -> tuple[KnownRow, ...]:
    name = "" if station is None else station.id
    return rows_at(record, keys, station=name, stated=stated_rows(cell, station or name))


def _by_touch() -> tuple[str, ...]:
    return tuple(
        method.name
        for method in all_methods()
        if not method.needs.by_sensor and not method.needs.named
    )


def mm_per_px(station: Station) -> float | None:
    """Return the length of a camera's pixel, ``None`` if unknown."""
    if station.kind is not StationKind.CAMERA or "mm_per_px" not in station.details:
        return None
    if None in (station.x_mm, station.y_mm, station.z_mm):
        return None
    try:
        model = camera_station(station).model
    except (TypeError, ValueError, IndexError):  # a damaged record counts for nothing
        return None
    area = 0.0 if model is None else abs(model.determinant)
    return math.sqrt(area) if math.isfinite(area) and area > 0 else None


def measuring_step(
    key: str, *, station: str = "", kind: StationKind | None = None, tool: int | None = None
) -> str:
    """Return how to measure a row in a cell, one sentence with its command.

    Args:
        key: Key of the row.
        station: The station that is meant, empty where none is known.
        kind: What the station is, ``None`` where that is not known.
        tool: The tool that is meant; ``None`` where none is known.

    Raises:
        KeyError: There is no such row.

    Example:
        >>> from robolink.accuracy import measuring_step
        >>> measuring_step("place_mm", station="BEAMS-02", tool=1)
        'Learn it five times: robolink cell station learn BEAMS-02 --tool 1'
    """
    at, number = station or "ID", "N" if tool is None else str(tool)
    learn = f"robolink cell station learn {at} --tool {number}"
    camera = f"robolink calibrate camera-affine --station {at} --tool {number}"
    return {
        "touch_mm": tr(
            "Measure a gauge tip with a known offset five times: {command}",
            command=f"robolink cell accuracy measure touch_mm --tool {number} --true X,Y",
        ),
        "place_mm": tr("Measure the camera five times: {command}", command=camera)
        if kind is StationKind.CAMERA
        else tr("Learn it five times: {command}", command=learn),
        "camera_turn_deg": tr("Measure the camera five times: {command}", command=camera),
        "camera_scale_percent": tr("Measure the camera five times: {command}", command=camera),
        "plate_mm": tr("Learn its height: {command}", command=learn),
        "tip_image_px": tr(
            "Measure five nozzles twice, turned in the mount: {command}",
            command=f"robolink cell accuracy measure tip_image_px --station {at}",
        ),
        "bend_deg": _stated(key),
        "print_mm": _stated(key),
    }[key]


def learning_commands(
    station: str, kind: StationKind, *, tool: int, known_tool: int | None = None
) -> tuple[str, ...]:
    """Return the commands that relearn a station; each follows ``robolink`` and the cell's name.

    A pin and a camera are found together with the tip. Beams and a plate need a tip that is known.
    For beams the tool can be measured by touch first; of its length that tells nothing, so for a
    plate there is no command then.

    Args:
        station: Its name.
        kind: What it is.
        tool: The tool whose measurement is in doubt.
        known_tool: Another tool, whose tip is known; ``None`` for none.

    Example:
        >>> from robolink.accuracy import learning_commands
        >>> from robolink.stations import StationKind
        >>> learning_commands("BEAMS-02", StationKind.BEAMS, tool=1, known_tool=15)
        ('cell station learn BEAMS-02 --tool 15',)
    """
    at = shlex.quote(station)
    if kind is StationKind.PIN:
        return (f"calibrate n-angle --station {at} --tool {tool}",)
    if kind is StationKind.CAMERA:
        return (f"calibrate camera-affine --station {at} --tool {tool}",)
    if known_tool is not None:
        return (f"cell station learn {at} --tool {known_tool}",)
    if kind is StationKind.TOUCH:
        return ()
    return f"calibrate two-pose --tool {tool}", f"cell station learn {at} --tool {tool}"


def _stated(key: str) -> str:
    return tr(
        "No command measures it: state {key} in the cell file, as its drawing or certificate says.",
        key=key,
    )
