"""Replacements for functions of robolink that restore known defects.

:mod:`tests.soak.known_defects` assigns them.
"""

import contextlib
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from robolink.checkpoints import Checkpoint, checkpoint
from robolink.controllers.controller_core import ControllerCore
from robolink.controllers.epson.controller import EpsonController
from robolink.controllers.epson.group import EpsonGroup
from robolink.controllers.epson.session import EpsonSession, command_class_of
from robolink.controllers.markers import MarkerStore
from robolink.controllers.softmotion.answers import Fate
from robolink.controllers.softmotion.commands import CommandSender
from robolink.controllers.tool_table import ToolTableCore
from robolink.errors import RobolinkError
from robolink.journal._lease import Grip, Lease
from robolink.journal.store import connection
from robolink.model import (
    EntryKind,
    Finding,
    Marker,
    MarkerKind,
    NewEntry,
    Pose,
    ToolOffset,
    Verdict,
    new_operation,
)
from robolink.procedures.witnessed_touches import TouchPlan
from robolink.protocols.epson_text import parse_status
from robolink.stop_latch import StopLatch
from robolink.timing import wall_label
from robolink.transaction import _put_back as putting_back
from robolink.transaction import _undo as undo_history
from robolink.transaction._settling import Settler

Function = Callable[..., Any]


def none_of_them(*_given: object) -> list[Any]:
    """Find nothing."""
    return []


def nothing(*_given: object, **_named: object) -> None:
    """Never refuse, in place of a check that does."""


# Stopping.


_announced = EpsonSession._announced


def asked_before_the_lock(session: EpsonSession, request: Any) -> str:
    """Check the latch, and only then wait for the lock of the exchange."""
    session.latch.admit(command_class_of(request), request.name)
    return _announced(session, request)


def admitted_unasked(session: Any, request: Any, what: str) -> None:
    """Check everything but the latch under the lock."""
    checkpoint(Checkpoint.HELD, what)
    session._check_usable(request)
    if session._pending is not None and request.name == "Abort":
        session._pending.abort_requested = True


def latched_when_at_rest(controller: ControllerCore) -> None:
    """Stop the machine first, and close the latch then."""
    for group in controller.groups:
        group.stop()
    controller.latch.close()


@contextmanager
def open_while_stopping(_latch: StopLatch) -> Iterator[None]:
    yield


def stop_not_looked_after(ask: Function, _clock: object, *, controller: str) -> Any:
    """Send the Stop that ends tasks, and take its refusal for a stopped machine."""
    with contextlib.suppress(RobolinkError):
        ask("Stop")
    return parse_status(ask("GetStatus"))


def stop_sent_only(commands: CommandSender) -> None:
    """Take an acknowledged stop for a stopped machine."""
    commands.stop()


_stop = ControllerCore.stop


def released_at_once(controller: ControllerCore) -> None:
    """Open the latch when the machine has stopped, without a person's release."""
    _stop(controller)
    controller.release_stop()


# Markers.

_begin = MarkerStore.begin


def unmarked(*kinds: MarkerKind) -> Function:
    """Return a begin function that stores nothing for some kinds of markers."""

    def begin(
        store: Any,
        kind: MarkerKind,
        request: str,
        details: Mapping[str, object],
        *,
        operation: str = "",
    ) -> Marker:
        if kind not in kinds:
            return _begin(store, kind, request, details, operation=operation)
        marker = Marker(operation or new_operation(), kind, request, wall_label(), dict(details))
        store.ledger.begin(marker)
        if kind in (MarkerKind.SELECTION, MarkerKind.CHANGE):
            store._procedures[kind] = marker
        return marker

    return begin


def one_marker_for_all() -> Function:
    """Return a begin function that gives every movement the first one's operation."""

    def begin(
        store: Any,
        kind: MarkerKind,
        request: str,
        details: Mapping[str, object],
        *,
        operation: str = "",
    ) -> Marker:
        if kind is MarkerKind.MOVE:
            operation = operation or "movement"
        return _begin(store, kind, request, details, operation=operation)

    return begin


def forgotten_selection(preserver: Any, marker: Marker) -> None:
    """Drop the marker of a procedure without selecting the earlier tool."""
    preserver._link.markers.clear(marker)


def written_again_after_silence(sender: Any, command: Any, before: Any, *until: Any) -> Any:
    """Take silence for a damaged block, which may be written again."""
    now, fate = _await_acknowledgement(sender, command, before, *until)
    return now, Fate.DAMAGED if fate is Fate.UNSEEN else fate


_await_acknowledgement = CommandSender._await_acknowledgement


def still_usable(wire: Any, error: RobolinkError) -> RobolinkError:
    return error


@contextmanager
def settled_by_silence(store: MarkerStore, marker: Marker) -> Iterator[None]:
    """Drop the marker of an unanswered request."""
    try:
        yield
    except RobolinkError:
        store.clear(marker)
        raise


