"""The page about a change, made from the journal alone."""

from collections.abc import Sequence
from pathlib import Path

from robolink import __version__
from robolink.errors import ConfigError, JournalError
from robolink.files.named import require_free
from robolink.journal import Journal, open_journal
from robolink.messages import tr
from robolink.model import OutcomeLog, Recorded
from robolink.report import Report, reports_of, save
from robolink.timing import wall_time
from robolink_cli.access.look_pictures import looks_of


def page_of_change(change: str) -> tuple[str, ...]:
    """Write the page about a change into the working folder, as 'robolink journal report' does.

    Args:
        change: Its whole id.

    Returns:
        Where it is, and what is wrong with the journal; each a sentence.

    Raises:
        ConfigError: The change is not in the journal.
        JournalError: The journal cannot be read.
        OSError: The page cannot be written.
    """
    journal = open_journal(read_only=True)
    entries = list(journal.entries(change=change, newest_first=False))
    path = free_page(change).absolute()
    require_free(path, replace=False)
    reports, problems = reports_from(journal, entries)
    save(reports[0], path, others=reports[1:], looks=looks_of(change), replace=False)
    return (tr("Report: {path}", path=path), *problems)


def free_page(change: str, *, replace: bool = False) -> Path:
    """Return where to write a page without a name: an older one of the same change stays.

    Args:
        change: Its whole id.
        replace: Whether the older one gives way.
    """
    first = Path(f"change-{change[:8]}.html")
    path, number = first, 1
    while path.exists() and not replace:
        number += 1
        path = first.with_stem(f"{first.stem}-{number}")
    return path


def reports_from(
    journal: Journal, entries: Sequence[Recorded]
) -> tuple[tuple[Report, ...], list[str]]:
    """Return the report of each tool, and what is wrong with the journal.

    The whole journal is checked: that an entry is as it was stored rests on all before it.

    Raises:
        ConfigError: The entries are not about a change, or cannot be understood.
    """
    check, problems = _checked(journal)
    return _made(entries, check, problems), problems


def report_on_record(outcomes: OutcomeLog, change: str, tool: int) -> Report:
    """Return the report of a tool of a change that this command made.

    Args:
        outcomes: The record of its controller.
        change: Its whole id.
        tool: Number of the tool.

    Raises:
        ConfigError: The entries cannot be understood, or are not about the tool.
        JournalError: The journal cannot be read.
    """
    entries = tuple(outcomes.recorded(change=change))[::-1]
    if outcomes.durable:
        reports, _ = reports_from(open_journal(read_only=True), entries)
    else:
        kept_nowhere = tr("The journal of this simulator is deleted when this command ends.")
        reports = _made(entries, kept_nowhere, ())
    for report in reports:
        if report.tool == tool:
            return report
    raise ConfigError(
        tr("Tool {tool} is not on record in this change.", tool=tool),
        remedy=tr("'robolink journal list' shows what is on record."),
    )


def _made(entries: Sequence[Recorded], check: str, problems: Sequence[str]) -> tuple[Report, ...]:
    return reports_of(
        entries,
        made_at=wall_time().isoformat(timespec="seconds"),
        robolink_version=__version__,
        check=check,
        problems=problems,
    )


def _checked(journal: Journal) -> tuple[str, list[str]]:
    try:
        found = journal.verify()
    except JournalError as error:
        return tr("The journal could not be checked: {error}", error=error), []
    if found.problems:
        return tr("The journal was CHANGED after it was stored."), list(found.problems)
    return tr(
        "All {count} journal entries were checked when this page was made: none was "
        "changed, none is missing.",
        count=found.checked,
    ), []
