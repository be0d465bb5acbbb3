"""How often a pin is touched with a tilted tool, and how far the tool leans."""

from collections.abc import Callable
from typing import Any

import click

from robolink.messages import tr
from robolink_cli.options.motion import motion_option


def tilt_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--count`` and ``--tilt``."""
    lean = motion_option(
        "--tilt",
        "tilt_deg",
        type=click.FloatRange(5, 45),
        default=20.0,
        metavar="DEG",
        show_default=True,
        help=tr("How far the tool leans in the others, against the first one."),
    )
    number = motion_option(
        "--count",
        type=click.IntRange(4, 12),
        default=6,
        show_default=True,
        help=tr("Number of touches, the first one in the orientation in which the tool stands."),
    )
    command: Callable[..., Any] = number(lean(function))
    return command
