"""Restores an old value: once, and only over what this change wrote."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.errors import ReadBackError, RobolinkError, SelectedToolError
from robolink.messages import first_sentence, in_english, tr
from robolink.model import (
    Controller,
    EntryKind,
    NewEntry,
    ToolOffset,
    ToolTable,
    describe_offset,
    plain_offset,
    read_for_verdict,
)
from robolink.package_log import PackageLog

_LOG: Final = PackageLog(__package__)


@dataclass(frozen=True, slots=True)
class Step:
    """One tool of a change.

    Attributes:
        tool: Its number.
        before: What it held; ``None`` for undefined.
        requested: What it is to hold.
        was_read: Whether ``before`` was read, or is what the caller believes.
    """

    tool: int
    before: ToolOffset | None
    requested: ToolOffset | None
    was_read: bool = True


@dataclass(frozen=True, slots=True)
class PutBack:
    """The result for one tool whose change was restored.

    Attributes:
        tool: Its number.
        restored: Whether it holds its old value now, proved by reading.
        written: Whether a write was needed for that.
        sentence: The same for a person.
        entry: The same for the journal.
        error: What kept the old value from being written back, ``None`` for nothing.
    """

    tool: int
    restored: bool
    written: bool
    sentence: str
    entry: NewEntry
    error: RobolinkError | None = None


def put_back(
    controller: Controller,
    steps: Sequence[Step],
    *,
    spoiled: int | None = None,
    selected: int | None = None,
) -> list[PutBack]:
    """Restore each tool's old value, the last one first, with at most one write each.

    A stop does not hinder it, once for each tool (docs/reference/rules.md 5).

    Args:
        controller: Whose tools they are.
        steps: What the change was to do.
        spoiled: A tool whose write was read back as something else, so that what it holds is
            this change's own doing.
        selected: The tool that was in force before the change, ``None`` where that is not known.
            A tool that becomes undefined again gives way to it, should it be in force now, and to
            the flange where it is not known.
    """
    done = [
        _put_one_back(controller, step, spoiled=step.tool == spoiled, selected=selected or 0)
        for step in reversed(steps)
    ]
    for one in done:
        tell = _LOG.decided if one.restored else _LOG.doubted
        tell(f"rolled back: {in_english(one.sentence)}", controller=controller.identity)
    return done


def _put_one_back(controller: Controller, step: Step, *, spoiled: bool, selected: int) -> PutBack:
    tools, tool, before = controller.tools, step.tool, step.before
    try:
        now = read_for_verdict(tools, tool, (before, step.requested))
        if tools.same(now, before):
            return _restored(step, tr("Tool {tool} holds its old value.", tool=tool), written=False)
        if not (spoiled or tools.same(now, step.requested)):
            return _conflict(step, now)
        with controller.latch.putting_back(tool):
            if before is None:
                _clear(tools, tool, now, selected)
            else:
                tools.write(tool, before, expected=now)
    except RobolinkError as error:
        return _failed(step, error)
    sentence = tr("The old value of tool {tool} is back.", tool=tool)
    return _restored(step, sentence, written=True)


def _clear(tools: ToolTable, tool: int, now: ToolOffset | None, selected: int) -> None:
    try:
        tools.clear(tool, expected=now, then_select=selected)
    except SelectedToolError:
        # The tool was selected without a definition, which meant the flange.
        tools.clear(tool, expected=now, then_select=0)


def _restored(step: Step, sentence: str, *, written: bool) -> PutBack:
    kind = EntryKind.ROLLED_BACK if written else EntryKind.NOT_APPLIED
    entry = _entry(kind, step, step.before, sentence)
    return PutBack(step.tool, restored=True, written=written, sentence=sentence, entry=entry)


def _conflict(step: Step, now: ToolOffset | None) -> PutBack:
    sentence = tr(
        "Tool {tool} holds {now}, neither its old value nor the new one. It was left as it is.",
        tool=step.tool,
        now=describe_offset(now),
    )
    return PutBack(
        step.tool, False, False, sentence, _entry(EntryKind.CONFLICT, step, now, sentence)
    )


def _failed(step: Step, error: RobolinkError) -> PutBack:
    sentence = tr(
        "DO NOT START THE CELL. Tool {tool} holds an untested value; the old one could not "
        "be written back: {error}",
        tool=step.tool,
        error=first_sentence(error.what),
    )
    kind = EntryKind.CONFLICT if isinstance(error, ReadBackError) else EntryKind.UNKNOWN
    entry = _entry(kind, step, None, sentence)
    return PutBack(step.tool, False, False, sentence, entry, error)


def _entry(kind: EntryKind, step: Step, now: ToolOffset | None, sentence: str) -> NewEntry:
    details: dict[str, object] = {
        "before": plain_offset(step.before),
        "requested": plain_offset(step.requested),
    }
    if kind is not EntryKind.UNKNOWN:
        details["value"] = plain_offset(now)
    return NewEntry(kind, tool=step.tool, verdict=sentence, details=details)


def left_unverified(tools: Sequence[int], *, marked: bool) -> str:
    """Return the sentence for tools that could not be restored, since the link is gone.

    Args:
        tools: Their numbers.
        marked: Whether the change left a marker, so that ``recover`` puts the old values back.
    """
    numbers = ", ".join(map(str, tools))
    if not marked:
        return tr(
            "Tool {numbers} may hold the new value, which was never tested; 'robolink "
            "recover' reads what it holds.",
            numbers=numbers,
        )
    return tr(
        "Tool {numbers} may hold the new value, which was never tested; 'robolink recover' "
        "restores the old one.",
        numbers=numbers,
    )
