"""What was done to a controller over one connection, and how much of it is confirmed.

The durable markers say to the next process what this one had begun. The ledger says to whoever
is told of an error what stands on the controller now: it is written to before the journal is,
so that it holds whatever breaks afterwards, the link, the stream, the journal or the disk.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from robolink.controller_outcome import Components, ControllerOutcome, ToolOutcome, note_outcome
from robolink.deprecation import deprecated
from robolink.messages import joined, tr
from robolink.model._outcomes import Marker, MarkerKind
from robolink.model._status import ControllerStatus
from robolink.model._tools import ToolOffset, describe_offset, read_offset

Same = Callable[[ToolOffset | None, ToolOffset | None], bool]

_SET, _MOVE = MarkerKind.SET, MarkerKind.MOVE  # before Python 3.12 a member is found slowly


@dataclass(slots=True)
class Account:
    """What was started in one block of work; made by :meth:`Ledger.open`.

    Attributes:
        before: What each tool held before the first write to it in this block.
        selected_before: Which tool was selected before the first selection in this block.
        carried_out: Requests that the controller has carried out, but for tools.
        moved: Whether a movement was begun.
    """

    before: dict[int, ToolOffset | None] = field(default_factory=dict)
    selected_before: int | None = None
    carried_out: dict[str, None] = field(default_factory=dict)
    moved: bool = False


@dataclass(slots=True)
class _Deed:
    """One command that was started; ``answered`` when the controller is known to have ended it."""

    marker: Marker
    answered: bool = False

    @property
    def tool(self) -> int | None:
        tool = self.marker.details.get("tool")
        return tool if isinstance(tool, int) and self.marker.kind is _SET else None

    @property
    def selects(self) -> bool:
        return "select" in self.marker.details and self.marker.kind is _SET

    @property
    def before(self) -> ToolOffset | None:
        return read_offset(self.marker.details.get("before"))

    @property
    def requested(self) -> ToolOffset | None:
        return read_offset(self.marker.details.get("requested"))


class Ledger:
    """The commands of one connection that write or move. Thread-safe.

    Attributes:
        same: Whether the controller stores two offsets alike.
    """

    def __init__(self) -> None:
        self.same: Same = lambda a, b: a == b
        self._lock = threading.RLock()
        self._doubts: dict[str, _Deed] = {}
        self._open: dict[str, Marker] = {}
        self._holds: dict[int, ToolOffset | None] = {}
        self._requested: dict[int, ToolOffset | None] = {}
        self._selected: int | None = None
        self._seen: tuple[ControllerStatus, int] | None = None
        self._whole = Account()
        self._accounts = [self._whole]
        self._unkept: list[Account] = []

    # What begins and how it ends, as reported by the keeper of the markers.

    def begin(self, marker: Marker) -> None:
        """Note a command or a procedure that is about to start; its marker is durable."""
        with self._lock:
            self._open[marker.operation] = marker
            if marker.kind not in (_SET, _MOVE):
                return
            deed = self._doubts[marker.operation] = _Deed(marker)
            if deed.tool is not None:
                self._requested[deed.tool] = deed.requested
            for account in self._accounts:
                if marker.kind is _MOVE:
                    account.moved = True
                elif deed.tool is not None:
                    account.before.setdefault(deed.tool, deed.before)
                elif deed.selects and account.selected_before is None:
                    account.selected_before = int(str(marker.details["before"]))

    def answered(self, marker: Marker) -> None:
        """Note that the controller has finished with it, whatever it did: later reads count."""
        with self._lock:
            if marker.operation in self._doubts:
                self._doubts[marker.operation].answered = True

    def proved(self, marker: Marker, found: object) -> None:
        """Note what was read after a command: a tool's offset, the selected tool, a value."""
        with self._lock:
            deed = self._doubts.get(marker.operation)
            if deed is not None:
                self._prove(deed, found)

    def ended(self, marker: Marker) -> None:
        """Note that its outcome is known: confirmed, or refused, or a movement that ended."""
        with self._lock:
            deed = self._doubts.pop(marker.operation, None)
            if deed is None:
                return
            if deed.tool is not None:
                self._holds.setdefault(deed.tool, deed.before)
            elif deed.selects:
                self._selected = int(str(deed.marker.details["before"]))

    def recorded(self, marker: Marker) -> None:
        """Note that its outcome is recorded: its marker is gone."""
        with self._lock:
            self._open.pop(marker.operation, None)

    def open_writes(self, tool: int) -> tuple[Marker, ...]:
        """Return the markers of writes to a tool with a known, unrecorded outcome."""
        with self._lock:
            return tuple(
                marker
                for operation, marker in self._open.items()
                if operation not in self._doubts and _Deed(marker).tool == tool
            )

    # What else is read.

    def saw_tool(self, tool: int, holds: ToolOffset | None) -> None:
        """Note the value read from a tool."""
        with self._lock:
            doubts = [deed for deed in self._doubts.values() if deed.tool == tool]
            if all(deed.answered for deed in doubts):
                for deed in doubts:
                    self._prove(deed, holds)
                if tool in self._holds:
                    self._holds[tool] = holds

    def saw_selected(self, tool: int | None) -> None:
        """Note which tool read as selected."""
        with self._lock:
            doubts = [deed for deed in self._doubts.values() if deed.selects]
            if all(deed.answered for deed in doubts):
                for deed in doubts:
                    del self._doubts[deed.marker.operation]
                self._selected = tool

    def saw_status(self, status: ControllerStatus, at_ns: int) -> None:
        """Note the state that was read, and when on the controller's clock."""
        self._seen = (status, at_ns)

    @property
    def seen(self) -> tuple[ControllerStatus, int] | None:
        """The state read last, and when on the controller's clock; ``None`` for never.

        It takes no lock: whoever looks on from another thread holds up nobody at work.
        """
        return self._seen

    # The present state.

    @contextmanager
    def block(self) -> Iterator[Account]:
        """Add to whatever ends the block early what it left on the controller."""
        account = self.open()
        try:
            yield account
        except BaseException as error:
            note_outcome(error, self.outcome(account))
            raise
        finally:
            self.close(account)

    @contextmanager
    def telling(self) -> Iterator[None]:
        """Add to whatever leaves the block what was left on the controller since connecting."""
        try:
            yield
        except BaseException as error:
            note_outcome(error, self.outcome())
            raise

    def open(self) -> Account:
        """Start an account of what is done from now on."""
        with self._lock:
            account = Account()
            self._accounts.append(account)
            return account

    def close(self, account: Account, *, kept: bool = True) -> None:
        """End an account.

        Args:
            account: The account.
            kept: Whether what was written in it is to stay. What is not, and was not put back,
                stands unproved.
        """
        with self._lock:
            self._accounts = [other for other in self._accounts if other is not account]
            if not kept:
                self._unkept.append(account)

    def outcome(self, account: Account | None = None) -> ControllerOutcome:
        """Return the result of what was done in ``account``, by default since connecting."""
        with self._lock:
            since = self._whole if account is None else account
            doubts = self._doubts.values()
            moves = [deed for deed in doubts if deed.marker.kind is _MOVE]
            unproved = {m.kind for m in self._open.values()} - {MarkerKind.SELECTION}
            stands = any(map(self._stands, self._unkept))
            others = [d for d in doubts if d not in moves and d.tool is None and not d.selects]
            return ControllerOutcome(
                tools={tool: self._tool(tool, before) for tool, before in since.before.items()},
                selected=self._selected,
                selected_before=since.selected_before,
                selection_known=not any(deed.selects for deed in doubts),
                carried_out=tuple(since.carried_out),
                doubtful=tuple(deed.marker.request for deed in others),
                moved=since.moved,
                moving=tuple(deed.marker.request for deed in moves),
                settled=not unproved and not stands,
                left_open=bool(self._open) or stands,
                reset_first=self._seen is not None and self._seen[0].needs_reset,
            )

    @deprecated("outcome")
    def standing(self, account: Account | None = None) -> ControllerOutcome:
        """Return what :meth:`outcome` returns."""
        return self.outcome(account)

    def _tool(self, tool: int, before: ToolOffset | None) -> ToolOutcome:
        known = all(deed.tool != tool for deed in self._doubts.values())
        holds = self._holds.get(tool, before)
        return ToolOutcome(
            before=_plain(before),
            holds=_plain(holds),
            requested=_plain(self._requested.get(tool)),
            known=known,
            differs=known and not self.same(holds, before),
        )

    def _stands(self, account: Account) -> bool:
        """Whether something that was not kept was not restored either."""
        return any(
            not self.same(self._holds.get(tool, before), before)
            for tool, before in account.before.items()
        )

    def _prove(self, deed: _Deed, found: object) -> None:
        if deed.tool is not None:
            self._holds[deed.tool] = found if isinstance(found, ToolOffset) else None
        elif deed.selects:
            self._selected = found if isinstance(found, int) else None
        else:
            for account in self._accounts:
                account.carried_out[deed.marker.request] = None
        del self._doubts[deed.marker.operation]


