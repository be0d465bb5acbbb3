"""A PLC mailbox in its documented DEVICE role.

It follows docs/reference/mailbox.md with the codec and nothing else: no kinematics, no path. A
movement takes half a second and ends at its target.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from robolink_simulators.cell.clock import ManualClock

from robolink.protocols.mailbox import (
    Answer,
    Bits,
    BlockError,
    Capability,
    Command,
    CommandState,
    ErrorClass,
    Finished,
    GroupState,
    Opcode,
    Response,
    Six,
    Slot,
    beats_for,
    crc16,
    decode_command,
    encode_device_id,
    encode_response,
    kinematics_word,
    next_number,
)
from robolink.transport import MailboxHead

MS = 1_000_000
MOVE_NS = 500 * MS
WATCHDOG_NS = 500 * MS
SILENCE_NS = 10_000 * MS
IDENTITY: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
STRANGER = 0xCAFE0001

DONE = (CommandState.DONE, 0)

Outcome = tuple[CommandState, int]


class Plc:
    """The mailbox program.

    Attributes:
        now: The shown state, except time, ends and tools.
        slots: The tool slots.
        answers: Whether it acknowledges commands at all.
        frozen: Whether its heartbeat has stopped.
        takes_tools: Whether the axis group really uses a written tool.
        refusals: Opcodes that are refused, with their error.
        refuses: Refuses single commands: returns the error, 0 for none.
        overhears: The commands that it never notices.
        device: Its device block, which identifies the PLC.
        edge: The place where the input switches during a movement that waits for it.
        executed: Every command that it accepted, in order.
    """

    def __init__(self, clock: ManualClock) -> None:
        self.clock = clock
        self.now = Response(
            group_state=GroupState.STANDBY,
            bits=Bits.POWERED | Bits.IN_SYNC | Bits.TOOL_KNOWN | Bits.PERMITTED,
            boot_id=7,
            tcp=(400.0, 100.0, 300.0, 30.0, 0.0, 0.0),
            kinematics=kinematics_word(2),
            axis_count=4,
            capabilities=Capability(sum(Capability)),
            ack_head=40,
            ack_owner=STRANGER,
            state=CommandState.DONE,
        )
        self.slots = {number: Slot() for number in range(1, 16)}
        self.device = encode_device_id(0x1234_BEEF)
        self.set_tool = IDENTITY
        self.owner = 0
        self.epoch = 65535
        self.answers = True
        self.frozen = False
        self.takes_tools = True
        self.executed: list[Command] = []
        self.refusals: dict[Opcode, int] = {}
        self.refuses: Callable[[Command], int] = lambda _command: 0
        self.overhears: Callable[[Command], bool] = lambda _command: False
        self.inputs = {3: 1}
        self.outputs: dict[int, int] = {}
        self.edge: Six | None = None
        self._last: tuple[int, int, int] | None = None
        self._beat = (0, 0)
        self._sign_ns = clock.now_ns()
        self._queue: list[tuple[int, int, Command]] = []
        self._rejected: set[tuple[int, int]] = set()

    def opcodes(self) -> list[Opcode]:
        """Return the opcodes of the executed commands."""
        return [Opcode(command.opcode) for command in self.executed]

    def restart(self) -> None:
        """Switch the PLC off and on: the owner is gone, the epoch and the slots remain."""
        self.owner, self.set_tool, self._last = 0, IDENTITY, None
        self._queue.clear()
        self.now = Response(
            **{
                name: getattr(self.now, name)
                for name in ("kinematics", "axis_count", "capabilities", "unit_um", "tcp")
            },
            boot_id=next_number(self.now.boot_id),
            bits=Bits.PERMITTED,
        )

    def receive(self, words: Sequence[int]) -> None:
        """Take a command block."""
        self.advance()
        try:
            command = decode_command(words)
        except BlockError as error:
            if error.head and (error.head, error.crc) not in self._rejected:
                self._rejected.add((error.head, error.crc))
                self.now = replace(self.now, rejected=self.now.rejected + 1)
            return
        self.take_beat(words[62])
        identity = (command.owner, command.sequence, crc16(words[:61]))
        if identity == self._last or not self.answers or self.overhears(command):
            return
        self._last = identity
        if command.owner == self.owner:
            self._sign_ns = self.clock.now_ns()
        self.executed.append(command)
        self.acknowledge(command, *self._carry_out(command))

    def acknowledge(self, command: Command, state: CommandState, error: int) -> None:
        """Show a command as accepted."""
        self.now = replace(
            self.now,
            ack_head=command.sequence,
            ack_owner=command.owner,
            opcode_echo=command.opcode,
            state=state,
            error_class=error,
            raw_error=11000 if error else 0,
            answer=self._answer(command),
        )

    def take_beat(self, word: int) -> None:
        """Take the client's heartbeat; a late one restarts nothing."""
        self.advance()
        if beats_for(word, self.epoch) and word != self._beat[0]:
            self._beat = (word, self.clock.now_ns())
            self._sign_ns = self.clock.now_ns()

    def advance(self) -> None:
        """End movements, by arrival or for lack of heartbeats."""
        now_ns = self.clock.now_ns()
        silent_at = self._beat[1] + WATCHDOG_NS
        while self._queue:
            sequence, end_ns, command = self._queue[0]
            if end_ns <= min(now_ns, silent_at):
                self._queue.pop(0)
                self._arrive(sequence, command)
            elif now_ns > silent_at:
                self.end_all(ErrorClass.HEARTBEAT_LOST)
            else:
                break
        if self.now.bits & Bits.JOGGING and now_ns > silent_at:
            self.now = replace(self.now, bits=self.now.bits & ~Bits.JOGGING)
        self._show()

    def end_all(self, error: int = ErrorClass.NONE) -> None:
        """End every movement before its arrival."""
        for sequence, _end_ns, _command in self._queue:
            self._finish(Finished(sequence, CommandState.ABORTED, error))
        self._queue.clear()
        self._show()

    def response(self) -> tuple[int, ...]:
        """Return the response block."""
        self.advance()
        return encode_response(replace(self.now, plc_heartbeat=self._heartbeat()))

    def head(self) -> MailboxHead:
        """Return what the head of the response block says."""
        self.advance()
        now = self.now
        shown = (now.ack_head, now.state, now.error_class, now.group_state, self._heartbeat())
        return MailboxHead(*map(int, shown))

    def _heartbeat(self) -> int:
        return 1 if self.frozen else self.clock.now_ns() // (4 * MS) & 0xFFFF

    def _show(self) -> None:
        moving = self._queue or self.now.bits & Bits.JOGGING
        state = self.now.group_state
        if state in (GroupState.STANDBY, GroupState.MOVING):
            state = GroupState.MOVING if moving else GroupState.STANDBY
        active = self._queue[0][0] if self._queue else 0
        now = self.now
        shown = (now.group_state, now.queue_length, now.active_movement)
        if shown != (state, len(self._queue), active):
            self.now = replace(
                now, group_state=state, queue_length=len(self._queue), active_movement=active
            )

    def _arrive(self, sequence: int, command: Command) -> None:
        error = ErrorClass.NONE
        if command.opcode == Opcode.MOVE_UNTIL_INPUT and self.edge is None:
            error = ErrorClass.NO_EDGE
        self.now = replace(self.now, tcp=self.edge or command.pose)
        self._finish(Finished(sequence, CommandState.ERROR if error else CommandState.DONE, error))

    def _finish(self, end: Finished) -> None:
        first, second, third, _oldest = self.now.finished
        self.now = replace(self.now, finished=(end, first, second, third))
        if self.now.ack_head == end.sequence:
            self.now = replace(self.now, state=end.state, error_class=end.error_class)

    def _answer(self, command: Command) -> Answer:
        if command.opcode == Opcode.OWNERSHIP:
            return Answer.of_owner(self.owner, self.epoch)
        if command.opcode == Opcode.READ_INPUT:
            return Answer.of_input(self.inputs.get(command.operands[0], 0))
        if command.opcode == Opcode.MOVE_UNTIL_INPUT:
            return Answer.of_pose(self.edge or IDENTITY)
        return Answer.of_pose(self.set_tool)

    def _carry_out(self, command: Command) -> tuple[CommandState, int]:
        opcode = Opcode(command.opcode)
        error = command.refusal() or self.refusals.get(opcode, 0) or self.refuses(command)
        if not error and command.boot_id not in (0, self.now.boot_id):
            error = ErrorClass.OTHER_BOOT
        if not error and command.needs_owner and command.owner != self.owner:
            error = ErrorClass.NOT_OWNER
        elif not error and command.needs_owner and command.epoch != self.epoch:
            error = ErrorClass.STALE_EPOCH
        if not error and command.needs_permit and not self.now.bits & Bits.PERMITTED:
            error = ErrorClass.NOT_PERMITTED
        if error:
            return CommandState.ERROR, error
        act = self._acts().get(opcode)
        return act(command) if act else (CommandState.DONE, 0)

    def _acts(self) -> dict[Opcode, Callable[[Command], Outcome]]:
        return {
            Opcode.OWNERSHIP: self._own,
            Opcode.WRITE_TOOL: self._write_tool,
            Opcode.SELECT_TOOL: self._select_tool,
            Opcode.CLEAR_TOOL: self._clear_tool,
            Opcode.READ_TOOL: self._read_tool,
            Opcode.SET_KINEMATICS: self._set_kinematics,
            Opcode.WRITE_OUTPUT: self._write_output,
            Opcode.MOVE_DIRECT: self._move,
            Opcode.MOVE_LINEAR: self._move,
            Opcode.MOVE_UNTIL_INPUT: self._move,
            Opcode.JOG: self._jog,
            Opcode.STOP: self._stop,
            Opcode.HALT: self._halt,
            Opcode.RESET: lambda _command: self._enter(GroupState.STANDBY),
            Opcode.ENABLE: lambda _command: self._enter(GroupState.STANDBY),
            Opcode.DISABLE: lambda _command: self._enter(GroupState.DISABLED),
        }

    def _own(self, command: Command) -> Outcome:
        take, insist = command.operands[0], command.operands[1]
        if not take:
            self.owner = 0
        elif self.owner in (0, command.owner) or insist or self._owner_is_silent():
            if command.owner != self.owner:
                self.end_all(ErrorClass.NOT_OWNER)
            self.owner, self.epoch = command.owner, next_number(self.epoch)
        else:
            return CommandState.ERROR, ErrorClass.NOT_OWNER
        return DONE

    def _owner_is_silent(self) -> bool:
        return self.clock.now_ns() - self._sign_ns >= SILENCE_NS and not self._queue

    def _write_tool(self, command: Command) -> Outcome:
        number = command.operands[0]
        counter = self.slots[number].counter + 1
        self.slots[number] = Slot(counter, True, command.pose, command.name)
        if self.now.tool_slot == number and self.takes_tools:
            self.set_tool = command.pose
        return DONE

    def _select_tool(self, command: Command) -> Outcome:
        number = command.operands[0]
        self.set_tool = self.slots[number].tool if number else IDENTITY
        self.now = replace(self.now, tool_slot=number)
        return DONE

    def _clear_tool(self, command: Command) -> Outcome:
        number = command.operands[0]
        self.slots[number] = Slot(self.slots[number].counter + 1)
        return DONE

    def _read_tool(self, command: Command) -> Outcome:
        if command.operands[0] and not self._queue:
            return CommandState.ERROR, ErrorClass.NO_SUCH_MOVEMENT
        return DONE

    def _set_kinematics(self, command: Command) -> Outcome:
        self.set_tool = IDENTITY
        word = kinematics_word(*command.operands[:2])
        self.now = replace(self.now, kinematics=word, tool_slot=0)
        return DONE

    def _write_output(self, command: Command) -> Outcome:
        self.outputs[command.operands[0]] = command.operands[1]
        return DONE

    def _move(self, command: Command) -> Outcome:
        start_ns = self._queue[-1][1] if self._queue else self.clock.now_ns()
        self._queue.append((command.sequence, start_ns + MOVE_NS, command))
        self._show()
        return CommandState.ACTIVE, 0

    def _jog(self, command: Command) -> Outcome:
        goes = bool(command.operands[0] | command.operands[1])
        bits = self.now.bits | Bits.JOGGING if goes else self.now.bits & ~Bits.JOGGING
        self.now = replace(self.now, bits=bits)
        self._show()
        return (CommandState.ACTIVE, 0) if goes else DONE

    def _stop(self, command: Command) -> Outcome:
        self.now = replace(self.now, bits=self.now.bits & ~Bits.JOGGING)
        self.end_all()
        return self._enter(GroupState.STANDBY if command.operands[0] else GroupState.STOPPING)

    def _halt(self, _command: Command) -> Outcome:
        self.now = replace(self.now, bits=self.now.bits & ~Bits.JOGGING)
        self.end_all()
        return DONE

    def _enter(self, state: GroupState) -> Outcome:
        self.now = replace(self.now, group_state=state)
        return DONE
