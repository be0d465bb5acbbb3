"""Defects that robolink had, or that its rules speak of, each as a named replacement of functions.

None is an edit of the source: :data:`DEFECTS` says what is put in the place of what for the time
of one history. Most were found from outside, by foreign clients, proxies, a second thread in the
worst microsecond, careless people (docs/reliability.md, "What was found from outside, and what
holds now"); the others break one sentence of docs/reference/rules.md each.
"""

import contextlib
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Final

from robolink_simulators.soak import CellKind

from robolink.checkpoints import Checkpoint, checkpoint
from robolink.controllers.controller_core import ControllerCore
from robolink.controllers.epson.link.requests import command_class_of
from robolink.controllers.epson.link.session import EpsonSession
from robolink.controllers.markers import MarkerStore
from robolink.controllers.softmotion.link.commands import CommandSender
from robolink.errors import RobolinkError, TransportTimeoutError
from robolink.journal._lease import Grip
from robolink.journal.store import engines
from robolink.model import EntryKind, Finding, Marker, MarkerKind, NewEntry, Verdict, new_operation
from robolink.procedures.pin.touch_plan import TouchPlan
from robolink.standing import UNTOUCHED
from robolink.stop_latch import StopLatch
from robolink.timing import wall_label
from robolink.transaction import _put_back as putting_back
from robolink.transaction._settling import Settler

Function = Callable[..., Any]


@dataclass(frozen=True, slots=True)
class KnownDefect:
    """One defect, put back.

    Attributes:
        name: What is wrong, in one line.
        replacements: What is put in the place of what dotted names lead to.
        kind: The kind of cell that can have it; ``None`` for each.
        missed_because: Why no rule finds it in the hours that are run; empty where one does.
    """

    name: str
    replacements: Mapping[str, object]
    kind: CellKind | None = None
    missed_because: str = ""


def _nothing(*_given: object, **_named: object) -> None:
    """Stand in for a look that refuses."""


# Stopping.


def _asked_before_the_lock(session: EpsonSession, request: Any) -> Any:
    """Ask the latch, and only then wait for the lock of the exchange."""

    @contextmanager
    def exchanging() -> Iterator[None]:
        held: Any = session
        session.latch.admit(command_class_of(request), request.name)
        checkpoint(Checkpoint.LOCK, _shown(request))
        try:
            with held._gate, held._wire:
                checkpoint(Checkpoint.HELD, _shown(request))
                held._check_usable(request)
                if held._pending is not None and request.name == "Abort":
                    held._pending.abort_requested = True
                yield
        finally:
            checkpoint(Checkpoint.EXCHANGE, _shown(request))

    return exchanging()


def _shown(request: Any) -> str:
    return str(request.parameters[0] if request.name == "Execute" else request.name)


def _latched_when_at_rest(controller: ControllerCore) -> None:
    """Bring the machine to rest first, and latch then."""
    for group in controller.groups:
        group.stop()
    controller.latch.close()


@contextmanager
def _open_while_stopping(_latch: StopLatch) -> Iterator[None]:
    yield


def _stop_not_looked_after(ask: Function, _clock: object, *, controller: str) -> None:
    """Send the Stop that ends tasks, and take a refusal of it for rest."""
    with contextlib.suppress(RobolinkError):
        ask("Stop")


def _stop_sent_only(
    commands: CommandSender, _snapshots: object, _clock: object, *, controller: str
) -> None:
    """Take a stop that was acknowledged for rest."""
    commands.stop()


_stop = ControllerCore.stop


def _released_at_once(controller: ControllerCore) -> None:
    """Open the latch when the machine rests, without anybody's word."""
    _stop(controller)
    controller.release_stop()


# Markers.

_begin = MarkerStore.begin


def _unmarked(*kinds: MarkerKind) -> Function:
    """Return a beginning that stores nothing for some kinds of markers."""

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


def _one_marker_for_all() -> Function:
    """Return a beginning that gives every movement the operation of the first."""

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


def _forgotten_selection(preserver: Any, marker: Marker) -> None:
    """Forget the marker of a procedure without selecting the tool of before."""
    preserver._link.markers.clear(marker)


def _written_again_after_silence(sender: Any, command: Any, before: Any) -> Any:
    """Take silence for a damaged block, which may be written again."""
    try:
        return _await_acknowledgement(sender, command, before)
    except TransportTimeoutError:
        return before, False


_await_acknowledgement = CommandSender._await_acknowledgement


def _still_usable(wire: Any, error: RobolinkError) -> RobolinkError:
    return error


