"""Judges the open markers of tools, written or selected, and of movements."""

from robolink.messages import tr
from robolink.model import (
    EntryKind,
    Finding,
    Marker,
    NewEntry,
    ToolOffset,
    ToolTable,
    Verdict,
    describe_offset,
    plain_offset,
    read_offset,
)

_KINDS = {
    Verdict.DONE: EntryKind.DONE,
    Verdict.NOT_APPLIED: EntryKind.NOT_APPLIED,
    Verdict.CONFLICT: EntryKind.CONFLICT,
}


def examine_write(tools: ToolTable, marker: Marker) -> Finding:
    """Return what became of a write.

    Raises:
        ConfigError: The marker cannot be understood.
    """
    tool = int(str(marker.details["tool"]))
    requested = read_offset(marker.details.get("requested"))
    before = read_offset(marker.details.get("before"))
    now = tools.read(tool)
    if tools.same(now, requested):
        verdict = Verdict.DONE
        sentence = tr("Tool {tool} holds the new value {now}.", tool=tool, now=describe_offset(now))
    elif tools.same(now, before):
        verdict = Verdict.NOT_APPLIED
        sentence = tr(
            "Tool {tool} still holds the old value {now}; the write did not take.",
            tool=tool,
            now=describe_offset(now),
        )
    else:
        verdict = Verdict.CONFLICT
        sentence = tr(
            "Tool {tool} holds {now}: neither the old value {before} nor the new one {requested}.",
            tool=tool,
            now=describe_offset(now),
            before=describe_offset(before),
            requested=describe_offset(requested),
        )
    return Finding(marker, verdict, sentence, entries=(_entry(marker, tool, verdict, now),))


def examine_select(tools: ToolTable, marker: Marker) -> Finding:
    """Return what became of one selection."""
    now, wanted = tools.selected(), int(str(marker.details["select"]))
    verdict = Verdict.DONE if now == wanted else Verdict.NOT_APPLIED
    return Finding(marker, verdict, tr("Tool {now} is selected now.", now=now))


def examine_move(marker: Marker) -> Finding:
    """Return what can be told of a movement; whether it is as it should be, a person sees.

    How far it is from its target is not told: the tool in which that was meant may hold another
    value by now, or not be the selected one.
    """
    sentence = tr("It may have ended early. Look at the robot; nothing is sent again.")
    return Finding(marker, Verdict.LOOK, sentence)


def judge_selection(
    marker: Marker, *, now: int, before: int, restored: bool, action: str
) -> Finding:
    """Return whether a procedure that ended early has put the cell's own tool back.

    Args:
        marker: Of the procedure.
        now: The tool that is selected.
        before: The tool that was selected when the procedure began.
        restored: Whether all is as it was then.
        action: What settling would do about it, without a full stop.
    """
    if restored:
        sentence = tr("Tool {tool} is selected, as it was before.", tool=now)
        return Finding(marker, Verdict.DONE, sentence)
    if now == before:
        sentence = tr("Tool {tool} is selected, as before; power mode or speed are not.", tool=now)
    else:
        sentence = tr(
            "Tool {now} is selected; before it was tool {before}.", now=now, before=before
        )
    entry = NewEntry(EntryKind.SELECTION, tool=before, verdict=Verdict.NOT_RESTORED)
    return Finding(marker, Verdict.NOT_RESTORED, sentence, action, (entry,))


def _entry(marker: Marker, tool: int, verdict: Verdict, now: ToolOffset | None) -> NewEntry:
    details = {**marker.details, "value": plain_offset(now), "found_later": True}
    kind = _KINDS[verdict]
    if kind is EntryKind.DONE and marker.details.get("part"):
        # Whether the change that it is part of is done, is settled after it.
        kind = EntryKind.READ_BACK
    return NewEntry(kind, operation=marker.operation, tool=tool, verdict=verdict, details=details)
