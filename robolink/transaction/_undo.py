"""Undoing a change: what the tools held before it, or any value proved earlier, is written back.

An undo is a change like any other (docs/reference/rules.md 6): it expects what the journal proved
last, writes all of its tools or none, and can itself be undone.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass

from robolink.errors import ConfigError, ToolChangedError
from robolink.messages import tr
from robolink.model import (
    Controller,
    EntryKind,
    NewEntry,
    Recorded,
    ToolOffset,
    ToolReceipt,
    new_operation,
    require_engineer,
)
from robolink.timing import local_label
from robolink.transaction._change import change_tools
from robolink.transaction._history import changed_since, last_proof
from robolink.transaction._put_back import Step
from robolink.transaction._undo_history import (
    id_of_change,
    of_change,
    offset_of,
    proof_numbered,
    tool_of,
)
from robolink.transaction._wanted import Wanted
from robolink.ways import Way, way


@dataclass(frozen=True, slots=True)
class UndoPlan:
    """What an undo is to do.

    Attributes:
        steps: The tools to write: what each holds now, and what it is to hold again.
        unchanged: Tools that hold the old value already.
        sentence: What is undone.
        remarks: What else a person should know before agreeing, in sentences.
        details: The same for the journal, plain JSON.
    """

    steps: tuple[Step, ...]
    unchanged: tuple[int, ...]
    sentence: str
    remarks: tuple[str, ...]
    details: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class Undone:
    """What an undo did.

    Attributes:
        change: Its own id in the journal, by which it can be undone; empty when nothing was
            to do.
        receipts: What was written.
    """

    change: str
    receipts: tuple[ToolReceipt, ...]


def plan_undo(
    controller: Controller, *, tool: int | None = None, change: str = "", to: int | None = None
) -> UndoPlan:
    """Find out what an undo would write; changes nothing.

    Args:
        controller: The controller, connected.
        tool: Only this tool; by default all tools of the change.
        change: Id of the change to undo; by default the newest that is done.
        to: Number of an entry whose proved value is to come back, in place of a change.

    Raises:
        ConfigError: Nothing of that kind is on record about this controller.
        ToolChangedError: A tool does not hold what was proved last.

    Example:
        >>> import robolink
        >>> from robolink.transaction import Wanted, change_tools, plan_undo
        >>> with robolink.connect("epson+sim://undo-plan-example") as controller:
        ...     new = robolink.ToolOffset(5, 6, -70)
        ...     receipts = change_tools(controller, [Wanted(2, new, None)])
        ...     plan = plan_undo(controller)
        >>> [(step.tool, step.requested) for step in plan.steps]
        [(2, None)]
    """
    if to is not None:
        return _plan_to(controller, to, tool)
    entries = of_change(controller.outcomes, change, tool)
    # Newest first, so that of several writes of one tool the oldest says what was there before.
    wanted = {tool_of(entry): offset_of(entry, "before") for entry in entries}
    undone = id_of_change(entries[0])
    numbers = ", ".join(str(number) for number in sorted(wanted))
    sentence = tr(
        "undo the change {change} of tool {tool}, made on {at}",
        change=undone[:8],
        tool=numbers,
        at=local_label(entries[0].at),
    )
    details = {"undone_change": undone, "entries": [entry.number for entry in entries]}
    return _plan(controller, wanted, sentence, details, newest=entries)


def undo(
    controller: Controller,
    plan: UndoPlan,
    *,
    then_select: int | None = None,
    tell: Callable[[str], None] = lambda _sentence: None,
) -> Undone:
    """Write the old values: all of them, or none. The same tool stays selected.

    Args:
        controller: The controller, connected.
        plan: What to do.
        then_select: The tool to put in force in place of one that is in force and becomes
            undefined; without it that is refused.
        tell: Told what was put back when it fails on the way.

    Raises:
        NotAllowedError: It takes an engineer; nothing was sent.
        SelectedToolError: The tool in force would become undefined; nothing was sent.
        RobolinkError: As :func:`robolink.transaction.change_tools`.

    Example:
        >>> import robolink
        >>> from robolink import ToolOffset
        >>> from robolink.transaction import Wanted, change_tools, plan_undo, undo
        >>> with robolink.connect("epson+sim://undo-example") as controller:
        ...     _ = change_tools(controller, [Wanted(2, ToolOffset(5, 6, -70), None)])
        ...     _ = undo(controller, plan_undo(controller))
        ...     print(controller.tools.read(2))
        None
    """
    if not plan.steps:
        return Undone("", ())
    outcomes = controller.outcomes
    # Before the decision goes on record.
    controller.require_settled(plan.sentence)
    change = outcomes.change = new_operation()
    try:
        require_engineer(outcomes, tr("undo a change of a tool"))
        outcomes.append(
            NewEntry(EntryKind.DECISION, verdict=plan.sentence, details=dict(plan.details))
        )
        wanted = [
            Wanted(step.tool, step.requested, step.before, then_select=then_select)
            for step in plan.steps
        ]
        with ExitStack() as accepted:
            for step in plan.steps:
                # What was proved there before is no slip of the fingers; the figure goes on record.
                jump = controller.change_guard.beyond(step.before, step.requested)
                if jump is not None:
                    accepted.enter_context(controller.change_guard.accepting(step.tool, jump))
            return Undone(change, change_tools(controller, wanted, tell=tell))
    finally:
        outcomes.change = ""


def _plan_to(controller: Controller, number: int, tool: int | None) -> UndoPlan:
    entry = proof_numbered(controller.outcomes, number)
    if entry is None:
        raise ConfigError(
            tr(
                "Entry {number} does not say what was read from a tool of this controller.",
                number=number,
            ),
            remedy=tr("{changes} shows entries that do.", changes=way(Way.LIST_CHANGES)),
        )
    proved = tool_of(entry)
    if tool not in (None, proved):
        raise ConfigError(
            tr("Entry {number} is about tool {tool}.", number=number, tool=proved),
            remedy=tr("Name that tool, or leave {tool} out.", tool=way(Way.TOOL)),
        )
    sentence = tr(
        "bring tool {tool} back to what entry {number} of {at} proved",
        tool=proved,
        number=number,
        at=local_label(entry.at),
    )
    details = {"back_to_entry": number}
    return _plan(controller, {proved: offset_of(entry, "value")}, sentence, details)


def _plan(
    controller: Controller,
    wanted: Mapping[int, ToolOffset | None],
    sentence: str,
    details: Mapping[str, object],
    *,
    newest: Collection[Recorded] = (),
) -> UndoPlan:
    same = controller.tools.same
    found = [Step(tool, _expected(controller, tool, old), old) for tool, old in wanted.items()]
    found.sort(key=lambda step: step.tool)
    return UndoPlan(
        steps=tuple(step for step in found if not same(step.before, step.requested)),
        unchanged=tuple(step.tool for step in found if same(step.before, step.requested)),
        sentence=sentence,
        remarks=tuple(_changed_again(controller, newest)),
        details=details,
    )


def _expected(controller: Controller, tool: int, old: ToolOffset | None) -> ToolOffset | None:
    """Read a tool and refuse to go on when somebody else wrote it."""
    now = controller.tools.read(tool)
    changed = changed_since(controller, tool, now)
    if changed is not None and not controller.tools.same(now, old):
        raise ToolChangedError(
            changed.sentence,
            remedy=tr(
                "Nothing was written. Find out who changed it; 'robolink tool set' writes what "
                "you decide on."
            ),
            controller=controller.identity,
        )
    return now


def _changed_again(controller: Controller, newest: Collection[Recorded]) -> Iterator[str]:
    """Yield a sentence for each tool that a later change wrote too."""
    for tool, change in {tool_of(entry): id_of_change(entry) for entry in newest}.items():
        last = last_proof(controller, tool)
        if last is not None and id_of_change(last) != change:
            yield tr(
                "Tool {tool} was changed again later, last on {at}: that is undone as well.",
                tool=tool,
                at=local_label(last.at),
            )