@contextmanager
def _settled_by_silence(store: MarkerStore, marker: Marker) -> Iterator[None]:
    """Forget the marker of what was not answered."""
    try:
        yield
    except RobolinkError:
        store.clear(marker)
        raise


def _unread(tools: Any, marker: Marker) -> Finding:
    """Say that a write did not take without looking."""
    tool, before = int(str(marker.details["tool"])), marker.details.get("before")
    details = {**marker.details, "value": before, "found_later": True}
    entry = NewEntry(EntryKind.NOT_APPLIED, operation=marker.operation, tool=tool, details=details)
    return Finding(marker, Verdict.NOT_APPLIED, "it did not take", entries=(entry,))


_prepare = engines._prepare


def _not_synced(connection: sqlite3.Connection) -> None:
    """Leave it to the system when what was committed reaches the disk."""
    _prepare(connection)
    connection.execute("PRAGMA synchronous=OFF")


def _as_it_was_raised(error: Exception, *_given: object) -> Exception:
    return error


def _owner_not_compared(command: Any, now: Any) -> bool:
    return (now.ack_head, now.opcode_echo) == (command.sequence, command.opcode)


def _lease_not_proved(lease: Any, rows: Any, _purpose: str, _operator: str) -> Grip:
    """Take the look at the lease for the lease."""
    return Grip(1)


_take_aside = EpsonSession._take_aside


def _shown_whole(session: EpsonSession, event: object, *, hidden: bool = False) -> None:
    """Show what came unasked, the password of a bent login too."""
    _take_aside(session, event)


# The change, and what is said of it.


def _keeping(controller: Any, *, keep: bool) -> Settler:
    """Keep what nobody verified, whatever the person said."""
    return Settler(controller, keep=True)


_entry = putting_back._entry


def _value_not_recorded(*given: Any) -> Any:
    """Put a roll-back on record without the value that is held since."""
    entry = _entry(*given)
    return replace(entry, details={k: v for k, v in entry.details.items() if k != "value"})


def _requested_believed(write: Any) -> Any:
    """Take the answer to a write for the proof of it."""
    return write.requested if write.acknowledged else write.read_doubted()


def _last_only(controller: Any, steps: Any, **named: Any) -> Any:
    return putting_back.put_back(controller, steps[-1:], **named)


_NOTERS: Final = (
    "robolink.controllers.controller_core",
    "robolink.controllers.markers",
    "robolink.model.record.ledger",
    "robolink.transaction._change",
)
_WIRE: Final = "robolink.controllers.softmotion.link.wire.MailboxWire.ended"
_COMMANDS: Final = "robolink.controllers.softmotion.link.commands"
_BEGIN: Final = "robolink.controllers.markers.MarkerStore.begin"
_SESSION: Final = "robolink.controllers.epson.link.session.EpsonSession"

_init = TouchPlan.__init__


def _nominal(plan: TouchPlan, *given: Any, **named: Any) -> None:
    """Bring the tip straight back over the pin, and judge nothing."""
    _init(plan, *given, **{**named, "nominal": True})


