"""report: one page about one tool change, from the journal."""

from pathlib import Path

import click

from robolink.messages import declared, tr
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.render import note, say
from robolink_cli.options.pose_source import point_numbers
from robolink_cli.session.context import CliContext, optional_controller

_ENDINGS = (".html", ".htm")


@click.command()
@click.argument("change", required=False)
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path), required=False)
@click.option("--force", is_flag=True, help=declared("Overwrite a file that is already there."))
@click.option(
    "--points",
    metavar="1-50",
    help=declared("Also show how far the tip moves at these taught points, read now from -c."),
)
@optional_controller
def report(
    context: CliContext,
    *,
    change: str | None,
    file: Path | None,
    force: bool,
    points: str | None,
) -> int:
    """Write one HTML page about CHANGE, to keep, to mail or to print.

    CHANGE is the beginning of an id, or the number of an entry, as 'robolink journal list'
    shows them; without it the newest change is meant, with -c the newest of that cell. The
    page comes from the journal alone and needs no controller, except for --points. Exit code 1
    when the check of the journal finds something wrong.
    """
    from robolink.files.named import require_free
    from robolink.report import save
    from robolink.transaction import id_of_change
    from robolink_cli.access.change_page import free_page, reports_from
    from robolink_cli.commands.record.journal_lookup import journal_to_read
    from robolink_cli.commands.record.recorded_change import (
        find_change,
        report_payload,
        with_points,
    )
    from robolink_cli.options.impact import ImpactRequest

    if change is not None and file is None and change.lower().endswith(_ENDINGS):
        file, change = Path(change), None
    request = ImpactRequest(point_numbers(points)) if points else None
    if request is not None:
        context.require_url()
    journal = journal_to_read()
    entries = find_change(journal, change, controller=context.url)
    path = file or free_page(id_of_change(entries[-1]), replace=force)
    require_free(path, replace=force)
    reports, problems = reports_from(journal, entries)
    if request is not None:
        reports = with_points(context, reports, request)
    save(reports[0], path, others=reports[1:], replace=force)
    for problem in problems:
        note(problem)
    payload = report_payload(reports, path)
    context.emit("report", payload, lambda: say(tr("Report: {path}", path=path)))
    return DIFFERENT if problems else 0
