"""station list, show, learn: the pins, beams and surfaces of a cell."""

import click

from robolink_cli._context import CliContext, controller_options


@click.group()
def station() -> None:
    """The pins, light beams and touch surfaces of a cell: where they are, and how sure."""


@station.command("list")
@controller_options
def list_stations(context: CliContext) -> None:
    """List the stations of a cell. Reads cell file and journal only; no controller is asked."""
    from robolink_cli._station_views import known_stations, show_stations, station_payload

    stations = known_stations(context)
    payload = {"stations": [station_payload(one) for one in stations.values()]}
    context.emit("stations", payload, lambda: show_stations(tuple(stations.values())))


@station.command("show")
@click.argument("name", metavar="ID")
@controller_options
def show(context: CliContext, name: str) -> None:
    """Show one station. Reads cell file and journal only; no controller is asked."""
    from robolink_cli._station_views import known_station, show_station, station_payload

    found = known_station(context, name)
    context.emit("station", station_payload(found), lambda: show_station(found))
