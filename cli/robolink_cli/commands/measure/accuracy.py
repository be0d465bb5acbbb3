"""cell accuracy: what a cell knows of its accuracy, and measuring a row of it."""

from datetime import datetime
from pathlib import Path

import click

from robolink.messages import declared
from robolink_cli.console.numbers import NumberInside
from robolink_cli.options.consent import yes_option
from robolink_cli.options.line import LINE
from robolink_cli.session.completing import complete_station, complete_tool
from robolink_cli.session.context import CliContext, controller_options

_ROWS = (
    *("touch_mm", "place_mm", "camera_turn_deg", "camera_scale_percent"),
    *("plate_mm", "tip_image_px", "bend_deg", "print_mm"),
)


@click.group(invoke_without_command=True)
@click.option(
    "--robot",
    metavar="NAME",
    help=declared("A controller with several robots: which one, as 'station list' names it."),
)
@controller_options
def accuracy(context: CliContext, robot: str | None) -> None:
    """What a cell knows of the errors that no measurement shows by itself.

    Each row with its half width, what tells it, and the command that measures it where it is a
    default. Reads cell file and journal only; no controller is asked.
    """
    if click.get_current_context().invoked_subcommand is not None:
        return
    from robolink_cli.views.accuracy import accuracy_payload, known_rows, show_accuracy

    known = known_rows(context, robot=robot)
    payload = accuracy_payload(context, known)
    context.emit("cell-accuracy", payload, lambda: show_accuracy(known))


@accuracy.command("measure", short_help="Put a row on record that was measured.")
@click.argument("row", type=click.Choice(_ROWS))
@click.option(
    "--tool",
    type=click.IntRange(1, 15),
    metavar="N",
    shell_complete=complete_tool,
    help=declared("The tool whose calibrations on record count."),
)
@click.option(
    "--true",
    "true",
    metavar="X,Y",
    help=declared("touch_mm: offset of the gauge tip, by its certificate, mm."),
)
@click.option(
    "--true-sigma",
    "true_sigma_mm",
    type=NumberInside(min=0, min_open=True),
    metavar="MM",
    help=declared("touch_mm: standard deviation of that, each coordinate."),
)
@click.option(
    "--study",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help=declared("touch_mm: a gauge study, as 'expert solve' takes it, in place of a gauge tip."),
)
@click.option(
    "--station",
    metavar="ID",
    shell_complete=complete_station,
    help=declared("Only measurements at this station; the row then holds for it alone."),
)
@click.option(
    "--nozzle",
    metavar="ID",
    type=LINE,
    help=declared("Only measurements of the nozzle or gauge tip with this id."),
)
@click.option(
    "--since",
    type=click.DateTime(["%Y-%m-%d", "%Y-%m-%dT%H:%M"]),
    metavar="YYYY-MM-DD[THH:MM]",
    help=declared("Only measurements from then on, by this computer's clock; else of 24 hours."),
)
@controller_options
@yes_option
def measure(
    context: CliContext,
    *,
    row: str,
    tool: int | None,
    true: str | None,
    true_sigma_mm: float | None,
    study: Path | None,
    station: str | None,
    nozzle: str | None,
    since: datetime | None,
    yes: bool,
) -> None:
    """Calculate ROW from measurements that are on record, show it, and put it on record.

    touch_mm: mount a gauge tip whose offset is known, calibrate it five times or more as you
    calibrate any needle, then name its tool and its true X,Y here. Or give a gauge study.

    tip_image_px: measure five nozzles of one kind or more by camera, each with its id, turn each
    by half a turn in its mount, measure all again, then name the camera here.

    Other rows are learnt without this command, or stated; it says how.
    """
    from robolink_cli.commands.measure.accuracy_measuring import Asked, measure_row

    asked = Asked(
        tool=tool,
        true=true,
        true_sigma_mm=true_sigma_mm,
        study=study,
        station=station or "",
        nozzle=nozzle or "",
        since=since,
    )
    measure_row(context, row, asked, yes=yes)
