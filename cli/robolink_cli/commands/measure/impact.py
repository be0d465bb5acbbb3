"""impact: how far a tool change moves the tip at taught points. Reads only."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, NamedTuple

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.console.render import emit, say
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.impact import impact_payload, impact_request, show_impact
from robolink_cli.options.report import ForceReport, ReportPath, report_request, reporting
from robolink_cli.session.completion import complete_tool
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, controller_options


class _Components(NamedTuple):
    """The components of the new offset that were given."""

    x: Annotated[
        float | None,
        CliOption(metavar="MM", help="New offset, mm from the flange; default: as stored."),
    ] = None
    y: Annotated[float | None, CliOption(metavar="MM", help="mm from the flange.")] = None
    z: Annotated[float | None, CliOption(metavar="MM", help="mm from the flange.")] = None
    u: Annotated[float | None, CliOption(metavar="DEG", help="Degrees about Z.")] = None


@click.command()
@controller_options
def impact(
    context: CliContext,
    *,
    tool: Annotated[
        int,
        click.IntRange(1, 15),
        CliOption(shell_complete=complete_tool, help="Number of the tool."),
    ],
    given: _Components,
    points: Annotated[
        str | None, CliOption(metavar="1-50", help="Taught points to read from the controller.")
    ] = None,
    path: Annotated[
        Path | None,
        CliOption("--pts", help="A .pts file of EPSON RC+ instead of the controller's points."),
    ] = None,
    report_path: ReportPath = None,
    force: ForceReport = False,
) -> None:
    """Show how far the tip will move at taught points when a tool's offset changes.

    The table shows the distance between where the present tip goes with the stored offset and
    where it goes with the new one. Writes nothing; works only while no program runs.
    """
    from robolink.calibration import impact_on
    from robolink.errors import UndefinedToolError
    from robolink.model import json_value, says_it_is_simulated
    from robolink_cli.views.documents import show_change

    request = impact_request(points, path, names=("--points", "--pts"))
    if request is None:
        raise ConfigError(
            tr("The points are missing."), remedy=tr("Give --points 1-50 or --pts robot1.pts.")
        )
    changes = _changes(given._asdict())
    wanted = report_request(report_path, force=force)
    with open_controller(context) as controller, reporting(wanted, controller) as draft:
        before = controller.tools.read(tool)
        if before is None:
            raise UndefinedToolError(
                tr("Tool {tool} is not defined: no program can use it.", tool=tool),
                remedy=tr("A new offset would move nothing."),
                controller=controller.identity,
            )
        after = replace(before, **changes)
        simulated = says_it_is_simulated(controller)
        found = impact_on(request.read(controller), old=before, new=after)
        draft.offer(tool, before=before, after=after, given=tuple(changes), impact=found)
    values = {"before": json_value(before), "after": json_value(after)}
    payload = {"tool": tool, **values, **impact_payload(found)}
    payload |= {"simulated": simulated, "report": draft.saved}

    def show() -> None:
        show_change(tool, before, after, after_name=tr("new"))
        show_impact(tool, found)
        say(tr("Nothing was written."))

    emit("impact", payload, show)


def _changes(given: dict[str, float | None]) -> dict[str, float]:
    """Return the components that were given, checked before a connection is made."""
    from robolink.model import ToolOffset

    units = {"x": "x_mm", "y": "y_mm", "z": "z_mm", "u": "u_deg"}
    changes = {units[axis]: value for axis, value in given.items() if value is not None}
    if not changes:
        raise ConfigError(
            tr("No component was given."), remedy=tr("Give at least one of --x --y --z --u.")
        )
    ToolOffset(**changes)
    return changes