def unread(tools: Any, marker: Marker) -> Finding:
    """Report a failed write without reading back."""
    tool, before = int(str(marker.details["tool"])), marker.details.get("before")
    details = {**marker.details, "value": before, "found_later": True}
    entry = NewEntry(EntryKind.NOT_APPLIED, operation=marker.operation, tool=tool, details=details)
    return Finding(marker, Verdict.NOT_APPLIED, "it did not take", entries=(entry,))


_prepare = connection._prepare


def not_synced(connection: sqlite3.Connection) -> None:
    """Leave it to the system when committed data reach the disk."""
    _prepare(connection)
    connection.execute("PRAGMA synchronous=OFF")


def as_it_was_raised(error: Exception, *_given: object) -> Exception:
    return error


def owner_not_compared(command: Any, now: Any) -> bool:
    return (now.ack_head, now.opcode_echo) == (command.sequence, command.opcode)


def lease_not_proved(lease: Any, rows: Any, _purpose: str, _operator: str) -> Grip:
    """Assume the lease from a reading of it."""
    return Grip(1)


_take_aside = EpsonSession._take_aside


def shown_whole(session: EpsonSession, event: object, *, hidden: bool = False) -> None:
    """Print unsolicited text, even the password of an altered login."""
    _take_aside(session, event)


# The change, and its report.


def keeping(controller: Any, *, keep: bool) -> Settler:
    """Keep an unverified value, whatever the person said."""
    return Settler(controller, keep=True)


def requested_believed(write: Any) -> Any:
    """Take the answer to a write as confirmation."""
    return write.requested if write.acknowledged else write.read_doubted()


def last_only(controller: Any, steps: Any, **named: Any) -> Any:
    return putting_back.put_back(controller, steps[-1:], **named)


_init = TouchPlan.__init__


def nominal(plan: TouchPlan, *given: Any, **named: Any) -> None:
    """Move the tip straight back over the pin, and judge nothing."""
    _init(plan, *given, **{**named, "nominal": True})


# Acts of people at the machine, the clock, and a frozen process.


def remembered(read: Function) -> Function:
    """Return a reading of the selected tool that is made once a session."""

    def selected(table: Any) -> int | None:
        if not hasattr(table, "remembered"):
            table.remembered = read(table)
        found: int | None = table.remembered
        return found

    return selected


def remembering(send: Function) -> Function:
    """Return a selection that is remembered as it was sent."""

    def selecting(table: Any, tool: int) -> None:
        send(table, tool)
        table.remembered = tool

    return selecting


_write = ToolTableCore.write


def three_digits(table: Any, tool: int, offset: ToolOffset, *, expected: Any) -> Any:
    """Write the digits that one kind of controller prints, on every kind."""
    return _write(table, tool, offset.rounded(3), expected=expected)


def newest_by_the_clock(outcomes: Any, tool: int | None) -> str:
    """Take the entry with the latest time of day for the newest change."""
    ends = outcomes.recorded(tool=tool, kinds=(EntryKind.DONE,))
    newest = max(ends, key=lambda entry: str(entry.at), default=None)
    return "" if newest is None else undo_history.id_of_change(newest)


_clear = MarkerStore.clear


def selection_stays_open(store: Any, marker: Marker, *entries: NewEntry) -> None:
    """Forget that a procedure ran, except for its marker in the journal."""
    if marker.kind is not MarkerKind.SELECTION or marker.operation not in store._under_way:
        _clear(store, marker, *entries)
        return
    store.ledger.ended(marker)
    store._under_way.pop(marker.operation, None)
    store._procedures.pop(marker.kind, None)


_secure = Lease.secure


def still_mine(lease: Any, rows: Any, purpose: str, operator: str) -> Grip:
    """Assume that a lease once held is still held."""
    return Grip(lease._epoch) if lease.held else _secure(lease, rows, purpose, operator)


_put_one_back = putting_back._put_one_back


def over_anything(controller: Any, step: Any, *, spoiled: bool, selected: int) -> Any:
    """Restore the old value whatever is stored by now."""
    return _put_one_back(controller, step, spoiled=True, selected=selected)


GIVING_UP_IS_A_REFUSAL = SimpleNamespace(TIMED_OUT=-1)


_pose = EpsonGroup.pose


def a_tenth_off(group: EpsonGroup) -> Pose:
    """Report a pose that is not the tip's."""
    pose = _pose(group)
    return replace(pose, x_mm=pose.x_mm + 0.1)


_take_leave = EpsonController._take_leave


def with_another_robot(controller: EpsonController) -> None:
    """Leave with the second robot selected."""
    controller._link.session.exchange("SetCurRobot", "2")
    _take_leave(controller)
