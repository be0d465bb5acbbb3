"""report: one page about one tool change, from the journal."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated

import click

from robolink.errors import ConfigError
from robolink.journal import Journal
from robolink.messages import tr
from robolink.model import EntryKind, Recorded, json_fields
from robolink.report import Report
from robolink.transaction import id_of_change
from robolink_cli.commands.record.journal_lookup import controller_meant, entries_of_change
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.render import emit, note, say
from robolink_cli.options.consent import Overwrite
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.impact import ImpactRequest, judge
from robolink_cli.options.pose_source import point_numbers
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, optional_controller
from robolink_cli.views.documents import verification_payload

_ENDINGS = (".html", ".htm")


@click.command()
@optional_controller
def report(
    context: CliContext,
    *,
    change: Annotated[str | None, CliArgument()] = None,
    file: Annotated[Path | None, CliArgument()] = None,
    force: Overwrite = False,
    points: Annotated[
        str | None,
        CliOption(
            metavar="1-50",
            help="Also show how far the tip moves at these taught points, read from -c now.",
        ),
    ] = None,
) -> int:
    """Write one HTML page about CHANGE, to keep, mail or print.

    CHANGE is the beginning of an id, or the number of an entry, as 'robolink journal list'
    shows them; default: the newest change, with -c the newest of that cell. The page comes from
    the journal alone and needs no controller, except for --points. Exit code 1 when the check of
    the journal finds an error.
    """
    from robolink.files.named import require_free
    from robolink.report import save
    from robolink_cli.access.change_page import free_page, reports_from
    from robolink_cli.access.look_pictures import looks_of
    from robolink_cli.commands.record.journal_lookup import journal_to_read

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
    looks = looks_of(id_of_change(entries[-1]))
    save(reports[0], path, others=reports[1:], looks=looks, replace=force)
    for problem in problems:
        note(problem)
    payload = report_payload(reports, path)
    emit("report", payload, lambda: say(tr("Report: {path}", path=path)))
    return DIFFERENT if problems else 0


_OF_A_CHANGE = (
    EntryKind.CALIBRATION,
    EntryKind.REFUSED,
    EntryKind.INTENT,
    EntryKind.DONE,
    EntryKind.ROLLED_BACK,
    EntryKind.CONFLICT,
)


def find_change(journal: Journal, name: str | None, *, controller: str | None) -> list[Recorded]:
    """Return the entries of a change in the order in which they were stored.

    Args:
        journal: Where to look.
        name: The beginning of its id, or the number of an entry; ``None`` for the newest.
        controller: URL of the controller that must be meant, ``None`` for any.

    Raises:
        ConfigError: There is no such change.
        JournalError: The journal cannot be read.
    """
    meant = controller_meant(controller)
    if name is None:
        newest = next(journal.entries(controller=meant, kinds=_OF_A_CHANGE), None)
        if newest is None:
            raise ConfigError(
                tr("No tool change is on record."),
                remedy=tr(
                    "'robolink journal list' shows what is on record; -c names another cell."
                ),
            )
        name = id_of_change(newest)
    return entries_of_change(journal, name, controller=meant)


def with_points(
    context: CliContext, reports: Sequence[Report], request: ImpactRequest
) -> tuple[Report, ...]:
    """Add the controller's present answers: which it is, and its taught points.

    Raises:
        ConfigError: It has no taught points.
    """
    with open_controller(context) as controller:
        facts, taught = controller.facts(), request.read(controller)
    return tuple(
        replace(report, facts=facts, impact=judge(taught, old=report.before, new=report.after))
        if report.after is not None
        else replace(report, facts=facts)
        for report in reports
    )


def report_payload(reports: Sequence[Report], path: Path) -> dict[str, object]:
    """Return the document of a page that was written."""
    record = reports[0].record
    assert record is not None  # noqa: S101 - made from the journal
    return {
        "file": str(path),
        "change": record.change,
        "done_by": list(record.people),
        "began_at": record.entries[0].at,
        "ended_at": record.entries[-1].at,
        "tools": [_tool_payload(one) for one in reports],
        "entries": [entry.number for entry in record.entries],
        "problems": list(record.problems),
    }


def _tool_payload(report: Report) -> dict[str, object]:
    """Return the values of one tool for an auditor's program; ``null`` if not recorded."""
    fit, proof = report.fit, report.verification
    return {
        "tool": report.tool,
        "outcome": str(report.outcome),
        "simulated": report.simulated,
        "method": report.method,
        "local_time": report.local_time or None,
        "machine": {name: value or None for name, value in asdict(report.facts).items()},
        **json_fields(report, "gauges", "before", "after"),
        "measured": [name for name in report.determined if not fit or name not in fit.changed],
        "changed": list(fit.changed) if fit else [],
        "repeatable_to_mm": fit.repeatable_to_mm if fit else None,
        "accurate_to_mm": _accurate_to_mm(report),
        "accuracy": fit.accuracy.as_json(fit.measured) if fit and fit.accuracy else None,
        "seating": dict(report.seating) if report.seating else None,
        "half_width95": dict(zip(fit.measured, fit.half_width95, strict=False)) if fit else {},
        "interval_from": fit.interval_from or None if fit else None,
        "region95_radius_mm": fit.region95_radius_mm if fit else None,
        "budget": fit.budget.as_json() if fit and fit.budget else None,
        "warnings": list(fit.warnings) if fit else [],
        "verification": verification_payload(proof) if proof else None,
    }


def _accurate_to_mm(report: Report) -> float | None:
    """Return what the tip is accurate to by the valid statement, a wider one included."""
    if report.widened_mm is not None:
        return report.widened_mm
    return None if report.fit is None else report.fit.accurate_to_mm
