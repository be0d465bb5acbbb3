"""Which command measures a row that a cell has by default."""

import shlex

from robolink.messages import tr
from robolink.stations import StationKind


def measuring_step(
    key: str, *, station: str = "", kind: StationKind | None = None, tool: int | None = None
) -> str:
    """Return how a row is measured in a cell, one sentence with its command.

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
            "Measure a gauge tip that is known, five times: {command}",
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
    """Return the commands that learn a station anew, each after ``robolink`` and the cell's name.

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
