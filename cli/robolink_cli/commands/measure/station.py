"""station list, show, learn: the pins, beams, surfaces and cameras of a cell."""

import click

from robolink.messages import declared, tr
from robolink_cli.console.numbers import NumberInside
from robolink_cli.options.consent import dry_run_option, yes_option
from robolink_cli.session.completing import complete_station, complete_tool
from robolink_cli.session.context import CliContext, controller_options


@click.group()
def station() -> None:
    """Pins, beams, surfaces and cameras of a cell: where, and how well known."""


_robot_option = click.option(
    "--robot",
    metavar="NAME",
    help=declared("A controller with several robots: which one, as 'station list' names it."),
)


@station.command("list")
@_robot_option
@controller_options
def list_stations(context: CliContext, robot: str | None) -> None:
    """List the stations of a cell. Reads cell file and journal only; no controller is asked."""
    from robolink_cli.views.stations import known_stations, show_stations, station_payload

    known = known_stations(context, robot=robot)
    payload = {"stations": [station_payload(one.station, robot=one.robot) for one in known]}
    context.emit("stations", payload, lambda: show_stations(known))


@station.command("show")
@click.argument("name", metavar="ID", shell_complete=complete_station)
@_robot_option
@controller_options
def show(context: CliContext, name: str, robot: str | None) -> None:
    """Show one station. Reads cell file and journal only; no controller is asked."""
    from robolink_cli.views.stations import known_station, show_station, station_payload

    found = known_station(context, name, robot=robot)
    payload = station_payload(found.station, robot=found.robot)
    context.emit("station", payload, lambda: show_station(found))


@station.command("learn", short_help="Find a station with a tool whose offset is known.")
@click.argument("name", metavar="ID", shell_complete=complete_station)
@click.option(
    "--tool",
    type=click.IntRange(1, 15),
    metavar="N",
    required=True,
    shell_complete=complete_tool,
    help=declared("Number of the tool whose offset is known."),
)
@click.option(
    "--sigma",
    "sigma_mm",
    type=NumberInside(min=0, min_open=True),
    metavar="MM",
    help=declared("Standard deviation of one coordinate of one touch, where it is known."),
)
@click.option(
    "--speed",
    "speed_mm_s",
    type=NumberInside(1, 100),
    default=20.0,
    metavar="MM_S",
    help=declared("Speed of straight moves, in Power Low."),
)
@click.option(
    "--box",
    "box_mm",
    type=NumberInside(min=1),
    metavar="MM",
    default=150.0,
    show_default=True,
    help=declared("How far, sideways, the flange may go from where it is."),
)
@click.option(
    "--assist",
    metavar="URL",
    help=declared("A simulator's assist or sim URL: its operator brings the tip onto the pin."),
)
@click.option(
    "--contact-input",
    type=click.IntRange(0, 0xFFFF),
    metavar="N",
    help=declared(
        "A pin: number of the input that shows contact of tip and pin, where there is one."
    ),
)
@click.option(
    "--off-in-contact",
    is_flag=True,
    help=declared("Whether that input goes off, not on, in contact."),
)
@controller_options
@dry_run_option
@yes_option
def learn(
    context: CliContext,
    *,
    name: str,
    tool: int,
    sigma_mm: float | None,
    speed_mm_s: float,
    box_mm: float,
    assist: str | None,
    contact_input: int | None,
    off_in_contact: bool,
    dry_run: bool,
    yes: bool,
) -> None:
    """Find a station with a tool whose offset is known, such as a gauge pin, and keep where it is.

    A pin is touched by a person, twice; beams and surfaces are looked for near the place in the
    cell file. No tool is written. An error in the tool's offset shifts the station by as much.
    """
    from robolink.calibration_run import Limits, usual_box
    from robolink.model import InputEdge
    from robolink.procedures import TouchPlan
    from robolink_cli.commands.measure.station_learning import learn as learn_it

    limits = Limits(usual_box(box_mm), speed_mm_s=speed_mm_s)
    contact = None
    if contact_input is not None:
        contact = InputEdge(contact_input, falling=off_in_contact)
    elif off_in_contact:
        raise click.UsageError(tr("--off-in-contact goes with --contact-input."))
    learn_it(
        context,
        name,
        tool=tool,
        limits=limits,
        sigma_mm=sigma_mm,
        touch=TouchPlan(contact=contact),
        assist=assist,
        dry_run=dry_run,
        yes=yes,
    )
