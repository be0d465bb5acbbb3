"""One program and its answers, line by line; no socket here.

Each question is answered by one line. What cannot be understood ends the conversation without an
answer, and the program, left without one, puts the old value back.
"""

from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from robolink.errors import (
    BusyError,
    CalibrationError,
    ConfigError,
    OutcomeUnknownError,
    RemoteProtocolError,
    RobolinkError,
)
from robolink.messages import tr
from robolink.model import (
    EntryKind,
    Identity,
    NewEntry,
    Pose,
    Signature,
    ToolOffset,
    plain_offset,
)
from robolink.protocols.spel_callback import (
    CallbackLine,
    CallbackWord,
    offset_fields,
    read_components,
    read_tool,
    same_thousandths,
)
from robolink.serving._callback_journal import (
    ProgramChange,
    begin_change,
    open_changes,
    record_name,
)
from robolink.serving._callback_limits import CallbackLimits, believed
from robolink.serving._program_measure import (
    facts_for_program,
    measure_named,
    proved,
    statements_on_record,
)
from robolink.stations import Station, StationKind, find_station

if TYPE_CHECKING:
    from robolink.calibration import AccuracyFacts, CalibrationResult
    from robolink.config import Cell
    from robolink.journal import Journal, JournalOutcomeLog
    from robolink.serving._program_measure import ProgramMeasure

Answer = tuple[CallbackWord, tuple[str, ...]]

_TOOLS: Final = range(1, 16)
_LENGTHS: Final = {
    CallbackWord.HELLO: 12,
    CallbackWord.BEGIN: 9,
    CallbackWord.SOLVE: 0,
    CallbackWord.WROTE: 8,
    CallbackWord.JUDGE: 1,
    CallbackWord.KEPT: 8,
    CallbackWord.RESTORED: 8,
    CallbackWord.BYE: 0,
}
"""Number of fields of each question; the fields of a pose depend on the method."""

_POSE_FIELDS: Final = 7
"""Number of fields before what was seen at a pose: the selected tool, and six lengths and angles.
"""


@dataclass(slots=True)
class _Run:
    """One calibration of one tool, from BEGIN on."""

    tool: int
    before: ToolOffset
    measure: "ProgramMeasure"
    station: str = ""
    result: "CalibrationResult | None" = None
    facts: "AccuracyFacts | None" = None
    change: ProgramChange | None = None
    written: bool = False


