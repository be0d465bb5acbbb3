"""Orders: what a line computer may deliver more than once, and is carried out once.

A queue that delivers at least once gives each job an id. That id stands in the journal beside the
change, in the very transaction that keeps it, so that there is no instant at which a value stays
and its order does not count as carried out. It is looked up under the lease, before anything is
moved or sent (docs/commands.md).
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Final

from robolink.errors import ConfigError, ToolChangedError
from robolink.messages import tr
from robolink.model import (
    Controller,
    EntryKind,
    Marker,
    NewEntry,
    OutcomeLog,
    Recorded,
    ToolOffset,
    ToolReceipt,
    describe_offset,
    plain_offset,
    read_for_verdict,
    read_offset,
)
from robolink.transaction._put_back import Step

LONGEST_ORDER: Final = 64
"""Largest number of characters of an order's id."""

Describe = Callable[[Sequence[ToolReceipt]], Mapping[str, object]]
"""Returns the result of a change, plain JSON, for a repeated delivery of the order."""


@dataclass(frozen=True, slots=True)
class DoneOrder:
    """An order that was carried out.

    Attributes:
        change: Id of its change in the journal.
        at: When it was kept, as a label.
        result: What was reported then, plain JSON.
    """

    change: str
    at: str
    result: Mapping[str, object] = field(hash=False)


@dataclass(frozen=True, slots=True)
class Order:
    """An order in progress.

    Attributes:
        id: Its id.
        job: What it is for, plain JSON.
        done: How it ended when it was carried out before; ``None`` when it is to be carried out.
    """

    id: str
    job: Mapping[str, object] = field(hash=False)
    done: DoneOrder | None = None


@dataclass(frozen=True, slots=True)
class OrderedChange:
    """What a change records about its order.

    Attributes:
        order: The order.
        describe: Makes its result from what was written.
    """

    order: Order
    describe: Describe

    def kept(self, receipts: Sequence[ToolReceipt]) -> NewEntry:
        """Return the entry that makes the order count as carried out."""
        tools = {str(receipt.tool): plain_offset(receipt.read_back) for receipt in receipts}
        details = {**self._said(receipts), "tools": tools}
        return NewEntry(EntryKind.ORDER, verdict=tr("order carried out"), details=details)

    def marked(self, steps: Sequence[Step]) -> dict[str, object]:
        """Return what the marker of the change says about the order.

        With it goes the result that will be reported should the change be found complete after a
        crash.
        """
        foreseen = [
            ToolReceipt(step.tool, step.before, step.requested, step.requested) for step in steps
        ]
        return {"ordered": self._said(foreseen)}

    def _said(self, receipts: Sequence[ToolReceipt]) -> dict[str, object]:
        result = dict(self.describe(receipts))
        return {"order": self.order.id, "job": dict(self.order.job), "result": result}


def plain_result(receipts: Sequence[ToolReceipt]) -> dict[str, object]:
    """Return what was written, plain JSON: the default result of an order."""
    return {
        "tools": [
            {
                "tool": receipt.tool,
                "before": plain_offset(receipt.before),
                "requested": plain_offset(receipt.requested),
                "read_back": plain_offset(receipt.read_back),
            }
            for receipt in receipts
        ]
    }


def require_order_id(order: str) -> str:
    """Return the id of an order.

    Raises:
        ConfigError: It is none: 1 to 64 printable ASCII characters.
    """
    if 0 < len(order) <= LONGEST_ORDER and order.isascii() and order.isprintable():
        return order
    raise ConfigError(
        tr("{order} is not the id of an order.", order=repr(order[: LONGEST_ORDER + 1])),
        remedy=tr("Give 1 to {most} printable ASCII characters.", most=LONGEST_ORDER),
    )


