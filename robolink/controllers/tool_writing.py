"""Compare-and-set of a tool offset: the same for every kind of controller.

Source: docs/reference/rules.md 2.

Read; equal to what is wanted: nothing is written, because a write wears the controller's
memory; not what was expected: nothing is written either; else a durable intent, one write,
and a read-back of all six components. What became of it goes on record together with the
end of the intent.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TypeVar

from robolink.controllers.markers import MarkerStore
from robolink.errors import (
    ControllerFaultError,
    ReadBackError,
    RejectedError,
    ToolChangedError,
    UnclearAnswerError,
)
from robolink.messages import tr
from robolink.model import (
    ANY,
    EntryKind,
    Expected,
    Marker,
    MarkerKind,
    NewEntry,
    ToolOffset,
    ToolReceipt,
    describe_offset,
    plain_offset,
    require_engineer,
)

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class ToolWrite:
    """One write as its controller carries it out.

    Attributes:
        tool: Number of the tool.
        requested: The new value as the controller can hold it; ``None`` clears the tool.
        request: What is sent, as a person may read it.
        send: Sends it; raises unless the controller accepted it.
        read: Reads what is stored.
        read_back: Reads it after the controller has accepted the write, where that is another
            question.
        read_doubted: Reads it when the answer told nothing, where that is another question.
    """

    tool: int
    requested: ToolOffset | None
    request: str
    send: Callable[[], object]
    read: Callable[[], ToolOffset | None]
    read_back: Callable[[], ToolOffset | None] | None = None
    read_doubted: Callable[[], ToolOffset | None] | None = None


class ToolWriter:
    """Carries out writes on one controller.

    Args:
        markers: Keeps the intents.
        same: Whether the controller stores two values alike.
        uninterrupted: Holds Ctrl-C back meanwhile.
        not_executed: Whether a refusal proves that nothing was done.
    """

    def __init__(
        self,
        markers: MarkerStore,
        *,
        same: Callable[[ToolOffset | None, ToolOffset | None], bool],
        uninterrupted: Callable[[], AbstractContextManager[None]],
        not_executed: Callable[[RejectedError], bool],
    ) -> None:
        self._markers = markers
        self._same = markers.ledger.same = same
        self._uninterrupted = uninterrupted
        self._not_executed = not_executed

    def change(self, write: ToolWrite, expected: Expected) -> ToolReceipt:
        """Write and read back; see :meth:`robolink.model.ToolTable.write`."""
        tool, requested, unconditional = write.tool, write.requested, expected is ANY
        if unconditional:
            require_engineer(self._markers.outcomes, tr("write tool {tool} blindly", tool=tool))
        self._markers.look()
        before = write.read()
        self._markers.ledger.saw_tool(tool, before)
        if self._same(before, requested):
            return ToolReceipt(
                tool, before, requested, before, skipped=True, unconditional=unconditional
            )
        if expected is not ANY and not self._same(before, expected):
            raise ToolChangedError(
                tr(
                    "Tool {tool} holds {found}, not the expected {expected}; nothing was written.",
                    tool=tool,
                    found=describe_offset(before),
                    expected=describe_offset(expected),
                ),
                remedy=tr(
                    "Someone changed it: a program that runs TLSet at its start, the pendant, or "
                    "a restored project. Read it again and decide anew."
                ),
                request=write.request,
            )
        found = self._write(write, before, unconditional=unconditional)
        if not self._same(found, requested):
            raise ReadBackError(
                tr(
                    "Tool {tool} was written as {requested}, but reads back as {found}.",
                    tool=tool,
                    requested=describe_offset(requested),
                    found=describe_offset(found),
                ),
                remedy=tr(
                    "Do not run the cell with it. Before the write it held {before}.",
                    before=describe_offset(before),
                ),
                request=write.request,
            )
        return ToolReceipt(tool, before, requested, found, unconditional=unconditional)

    def carry_out(
        self,
        request: str,
        details: Mapping[str, object],
        *,
        send: Callable[[], object],
        read: Callable[[], T],
        tell: Callable[[T], str] | None = None,
        entries: Callable[[Marker, T], Iterable[NewEntry]] = lambda _marker, _found: (),
    ) -> T:
        """Send something that is marked, and return what ``read`` finds then.

        Ctrl-C waits for that. A plain refusal settles the marker; a fault does not, because a
        controller in error may refuse to show the value that would prove what happened. After
        an answer that says neither yes nor no, reading settles it.

        Args:
            request: What is sent, as a person may read it.
            details: What is needed to settle it later.
            send: Sends it.
            read: Reads what it changes.
            tell: Says what the value that was read means, when the answer did not; only a
                controller that may answer so needs it.
            entries: What is put on record together with the end of the marker.

        Raises:
            UnclearAnswerError: The answer told nothing; the message says what was read.
        """
        ledger = self._markers.ledger
        with self._uninterrupted(), ledger.block():
            marker = self._markers.begin(MarkerKind.SET, request, details)
            unclear: UnclearAnswerError | None = None
            with self._markers.doubt(request):
                try:
                    with self._markers.unless_stopped(marker):
                        send()
                    ledger.answered(marker)
                except (RejectedError, ControllerFaultError) as error:
                    ledger.answered(marker)
                    if isinstance(error, RejectedError) and self._not_executed(error):
                        self._markers.clear(marker, _refusal(marker, error))
                    raise
                except UnclearAnswerError as error:
                    ledger.answered(marker)
                    unclear = error
                found = read()
            ledger.proved(marker, found)
            self._markers.clear(marker, *entries(marker, found))
        if unclear is not None:
            # What such a link says is not relied on, so this ends as a failure in any case.
            if tell is not None:
                unclear.remedy = tell(found)
            raise unclear
        return found

    def _write(
        self, write: ToolWrite, before: ToolOffset | None, *, unconditional: bool
    ) -> ToolOffset | None:
        details: dict[str, object] = {
            "tool": write.tool,
            "before": plain_offset(before),
            "requested": plain_offset(write.requested),
        }
        if unconditional:
            details["unconditional"] = True
        if self._markers.outcomes.change:
            details["change"] = self._markers.outcomes.change
        if self._markers.changing:
            details["part"] = True

        acknowledged = False

        def send() -> None:
            nonlocal acknowledged
            write.send()
            acknowledged = True

        def read() -> ToolOffset | None:
            another = write.read_back if acknowledged else write.read_doubted
            return (another or write.read)()

        def ends(found: ToolOffset | None) -> Iterator[EntryKind]:
            if not acknowledged and self._same(found, before):
                yield EntryKind.NOT_APPLIED
                return
            yield EntryKind.WRITE
            yield EntryKind.READ_BACK
            if not self._same(found, write.requested):
                yield EntryKind.CONFLICT
            elif acknowledged and not self._markers.changing:
                # A change of several steps says itself, at its end, whether it is done.
                yield EntryKind.DONE

        def entries(marker: Marker, found: ToolOffset | None) -> Iterator[NewEntry]:
            now = {**details, "value": plain_offset(found)}
            for kind in ends(found):
                said = {"request": write.request} if kind is EntryKind.WRITE else now
                yield NewEntry(kind, operation=marker.operation, tool=write.tool, details=said)

        return self.carry_out(
            write.request,
            details,
            send=send,
            read=read,
            tell=lambda found: self._told(write, before, found),
            entries=entries,
        )

    def _told(self, write: ToolWrite, before: ToolOffset | None, found: ToolOffset | None) -> str:
        tool = write.tool
        if self._same(found, write.requested):
            return tr("Reading tool {tool} back shows that it did run.", tool=tool)
        if self._same(found, before):
            return tr("Reading tool {tool} back shows that it did not run.", tool=tool)
        return tr("Tool {tool} reads back as {found}.", tool=tool, found=describe_offset(found))


def _refusal(marker: Marker, error: RejectedError) -> NewEntry:
    tool = marker.details.get("tool")
    return NewEntry(
        EntryKind.REFUSED,
        operation=marker.operation,
        tool=tool if isinstance(tool, int) else None,
        verdict=error.what,
        details={"request": marker.request, "code": error.code},
    )
