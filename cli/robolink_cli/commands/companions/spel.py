"""spel: programs that run on the controller itself."""

from pathlib import Path

import click

from robolink.messages import tr
from robolink_cli.commands.companions.spel_programs import check, run
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.options.shared import json_option


@click.group()
def spel() -> None:
    """Programs that a controller's project can hold."""


spel.add_command(check)
spel.add_command(run)


@spel.command("export", short_help="Write the companion programs.")
@click.argument("folder", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@click.option("--force", is_flag=True, help="Overwrite files that were changed.")
@json_option
def export(folder: Path, force: bool) -> None:
    """Write the companion programs: what a controller's project can hold of robolink.

    robolink_tools.prg publishes the tool table while production runs: add it to the RC+ project
    and call RobolinkPublish; docs/monitor-only.md says where. robolink_vision.prg takes looks for
    the camera vision-guide (docs/camera-and-board.md). With recal.prg the running program
    calibrates a tool itself (docs/spel-callback.md). calc_tool.prg and
    calc_board_tool.prg set tool 1 by Vision Guide; add them only where they are needed. The
    licence is 0BSD: they may be used in a machine without any duty.
    """
    from robolink_cli.commands.companions.companion_files import export_companions

    written = [str(path) for path in export_companions(folder, replace=force)]
    if json_is_on():
        emit_json("robolink/spel-export/1", {"files": written})
    else:
        for path in written:
            say(tr("wrote {path}", path=path))
