"""journal checks: what was found when cells were checked. Reads only, no controller."""

from typing import TYPE_CHECKING, Annotated

import click

from robolink.messages import tr
from robolink.timing import local_label
from robolink_cli.commands.record.journal_lookup import (
    OfController,
    controller_meant,
    journal_to_read,
    place_to_read,
)
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import json_option

if TYPE_CHECKING:
    from robolink.model import RecordedCheck


@click.command("checks", short_help="Show the newest checks of cells, newest first.")
@json_option
def checks(
    *,
    controller: OfController = None,
    limit: Annotated[int, click.IntRange(min=1), CliOption(help="Show at most this many.")] = 20,
) -> None:
    """Show the newest checks of cells ('robolink check'), newest first, with what they found."""
    from robolink.journal import may_exist

    meant = controller_meant(controller)
    found: list[RecordedCheck] = []
    if may_exist(place_to_read(meant)):
        found = list(journal_to_read(meant).checks(controller=meant, limit=limit))
    if json_is_on():
        emit_json("robolink/journal-checks/1", {"checks": [_payload(one) for one in found]})
        return
    for one in found:
        say(f"{one.number}  {local_label(one.at)}  {one.cell or one.controller}: {one.verdict}")
    if not found:
        say(tr("No check is on record here."))


def _payload(one: "RecordedCheck") -> dict[str, object]:
    from robolink.model import json_fields

    signature = json_fields(one.signature, "operator", "os_user", "host", "version")
    plain = json_fields(one, "number", "at", "controller", "cell", "well", "verdict")
    return {**plain, "details": dict(one.details), **signature, "hash": one.hash}