def _plain(offset: ToolOffset | None) -> Components:
    return None if offset is None else offset.components()


def describe_outcome(outcome: ControllerOutcome, *, settles: bool = True) -> str:
    """Return what moved, what was written, which tool is selected, and how to recover the rest.

    Args:
        outcome: What stands.
        settles: Whether to say which command settles it; not where that is said besides.
    """
    parts = outcome_sentences(outcome)
    if settles and (command := settling_command(outcome)):
        parts.append(command)
    return joined(" ", parts)


def outcome_sentences(outcome: ControllerOutcome) -> list[str]:
    """Return what moved, what was written and which tool is selected, a sentence each.

    They claim nothing that was not looked at.

    Args:
        outcome: What stands.
    """
    return [_movement(outcome), *_writes(outcome), _selection(outcome)]


def settling_command(outcome: ControllerOutcome) -> str:
    """Return the sentence that says which command settles what was left open; empty where none is.

    Args:
        outcome: What stands.
    """
    if not outcome.left_open:
        return ""
    if outcome.reset_first:
        return tr("Next: robolink robot reset, then robolink recover.")
    return tr("Next: robolink recover.")


def _movement(outcome: ControllerOutcome) -> str:
    if outcome.moving:
        return tr(
            "The robot may still be moving; robolink did not see the end of: {requests}.",
            requests=", ".join(outcome.moving),
        )
    if outcome.moved:
        return tr("Every movement has ended.")
    return tr("Nothing moved.")


