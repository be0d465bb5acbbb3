"""The options that every method of ``calibrate`` has."""

from collections.abc import Callable
from functools import wraps
from typing import Any, Final

import click

from robolink.config import USUAL_CHANGE_MM
from robolink.messages import declared
from robolink_cli.access.cell import with_cell_limits
from robolink_cli.commands.measure.calibrate.request import request_from
from robolink_cli.console.numbers import NumberInside
from robolink_cli.options.consent import dry_run_option, motion_option, plain_option, yes_option
from robolink_cli.options.impact import impact_options
from robolink_cli.options.report import report_options
from robolink_cli.session.completing import complete_tool
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.session.operator_identity import nozzle_options
from robolink_cli.session.ordering import order_option

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

_LENGTH: Final = NumberInside(min=0, min_open=True)


def calibration_options(function: Callable[..., None]) -> Callable[..., int | None]:
    """Add the options of the frame; the method gets a ``CalibrationRequest`` and its own.

    Limits that nobody typed are taken from the cell, for the method's own options too.
    """

    @wraps(function)
    def framed(context: CliContext, **given: Any) -> None:  # noqa: ANN401 - click passes the options by name
        options = with_cell_limits(
            context.cell, given, {o: k for o, k in _CELL_KEYS.items() if o in given}
        )
        frame = request_from(context, **{name: options.pop(name) for name in _FRAME})
        function(frame, **options)

    command: Callable[..., Any] = framed
    command = plain_option(yes_option(dry_run_option(controller_options(command))))
    command = impact_options(report_options(nozzle_options(order_option(command))))
    for option in reversed(_own_options()):
        command = option(command)
    return command


def sigma_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--sigma``."""
    command: Callable[..., Any] = click.option(
        "--sigma",
        "sigma_mm",
        type=_LENGTH,
        metavar="MM",
        help=declared(
            "Standard deviation of one coordinate of one measurement, where it is known."
        ),
    )(function)
    return command


_FRAME: Final = (
    "tool",
    "speed_mm_s",
    "box_mm",
    "max_change_mm",
    "rms_mm",
    "residual_mm",
    "interval_mm",
    "tolerance_mm",
    "no_verify",
    "assist",
    "impact",
    "impact_pts",
    "report_path",
    "force",
    "nozzle",
    "lot",
    "order",
    "dry_run",
    "yes",
)
"""Options that the frame takes; the others are the method's own."""


def _own_options() -> tuple[Callable[[Callable[..., Any]], Callable[..., Any]], ...]:
    return (
        click.option(
            "--tool",
            type=int,
            metavar="N",
            required=True,
            shell_complete=complete_tool,
            help=declared("Number of the tool, 1 to 15."),
        ),
        motion_option(
            "--speed",
            "speed_mm_s",
            type=NumberInside(1, 100),
            default=20.0,
            metavar="MM_S",
            help=declared("Speed of straight moves, in Power Low."),
        ),
        motion_option(
            "--box",
            "box_mm",
            type=NumberInside(min=1),
            metavar="MM",
            default=150.0,
            show_default=True,
            help=declared("How far, sideways, the flange may go from where it is."),
        ),
        click.option(
            "--max-change",
            "max_change_mm",
            type=_LENGTH,
            metavar="MM",
            default=USUAL_CHANGE_MM,
            show_default=True,
            help=declared(
                "Largest change against the stored offset that is accepted; more than the cell "
                "allows takes an engineer."
            ),
        ),
        click.option(
            "--max-rms",
            "rms_mm",
            type=_LENGTH,
            metavar="MM",
            help=declared("Largest rms of the residuals that is accepted."),
        ),
        click.option(
            "--max-residual",
            "residual_mm",
            type=_LENGTH,
            metavar="MM",
            help=declared("Largest residual of one pose that is accepted."),
        ),
        click.option(
            "--max-interval",
            "interval_mm",
            type=_LENGTH,
            metavar="MM",
            help=declared("Accurate to this or better (95 %), or it is refused."),
        ),
        motion_option(
            "--tolerance",
            "tolerance_mm",
            type=_LENGTH,
            metavar="MM",
            default=0.2,
            show_default=True,
            help=declared("Largest drift that passes the turn test."),
        ),
        motion_option("--no-verify", is_flag=True, help=declared("Leave the turn test out.")),
        motion_option(
            "--assist",
            metavar="URL",
            help=declared(
                "A simulator's assist or sim URL: its operator brings the tip onto the pin."
            ),
        ),
    )