DEFECTS: Final = (
    KnownDefect(
        "a stop holds nothing back",
        {"robolink.stop_latch.StopLatch.admit": _nothing},
    ),
    KnownDefect(
        "a stop is looked for before the lock of the exchange, not under it",
        {f"{_SESSION}._exchanging": _asked_before_the_lock},
        CellKind.EPSON,
    ),
    KnownDefect(
        "a stop latches when the machine rests, not before",
        {
            "robolink.controllers.controller_core.ControllerCore.stop": _latched_when_at_rest,
            "robolink.stop_latch.StopLatch.stopping": _open_while_stopping,
        },
        missed_because=(
            "a movement would have to leave within the two points between the last "
            "look and the end of the stop"
        ),
    ),
    KnownDefect(
        "a stop opens again by itself when the machine rests",
        {"robolink.controllers.controller_core.ControllerCore.stop": _released_at_once},
    ),
    KnownDefect(
        "what was stopped may end well",
        {"robolink.stop_latch.StopLatch.require_open": _nothing},
        missed_because=(
            "nothing leaves under the latch, so only a stop among the last reads of a deed tells"
        ),
    ),
    KnownDefect(
        "an EPSON stop that is refused while a movement runs is acknowledged",
        {"robolink.controllers.epson.motion.group.bring_to_rest": _stop_not_looked_after},
        CellKind.EPSON,
    ),
    KnownDefect(
        "a PLC's stop is acknowledged when it is accepted",
        {"robolink.controllers.softmotion.motion.group.bring_group_to_rest": _stop_sent_only},
        CellKind.SOFTMOTION,
    ),
    KnownDefect(
        "what is unsettled blocks nothing",
        {"robolink.controllers.markers.MarkerStore.require_settled": _nothing},
    ),
    KnownDefect("a movement leaves no durable mark", {_BEGIN: _unmarked(MarkerKind.MOVE)}),
    KnownDefect("a write leaves no durable mark", {_BEGIN: _unmarked(MarkerKind.SET)}),
    KnownDefect(
        "a calibration that is killed leaves no mark of the tool of before",
        {
            _BEGIN: _unmarked(MarkerKind.SELECTION),
            "robolink.controllers.markers.MarkerStore.note_selection": _nothing,
        },
    ),
    KnownDefect(
        "a change that is killed before its proof leaves no mark",
        {_BEGIN: _unmarked(MarkerKind.CHANGE)},
    ),
    KnownDefect("all movements of a process share one operation", {_BEGIN: _one_marker_for_all()}),
    KnownDefect(
        "the tool of before is not selected again",
        {"robolink.controllers.preserving.Preserver.restore": _forgotten_selection},
    ),
    KnownDefect(
        "what was not answered counts as not done",
        {"robolink.controllers.markers.MarkerStore.unless_stopped": _settled_by_silence},
    ),
    KnownDefect(
        "recover believes that a write did not take, and reads nothing",
        {"robolink.controllers.resolving.examine_write": _unread},
    ),
    KnownDefect(
        "what the journal commits is not synced",
        {"robolink.journal.store.engines._prepare": _not_synced},
    ),
    KnownDefect(
        "an error of the journal's disk is one of SQLAlchemy's",
        {"robolink.journal.store.store.journal_error": _as_it_was_raised},
    ),
    KnownDefect(
        "an exit code says what broke last, not what stands unproved",
        {"robolink_cli.console.exit_codes.standing_after": lambda _error: UNTOUCHED},
    ),
    KnownDefect(
        "of several tools only the last is put back",
        {"robolink.transaction._change.put_back": _last_only},
        missed_because=(
            "it ends with 6 and says which tool holds what, and a person typed the value"
        ),
    ),
    KnownDefect(
        "a deleted journal is taken for a new one",
        {"robolink.journal._outcome_log.traces_of": _nothing},
    ),
    KnownDefect(
        "a mailbox block is written again after silence",
        {
            f"{_COMMANDS}.CommandSender._await_acknowledgement": _written_again_after_silence,
            _WIRE: _still_usable,
        },
        CellKind.SOFTMOTION,
    ),
    KnownDefect(
        "another client's acknowledgement is taken for ours",
        {f"{_COMMANDS}.is_own": _owner_not_compared},
        CellKind.SOFTMOTION,
        missed_because="the other client never has the number that is awaited",
    ),
    KnownDefect(
        "an EPSON session goes on after a time-out",
        {f"{_SESSION}._end": _nothing},
        CellKind.EPSON,
        missed_because=("the late answer ends it: its name, or its place in line, is another's"),
    ),
    KnownDefect(
        "the lease is looked at, and never taken",
        {"robolink.journal._lease.Lease.secure": _lease_not_proved},
    ),
    KnownDefect(
        "what a change wrote is not taken back when it fails",
        {"robolink.transaction._change.ToolChange._take_back": _nothing},
    ),
    KnownDefect(
        "recover keeps what nobody verified",
        {"robolink.transaction._recovery.Settler": _keeping},
    ),
    KnownDefect(
        "a roll-back is on record without its value",
        {"robolink.transaction._put_back._entry": _value_not_recorded},
    ),
    KnownDefect(
        "the answer to a write is taken for its proof",
        {"robolink.controllers.tool_writing.ToolWrite.read": _requested_believed},
    ),
    KnownDefect(
        "an error does not say what it left on the controller",
        {f"{module}.note_standing": _nothing for module in _NOTERS},
    ),
    KnownDefect(
        "who only presses ENTER gets a proof",
        {
            "robolink.procedures.pin.touch_plan.TouchPlan.__init__": _nominal,
        },
    ),
    KnownDefect(
        "a tool change after a restart of the PLC goes on",
        {"robolink.controllers.softmotion.link.snapshots.Snapshots._other_plc": _nothing},
        CellKind.SOFTMOTION,
    ),
    KnownDefect(
        "an interruption strikes in the middle of an exchange",
        {"robolink.interrupts.InterruptGate.__enter__": _nothing},
    ),
    KnownDefect(
        "a login that comes back bent is shown",
        {f"{_SESSION}._take_aside": _shown_whole},
        CellKind.EPSON,
    ),
)
