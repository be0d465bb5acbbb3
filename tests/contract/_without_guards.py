"""The places that docs/reference/rules.md names, each with a stand-in that lacks its guard.

They show that a check can fail. As a plugin (``-p tests.contract._without_guards``) this module
removes the guard that ROBOLINK_WITHOUT names before the tests are collected.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from functools import reduce
from importlib import import_module
from typing import Any, Final

import pytest

from robolink.errors import RobolinkError
from robolink.model import MarkerKind, ToolOffset, ToolReceipt
from robolink.timing import wall_label

StandIn = Callable[..., Any] | property


def found(place: str) -> tuple[Any, str]:
    """Return the owner of a place and its name there.

    Raises:
        AttributeError, ImportError: There is no such place.
    """
    parts = place.split(".")
    for length in range(len(parts) - 1, 0, -1):
        try:
            module = import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        owner = reduce(getattr, parts[length:-1], module)
        getattr(owner, parts[-1])
        return owner, parts[-1]
    raise ImportError(place)


@contextmanager
def without(place: str) -> Iterator[None]:
    """Remove the guard of a place during the block, in every module that imported it."""
    with pytest.MonkeyPatch.context() as patch:
        take_out(place, patch.setattr)
        yield


def take_out(place: str, put: Callable[[Any, str, Any], None]) -> None:
    """Remove the guard of a place.

    Args:
        place: The name on the page.
        put: Replaces an attribute.
    """
    for at, stand_in in LEFT[place].items():
        owner, name = found(at)
        put(owner, name, stand_in)


def pytest_configure() -> None:
    """Remove the guard that the environment names."""
    place = os.environ.get("ROBOLINK_WITHOUT")
    if place:
        take_out(place, setattr)


def _nothing(*_given: object, **_named: object) -> None:
    return None


def _open(*_given: object, **_named: object) -> Any:
    return nullcontext()


class _Whatever:
    """Equal to every value."""

    def __eq__(self, _other: object) -> bool:
        return True

    __hash__ = None  # type: ignore[assignment]


@contextmanager
def _calmed(latch: Any, _request: str) -> Iterator[None]:
    """Let a reset through, whatever stop came since it began."""
    latch._permits.__dict__["calms"] = _Whatever()
    try:
        yield
    finally:
        latch._permits.__dict__["calms"] = None


def _carried_out(link: Any, command: Any) -> Any:
    command.send()
    command.acknowledged = True
    return command.read()


def _moved_unmarked(group: Any, target: Any, request: str, *, selected: int | None) -> Any:
    from robolink.model import Marker

    group._require_tool(target, selected, request)
    return Marker("unmarked", MarkerKind.MOVE, request, wall_label())


def _begun(
    store: Any, kind: Any, request: str, details: Mapping[str, object], *, operation: str = ""
) -> Any:
    from robolink.model import Marker, new_operation

    marker = Marker(operation or new_operation(), kind, request, wall_label(), dict(details))
    store._recorded(lambda: store.outcomes.begin(marker))
    store.ledger.begin(marker)
    store._under_way[marker.operation] = kind
    if kind in (MarkerKind.SELECTION, MarkerKind.CHANGE):
        store._procedures[kind] = marker
    return marker


def _changed(write: Any, _expected: object) -> ToolReceipt:
    """Write whatever value is stored, and trust the answer."""
    write.before = write.read_back()
    write._link.carry_out(write)
    return ToolReceipt(write.tool, None, write.requested, None)


def _ended(_wire: object, error: Any) -> Any:
    return error


def _to_the_last_bit(_table: object, a: object, b: object) -> bool:
    return a == b


def _as_given(_table: object, _tool: int, offset: ToolOffset) -> ToolOffset:
    return offset


def _preserved(preserver: Any, _reason: str) -> Any:
    return nullcontext()


def _previewed(table: Any, tool: int, offset: ToolOffset) -> tuple[str, ...]:
    table.write(tool, offset, expected=table.read(tool))
    return ("written",)


def _unguarded(controller: Any, text: str) -> str:
    """Run a typed statement without recording it."""
    return str(controller._link.session.exchange("Execute", text).text or "")


def _settled_unread(_settler: object, marker: Any) -> Any:
    """Treat whatever was begun as finished."""
    from robolink.model import Finding, Verdict

    return Finding(marker, Verdict.DONE, "")


def _line_without_a_look(operator: Any, _look: object, *, wait_s: float = 1.0) -> str:
    while (line := operator.poll(wait_s)) is None:
        pass
    return str(line)


def _knocking(connect: Callable[[], Any], **_named: object) -> Any:
    """Try again at once, for ever."""
    while True:
        try:
            return connect()
        except RobolinkError:
            continue


def _sent_in_part(transport: Any, data: bytes, **_named: object) -> None:
    transport._socket.send(data[:1])


def _not_looked(settings: Any, edge: object = None) -> Any:
    """Believe the settings that a movement wants."""
    from robolink.controllers.epson.answers import ArmState

    (tool,) = settings._window.printed_numbers("Print Tool")
    return ArmState(int(tool), True, False, 5, 20.0, None if edge is None else False)


def _set_as_stated(_state: Any, stated_mm_s2: float | None) -> Iterator[str]:
    """Set the stated acceleration, whatever was found."""
    if stated_mm_s2 is not None:
        yield f"AccelS {stated_mm_s2:.3f}, {stated_mm_s2:.3f}"


def _taken_from_anybody(seats: Any, cell: str, tablet: Any, *, moving: object) -> Any:
    from robolink_cli.panel.guard.seat import Holder, Taking, _Seat

    mine = Holder(tablet.id, tablet.who, tablet.address, wall_label())
    seats._seats[cell] = _Seat(mine, seats.clock.now_ns())
    return Taking()


def _opened_in_any_case(latch: Any) -> None:
    """Open the latch when no stop is under way, whoever stopped meanwhile."""
    with latch._stops:
        latch._stops.wait_for(lambda: not latch._under_way, 10.0)
        latch._released = latch._closings


_ITSELF: Final[Mapping[str, StandIn]] = {
    "robolink.controllers.DriverLink.carry_out": _carried_out,
    "robolink.controllers.MotionGroupCore._marked": _moved_unmarked,
    "robolink.controllers.markers.MarkerStore.begin": _begun,
    "robolink.journal._identity._told_twice": lambda _who, first: first,
    "robolink.journal._outcome_log.JournalOutcomeLog._refuse_lost": _nothing,
    "robolink.journal.store.reserve.LogReserve.keep": _nothing,
    "robolink.journal._homes.CellHome.refusal": _nothing,
    "robolink_cli.commands.fleet.job_gate.JobGate.begin": _nothing,
    "robolink.controllers.markers.MarkerStore.doubt": _open,
    "robolink.controllers.epson.line.EpsonConversation._end": _nothing,
    "robolink.controllers.softmotion.wire.MailboxWire.ended": _ended,
    "robolink.controllers.softmotion.commands.CommandSender._allowed": (
        lambda sender, draft, _require: sender._before(draft)
    ),
    "robolink.controllers.softmotion.commands.CommandSender._before": (
        lambda sender, _draft: sender._snapshots.take()
    ),
    "robolink.stop_latch.StopLatch.release": _opened_in_any_case,
    "robolink.controllers.softmotion.wire.MailboxWire._may_beat": property(
        lambda wire: wire._attends or not wire.motions.unfinished
    ),
    "robolink.controllers.ToolWrite.change": _changed,
    "robolink.controllers.ToolTableCore.require_writable": _nothing,
    "robolink.model.ChangeGuard.require": _nothing,
    "robolink.controllers.ToolTableCore._require_values_of_a_tool": _nothing,
    "robolink.controllers.tool_table.require_replacement": lambda _tool, _other: 0,
    "robolink.controllers.Preserver.preserved": _preserved,
    "robolink.controllers.MotionGroupCore._require_tool": _nothing,
    "robolink.stop_latch.StopLatch.require_open": _nothing,
    "robolink.stop_latch.StopLatch.admit": _nothing,
    "robolink.stop_latch.StopLatch.restoring": _open,
    "robolink.stop_latch.StopLatch.calming": _calmed,
    "robolink.controllers.epson.preserve.EpsonPreserver._restore_more": _nothing,
    "robolink.controllers.epson.movement.Settings.look": _not_looked,
    "robolink.controllers.epson.answers.ArmState.lowered": _set_as_stated,
    "robolink.controllers.epson.movement.Settings.require_as_told": _nothing,
    "robolink.controllers.epson.movement.EpsonMotionUntilInput._require_kept": _nothing,
    "robolink.controllers.connect_when_reachable": _knocking,
    "robolink.transaction.Settler.examine": _settled_unread,
    "robolink.controllers.PolledGroup.halt": lambda group: group._send_stop(),
    "robolink.transaction.ToolChange._take_back": _nothing,
    "robolink.controllers.markers.ProcedureLock.held": _open,
    "robolink.controllers.ControllerCore.procedure": _open,
    "robolink_cli.session.motion_consent.agree_to_motion": _nothing,
    "robolink_cli.wizard.lease.JogLease.spend": lambda _lease, _now_s: True,
    "robolink.runner.permitted_by": _open,
    "robolink_cli.panel.guard.requests.PageRequest.foreign": _nothing,
    "robolink_cli.panel.guard.requests.is_host": lambda *_given: True,
    "robolink_cli.panel.guard.access.Access.is_paired": lambda *_given: True,
    "robolink_cli.panel.guard.access.Access.why_not": lambda *_given, **_named: "",
    "robolink_cli.panel.guard.access.Access.why_not_answer": lambda *_given: "",
    "robolink_cli.panel.guard.people.Tries.pause_s": lambda *_given: 0.0,
    "robolink_cli.panel.guard.seat.Seats.has": lambda *_given: True,
    "robolink_cli.panel.guard.seat.Seats.take": _taken_from_anybody,
    "robolink.controllers.ToolTableCore.preview_write": _previewed,
    "robolink.controllers.ToolTableCore._require_known": _nothing,
    "robolink.model.ToolOffset.__post_init__": _nothing,
    "robolink.controllers.epson.controller.EpsonController.execute_raw": _unguarded,
    "robolink.controllers.ControllerCore.close": _nothing,
    "robolink.transport.tcp.TcpTransport.send": _sent_in_part,
    "robolink.transport.opcua.client.OpcuaClient._require_may_write": _nothing,
}
_AS_IMPORTED: Final[Mapping[str, Mapping[str, StandIn]]] = {
    "robolink_cli.wizard.views.offered.refusal": {
        "robolink_cli.wizard.flow.refusal": lambda _view, _press: ""
    },
    "robolink_cli.prompts.questions.agree": {
        "robolink_cli.prompts.questions.agree": _nothing,
        "robolink_cli.commands.controller.tool.agree": _nothing,
    },
    "robolink.runner.awaited_line": {
        "robolink.runner.awaited_line": _line_without_a_look,
        "robolink.runner._runner.awaited_line": _line_without_a_look,
    },
    "robolink.controllers.ToolTableCore.same": {
        "robolink.controllers.epson.tools.EpsonToolTable.same": _to_the_last_bit,
        "robolink.controllers.epson.tools.EpsonToolTable._storable": _as_given,
    },
    "robolink.controllers.epson.rest.bring_to_rest": {
        "robolink.controllers.epson.rest.bring_to_rest": _nothing,
        "robolink.controllers.epson.group.bring_to_rest": _nothing,
    },
    "robolink.controllers.softmotion.commands.CommandSender.bring_to_rest": {
        "robolink.controllers.softmotion.commands.CommandSender.bring_to_rest": _nothing
    },
    "robolink.controllers.epson.answers.require_ready": {
        "robolink.controllers.epson.window.require_ready": _nothing,
    },
    "robolink.transport.opcua.server_certificate.require_pinned": {
        "robolink.transport.opcua.session.require_pinned": _nothing,
    },
}
LEFT: Final[Mapping[str, Mapping[str, StandIn]]] = {
    **{place: {place: stand_in} for place, stand_in in _ITSELF.items()},
    **_AS_IMPORTED,
}
"""The stand-ins for each place: for itself, and for every import of it."""
