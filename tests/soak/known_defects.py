"""Defects that robolink had or that its rules mention, each as a named replacement of functions.

The source is not edited: :data:`DEFECTS` lists the replacements for the time of one history. Most
were found from outside: in robolink, by foreign clients, proxies, a second thread in the worst
microsecond, careless people (docs/reliability.md, "What was found from outside, and what holds
now"), or in other trusted systems, by their users; ``found_by`` says so. The others break one
sentence of docs/reference/rules.md each.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from robolink.controller_outcome import UNTOUCHED
from robolink.controllers.epson.tools import EpsonToolTable
from robolink.model import MarkerKind
from tests.soak import stand_ins
from tests.soak.adversary import CellKind


@dataclass(frozen=True, slots=True)
class KnownDefect:
    """One defect, restored.

    Attributes:
        name: The defect, in one line.
        replacements: The objects that replace dotted names.
        kind: The kind of cell that can have it; ``None`` for all.
        found_by: Who found it from outside, in a few words; empty for nobody.
        missed_because: Why no rule finds it in the hours that are run; empty if one does.
    """

    name: str
    replacements: Mapping[str, object]
    kind: CellKind | None = None
    found_by: str = ""
    missed_because: str = ""


_NOTERS: Final = (
    "robolink.controllers.controller_core",
    "robolink.controllers.markers",
    "robolink.model._ledger",
    "robolink.transaction._change",
)
_WIRE: Final = "robolink.controllers.softmotion.wire.MailboxWire.ended"
_ANSWERS: Final = "robolink.controllers.softmotion.answers"
_COMMANDS: Final = "robolink.controllers.softmotion.commands"
_SENDER: Final = f"{_COMMANDS}.CommandSender"
_CORE: Final = "robolink.controllers.controller_core.ControllerCore"
_BEGIN: Final = "robolink.controllers.markers.MarkerStore.begin"
_CONVERSATION: Final = "robolink.controllers.epson.line.EpsonConversation"
_SESSION: Final = "robolink.controllers.epson.session.EpsonSession"

_THREAD: Final = "stops from a second thread"
_RECALIBRATION: Final = "stops in a whole recalibration"
_PROXY: Final = "disturbed runs"
_REAL_DRIVERS: Final = "kinds of defects that real drivers had"
_MOVEMENT: Final = "robolink.controllers.epson.movement"
_EPSON_GROUP: Final = "robolink.controllers.epson.group.EpsonGroup"
_EPSON_TOOLS: Final = "robolink.controllers.epson.tools.EpsonToolTable"

DEFECTS: Final = (
    KnownDefect(
        "a stop holds nothing back",
        {"robolink.stop_latch.StopLatch.admit": stand_ins.nothing},
        found_by=_THREAD,
    ),
    KnownDefect(
        "a stop is looked for before the lock of the exchange, not under it",
        {
            f"{_SESSION}._announced": stand_ins.asked_before_the_lock,
            f"{_SESSION}._admit": stand_ins.admitted_unasked,
        },
        CellKind.EPSON,
        found_by=_THREAD,
    ),
    KnownDefect(
        "a stop latches when the machine rests, not before",
        {
            f"{_CORE}.stop": stand_ins.latched_when_at_rest,
            "robolink.stop_latch.StopLatch.stopping": stand_ins.open_while_stopping,
        },
        found_by=_THREAD,
    ),
    KnownDefect(
        "a stop opens again by itself when the machine rests",
        {f"{_CORE}.stop": stand_ins.released_at_once},
        found_by=_RECALIBRATION,
    ),
    KnownDefect(
        "what was stopped may end well",
        {"robolink.stop_latch.StopLatch.require_open": stand_ins.nothing},
        found_by=_RECALIBRATION,
    ),
    KnownDefect(
        "an EPSON stop that is refused while a movement runs is acknowledged",
        {
            f"{place}.bring_to_rest": stand_ins.stop_not_looked_after
            for place in (
                "robolink.controllers.epson.group",
                "robolink.controllers.epson.rest",
            )
        },
        CellKind.EPSON,
        found_by="a jog that was killed",
    ),
    KnownDefect(
        "a PLC's stop is acknowledged when it is accepted",
        {f"{_SENDER}.bring_to_rest": stand_ins.stop_sent_only},
        CellKind.SOFTMOTION,
    ),
    KnownDefect(
        "what is unsettled blocks nothing",
        {"robolink.controllers.markers.MarkerStore._unsettled": stand_ins.none_of_them},
        found_by="a jog after a killed calibration",
    ),
    KnownDefect("a movement leaves no durable mark", {_BEGIN: stand_ins.unmarked(MarkerKind.MOVE)}),
    KnownDefect("a write leaves no durable mark", {_BEGIN: stand_ins.unmarked(MarkerKind.SET)}),
    KnownDefect(
        "a calibration that is killed leaves no mark of the tool of before",
        {
            _BEGIN: stand_ins.unmarked(MarkerKind.SELECTION),
            "robolink.controllers.markers.MarkerStore.note_selection": stand_ins.nothing,
        },
        found_by="two state folders",
    ),
    KnownDefect(
        "a change that is killed before its proof leaves no mark",
        {_BEGIN: stand_ins.unmarked(MarkerKind.CHANGE)},
        found_by="a journal that fails midway",
    ),
    KnownDefect(
        "all movements of a process share one operation", {_BEGIN: stand_ins.one_marker_for_all()}
    ),
    KnownDefect(
        "the tool of before is not selected again",
        {"robolink.controllers.preserving.Preserver.restore": stand_ins.forgotten_selection},
        found_by="a journal that fails midway",
    ),
    KnownDefect(
        "what was not answered counts as not done",
        {"robolink.controllers.markers.MarkerStore.unless_stopped": stand_ins.settled_by_silence},
        found_by="a proxy that bends answers",
    ),
    KnownDefect(
        "recover believes that a write did not take, and reads nothing",
        {"robolink.controllers.resolving.examine_write": stand_ins.unread},
    ),
    KnownDefect(
        "what the journal commits is not synced",
        {"robolink.journal.store.connection._prepare": stand_ins.not_synced},
    ),
    KnownDefect(
        "an error of the journal's disk is one of the database's",
        {"robolink.journal.store.store.journal_error": stand_ins.as_it_was_raised},
        found_by="an unwritable journal",
    ),
    KnownDefect(
        "an exit code says what broke last, not what stands unproved",
        {"robolink.controller_outcome.outcome_after": lambda _error: UNTOUCHED},
        found_by=_PROXY,
    ),
    KnownDefect(
        "of several tools only the last is put back",
        {"robolink.transaction._change.put_back": stand_ins.last_only},
    ),
    KnownDefect(
        "a deleted journal is taken for a new one",
        {"robolink.journal._outcome_log.traces_of": stand_ins.nothing},
        found_by="people who look for space",
    ),
    KnownDefect(
        "a mailbox block is written again after silence",
        {
            f"{_SENDER}._await_acknowledgement": stand_ins.written_again_after_silence,
            _WIRE: stand_ins.still_usable,
        },
        CellKind.SOFTMOTION,
        found_by="users of pymodbus",
    ),
    KnownDefect(
        "another client's acknowledgement is taken for ours",
        {f"{_ANSWERS}.is_own": stand_ins.owner_not_compared},
        CellKind.SOFTMOTION,
        found_by="users of EPICS asyn",
    ),
    KnownDefect(
        "an EPSON session goes on after a time-out",
        {f"{_CONVERSATION}._end": stand_ins.nothing},
        CellKind.EPSON,
        found_by="users of EPICS asyn",
    ),
    KnownDefect(
        "the lease is looked at, and never taken",
        {"robolink.journal._lease.Lease.secure": stand_ins.lease_not_proved},
    ),
    KnownDefect(
        "what a change wrote is not taken back when it fails",
        {"robolink.transaction._change.ToolChange._take_back": stand_ins.nothing},
        found_by="a journal that fails midway",
    ),
    KnownDefect(
        "recover keeps what nobody verified",
        {"robolink.transaction._settling.Settler": stand_ins.keeping},
    ),
    KnownDefect(
        "the answer to a write is taken for its proof",
        {"robolink.controllers.tool_writing.ToolWrite.read": stand_ins.requested_believed},
        found_by="users of flexiv_rdk",
    ),
    KnownDefect(
        "an error does not say what it left on the controller",
        {f"{module}.note_outcome": stand_ins.nothing for module in _NOTERS},
        found_by=_PROXY,
    ),
    KnownDefect(
        "who only presses ENTER gets a proof",
        {
            "robolink.procedures.witnessed_touches.TouchPlan.__init__": stand_ins.nominal,
            "robolink.calibration_run._turn_test.require_proved": stand_ins.nothing,
        },
        found_by="careless people",
    ),
    KnownDefect(
        "a tool change after a restart of the PLC goes on",
        {"robolink.controllers.softmotion.snapshots.Snapshots._other_plc": stand_ins.nothing},
        CellKind.SOFTMOTION,
        found_by="users of pyads",
    ),
    KnownDefect(
        "an interruption strikes in the middle of an exchange",
        {"robolink.interrupts.InterruptGate.__enter__": stand_ins.nothing},
        found_by="a closed window",
    ),
    KnownDefect(
        "a login that comes back bent is shown",
        {
            f"{_SESSION}._take_aside": stand_ins.shown_whole,
            "robolink.controllers.epson.line.repeats": stand_ins.nothing,
        },
        CellKind.EPSON,
        found_by="users of smtpd",
    ),
    KnownDefect(
        "the selected tool is remembered within a session",
        {
            f"{_EPSON_TOOLS}._selected": stand_ins.remembered(EpsonToolTable._selected),
            f"{_EPSON_TOOLS}._send_selection": stand_ins.remembering(
                EpsonToolTable._send_selection
            ),
        },
        CellKind.EPSON,
        found_by=_REAL_DRIVERS,
    ),
    KnownDefect(
        "a movement does not look at the selected tool",
        {"robolink.controllers.motion_group.MotionGroupCore._require_tool": stand_ins.nothing},
    ),
    KnownDefect(
        "typed values lose digits",
        {"robolink.controllers.tool_table.ToolTableCore.write": stand_ins.three_digits},
        CellKind.SOFTMOTION,
        found_by=_REAL_DRIVERS,
    ),
    KnownDefect(
        "power and speed are not put back",
        {"robolink.controllers.epson.preserve.EpsonPreserver._restore_more": (stand_ins.nothing)},
        CellKind.EPSON,
        found_by=_REAL_DRIVERS,
    ),
    KnownDefect(
        "undo sorts by the wall clock",
        {"robolink.transaction._undo._newest_done": stand_ins.newest_by_the_clock},
        found_by=_REAL_DRIVERS,
    ),
    KnownDefect(
        "a marker outlives what it marks",
        {"robolink.controllers.markers.MarkerStore.clear": stand_ins.selection_stays_open},
        found_by=_REAL_DRIVERS,
    ),
    KnownDefect(
        "a frozen holder goes on after its lease was taken",
        {
            "robolink.journal._lease.Lease.secure": stand_ins.still_mine,
            "robolink.journal._lease.Lease._lose": stand_ins.nothing,
        },
        CellKind.SOFTMOTION,
        found_by=_REAL_DRIVERS,
    ),
    KnownDefect(
        "a roll-back writes over what was typed by hand",
        {"robolink.transaction._put_back._put_one_back": stand_ins.over_anything},
        found_by=_REAL_DRIVERS,
    ),
    KnownDefect(
        "a movement that nobody waits on goes on when the session ends",
        {"robolink.controllers.epson.group.EpsonGroup.abort_unfinished": stand_ins.nothing},
        CellKind.EPSON,
        found_by=_REAL_DRIVERS,
    ),
    KnownDefect(
        "a controller that gives up waiting counts as one that refused",
        {
            f"{_MOVEMENT}.ErrorCode": stand_ins.GIVING_UP_IS_A_REFUSAL,
            f"{_MOVEMENT}.EpsonMotion._runs_on": stand_ins.nothing,
        },
        CellKind.EPSON,
        found_by=_REAL_DRIVERS,
    ),
    KnownDefect(
        "a pose is told a tenth of a millimetre off",
        {f"{_EPSON_GROUP}.pose": stand_ins.a_tenth_off},
        CellKind.EPSON,
    ),
    KnownDefect(
        "a session leaves another robot in force",
        {
            "robolink.controllers.epson.controller.EpsonController._take_leave": (
                stand_ins.with_another_robot
            )
        },
        CellKind.EPSON,
    ),
)
