"""What the record says that an undo needs: how changes ended, and what was proved."""

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import PROOFS, EntryKind, OutcomeLog, Recorded, ToolOffset, read_offset
from robolink.ways import Way, way

_ENDS = (EntryKind.DONE, EntryKind.ROLLED_BACK)


def id_of_change(entry: Recorded) -> str:
    """Return by which id a person names what an entry belongs to.

    A single write that was made outside of a change is known by its operation.
    """
    return entry.change or entry.operation


def of_change(outcomes: OutcomeLog, change: str, tool: int | None) -> list[Recorded]:
    """Return how the tools of a change were done, newest first.

    Args:
        outcomes: The record of one controller.
        change: Id of the change, empty for the newest that was not taken back.
        tool: Only this tool of it.

    Raises:
        ConfigError: There is none, or it was taken back.
    """
    chosen = change or _newest_done(outcomes, tool)
    ends = list(outcomes.recorded(change=chosen, kinds=_ENDS)) if chosen else []
    if chosen and not ends:  # a single write, known by its operation
        ends = [entry for entry in outcomes.recorded(kinds=_ENDS) if id_of_change(entry) == chosen]
    taken_back = any(entry.kind is EntryKind.ROLLED_BACK for entry in ends)
    done = [entry for entry in ends if tool in (None, entry.tool)]
    if not done or taken_back:
        raise ConfigError(
            _nothing_to_undo(chosen, taken_back=taken_back),
            remedy=tr("{changes} shows what can be undone.", changes=way(Way.LIST_CHANGES)),
        )
    return done


def _newest_done(outcomes: OutcomeLog, tool: int | None) -> str:
    taken_back = set()
    for entry in outcomes.recorded(tool=tool, kinds=_ENDS):
        if entry.kind is EntryKind.ROLLED_BACK:
            taken_back.add(id_of_change(entry))
        elif id_of_change(entry) not in taken_back:
            return id_of_change(entry)
    return ""


def _nothing_to_undo(change: str, *, taken_back: bool) -> str:
    if not change:
        return tr("No finished change of this controller is on record.")
    if taken_back:
        return tr("The change {change} was taken back when it was made.", change=change[:8])
    return tr("The change {change} completed nothing for that tool.", change=change[:8])


def proof_numbered(outcomes: OutcomeLog, number: int) -> Recorded | None:
    """Return the entry of that number if it says what was read from a tool."""
    for entry in outcomes.recorded(kinds=PROOFS):
        if entry.number <= number:
            known = entry.number == number and entry.tool is not None and "value" in entry.details
            return entry if known else None
    return None


def tool_of(entry: Recorded) -> int:
    """Return which tool an entry is about."""
    if entry.tool is None:
        raise _unreadable(entry)
    return entry.tool


def offset_of(entry: Recorded, name: str) -> ToolOffset | None:
    """Return a value of an entry, ``None`` for an undefined tool."""
    if name not in entry.details:
        raise _unreadable(entry)
    return read_offset(entry.details[name])


def _unreadable(entry: Recorded) -> ConfigError:
    return ConfigError(
        tr("Entry {number} of the journal cannot be understood.", number=entry.number),
        remedy=tr(
            "'robolink journal verify' checks it; name an earlier value with {to}.",
            to=way(Way.EARLIER_VALUE),
        ),
    )
