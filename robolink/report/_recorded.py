"""From the entries of a change in the journal to its report; no controller is needed."""

from collections.abc import Iterator, Mapping, Sequence

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import EntryKind, Recorded, answered_by_in_words
from robolink.report._recorded_tool import report_of_tool
from robolink.report._values import Judgement, Record, Report
from robolink.ways import Way, way

_NOT_ABOUT_A_CHANGE = (
    EntryKind.SELECTION,
    EntryKind.LEASE,
    EntryKind.RECONNECT,
    EntryKind.RAW,
    EntryKind.DECISION,
)
"""Their tool, where they name one, is not one that was changed."""


def reports_of(
    entries: Sequence[Recorded],
    *,
    made_at: str,
    robolink_version: str,
    check: str,
    problems: Sequence[str] = (),
) -> tuple[Report, ...]:
    """Return what became of each tool of a change.

    Args:
        entries: All that is on record about the change, in the order in which it was stored.
        made_at: Wall-clock label, ISO 8601.
        robolink_version: What makes the reports.
        check: What a check of the whole journal found, one sentence.
        problems: What is wrong with the journal.

    Raises:
        ConfigError: It changed no tool, or an entry cannot be understood.

    Example:
        >>> from robolink import ToolOffset, connect
        >>> from robolink.report import reports_of
        >>> from robolink.transaction import Wanted, change_tools
        >>> with connect("epson+sim://report-example") as controller:
        ...     receipts = change_tools(controller, [Wanted(2, ToolOffset(5, 6, -70), None)])
        ...     entries = tuple(reversed(list(controller.outcomes.recorded(tool=2))))
        >>> about = {"made_at": "2026-11-23T08:00:00Z", "robolink_version": "0.1.0"}
        >>> (report,) = reports_of(entries, check="The journal is whole.", **about)
        >>> report.tool
        2
    """
    tools = sorted({tool for entry in entries for tool in _tools(entry)})
    if not tools:
        raise ConfigError(
            tr("These entries are not about a change of a tool's offset."),
            remedy=tr("{changes} shows entries that are.", changes=way(Way.LIST_CHANGES)),
        )
    record = Record(
        change=entries[-1].change or entries[-1].operation,
        signature=entries[-1].signature,
        people=tuple(dict.fromkeys(_people(entries))),
        entries=tuple(entries),
        check=check,
        problems=tuple(problems),
    )
    made = {"made_at": made_at, "robolink_version": robolink_version}
    return tuple(
        _report(tool, [e for e in entries if _concerns(e, tool)], record, made) for tool in tools
    )


def _report(
    tool: int, entries: Sequence[Recorded], record: Record, made: Mapping[str, str]
) -> Report:
    try:
        return report_of_tool(tool, entries, record, judgements=tuple(_judged(entries)), **made)
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigError(
            tr(
                "The entries {first} to {last} cannot be understood: {error!r}.",
                first=entries[0].number,
                last=entries[-1].number,
                error=error,
            ),
            remedy=tr("'robolink journal verify' tells whether they were changed."),
        ) from error


def _tools(entry: Recorded) -> Iterator[int]:
    if entry.kind in _NOT_ABOUT_A_CHANGE:
        return
    if entry.tool is not None:
        yield entry.tool
    several = entry.details.get("tools")
    if isinstance(several, Mapping):
        yield from (int(tool) for tool in several)


def _concerns(entry: Recorded, tool: int) -> bool:
    """Tell whether an entry is about a tool, or about the whole change."""
    if entry.kind in _NOT_ABOUT_A_CHANGE:
        return entry.kind is EntryKind.DECISION and entry.tool in (None, tool)
    return entry.tool in (None, tool)


def _people(entries: Sequence[Recorded]) -> Iterator[str]:
    for entry in entries:
        signed = entry.signature
        role = f" ({signed.role})" if signed.role else ""
        user = tr("user {user} on {host}", user=signed.os_user, host=signed.host)
        yield f"{signed.operator}{role}, {user}" if signed.operator else user + role


def _judged(entries: Sequence[Recorded]) -> Iterator[Judgement]:
    for entry in entries:
        if (entry.tolerance or entry.verdict) and not _stands_in_the_head(entry):
            said = (_answer(entry) or entry.verdict, _fit(entry.details))
            found = "; ".join(part for part in said if part)
            yield Judgement(_what(entry), entry.tolerance, found)


def _stands_in_the_head(entry: Recorded) -> bool:
    """Tell whether an entry only repeats which nozzle or lot it was: an older one, unasked."""
    named = entry.verdict and entry.verdict in (entry.signature.nozzle, entry.signature.lot)
    return bool(named) and entry.kind is EntryKind.DECISION and "question" not in entry.details


def _what(entry: Recorded) -> str:
    """Return what a row is about: a question that was answered says more than its kind."""
    if entry.kind is EntryKind.DECISION and "question" in entry.details:
        return tr("answer")
    return str(entry.kind)


def _answer(entry: Recorded) -> str:
    """Return what was asked and what was answered, and how; empty for what was no question."""
    details = entry.details
    if entry.kind is not EntryKind.DECISION or "question" not in details:
        return ""
    by = details.get("answered_by")
    if by is None:  # older entries do not say it
        return tr("{question} {answer}", question=details["question"], answer=entry.verdict)
    return tr(
        "{question} {answer} ({by})",
        question=details["question"],
        answer=entry.verdict,
        by=answered_by_in_words(str(by)),
    )


def _fit(details: Mapping[str, object]) -> str:
    """Return how well a measurement agreed with itself, in words."""
    rms_mm, largest_mm = details.get("rms_mm"), details.get("max_residual_mm")
    if not isinstance(rms_mm, float) or not isinstance(largest_mm, float):
        return ""
    return tr("rms {rms:.3f} mm, largest residual {largest:.3f} mm", rms=rms_mm, largest=largest_mm)
