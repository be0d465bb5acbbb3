"""doctor: what could cause trouble on this computer."""

import click

from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.options.shared import json_option


@click.command()
@json_option
def doctor() -> int:
    """Check versions, folders, cell files, passwords, ports and unfinished jobs.

    Connects to no controller and changes nothing. Problems are listed first; then the exit code
    is 1.
    """
    from dataclasses import asdict

    from robolink_cli.commands.computer.checkup import Level, check_up, in_words

    remarks = check_up()
    healthy = all(remark.level is not Level.BAD for remark in remarks)
    if json_is_on():
        entries = [asdict(remark) for remark in remarks]
        emit_json("robolink/doctor/1", {"healthy": healthy, "checks": entries})
    else:
        for line in in_words(remarks):
            say(line)
    return 0 if healthy else DIFFERENT