def _writes(outcome: ControllerOutcome) -> list[str]:
    if not (outcome.tools or outcome.carried_out or outcome.doubtful):
        return [tr("Nothing was written.")]
    parts = [_tool(number, tool) for number, tool in sorted(outcome.tools.items())]
    if outcome.carried_out:
        parts.append(
            tr("This was carried out: {requests}.", requests=", ".join(outcome.carried_out))
        )
    if outcome.doubtful:
        parts.append(
            tr(
                "This may or may not have been carried out: {requests}.",
                requests=", ".join(outcome.doubtful),
            )
        )
    return parts


def _tool(number: int, tool: ToolOutcome) -> str:
    before, holds = _shown(tool.before), _shown(tool.holds)
    if not tool.known:
        return tr(
            "Tool {tool} may hold the new value {requested}; before, it held {before}.",
            tool=number,
            requested=_shown(tool.requested),
            before=before,
        )
    if tool.differs:
        return tr(
            "Tool {tool} now holds {holds}; before, it held {before}.",
            tool=number,
            holds=holds,
            before=before,
        )
    return tr("Tool {tool} holds {holds}, as before.", tool=number, holds=holds)


def _selection(outcome: ControllerOutcome) -> str:
    if not outcome.selection_known:
        return tr("Selected tool: not confirmed.")
    if outcome.selected is None:
        return tr("Selected tool: not checked.")
    if outcome.selected_another:
        return tr(
            "Tool {now} is selected now; it was tool {tool} before.",
            now=outcome.selected,
            tool=outcome.selected_before,
        )
    return tr("Tool {tool} is selected.", tool=outcome.selected)


def _shown(components: Components) -> str:
    return describe_offset(None if components is None else ToolOffset(*components))
