"""One tool change: written as a whole, kept as a whole, or restored as a whole.

The order is that of docs/reference/rules.md 6: look at the lease, read the old values, compare them
with what is expected, store the intent durably (which takes the lease), write, read back. A change
of one tool that nothing is to verify is done then. Any other is open, in the journal too,
until :meth:`ToolChange.keep`; whatever ends it earlier puts the old values back, once.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Self

from robolink.controller_outcome import note_outcome
from robolink.errors import (
    BusyError,
    ConfigError,
    LeaseLostError,
    NotAllowedError,
    NotReadyError,
    OutcomeUnknownError,
    ReadBackError,
    RemoteProtocolError,
    RobolinkError,
    ToolError,
    TransportError,
)
from robolink.messages import tr
from robolink.model import (
    ANY,
    Account,
    Controller,
    EntryKind,
    Expected,
    Marker,
    MarkerKind,
    NewEntry,
    ToolOffset,
    ToolReceipt,
    new_operation,
    not_of_class,
    plain_offset,
    require_offset,
    tool_changed,
)
from robolink.transaction._orders import Describe, Order, OrderedChange, plain_result
from robolink.transaction._put_back import PutBack, Step, left_unverified, put_back


@dataclass(frozen=True, slots=True)
class Wanted:
    """The intended value of one tool.

    Attributes:
        tool: Its number.
        offset: The new value; ``None`` clears it.
        expected: What the caller believes it holds now.
        details: More for the journal, plain JSON.
        then_select: The tool to select before this one is cleared, should this one be in
            force; without it that is refused.

    Raises:
        ConfigError: The offset or what is expected is not a ``ToolOffset``.
    """

    tool: int
    offset: ToolOffset | None
    expected: Expected
    details: Mapping[str, object] | None = field(default=None, hash=False)
    then_select: int | None = None

    def __post_init__(self) -> None:
        if self.offset is not None:
            require_offset("offset", self.offset)
        if self.expected is not None and self.expected is not ANY:
            require_offset("expected", self.expected)


_OUT_OF_REACH = (OutcomeUnknownError, TransportError, RemoteProtocolError, LeaseLostError)
"""After these errors nothing can be undone here: the link or the right to write is lost."""


class ToolChange:
    """A change in progress; a context manager that restores what was not kept.

    Attributes:
        kept: Whether the new values stay.

    Args:
        controller: The controller, connected.
        wanted: The tools to change, each once, in the order in which they are written.
        verify: Whether something is to be verified between the writes and :meth:`keep`.
        marked: More for its durable marker, plain JSON.
        tell: Told, in sentences, what was restored.
        order: The order that it carries out; with the values it is kept that this is done.
        describe: Makes the result of the order from what was written.
        select: The tool to select once all are written; ``None`` to leave that as it is.
        wait_s: How long the block, and then :meth:`write`, waits for other threads and programs
            that are at work, in seconds, 0 not at all; ``None`` for the controller's
            ``patience.wait_s``.

    Example:
        >>> from robolink import ToolOffset, connect
        >>> from robolink.transaction import ToolChange, Wanted
        >>> controller = connect("epson+sim://change-example")
        >>> wanted = Wanted(1, ToolOffset(12.3, -3.7, -20), controller.tools.read(1))
        >>> with ToolChange(controller, [wanted], verify=True) as change:
        ...     receipts = change.write()
        ...     change.keep("the first part was good")
    """

    def __init__(
        self,
        controller: Controller,
        wanted: Sequence[Wanted],
        *,
        verify: bool = False,
        marked: Mapping[str, object] | None = None,
        tell: Callable[[str], None] = lambda _sentence: None,
        order: Order | None = None,
        describe: Describe = plain_result,
        select: int | None = None,
        wait_s: float | None = None,
    ) -> None:
        self._controller = controller
        self._wanted = tuple(wanted)
        for number, one in enumerate(self._wanted):
            if not isinstance(one, Wanted):
                raise not_of_class(f"wanted[{number}]", one, Wanted)
        # An order counts as carried out in the transaction that keeps the value, which requires a
        # change that is open until then.
        self._several_steps = verify or len(self._wanted) != 1 or order is not None
        self._ordered = None if order is None else OrderedChange(order, describe, select)
        self._select = select
        self._verify = verify
        self._marked = marked or {}
        self._tell = tell
        self._own_id = False
        self._marker: Marker | None = None
        self._begun: list[Step] = []
        self._receipts: tuple[ToolReceipt, ...] = ()
        self._spoiled: int | None = None
        self._selected: int | None = None
        self._account: Account | None = None
        self._wait_s = wait_s
        self._signs_of_life = ExitStack()
        self._procedure = ExitStack()
        self.kept = False

    def __enter__(self) -> Self:
        controller = self._controller
        with ExitStack() as entered:
            # Id, marker and roll-back belong to one change at a time.
            entered.enter_context(controller.procedure(self.request, wait_s=self._wait_s))
            self._account = controller.ledger.open()
            if not controller.outcomes.change:
                controller.outcomes.change = new_operation()
                self._own_id = True
            self._procedure = entered.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if not self.kept and (self._begun or self._marker):
                with self._controller.uninterrupted():
                    self._take_back(error)
        finally:
            self._signs_of_life.close()
            if self._own_id:
                self._controller.outcomes.change = ""
            with self._procedure:
                self._settle_account(error)

    def write(self) -> tuple[ToolReceipt, ...]:
        """Write everything and read it back.

        Raises:
            ToolChangedError: A tool does not hold what was expected; nothing was written.
            NotAllowedError: A tip would be taken farther than the cell allows, which nobody has
                accepted; nothing was written.
            SelectedToolError: A selected tool is to be cleared, and none is named to be selected
                in its place; nothing was written.
            OutcomeUnknownError: An earlier job is unfinished, or a write was not answered.
            ReadBackError: Another value came back; the old ones are restored.
            ConfigError: The intent cannot be stored; nothing was written.
            BusyError: Another process has the controller.
            StoppedError: A stop came; what was written is restored.
        """
        with self._controller.patience.within(self._wait_s):
            self._controller.latch.require_open(self.request)
            # A value already stored needs no write that could be refused, and is reported as done.
            self._controller.require_settled(self.request)
            steps = self._believed() or self._compare()
            for doubt in self._controller.tools.doubts([step.tool for step in steps]):
                self._tell(doubt)
            self._selected = self._selected_before(steps)
            if self._several_steps and any(self._differs(step) for step in steps):
                for step in steps:  # all reasons to refuse a write, before the first one
                    self._controller.change_guard.require(step.tool, step.before, step.requested)
                tools = {
                    str(step.tool): {
                        "before": plain_offset(step.before),
                        "requested": plain_offset(step.requested),
                    }
                    for step in steps
                }
                details = {
                    "tools": tools,
                    "verify": self._verify,
                    "change": self._controller.outcomes.change,
                    **(self._ordered.marked(steps) if self._ordered else {}),
                    **self._marked,
                }
                if self._selected is not None:
                    details["selected"] = self._selected
                with self._controller.uninterrupted():
                    self._marker = self._controller.begin(MarkerKind.CHANGE, self.request, details)
                    self._signs_of_life.enter_context(self._controller.signs_of_life())
            for wanted, step in zip(self._wanted, steps, strict=True):
                self._receipts += (self._write(wanted, step),)
            if self._select is not None and self._controller.tools.selected() != self._select:
                self._controller.tools.select(self._select)
            return self._receipts

    def keep(self, verdict: str = "") -> None:
        """Record that the new values stay.

        Args:
            verdict: Why, in words.

        Raises:
            ConfigError: It cannot be recorded; the change stays open for ``recover``.
            StoppedError: A stop came before; what was written is restored.
        """
        self._controller.latch.require_open(self.request)
        if self._marker is None:
            # Each write recorded its own end; this entry records what the values are based on.
            told = any(wanted.details for wanted in self._wanted)
            ends = self._ends(EntryKind.DECISION, "", verdict) if told else []
            if self._ordered:
                ends.append(self._ordered.kept(self._receipts))
            if ends:
                self._controller.outcomes.append(*ends)
            self.kept = True
            return
        entries = self._ends(EntryKind.DONE, self._marker.operation, verdict)
        if self._ordered:
            entries.append(self._ordered.kept(self._receipts))
        with self._controller.uninterrupted():
            self._controller.finish(self._marker, *entries)
            self.kept = True

    def _ends(self, kind: EntryKind, operation: str, verdict: str) -> list[NewEntry]:
        return [
            NewEntry(
                kind,
                operation=operation,
                tool=receipt.tool,
                verdict=verdict,
                details={
                    **(wanted.details or {}),
                    "before": plain_offset(receipt.before),
                    "requested": plain_offset(receipt.requested),
                    "value": plain_offset(receipt.read_back),
                },
            )
            for wanted, receipt in zip(self._wanted, self._receipts, strict=True)
        ]

    @property
    def request(self) -> str:
        """What is done, for display."""
        if not self._wanted:
            return tr("selecting tool {tool}", tool=self._select)
        numbers = ", ".join(str(wanted.tool) for wanted in self._wanted)
        return tr("change of tool {numbers}", numbers=numbers)

    def _believed(self) -> list[Step]:
        """Return the step of a single write that nothing verifies, without reading anything.

        The write itself reads the tool, just before it, and refuses another value than is
        expected: nothing can have been written yet that would have to be taken back. Of several
        tools all are read before the first is written, and each again before its own write, which
        the writes of the others keep waiting. A clear, or a tool that gets its first definition,
        may change what is selected, so those are looked at beforehand too.
        """
        if self._several_steps:
            return []
        (wanted,) = self._wanted
        if wanted.offset is None or not isinstance(wanted.expected, ToolOffset):
            return []
        return [Step(wanted.tool, wanted.expected, wanted.offset, was_read=False)]

    def _compare(self) -> list[Step]:
        """Read every tool before the first is written."""
        tools = self._controller.tools
        self._controller.outcomes.look()
        steps = []
        for wanted in self._wanted:
            tools.require_writable(wanted.tool)
            before = tools.read(wanted.tool)
            step = Step(wanted.tool, before, wanted.offset)
            steps.append(step)
            expected = wanted.expected
            if expected is ANY or tools.same(before, expected) or not self._differs(step):
                if wanted.offset is None:
                    # Raises the errors of a clear before the first of several tools is written.
                    tools.preview_clear(wanted.tool, then_select=wanted.then_select)
                continue
            identity = self._controller.identity
            raise tool_changed(wanted.tool, before, expected, controller=identity)
        return steps

    def _selected_before(self, steps: list[Step]) -> int | None:
        """Return the selected tool if this change, or restoring it, may need to know it."""
        defines = any(step.before is None and step.requested is not None for step in steps)
        return self._controller.tools.selected() if self._selects or defines else None

    @property
    def _selects(self) -> bool:
        """Whether it may select another tool than was selected before."""
        clears = any(wanted.then_select is not None for wanted in self._wanted)
        return clears or self._select is not None

    def _differs(self, step: Step) -> bool:
        return not self._controller.tools.same(step.before, step.requested)

    def _write(self, wanted: Wanted, step: Step) -> ToolReceipt:
        tools = self._controller.tools
        # Before the write: whatever interrupts it, the step is checked again.
        self._begun.append(step)
        expected: Expected = ANY if wanted.expected is ANY else step.before
        try:
            if wanted.offset is None:
                return tools.clear(wanted.tool, expected=expected, then_select=wanted.then_select)
            return tools.write(wanted.tool, wanted.offset, expected=expected)
        except ReadBackError:
            self._spoiled = wanted.tool
            raise
        except (NotReadyError, BusyError, NotAllowedError, ToolError):
            self._begun.pop()  # these four errors mean that nothing was sent
            raise

    def _take_back(self, error: BaseException | None) -> None:
        if isinstance(error, _OUT_OF_REACH):
            self._leave_open(error)
            return
        begun = list(self._proved_begun())
        done = put_back(self._controller, begun, spoiled=self._spoiled, selected=self._selected)
        for result in done:
            self._tell(result.sentence)
        self._select_again()
        refusal = next((result.error for result in done if result.error is not None), None)
        try:
            self._record(done)
        except LeaseLostError as lost:
            refusal = refusal or lost
        if isinstance(error, RobolinkError):
            for result in done:
                error.say_what_stands(result.sentence)
        elif refusal is not None and (error is None or isinstance(error, Exception)):
            # To the caller that leaves the block, the old values are back.
            for result in done:
                if result.error is None:
                    refusal.say_what_stands(result.sentence)
            raise refusal from error

    def _proved_begun(self) -> Iterator[Step]:
        """Return what was started, with the values read before each write, not the expected."""
        account = self._account
        assert account is not None  # noqa: S101 - __enter__ opened it
        for step in self._begun:
            if step.tool in account.before:
                yield replace(step, before=account.before[step.tool])
            elif step.was_read:
                yield step

    def _select_again(self) -> None:
        """Select the tool again that this change selected another one for."""
        if not self._selects:
            return
        tools, before = self._controller.tools, self._selected
        try:
            if before is not None and tools.selected() != before:
                with self._controller.latch.restoring():
                    tools.select(before)
                self._tell(tr("Tool {tool} is selected again.", tool=before))
        except RobolinkError as error:
            self._tell(
                tr("Tool {tool} could NOT be selected again: {error}", tool=before, error=error)
            )

    def _settle_account(self, error: BaseException | None) -> None:
        """Add to ``error`` what stands, and which tool is selected."""
        ledger, account = self._controller.ledger, self._account
        assert account is not None  # noqa: S101 - __enter__ opened it
        try:
            if error is not None:
                # A link that is gone has already reported what it knew.
                with suppress(RobolinkError):
                    self._controller.tools.selected()
        finally:
            ledger.close(account, kept=self.kept)
            if error is not None:
                note_outcome(error, ledger.outcome(account))

    def _leave_open(self, error: RobolinkError) -> None:
        """Report what stands in the journal for ``recover``; nothing if no write was sent."""
        tools = self._controller.ledger.outcome(self._account).tools
        stand = [number for number, tool in tools.items() if tool.differs or not tool.known]
        if not stand:
            return
        sentence = left_unverified(stand, marked=self._marker is not None)
        self._tell(sentence)
        error.say_what_stands(sentence)

    def _record(self, done: Sequence[PutBack]) -> None:
        entries = [result.entry for result in done]
        # The error being raised matters more than a failure to record; what is not recorded stays
        # open.
        with suppress(ConfigError):
            for result in done:
                self._close_writes(result)
            if self._marker is not None and all(result.restored for result in done):
                self._controller.finish(self._marker, *entries)
            else:
                self._controller.outcomes.append(*entries)

    def _close_writes(self, result: PutBack) -> None:
        """Remove the markers of writes whose value is known to be gone again.

        They stand open where a fault of the controller, or of the journal, came between write
        and record.
        """
        if result.restored:
            for marker in self._controller.ledger.open_writes(result.tool):
                entry = replace(result.entry, operation=marker.operation)
                self._controller.finish(marker, entry)


def change_tools(
    controller: Controller,
    wanted: Sequence[Wanted],
    *,
    tell: Callable[[str], None] = lambda _sentence: None,
    order: Order | None = None,
    describe: Describe = plain_result,
    select: int | None = None,
    wait_s: float | None = None,
) -> tuple[ToolReceipt, ...]:
    """Write tools without a turn test: all of them, or none.

    Args:
        controller: The controller, connected.
        wanted: The tools to change.
        tell: Told what was restored.
        order: The order that this carries out (:func:`robolink.transaction.carrying_out`).
        describe: Makes the result of the order from what was written.
        select: The tool to select once all are written; ``None`` to leave that as it is.
        wait_s: As for :class:`ToolChange`.

    Raises:
        RobolinkError: As :meth:`ToolChange.write`; the old values are back, or the error says
            that they are not.

    Example:
        >>> from robolink import ToolOffset, connect
        >>> from robolink.transaction import Wanted, change_tools
        >>> with connect("epson+sim://tools-example") as controller:
        ...     receipts = change_tools(controller, [Wanted(2, ToolOffset(5, 6, -70), None)])
        ...     print(controller.tools.read(2).x_mm)
        5.0
    """
    change = ToolChange(
        controller,
        wanted,
        tell=tell,
        order=order,
        describe=describe,
        select=select,
        wait_s=wait_s,
    )
    with controller.latch.watching(change.request), change:
        receipts = change.write()
        change.keep()
    return receipts