@contextmanager
def carrying_out(
    controller: Controller, order: str, job: Mapping[str, object], *, wait_s: float | None = None
) -> Iterator[Order]:
    """Keep the lease, look the order up, and record its id with all that is done for it.

    Where :attr:`Order.done` says that it was carried out before, nothing is to be done; else the
    order goes with the change: :class:`ToolChange`, :func:`change_tools` and
    :class:`robolink.calibration_run.NozzleChange` take it.

    Args:
        controller: The controller, connected.
        order: The id that the line computer gave.
        job: What is ordered, plain JSON. The same order must not come with another job.
        wait_s: How long to wait for other threads and programs, as :class:`ToolChange` does.

    Raises:
        BusyError: Another process is changing this controller.
        ConfigError: The id is none, or the order is not to be carried out again: it was another
            job, or what it did was taken back, or closed on a person's word.
        ToolChangedError: A tool that it wrote holds another value since.
        OutcomeUnknownError: An earlier job is unfinished, perhaps this very order, or what was
            in force before it and is not put back.

    Example:
        >>> import robolink
        >>> from robolink import ToolOffset
        >>> from robolink.transaction import Wanted, carrying_out, change_tools
        >>> wanted = [Wanted(2, ToolOffset(5, 6, -70), None)]
        >>> with robolink.connect("epson+sim://order-example") as controller:
        ...     for delivery in (1, 2):
        ...         with carrying_out(controller, "J-1007", {"tool": 2}) as order:
        ...             if order.done is None:
        ...                 _ = change_tools(controller, wanted, order=order)
        ...             print(delivery, order.done is not None)
        1 False
        2 True
    """
    require_order_id(order)
    outcomes, purpose = controller.outcomes, tr("order {order}", order=order)
    plain = json.loads(json.dumps(job))
    with (
        controller.procedure(purpose, wait_s=wait_s),
        outcomes.hold(purpose),
        controller.signs_of_life(),
    ):
        # A caller told that the order is done starts production: with the selected tool, at the
        # speed and in the power mode that a killed run may not have restored.
        controller.require_settled(purpose)
        entry = _found(outcomes, order)
        if entry is not None:
            yield Order(order, plain, _done(controller, order, plain, entry))
            return
        outcomes.order = order
        try:
            yield Order(order, plain)
        finally:
            outcomes.order = ""


def order_of(marker: Marker) -> str:
    """Return the order of a change, empty for none."""
    ordered = marker.details.get("ordered")
    return str(ordered["order"]) if isinstance(ordered, dict) and "order" in ordered else ""


def kept_later(marker: Marker, now: Mapping[int, ToolOffset | None]) -> tuple[NewEntry, ...]:
    """Return the entry that makes an order count as carried out when its change is found complete.

    Args:
        marker: The marker of the change.
        now: What its tools hold.
    """
    tools = {str(tool): plain_offset(offset) for tool, offset in now.items()}
    return _ended(marker, tr("found complete later"), tools=tools)


def forgotten(marker: Marker) -> tuple[NewEntry, ...]:
    """Return the entry that ends an order whose change nobody looked at."""
    return _ended(marker, tr("dropped without a check"), forgotten=True)


def _ended(marker: Marker, verdict: str, **more: object) -> tuple[NewEntry, ...]:
    ordered = marker.details.get("ordered")
    if not isinstance(ordered, dict) or not order_of(marker):
        return ()
    details = {**ordered, **more}
    return (
        NewEntry(EntryKind.ORDER, operation=marker.operation, verdict=verdict, details=details),
    )


def _found(outcomes: OutcomeLog, order: str) -> Recorded | None:
    return next(
        (
            entry
            for entry in outcomes.recorded(kinds=(EntryKind.ORDER,))
            if entry.details.get("order") == order
        ),
        None,
    )


def _done(
    controller: Controller, order: str, job: Mapping[str, object], entry: Recorded
) -> DoneOrder:
    """Return how an order ended, if that is still so; reads only.

    Raises:
        ConfigError, ToolChangedError: See :func:`carrying_out`.
    """
    if entry.details.get("job") != job:
        raise _refused(tr("Order {order} was given before, for another job.", order=order))
    if entry.details.get("forgotten"):
        raise _refused(
            tr("Order {order} was closed without checking how it ended.", order=order),
        )
    if _taken_back(controller.outcomes, entry):
        raise _refused(tr("Order {order} was undone.", order=order))
    tools, result = entry.details.get("tools"), entry.details.get("result")
    if not isinstance(tools, dict) or not isinstance(result, dict):
        raise _refused(
            tr("Entry {number} of the journal cannot be understood.", number=entry.number)
        )
    for number, value in tools.items():
        tool, left = int(number), read_offset(value)
        now = read_for_verdict(controller.tools, tool, (left,))
        if not controller.tools.same(now, left):
            raise ToolChangedError(
                tr(
                    "Order {order} left tool {tool} with {left}; it holds {now} now.",
                    order=order,
                    tool=tool,
                    left=describe_offset(left),
                    now=describe_offset(now),
                ),
                remedy=_anew(),
                controller=controller.identity,
            )
    return DoneOrder(entry.change, entry.at, result)


def _taken_back(outcomes: OutcomeLog, kept: Recorded) -> bool:
    """Whether an undo of the change has written anything."""
    for entry in outcomes.recorded(kinds=(EntryKind.DECISION,)):
        if entry.number < kept.number:
            break
        if entry.details.get("undone_change") == kept.change and any(
            outcomes.recorded(change=entry.change, kinds=(EntryKind.DONE,))
        ):
            return True
    return False


def _refused(what: str) -> ConfigError:
    return ConfigError(what, remedy=_anew())


def _anew() -> str:
    return tr("Nothing was moved or written. Give a new order if the work must be done again.")