class CallbackConversation:
    """Answers one program.

    Args:
        journal: Where all is recorded.
        limits: What its measurements are held to.
        peer: From where it calls, as a person may read it.
        signature: Who watches over it, and with what software.
        controllers: Names under which its robots are on record, see ``record_name``; without one,
            that of the robot's serial number.
        cell: The cell, whose stations a program may measure at; those on record count without.
        tell: Told of each refusal: the code that the program is given, and the error, which says
            what a person has to do. The program cannot show that.

    Attributes:
        over: Whether the program has said that it is done.

    Example:
        >>> from robolink.journal import memory_journal
        >>> from robolink.protocols.spel_callback import CallbackLine, CallbackWord
        >>> from robolink.serving import CallbackConversation, CallbackLimits
        >>> journal, limits = memory_journal("serving-example"), CallbackLimits(tolerance_mm=0.1)
        >>> talk = CallbackConversation(journal, limits, peer="192.168.0.1")
        >>> robot_tool_value = ("SIM00001", "1", "0", "-", "1", "1", *("0.000",) * 6)
        >>> talk.answer(CallbackLine(1, CallbackWord.HELLO, robot_tool_value)).word.value
        'WELCOME'
        >>> talk.close()
    """

    def __init__(
        self,
        journal: "Journal",
        limits: CallbackLimits,
        *,
        peer: str,
        signature: Signature | None = None,
        controllers: Collection[str] = (),
        cell: "Cell | None" = None,
        tell: Callable[[str, RobolinkError], None] = lambda _code, _error: None,
    ) -> None:
        self.over = False
        self._journal = journal
        self._limits = limits
        self._peer = peer
        self._signature = signature or Signature()
        self._controllers, self._cell = tuple(controllers), cell
        if cell is not None:
            cell.home.require_here()
        self._tell = tell
        self._log: JournalOutcomeLog | None = None
        self._number = 0
        self._flag = 0
        self._welcome = False
        self._run: _Run | None = None
        self._deeds: dict[CallbackWord, Callable[[Sequence[str]], Answer]] = {
            CallbackWord.HELLO: self._hello,
            CallbackWord.BEGIN: self._begin,
            CallbackWord.POSE: self._pose,
            CallbackWord.PROOF: self._pose_of_proof,
            CallbackWord.ROUND: self._round,
            CallbackWord.SOLVE: self._solve,
            CallbackWord.WROTE: self._wrote,
            CallbackWord.JUDGE: self._judge,
            CallbackWord.KEPT: lambda fields: self._reported(fields, kept=True),
            CallbackWord.RESTORED: lambda fields: self._reported(fields, kept=False),
            CallbackWord.BYE: self._bye,
        }

    def answer(self, line: CallbackLine) -> CallbackLine:
        """Return the answer to a question.

        Raises:
            RemoteProtocolError: It makes no sense here; nothing is to be answered.
        """
        deed = self._deeds.get(line.word)
        if deed is None or len(line.fields) != _LENGTHS.get(line.word, len(line.fields)):
            raise _senseless(line)
        if line.number != self._number + 1 or (self._log is None) != (line.word == "HELLO"):
            raise _senseless(line)
        self._number = line.number
        try:
            word, fields = deed(line.fields)
        except (CalibrationError, BusyError, ConfigError, OutcomeUnknownError) as error:
            word, fields = self._refused(error)
        return CallbackLine(line.number, word, fields)

    def beat(self) -> None:
        """Show others that a change is in progress."""
        if self._log is not None:
            self._log.beat()

    def close(self) -> None:
        """Release the lease. What is open stays open until program or person says how it ended."""
        if self._log is not None:
            self._log.close()

    # What the program reports about itself.

    def _hello(self, fields: Sequence[str]) -> Answer:
        serial, robot, flag, operation, tool, *value = fields
        if flag not in ("0", "1", "2", "3"):
            raise RemoteProtocolError(tr("{field!r} is not a state of a program.", field=flag))
        place = f"spel@{self._peer}"
        name = record_name(serial, _number(robot), self._controllers) or place
        log = self._journal.log(name, signature=self._signature)
        # The robots of one controller call from the same address.
        address = f"spel://{self._peer}" if robot == "1" else f"spel://{self._peer}?robot={robot}"
        log.ask(lambda: Identity(name, address, place))
        self._log, self._flag = log, int(flag)
        if flag == "1":
            raise CalibrationError("not_restored", tr("The program has not put its tool back."))
        if flag in ("2", "3"):
            self._settle(operation, _number(tool), read_tool(value), kept=flag == "2")
        self._welcome = True
        return CallbackWord.WELCOME, ()

    def _settle(self, operation: str, tool: int, value: ToolOffset | None, *, kept: bool) -> None:
        """Close the program's change when the link is cut."""
        log = self._require_log()
        changes, _ = open_changes(log)
        for change in changes:
            if change.operation == operation and change.tool == tool:
                if not (change.end_kept(value) if kept else change.end_restored(value)):
                    raise CalibrationError(
                        "conflict", tr("Tool {tool} holds another value.", tool=tool)
                    )
                return
        log.append(
            NewEntry(
                EntryKind.RECONNECT,
                operation=operation,
                tool=tool,
                details={"kept": kept, "reported": plain_offset(value)},
            )
        )

    def _begin(self, fields: Sequence[str]) -> Answer:
        if not self._welcome:
            raise RemoteProtocolError(tr("The program was not let in."))
        tool, before = _number(fields[0]), read_tool(fields[2:])
        if tool not in _TOOLS:
            raise CalibrationError("tool_number", tr("There is no tool {tool}.", tool=tool))
        if before is None:
            raise CalibrationError("tool_undefined", tr("Tool {tool} is not defined.", tool=tool))
        self._require_settled(tool, before)
        try:
            measure = measure_named(fields[1], self._limits, self._station)
        except ConfigError as error:
            raise CalibrationError("station_unknown", error.what) from error
        self._run = _Run(tool, before, measure, fields[1].partition("@")[2])
        return CallbackWord.GO, ()

    def _station(self, name: str, kind: StationKind) -> Station:
        recorded = self._require_log().recorded(kinds=(EntryKind.STATION,))
        return find_station(self._cell, recorded, name, kind=kind)

    def _require_settled(self, tool: int, value: ToolOffset | None) -> None:
        """Close what the program never wrote; refuse while anything else is open.

        A program with no flag set wrote nothing: it sets the flag before it writes.

        Raises:
            CalibrationError: ``unsettled``.
        """
        log = self._require_log()
        changes, others = open_changes(log)
        for change in changes:
            if self._flag != 0 or change.tool != tool or not change.end_never_written(value):
                others = True
        if others or self._in_work():
            raise CalibrationError(
                "unsettled", tr("Something that was begun on this controller is not settled.")
            )

    # What the program measured.

    def _pose(self, fields: Sequence[str]) -> Answer:
        run, stored = self._measuring(proof=False)
        return self._add(run, fields, {run.tool: stored}, proof=False)

    def _pose_of_proof(self, fields: Sequence[str]) -> Answer:
        run, written = self._measuring(proof=True)
        return self._add(run, fields, {run.tool: written}, proof=True)

    def _measuring(self, *, proof: bool) -> tuple[_Run, ToolOffset]:
        """Return what is measured, and the value of its tool at this moment.

        Raises:
            RemoteProtocolError: Nothing is measured now, or nothing tested.
        """
        run = self._require_run()
        if not proof:
            if run.change is not None:
                raise RemoteProtocolError(tr("The touches of the measurement were over."))
            return run, run.before
        if not run.written or run.change is None or run.change.requested is None:
            raise RemoteProtocolError(tr("Nothing was written that could be proved."))
        return run, run.change.requested

    def _round(self, fields: Sequence[str]) -> Answer:
        from robolink.calibration import flange_poses
        from robolink.serving._beam_measure import ProgramCrossings
        from robolink.serving._beam_round import read_round

        driven = read_round(fields)
        run, value = self._measuring(proof=driven.proof)
        if not isinstance(run.measure, ProgramCrossings):
            raise RemoteProtocolError(tr("Only beams are driven around."))
        if driven.tool != run.tool:
            raise _other_tool(driven.tool)

        def flange_of(pose: Pose) -> Pose:
            (flange,) = flange_poses([pose], tools={run.tool: value})
            return flange

        return CallbackWord.OK, (str(run.measure.add_round(driven, flange_of)),)

    def _add(
        self, run: _Run, fields: Sequence[str], known: dict[int, ToolOffset], *, proof: bool
    ) -> Answer:
        from robolink.calibration import flange_poses

        pose_fields, seen = fields[:_POSE_FIELDS], fields[_POSE_FIELDS:]
        if len(seen) != run.measure.length:
            raise RemoteProtocolError(tr("A pose has the wrong number of fields."))
        taken_in, (x, y, z, u, v, w) = _number(pose_fields[0]), read_components(pose_fields[1:])
        if taken_in and taken_in not in known:
            raise _other_tool(taken_in)
        pose = Pose(x_mm=x, y_mm=y, z_mm=z, u_deg=u, v_deg=v, w_deg=w, tool=taken_in)
        (flange,) = flange_poses([pose], tools=known)
        return CallbackWord.OK, (str(run.measure.add(flange, seen, proof=proof)),)

    def _solve(self, _fields: Sequence[str]) -> Answer:
        run = self._require_run()
        if run.change is not None:
            raise RemoteProtocolError(tr("A value was given already."))
        found = run.measure.solve(run.before)
        log = self._require_log()
        facts = facts_for_program(log.recorded, self._cell, found, run.measure, run.station)
        run.facts, result = facts, believed(found, run.before, self._limits, facts)
        rounded = ToolOffset(*(round(value, 3) for value in result.offset.components()))
        run.result = result
        run.change = begin_change(log, run.tool, run.before, rounded)
        run.change.note(
            EntryKind.CALIBRATION,
            result.method,
            peer=self._peer,
            **statements_on_record(result),
            **run.measure.on_record(),
        )
        return CallbackWord.VALUE, (run.change.operation, *offset_fields(rounded))

    # What the program wrote.

    def _wrote(self, fields: Sequence[str]) -> Answer:
        run, change = self._of_change(fields[0])
        value = read_tool(fields[1:])
        if not same_thousandths(value, change.requested):
            raise CalibrationError("read_back", tr("Another value was read back."))
        change.note(EntryKind.WRITE, tr("written by the program"), reported=plain_offset(value))
        run.written = True
        return CallbackWord.PROVE, ()

    def _judge(self, fields: Sequence[str]) -> Answer:
        run, change = self._of_change(fields[0])
        if run.result is None or change.requested is None or not run.written:
            raise RemoteProtocolError(tr("Nothing was written that could be proved."))
        assert run.facts is not None  # noqa: S101 - a value was given
        proof = proved(run.measure, run.result, change.requested, run.facts)
        change.allow_keeping(
            tr("confirmed by what the program saw after the write"),
            max_drift_mm=proof.max_drift_mm,
            tolerance_mm=self._limits.tolerance_mm,
            warnings=list(proof.warnings),
        )
        return CallbackWord.KEEP, (change.operation,)

    def _reported(self, fields: Sequence[str], *, kept: bool) -> Answer:
        _, change = self._of_change(fields[0])
        value = read_tool(fields[1:])
        self._run = None
        if not (change.end_kept(value) if kept else change.end_restored(value)):
            raise CalibrationError(
                "conflict", tr("Tool {tool} holds another value.", tool=change.tool)
            )
        return CallbackWord.DONE, ()

    def _bye(self, _fields: Sequence[str]) -> Answer:
        self.over = True
        return CallbackWord.BYE, ()

    # The present state.

    def _refused(self, error: RobolinkError) -> Answer:
        """Record a refusal; a program that has written restores the old value."""
        code = error.code if isinstance(error, CalibrationError) else _code(error)
        run, log = self._run, self._log
        self._say(code, error)
        if log is None:
            return CallbackWord.REFUSE, (code,)
        entry = NewEntry(
            EntryKind.REFUSED,
            tool=None if run is None else run.tool,
            verdict=error.what,
            details={"code": code, "peer": self._peer},
        )
        try:
            log.append(entry)
        except ConfigError as unrecorded:
            code = self._unrecorded("journal", unrecorded, besides=error)
        except OutcomeUnknownError as missing:  # nothing is recorded until a person has looked
            code = self._unrecorded("unsettled", missing, besides=error)
        if self._in_work():
            return CallbackWord.BACK, (code,)
        self._run = None
        return CallbackWord.REFUSE, (code,)

    def _unrecorded(self, code: str, error: RobolinkError, *, besides: RobolinkError) -> str:
        """Report why a refusal was not recorded, unless it was refused for it; return the code."""
        if str(error) != str(besides):
            self._say(code, error)
        return code

    def _say(self, code: str, error: RobolinkError) -> None:
        with suppress(Exception):  # a console that is gone must not end a conversation
            self._tell(code, error)

    def _in_work(self) -> bool:
        return self._run is not None and self._run.change is not None

    def _require_log(self) -> "JournalOutcomeLog":
        if self._log is None:
            raise RemoteProtocolError(tr("The program has not said who it is."))
        return self._log

    def _require_run(self) -> _Run:
        if self._run is None:
            raise RemoteProtocolError(tr("No calibration was begun."))
        return self._run

    def _of_change(self, operation: str) -> tuple[_Run, ProgramChange]:
        run = self._require_run()
        if run.change is None or run.change.operation != operation:
            raise RemoteProtocolError(tr("{operation!r} was not begun here.", operation=operation))
        return run, run.change


def _code(error: RobolinkError) -> str:
    if isinstance(error, BusyError):
        return "busy"
    return "settled_by_another" if isinstance(error, OutcomeUnknownError) else "journal"


def _number(field_text: str) -> int:
    if not (field_text.isascii() and field_text.isdecimal() and len(field_text) <= 5):
        raise RemoteProtocolError(tr("{field!r} is not a number.", field=field_text))
    return int(field_text)


def _other_tool(tool: int) -> CalibrationError:
    return CalibrationError("tool_pose", tr("A pose was taken in tool {tool}.", tool=tool))


def _senseless(line: CallbackLine) -> RemoteProtocolError:
    return RemoteProtocolError(
        tr("{word} number {number} makes no sense here.", word=line.word, number=line.number)
    )
