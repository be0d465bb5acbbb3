"""The checks that write or move, on a controller in service: everything is restored.

The checks connect anew, stop and are interrupted on purpose, and a process may be killed among
them. So before the first of them a durable change and a durable selection stand in the record of
the controller, as those of any change of a tool and of any procedure (docs/reference/rules.md 4
and 6); after the last one both are settled by reading, and put back where that is needed. Whatever
ends the process in between, ``robolink recover`` finds the two and does the same.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import reduce
from typing import Final, Protocol

from robolink.controller_outcome import ControllerOutcome, note_outcome
from robolink.errors import (
    ConfigError,
    LeaseHeldError,
    LoginUnansweredError,
    OutcomeUnknownError,
    RobolinkError,
)
from robolink.interrupts import InterruptGate
from robolink.messages import listed, tr
from robolink.model import (
    Controller,
    EntryKind,
    Ledger,
    Marker,
    MarkerKind,
    NewEntry,
    ToolOffset,
    new_operation,
    plain_offset,
)
from robolink.testing.subject import another_offset
from robolink.timing import Deadline, SystemClock

_REST_S: Final = 10.0
"""Longest time for a step, in s: 5 mm at 10 mm/s end well before."""

_LOOK_S: Final = 0.05

_AGAIN_S: Final = 0.5

_STOP_S: Final = 4.0
"""Longest time for a stop, in s: it logs in, stops and logs out within a second or two."""

_SILENT_S: Final = 12.0
"""Silence in s: after 10 s without a sign, a PLC releases its owner (docs/reference/mailbox.md,
"Owners")."""


class Connect(Protocol):
    """Connects to the controller, with its own record."""

    def __call__(self, *, leaves: bool) -> AbstractContextManager[Controller]:
        """Connect for a block that leaves begun what a later one settles, or for that one."""


@dataclass(frozen=True, slots=True)
class _Kept:
    """What is restored.

    Attributes:
        change: Marker of the tool that is written; ``None`` where none is.
        selection: Marker of tool, power and speed in force; ``None`` where the kind tells of none.
        before: What the tool holds.
        selected: The selected tool.
    """

    change: Marker | None
    selection: Marker | None
    before: ToolOffset | None
    selected: int | None


@contextmanager
def kept_on_site(
    connect: Connect,
    reason: str,
    *,
    tool: int | None,
    agree: Callable[[Controller], None],
    trials: Sequence[Ledger] = (),
) -> Iterator[None]:
    """Surround checks by a record of the present state, and restore that at their end.

    From the moment at which it stands on record until it is back, Ctrl-C ends the block alone.
    Whatever leaves the block says what stands then, and not what a check had just done.

    Args:
        connect: Connects to the controller, with its own record; once before the block and once
            after it. Nobody else may be connected in between but the block itself.
        reason: What is done, as a person may read it in the record.
        tool: The tool that the checks write; ``None`` where they write none.
        agree: Asks the person, while the controller is connected and nothing is begun.
        trials: The ledgers of the connections of the block in their order, which grow with them.

    Raises:
        ConfigError: The tool is the selected one, or is not there.
        OutcomeUnknownError: An earlier job is unfinished; or it could not be restored, and
            stays open for ``recover``.

    Example:
        >>> from robolink import ANY, ToolOffset, connect
        >>> from robolink.journal import memory_journal
        >>> from robolink.testing import kept_on_site
        >>> def reach(*, leaves=False):
        ...     return connect("epson+sim://site-example")
        >>> own = memory_journal("a trial").log("a trial")  # what is kept blocks every other write
        >>> with kept_on_site(reach, "a trial of tool 2", tool=2, agree=lambda controller: None):
        ...     with connect("epson+sim://site-example", outcomes=own) as controller:
        ...         receipt = controller.tools.write(2, ToolOffset(5, 6, -70), expected=ANY)
        >>> with reach() as controller:
        ...     print(controller.tools.read(2))
        None
    """
    kept: _Kept | None = None
    back = False
    ledgers: list[Ledger] = []
    gate = InterruptGate()
    gate.open()
    try:
        try:
            with ExitStack() as held, connect(leaves=True) as controller:
                controller.require_settled(reason)
                if tool is not None:
                    _require_spare(controller, tool)
                agree(controller)
                held.enter_context(gate)  # once begun, it will be restored
                kept = _put_on_record(controller, reason, tool)
            yield
        finally:
            if kept is not None:
                with gate:
                    ledgers.extend(trials)
                    _put_back(connect, kept, tool, ledgers)
                    back = True
    except BaseException as error:
        if kept is None:
            raise
        told = _without_doubt(error) if back else error
        stands = reduce(
            ControllerOutcome.followed_by,
            (ledger.outcome() for ledger in ledgers),
            ControllerOutcome(),
        )
        if kept.selected is not None:
            stands = replace(stands, selected_before=kept.selected)
        stands = replace(stands, settled=False, left_open=True)
        note_outcome(told, stands.put_back() if back else stands)
        if told is error:
            raise
        raise told from None
    finally:
        gate.close()


def _without_doubt(error: BaseException) -> BaseException:
    """Return the cause of an unknown outcome, once it has been read and nothing is left of it."""
    caused = error.__cause__ if isinstance(error, OutcomeUnknownError) else None
    return caused if isinstance(caused, RobolinkError) else error


def _require_spare(controller: Controller, tool: int) -> None:
    controller.tools.require_writable(tool)
    if controller.tools.selected() == tool:
        raise ConfigError(
            tr("Tool {tool} is selected: the checks would overwrite it.", tool=tool),
            remedy=tr("Name a tool that no program uses."),
        )


def _put_on_record(controller: Controller, reason: str, tool: int | None) -> _Kept:
    # The kind of controller decides what is restored besides the selected tool, and reports it.
    with controller.preserved(reason):
        found = [it for it in controller.outcomes.open_markers() if it.kind is MarkerKind.SELECTION]
        before = None if tool is None else controller.tools.read(tool)
        selected = controller.tools.selected()
    change = selection = None
    with controller.uninterrupted():
        if tool is not None:
            details: dict[str, object] = {
                "tools": {
                    str(tool): {
                        "before": plain_offset(before),
                        "requested": plain_offset(another_offset(before)),
                    }
                },
                "verify": True,
                "change": new_operation(),
            }
            if selected is not None:
                details["selected"] = selected
            change = controller.begin(MarkerKind.CHANGE, reason, details)
        if found:
            selection = controller.begin(MarkerKind.SELECTION, reason, found[0].details)
    return _Kept(change, selection, before, selected)


def _put_back(connect: Connect, kept: _Kept, tool: int | None, ledgers: list[Ledger]) -> None:
    """Restore the recorded state; the ledger of that joins those of the checks.

    Raises:
        OutcomeUnknownError: It could not be, and stays open for ``recover``.
    """
    moving = any(ledger.outcome().moving for ledger in ledgers)
    try:
        with _reached_again(connect) as controller, controller.uninterrupted():
            ledgers.append(controller.ledger)
            controller.release_stop()
            if moving:
                _await_rest(controller)
            if kept.change is not None and tool is not None:
                _restore_tool(controller, kept, tool)
            if kept.selection is not None:
                finding = controller.resolver.examine(kept.selection)
                _once_free(controller, lambda: controller.resolver.settle(finding))
    except RobolinkError as error:
        raise OutcomeUnknownError(
            listed(tr("The checks could not restore everything:"), [error.what]),
            remedy=tr("Do not start the cell. Next: 'robolink recover'."),
            controller=error.controller,
        ) from error


@contextmanager
def _reached_again(connect: Connect) -> Iterator[Controller]:
    """Connect, although whoever stopped the checks may still have the only login."""
    deadline = Deadline.after(SystemClock(), _STOP_S)
    with ExitStack() as stack:
        while True:
            try:
                controller = stack.enter_context(connect(leaves=False))
                break
            except LoginUnansweredError:
                if deadline.expired:
                    raise
                SystemClock().sleep(_AGAIN_S)
        yield controller


def _once_free(controller: Controller, act: Callable[[], object]) -> None:
    """Do what a PLC refuses while it still treats a check, whose link was lost, as its owner.

    Raises:
        LeaseHeldError: Somebody else owns it.
    """
    deadline = Deadline.after(controller.clock, _SILENT_S)
    while True:
        try:
            act()
            return
        except LeaseHeldError:
            if deadline.expired:
                raise
            controller.clock.sleep(_AGAIN_S)


def _await_rest(controller: Controller) -> None:
    """Wait for the end of a movement whose connection was lost: nobody else has waited for it.

    Raises:
        OutcomeUnknownError: It did not come.
    """
    deadline = Deadline.after(controller.clock, _REST_S)
    while controller.status().running:
        if deadline.expired:
            raise OutcomeUnknownError(
                tr("The robot still moves."),
                remedy=tr("Press the emergency stop if the robot still moves."),
                controller=controller.identity,
            )
        controller.clock.sleep(_LOOK_S)


def _restore_tool(controller: Controller, kept: _Kept, tool: int) -> None:
    """Restore the tool's value; a check may have left any value of its own there."""
    marker = kept.change
    assert marker is not None  # noqa: S101 - the caller checked it
    tools = controller.tools
    mine = controller.begin(marker.kind, marker.request, marker.details, operation=marker.operation)
    now = tools.read(tool)
    written = not tools.same(now, kept.before)
    before = kept.before
    # A roll-back of this change is part of the restoring.
    with controller.latch.putting_back(tool):
        if written and before is None:
            selected = kept.selected or 0
            _once_free(controller, lambda: tools.clear(tool, expected=now, then_select=selected))
        elif written and before is not None:
            _once_free(controller, lambda: tools.write(tool, before, expected=now))
    controller.finish(
        mine,
        NewEntry(
            EntryKind.ROLLED_BACK if written else EntryKind.NOT_APPLIED,
            operation=mine.operation,
            tool=tool,
            verdict=tr("checked against the contract; its earlier value is restored"),
            details={**mine.details, "value": plain_offset(kept.before)},
        ),
    )
