"""The option that names a camera."""

from collections.abc import Callable
from typing import Any

import click

from robolink.messages import declared


def sensor_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--sensor``."""
    decorate: Callable[[Callable[..., Any]], Callable[..., Any]] = click.option(
        "--sensor",
        metavar="NAME|URL",
        help=declared("The camera: a plug-in's name or URL, or a simulator's assist or sim URL."),
    )
    return decorate(function)
