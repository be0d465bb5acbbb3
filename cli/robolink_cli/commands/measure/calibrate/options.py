"""The options that every method of ``calibrate`` has."""

from collections.abc import Callable
from typing import Any, Final

import click

from robolink.messages import declared
from robolink_cli.access.cell import with_cell_limits
from robolink_cli.commands.measure.calibrate.request import LENGTH, request_from
from robolink_cli.options.declaration import declared_options
from robolink_cli.session.context import CliContext, controller_options

_CELL_KEYS: Final = {
    "lift_mm": "lift_mm",
    "clearance_mm": "clearance_mm",
    "speed_mm_s": "speed_mm_s",
    "box_mm": "box_mm",
    "max_change_mm": "max_change_mm",
    "tolerance_mm": "drift_tolerance_mm",
    "rms_mm": "rms_tolerance_mm",
    "residual_mm": "residual_tolerance_mm",
    "interval_mm": "interval_tolerance_mm",
}
"""Option to key in the cell file."""


def calibration_options(function: Callable[..., None]) -> Callable[..., int | None]:
    """Add the options of the frame; the method gets a ``CalibrationRequest`` and its own.

    Limits that nobody typed are taken from the cell, for the method's own options too.
    """

    def framed(context: CliContext, **given: Any) -> None:  # noqa: ANN401 - click passes the options by name
        options = with_cell_limits(
            context.cell, given, {o: k for o, k in _CELL_KEYS.items() if o in given}
        )
        framing = request_from.__annotations__.keys() & options
        frame = request_from(context, **{name: options.pop(name) for name in framing})
        function(frame, **options)

    add: Callable[..., Callable[..., int | None]] = declared_options(request_from)
    return add(controller_options(framed))


def sigma_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--sigma``."""
    command: Callable[..., Any] = click.option(
        "--sigma",
        "sigma_mm",
        type=LENGTH,
        metavar="MM",
        help=declared(
            "Standard deviation of one coordinate of one measurement, where it is known."
        ),
    )(function)
    return command
