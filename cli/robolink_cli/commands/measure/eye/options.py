"""Which picture is looked at: the options that eye look and eye collect share."""

from pathlib import Path
from typing import Annotated, NamedTuple

from robolink_cli.console.numbers import NumberInside
from robolink_cli.options.declaration import CliOption
from robolink_cli.session.completion import complete_station


class EyeOptions(NamedTuple):
    """Which picture is looked at, and for what.

    Attributes:
        station: Name of a camera's station.
        sensor: URL of the camera.
        picture: A picture file in place of a camera.
        diameter_px: What the tip is wide, in pixels.
        solid: Whether it has no bore.
    """

    station: Annotated[
        str | None,
        CliOption(
            metavar="ID",
            shell_complete=complete_station,
            help="The camera's station. Default: the only camera of the cell.",
        ),
    ] = None
    sensor: Annotated[
        str | None,
        CliOption(
            metavar="URL",
            help="Another camera: folder:///PATH, http://HOST/PICTURE, gige://SERIAL, usb://0. "
            "Needs no cell.",
        ),
    ] = None
    picture: Annotated[
        Path | None, CliOption(metavar="FILE", help="A picture file in place of a camera.")
    ] = None
    diameter_px: Annotated[
        float | None,
        NumberInside(4, 10_000),
        CliOption(
            metavar="PX",
            help="Diameter of the tip's face in the picture. Default: as taught at the station, "
            "or diameter_mm of the cell file; else any.",
        ),
    ] = None
    solid: Annotated[bool, CliOption(help="The tip has no bore.")] = False
