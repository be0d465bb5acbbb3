"""Whether a robot can tilt its tool, and how often and how far it is to."""

from collections.abc import Callable
from typing import Any, Final

import click

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Controller
from robolink_cli._motion_options import motion_option

_LEAST_AXES: Final = 5
"""X, Y, Z and a turn take four; whatever tilts needs another one."""


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


def require_tilting(controller: Controller, method: str) -> None:
    """Refuse a method with tilted poses on a robot of four axes; reads only.

    A machine that does not tell its axes is not refused here: what it cannot take up shows when it
    has moved.

    Raises:
        CalibrationError: ``rank_deficient``.
    """
    axes = _axes(controller)
    if not 0 < axes < _LEAST_AXES:
        return
    raise CalibrationError(
        "rank_deficient",
        tr(
            "{robot} has {axes} axes and turns its tool about Z only, so {method} cannot be "
            "measured with it: nothing shows Z and the tilt of the tool.",
            robot=", ".join(controller.facts().robot_models) or controller.identity,
            axes=axes,
            method=method,
        ),
        remedy=tr(
            "Measure X and Y with 'calibrate n-angle' and Z with 'calibrate z-touch' or "
            "'calibrate one-touch'."
        ),
    )


def _axes(controller: Controller) -> int:
    counted = controller.groups[0].axes() if controller.groups else {}
    return max((len(values) for name, values in counted.items() if name != "pulses"), default=0)
