"""The option that names a camera."""

from typing import Annotated

from robolink_cli.options.declaration import CliOption

Sensor = Annotated[
    str | None,
    CliOption(
        metavar="NAME|URL",
        help="The camera: a plug-in's name or URL, or a simulator's assist or sim URL.",
    ),
]
