"""station list, show, learn: the pins, beams, surfaces and cameras of a cell."""

from pathlib import Path
from typing import Annotated

import click

from robolink.messages import tr
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import emit
from robolink_cli.options.consent import DryRun, Yes
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.session.completion import complete_station, complete_tool
from robolink_cli.session.context import CliContext, controller_options


@click.group()
def station() -> None:
    """Show the pins, beams, surfaces and cameras of a cell: where, and how accurately known."""


_Robot = Annotated[
    str | None,
    CliOption(
        metavar="NAME",
        help="For a controller with several robots: the robot, as 'station list' names it.",
    ),
]


@station.command("list")
@controller_options
def list_stations(
    context: CliContext,
    *,
    robot: _Robot = None,
) -> None:
    """List the stations of a cell. Reads cell file and journal only; connects to no controller."""
    from robolink_cli.views.stations import known_stations, show_stations, station_payload

    known = known_stations(context, robot=robot)
    payload = {"stations": [station_payload(one.station, robot=one.robot) for one in known]}
    emit("stations", payload, lambda: show_stations(known))


@station.command("show")
@controller_options
def show(
    context: CliContext,
    *,
    name: Annotated[str, CliArgument(metavar="ID", shell_complete=complete_station)],
    robot: _Robot = None,
) -> None:
    """Show one station. Reads cell file and journal only; connects to no controller."""
    from robolink_cli.views.stations import known_station, show_station, station_payload

    found = known_station(context, name, robot=robot)
    payload = station_payload(found.station, robot=found.robot)
    emit("station", payload, lambda: show_station(found))


@station.command("learn", short_help="Learn where a station is, with a tool whose offset is known.")
@controller_options
def learn(
    context: CliContext,
    *,
    name: Annotated[str, CliArgument(metavar="ID", shell_complete=complete_station)],
    tool: Annotated[
        int,
        click.IntRange(1, 15),
        CliOption(shell_complete=complete_tool, help="Number of the tool whose offset is known."),
    ],
    sigma_mm: Annotated[
        float | None,
        NumberInside(min=0, min_open=True),
        CliOption(help="Standard deviation of one coordinate of one touch, if known."),
    ] = None,
    speed_mm_s: Annotated[
        float,
        NumberInside(1, 100),
        CliOption(help="Speed of straight moves, in Power Low.", show_default=False),
    ] = 20.0,
    box_mm: Annotated[
        float,
        NumberInside(min=1),
        CliOption(help="How far the flange may move sideways from its present place."),
    ] = 150.0,
    assist: Annotated[
        str | None,
        CliOption(
            metavar="URL",
            help="A simulator's assist or sim URL: its simulated operator jogs the tip "
            "onto the pin.",
        ),
    ] = None,
    contact_input: Annotated[
        int | None,
        click.IntRange(0, 0xFFFF),
        CliOption(
            help="For a pin: number of the input that shows contact of tip and pin, if "
            "there is one."
        ),
    ] = None,
    off_in_contact: Annotated[
        bool, CliOption(help="The input goes off, not on, in contact.")
    ] = False,
    picture: Annotated[
        Path | None,
        CliOption(
            metavar="FILE",
            help="For a camera: the page or picture to write, .html or .png. Default: ID.html.",
        ),
    ] = None,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Learn where a station is, with a tool whose offset is known, such as a gauge pin.

    You touch a pin twice; robolink finds beams and surfaces near the place in the cell file.
    Writes no tool. An error in the tool's offset shifts the station by the same amount.

    For a camera: jog the tip over the lens first. You confirm one picture, which teaches how the
    tip looks there; a movement of 1 mm and back shows how late pictures are.
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
        raise click.UsageError(tr("--off-in-contact needs --contact-input."))
    learn_it(
        context,
        name,
        tool=tool,
        limits=limits,
        sigma_mm=sigma_mm,
        touch=TouchPlan(contact=contact),
        assist=assist,
        picture=picture,
        dry_run=dry_run,
        yes=yes,
    )
