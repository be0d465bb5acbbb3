"""Orders: what a line computer may deliver more than once, and is carried out once.

A queue that delivers at least once gives each job an id. That id stands in the journal beside the
change, in the very transaction that keeps it, so that there is no instant at which a value stays
and its order does not count as carried out. It is looked up under the lease, before anything is
moved or sent (docs/commands.md). An order that ended otherwise, because a person, a limit or the
controller said no, stands there too: delivering it again is nobody's decision to try again.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError, RobolinkError, ToolChangedError
from robolink.files.named import read_named
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
from robolink.transaction._order_ends import anew, as_before, end_of, only_the_moment
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
        selects: The tool that it leaves selected; ``None`` where it leaves that as it is.
    """

    order: Order
    describe: Describe
    selects: int | None = None

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
        said: dict[str, object] = {
            "order": self.order.id,
            "job": dict(self.order.job),
            "result": result,
        }
        return said if self.selects is None else {**said, "selects": self.selects}


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
    controller: Controller,
    order: str,
    job: Mapping[str, object],
    *,
    wait_s: float | None = None,
    ends: Callable[[BaseException], bool] = lambda _error: True,
) -> Iterator[Order]:
    """Keep the lease, look the order up, and record its id with all that is done for it.

    Where :attr:`Order.done` says that it was carried out before, nothing is to be done; else the
    order goes with the change: :class:`ToolChange`, :func:`change_tools`, :func:`undo` and
    :class:`robolink.calibration_run.NozzleChange` take it, and :func:`finish_order` what writes
    no tool. If the block raises before that, how it ended is on record, and the next delivery
    raises the same kind of error. Not so where only the moment was wrong: the controller was not
    reached or was busy, the journal could not be used, or an outcome is unknown.

    Args:
        controller: The controller, connected.
        order: The id that the line computer gave.
        job: What is ordered, plain JSON. The same order must not come with another job.
        wait_s: How long to wait for other threads and programs, as :class:`ToolChange` does.
        ends: Whether what ended the block ends the order, too. It does not, and is not on record,
            where nothing was begun by then, as by a no to the question whether to begin, or where a
            person decides about each further delivery of an order that met a defect.

    Raises:
        BusyError: Another process is changing this controller, or has it and is silent.
        ConfigError: The id is none, or the order is not to be carried out again: it was another
            job, or what it did was taken back, or closed on a person's word, or the file that it
            wrote is gone or changed.
        RobolinkError: It ended before without a kept change, with an error of this kind.
        ToolChangedError: A tool that it wrote, or the selected one, is another since.
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
    outcomes.refuse_holder(silent=True)  # what it left is for a person to judge, not for a queue
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
        except (Exception, KeyboardInterrupt) as error:
            if ends(error):
                _record_end(controller, order, plain, error)
            raise
        finally:
            outcomes.order = ""


def finish_order(
    controller: Controller,
    order: Order,
    result: Mapping[str, object],
    *,
    files: Mapping[Path, bytes] | None = None,
) -> None:
    """Record that an order is carried out which writes no tool.

    Args:
        controller: The controller, inside :func:`carrying_out`.
        order: The order.
        result: What is reported when it is delivered again, plain JSON.
        files: What it leaves in which files. Call this before they are written: a file without
            its order would be in the way of a second delivery.

    Raises:
        ConfigError: It cannot be recorded.

    Example:
        >>> from pathlib import Path
        >>> import robolink
        >>> from robolink.transaction import carrying_out, finish_order
        >>> note = Path("note.txt")
        >>> with robolink.connect("epson+sim://finish-example") as controller:
        ...     for delivery in (1, 2):
        ...         with carrying_out(controller, "J-1008", {"note": "tools"}) as order:
        ...             if order.done is None:
        ...                 finish_order(controller, order, {}, files={note: b"seen"})
        ...                 _ = note.write_bytes(b"seen")
        ...             print(delivery, order.done is not None)
        1 False
        2 True
    """
    kept = OrderedChange(order, lambda _none: result).kept(())
    if files:
        digests = {str(path.absolute()): _digest(data) for path, data in files.items()}
        kept = NewEntry(kept.kind, verdict=kept.verdict, details={**kept.details, "files": digests})
    controller.outcomes.append(kept)


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
    done = _recorded(controller.outcomes, order, job, entry)
    tools = entry.details["tools"]
    assert isinstance(tools, dict)  # noqa: S101 - just looked at
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
                remedy=anew(),
                controller=controller.identity,
            )
    _require_selected(controller, order, entry)
    _require_files(order, entry)
    return done


def order_on_record(
    outcomes: OutcomeLog, order: str, job: Mapping[str, object]
) -> DoneOrder | None:
    """Return how an order was carried out, by the record alone; ``None`` where it has no end there.

    The controller is not asked: what it holds now may be another value.

    Args:
        outcomes: The record of its controller.
        order: Its id.
        job: What was ordered, plain JSON.

    Example:
        >>> import robolink
        >>> from robolink.transaction import carrying_out, finish_order, order_on_record
        >>> with robolink.connect("epson+sim://on-record-example") as controller:
        ...     with carrying_out(controller, "J-1009", {"note": 1}) as order:
        ...         finish_order(controller, order, {"seen": True})
        ...     dict(order_on_record(controller.outcomes, "J-1009", {"note": 1}).result)
        {'seen': True}

    Raises:
        RobolinkError: It ended without a kept change: an error of the kind that ended it; or it was
            another job, or was undone, or closed on a person's word, since (``ConfigError``).
    """
    entry = _found(outcomes, order)
    return None if entry is None else _recorded(outcomes, order, job, entry)


def _recorded(
    outcomes: OutcomeLog, order: str, job: Mapping[str, object], entry: Recorded
) -> DoneOrder:
    """Return how an order ended, as its entry has it.

    Raises:
        RobolinkError: See :func:`order_on_record`.
    """
    if entry.details.get("job") != job:
        raise _refused(tr("Order {order} was given before, for another job.", order=order))
    if isinstance(ended := entry.details.get("ended"), dict):
        raise as_before(order, entry.at, ended)
    if entry.details.get("forgotten"):
        raise _refused(
            tr("Order {order} was closed without checking how it ended.", order=order),
        )
    if _taken_back(outcomes, entry):
        raise _refused(tr("Order {order} was undone.", order=order))
    tools, result = entry.details.get("tools"), entry.details.get("result")
    if not isinstance(tools, dict) or not isinstance(result, dict):
        raise _refused(
            tr("Entry {number} of the journal cannot be understood.", number=entry.number)
        )
    return DoneOrder(entry.change, entry.at, result)


def _require_selected(controller: Controller, order: str, entry: Recorded) -> None:
    left = entry.details.get("selects")
    if left is not None and (now := controller.tools.selected()) != left:
        raise ToolChangedError(
            tr(
                "Order {order} left tool {left} selected; tool {now} is selected now.",
                order=order,
                left=left,
                now=now,
            ),
            remedy=anew(),
            controller=controller.identity,
        )


def _require_files(order: str, entry: Recorded) -> None:
    files = entry.details.get("files")
    for path, digest in files.items() if isinstance(files, dict) else ():
        try:
            found = _digest(read_named(Path(path)))
        except OSError as error:
            raise _refused(
                tr(
                    "Order {order} wrote {path}, which cannot be read now: {cause}.",
                    order=order,
                    path=path,
                    cause=error.strerror or error,
                )
            ) from error
        if found != digest:
            raise _refused(
                tr("Order {order} wrote {path}, which was changed since.", order=order, path=path)
            )


def _digest(data: bytes) -> str:
    return sha256(data).hexdigest()


def _record_end(
    controller: Controller, order: str, job: Mapping[str, object], error: BaseException
) -> None:
    """Record that an order ended without a kept change, unless its change was kept before."""
    if only_the_moment(error):
        return
    details = {"order": order, "job": dict(job), "ended": end_of(error)}
    outcomes = controller.outcomes
    try:
        with controller.uninterrupted():
            if _found(outcomes, order) is None:
                verdict = tr("order ended without a kept change")
                outcomes.append(NewEntry(EntryKind.ORDER, verdict=verdict, details=details))
    except RobolinkError:
        if isinstance(error, RobolinkError):
            error.say_what_stands(
                tr("robolink could not record how order {order} ended.", order=order)
            )


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
    return ConfigError(what, remedy=anew())
