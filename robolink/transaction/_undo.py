"""Undoes a change: writes back what the tools held before it, or any earlier value.

An undo is a change like any other (docs/reference/rules.md 6): it expects what the journal proved
last, writes all of its tools or none, and can itself be undone. What the record says of a tool,
and of how it was changed, is read here.
"""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field

from robolink.errors import ConfigError, ToolChangedError
from robolink.messages import listed, tr
from robolink.model import (
    PROOFS,
    Controller,
    EntryKind,
    NewEntry,
    OutcomeLog,
    Recorded,
    ToolOffset,
    ToolReceipt,
    new_operation,
    read_offset,
    require_engineer,
)
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import local_label
from robolink.transaction._change import Wanted, change_tools
from robolink.transaction._changed_since import changed_since, last_proof
from robolink.transaction._orders import Describe, Order, finish_order, plain_result
from robolink.transaction._put_back import Step


def earlier_corrections(controller: Controller, tool: int) -> tuple[float, ...]:
    """Return the lengths, mm, of the corrections since the nozzle was mounted, oldest first.

    They are those in the plane: Z is often measured by another method, and a write of
    Z alone is none. A nozzle is known by the id
    that was given for it; without one nothing is known to be the same nozzle, and there is nothing
    to compare with. What was taken back is none.
    """
    nozzle = controller.outcomes.signature.nozzle
    lengths: list[float] = []
    taken_back: set[str] = set()
    if not nozzle:
        return ()
    kinds = (EntryKind.DONE, EntryKind.ROLLED_BACK)
    for entry in controller.outcomes.recorded(tool=tool, kinds=kinds):
        if entry.signature.nozzle != nozzle:
            break
        if entry.kind is EntryKind.ROLLED_BACK:
            taken_back.add(entry.change)
        if entry.change in taken_back:
            continue
        before = read_offset(entry.details.get("before"))
        value = read_offset(entry.details.get("value"))
        if before is None or value is None:
            break
        length_mm = math.hypot(value.x_mm - before.x_mm, value.y_mm - before.y_mm)
        if length_mm or value.z_mm == before.z_mm:  # a write of Z alone did not correct X and Y
            lengths.append(length_mm)
    return tuple(reversed(lengths))


_ENDS = (EntryKind.DONE, EntryKind.ROLLED_BACK)


def id_of_change(entry: Recorded) -> str:
    """Return the id by which a person names what an entry belongs to.

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
    if chosen and not ends:  # a single write, identified by its operation
        ends = [entry for entry in outcomes.recorded(kinds=_ENDS) if id_of_change(entry) == chosen]
    taken_back = any(entry.kind is EntryKind.ROLLED_BACK for entry in ends)
    done = [entry for entry in ends if tool in (None, entry.tool)]
    if not done or taken_back:
        raise ConfigError(
            _nothing_to_undo(chosen, taken_back=taken_back),
            remedy=tr(
                "{changes} shows what can be undone.", changes=remedy_word(RemedyWord.LIST_CHANGES)
            ),
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
        return tr("The change {change} was undone when it was made.", change=change[:8])
    return tr("The change {change} completed nothing for that tool.", change=change[:8])


def proof_numbered(outcomes: OutcomeLog, number: int) -> Recorded | None:
    """Return the entry of that number if it has a value read from a tool."""
    for entry in outcomes.recorded(kinds=PROOFS):
        if entry.number <= number:
            known = entry.number == number and entry.tool is not None and "value" in entry.details
            return entry if known else None
    return None


def tool_of(entry: Recorded) -> int:
    """Return the tool of an entry."""
    if entry.tool is None:
        raise _unreadable(entry)
    return entry.tool


def offset_of(entry: Recorded, name: str) -> ToolOffset | None:
    """Return the offset in an entry, ``None`` for an undefined tool."""
    if name not in entry.details:
        raise _unreadable(entry)
    return read_offset(entry.details[name])


def _unreadable(entry: Recorded) -> ConfigError:
    return ConfigError(
        tr("Entry {number} of the journal cannot be understood.", number=entry.number),
        remedy=tr(
            "'robolink journal verify' checks it; name an earlier value with {to}.",
            to=remedy_word(RemedyWord.EARLIER_VALUE),
        ),
    )


@dataclass(frozen=True, slots=True)
class UndoPlan:
    """The plan of an undo.

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
    details: Mapping[str, object] = field(hash=False)


@dataclass(frozen=True, slots=True)
class Undone:
    """The result of an undo.

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
    # Newest first, so that the oldest of several writes of one tool gives the old value.
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
    order: Order | None = None,
    describe: Describe = plain_result,
) -> Undone:
    """Write the old values: all of them, or none. The same tool stays selected.

    Args:
        controller: The controller, connected.
        plan: What to do.
        then_select: The tool to select in place of one that is in force and becomes
            undefined; without it that is refused.
        tell: Told what was restored when it fails on the way.
        order: The order that this carries out (:func:`robolink.transaction.carrying_out`).
        describe: Makes the result of the order from what was written.

    Raises:
        NotAllowedError: It takes an engineer; nothing was sent.
        SelectedToolError: The selected tool would become undefined; nothing was sent.
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
        if order is not None:
            finish_order(controller, order, describe(()))
        return Undone("", ())
    with controller.procedure(plan.sentence):
        # Checked before the decision is recorded.
        controller.require_settled(plan.sentence)
        outcomes = controller.outcomes
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
                    # A value confirmed earlier is no typing mistake; the size of the jump is
                    # recorded.
                    jump = controller.change_guard.beyond(step.before, step.requested)
                    if jump is not None:
                        accepted.enter_context(controller.change_guard.accepting(step.tool, jump))
                receipts = change_tools(
                    controller,
                    wanted,
                    tell=tell,
                    order=order,
                    describe=describe,
                    select=_gives_way(controller, plan, then_select),
                )
                return Undone(change, receipts)
        finally:
            outcomes.change = ""


def _gives_way(controller: Controller, plan: UndoPlan, then_select: int | None) -> int | None:
    """Return the tool that is selected in place of one that becomes undefined, if one does."""
    cleared = [step.tool for step in plan.steps if step.requested is None]
    if then_select is None or controller.tools.selected() not in cleared:
        return None
    return then_select


def _plan_to(controller: Controller, number: int, tool: int | None) -> UndoPlan:
    entry = proof_numbered(controller.outcomes, number)
    if entry is None:
        raise ConfigError(
            tr(
                "Entry {number} has no value read from a tool of this controller.",
                number=number,
            ),
            remedy=tr(
                "{changes} shows entries that do.", changes=remedy_word(RemedyWord.LIST_CHANGES)
            ),
        )
    proved = tool_of(entry)
    if tool not in (None, proved):
        raise ConfigError(
            tr("Entry {number} is about tool {tool}.", number=number, tool=proved),
            remedy=tr("Name that tool, or leave {tool} out.", tool=remedy_word(RemedyWord.TOOL)),
        )
    sentence = tr(
        "restore tool {tool} to the value confirmed by entry {number} of {at}",
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
    """Read a tool and refuse to continue if somebody else wrote it."""
    now = controller.tools.read(tool)
    changed = changed_since(controller, tool, now)
    if changed is not None and not controller.tools.same(now, old):
        raise ToolChangedError(
            listed(
                tr("Something else has changed tool {tool}:", tool=changed.tool), changed.findings
            ),
            remedy=tr(
                "Nothing was written. Find out who changed it, then use 'robolink tool set'."
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
