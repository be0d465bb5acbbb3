"""How a command ends that was ended: by Ctrl-C, a signal, or because nobody reads its output.

Whatever it was, the last line says what a person must know who stands before the machine then:
whether the robot stands, which tools were written, which tool is selected.
"""

from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime
from itertools import takewhile
from typing import TYPE_CHECKING, Final

from robolink.errors import ConfigError, RobolinkError
from robolink.interrupts import EndedBy, Interrupted
from robolink.messages import tr
from robolink.model import EntryKind, MarkerKind, NewEntry

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robolink.model import Controller, Marker

_HOLDS_NEW: Final = frozenset({EntryKind.DONE})
_HOLDS_OLD: Final = frozenset({EntryKind.ROLLED_BACK})
_UNTOUCHED: Final = frozenset({EntryKind.NOT_APPLIED, EntryKind.REFUSED})
_IN_DOUBT: Final = frozenset(
    {
        EntryKind.INTENT,
        EntryKind.WRITE,
        EntryKind.READ_BACK,
        EntryKind.CONFLICT,
        EntryKind.UNKNOWN,
    }
)
_OF_A_WRITE: Final = _HOLDS_NEW | _HOLDS_OLD | _UNTOUCHED | _IN_DOUBT

_UNPROVED: Final = frozenset({MarkerKind.SET, MarkerKind.MOVE, MarkerKind.CHANGE})


class CommandEnded(Interrupted):
    """A command on a controller that was ended, with the state that it has left.

    Attributes:
        state: What stands, what was written, which tool is selected: one line.
        unproved: Whether a write or a movement of this command is not settled.
    """

    def __init__(self, by: EndedBy, state: str, *, unproved: bool = False) -> None:
        super().__init__(by)
        self.state = state
        self.unproved = unproved


def command_ended(
    error: KeyboardInterrupt, controller: "Controller", since_s: float, left: "Sequence[Marker]"
) -> CommandEnded:
    """Look at the controller once more, and return the ending with what was seen.

    Args:
        error: What ended the command; everything is cleaned up.
        controller: The controller, connected; the link may be gone.
        since_s: When the command began, in wall-clock seconds.
        left: The markers that this command leaves open.
    """
    by, state = _by(error), state_now(controller, since_s)
    _record(controller, by, state, since_s)
    return CommandEnded(by, state, unproved=any(marker.kind in _UNPROVED for marker in left))


def ended_out_of_reach(
    error: KeyboardInterrupt, controller: "Controller | None", since_s: float
) -> CommandEnded:
    """Return the ending of a command that had not reached the controller, or was leaving it."""
    if controller is None:
        return CommandEnded(_by(error), tr("Nothing was sent that changes anything."))
    return CommandEnded(_by(error), _written(controller, since_s))


def state_now(controller: "Controller", since_s: float) -> str:
    """Return what stands, what was written since then, and which tool is selected: one line."""
    parts = [_motion(controller), _written(controller, since_s), _selected(controller)]
    return " ".join(filter(None, parts))


def _by(error: KeyboardInterrupt) -> EndedBy:
    return error.by if isinstance(error, Interrupted) else EndedBy.CTRL_C


def _motion(controller: "Controller") -> str:
    if not controller.capabilities.motion:
        return ""
    try:
        moving = controller.status().running
    except RobolinkError:
        return tr("Whether the robot stands still cannot be read: look at it.")
    if moving:
        return tr("The controller still runs something: look at the robot.")
    return tr("The robot stands still.")


def _selected(controller: "Controller") -> str:
    try:
        tool = controller.tools.selected()
    except RobolinkError:
        return tr("Which tool is selected cannot be read.")
    if tool is None:
        return tr("This controller does not tell which tool is selected.")
    return tr("Tool {tool} is selected.", tool=tool)


def _written(controller: "Controller", since_s: float) -> str:
    """Say of each tool what became of it, by what is on record since the command began."""
    try:
        ends = _newest(controller, since_s)
    except ConfigError:
        return tr("What was written cannot be read from the journal.")
    sentences = [_of_tool(tool, kind) for tool, kind in sorted(ends.items())]
    return " ".join(filter(None, sentences)) or tr("No tool was written.")


def _of_tool(tool: int, kind: EntryKind) -> str:
    if kind in _HOLDS_NEW:
        return tr("Tool {tool} was written and holds its new value.", tool=tool)
    if kind in _HOLDS_OLD:
        return tr("Tool {tool} was written, and holds its old value again.", tool=tool)
    if kind in _UNTOUCHED:
        return ""
    return tr(
        "Tool {tool} may hold a value that nobody has proved: run 'robolink recover'.", tool=tool
    )


def _newest(controller: "Controller", since_s: float) -> dict[int, EntryKind]:
    ends: dict[int, EntryKind] = {}
    for tool, kind in _since(controller, since_s):
        ends.setdefault(tool, kind)
    return ends


def _since(controller: "Controller", since_s: float) -> Iterator[tuple[int, EntryKind]]:
    since = datetime.fromtimestamp(since_s, UTC).isoformat(timespec="milliseconds")
    recorded = controller.outcomes.recorded(kinds=_OF_A_WRITE)
    for entry in takewhile(lambda entry: entry.at >= since, recorded):
        if entry.tool is not None:
            yield entry.tool, entry.kind


def _record(controller: "Controller", by: EndedBy, state: str, since_s: float) -> None:
    """Put the line on record where something was written: nobody may be left who reads it."""
    with suppress(ConfigError):
        if next(_since(controller, since_s), None) is not None:
            details = {"ended_by": str(by)}
            controller.outcomes.append(NewEntry(EntryKind.DECISION, verdict=state, details=details))
