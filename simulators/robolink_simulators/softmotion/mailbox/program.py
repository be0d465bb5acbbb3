"""The mailbox program of a PLC: what it does with a command, and meanwhile.

Source: docs/reference/mailbox.md.

Theory of operation. Clients write words. In the next cycle of its task the program looks at
them: a whole new command is accepted, once, and handed to one of the desks, which call the
blocks of the axis group. Between the cycles it follows what the group does, as if its task ran
in step with every change, so that nothing of that depends on the period.
"""

from collections.abc import Mapping, Sequence
from typing import Final

from robolink.protocols.mailbox import (
    Answer,
    Command,
    CommandState,
    ErrorClass,
    ExportProfile,
    Finished,
    Opcode,
    WordOrder,
    opcodes_of,
)
from robolink_simulators.device.wire_time import WireTime
from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.mailbox.exchange import Inbox
from robolink_simulators.softmotion.mailbox.image import UserUnits
from robolink_simulators.softmotion.mailbox.jobs import (
    CommandResult,
    Handler,
    Job,
    Jobs,
    Rejected,
    SignalDesk,
    ok,
)
from robolink_simulators.softmotion.mailbox.motion_commands import MotionDesk
from robolink_simulators.softmotion.mailbox.options import MailboxOptions
from robolink_simulators.softmotion.mailbox.ownership import MailboxOwnership
from robolink_simulators.softmotion.mailbox.retained import RetainedMemory
from robolink_simulators.softmotion.mailbox.tool_commands import ToolDesk
from robolink_simulators.softmotion.mailbox.watchdogs import ClientWatch

_ANYTIME: Final = frozenset({Opcode.STOP, Opcode.HALT})
_CHANGING_TOOLS: Final = frozenset(
    {Opcode.WRITE_TOOL, Opcode.SELECT_TOOL, Opcode.CLEAR_TOOL, Opcode.SET_KINEMATICS}
)
_ANSWERED: Final = frozenset(
    {
        Opcode.SELECT_TOOL,
        Opcode.READ_TOOL,
        Opcode.OWNERSHIP,
        Opcode.READ_INPUT,
        Opcode.MOVE_UNTIL_INPUT,
    }
)


class MailboxProgram:
    """One mailbox for one axis group, from one PLC start to the next.

    Args:
        group: The axis group.
        memory: The retained variables.
        tools: Serves the opcodes about tools.
        units: Of the mailbox.
        options: How the project is set up.
        wire_time: By which the silence of clients is counted.

    Attributes:
        inbox: What clients have written.
        jobs: The commands that were accepted.
        ownership: Who may command.
        permitted: The machine's own permit (``xPermit``).
        capabilities: What the program can be told.
    """

    def __init__(
        self,
        group: AxisGroup,
        memory: RetainedMemory,
        tools: ToolDesk,
        units: UserUnits,
        *,
        options: MailboxOptions,
        wire_time: WireTime,
    ) -> None:
        profile = ExportProfile(options.profile)
        self.capabilities = profile.capabilities
        self.inbox = Inbox(WordOrder[options.word_order.upper()])
        self.jobs = Jobs(group)
        self.ownership = MailboxOwnership(memory, wire_time)
        self.permitted = True
        self._group = group
        self._memory = memory
        self._tools = tools
        self._motion = MotionDesk(group, units, self.jobs)
        self._watch = ClientWatch(wire_time)
        self._cycle_ns = options.program_cycle_us * 1000
        self._look_ns: int | None = None
        self._answer = Answer()
        self._handlers = self._handlers_of(profile)

    @property
    def answer(self) -> Answer:
        """The answer words: the acknowledged command's own, or else the set tool."""
        job = self.jobs.acknowledged
        if job is None or job.command.opcode not in _ANSWERED:
            return self._tools.set_tool()
        return self._motion.latched(job) or self._answer

    @property
    def holder(self) -> int:
        """Token of the owner, 0 for nobody."""
        return self.ownership.holder

    def write(self, first: int, words: Sequence[int], now_ns: int) -> None:
        """Accept a client's write; the next cycle reads it."""
        self.inbox.write(first, words)
        self._plan_look(now_ns)

    def run(self, now_ns: int) -> None:
        """Do what is due now."""
        self._follow()
        looks = self._look_ns is not None and now_ns >= self._look_ns
        if looks:
            self._look_ns = None
            self._note_beat(now_ns)
            command = self.inbox.new_command()
            if command is not None:
                self._accept(command, now_ns)
        self._supervise(now_ns)
        if looks:
            self._follow()

    def zero_inputs(self, now_ns: int) -> None:
        """Take the zeros that a fieldbus leaves when its watchdog expires."""
        self.inbox.zero()
        self._plan_look(now_ns)

    def seize(self, now_ns: int) -> None:
        """Let an unknown client take the mailbox, because a person insists."""
        self.ownership.seize(now_ns)
        self.jobs.end_moving(ErrorClass.NOT_OWNER)

    def next_change(self, now_ns: int) -> int | None:
        """Return when :meth:`run` will next do something by itself, if ever."""
        deadline_ns = self._watch.deadline_ns
        if self.jobs.moving and (self._reason_to_end(now_ns) or self.jobs.expelled):
            # Permit or owner lost since the last cycle, or a halt was refused: try again.
            deadline_ns = self._next_cycle_ns(now_ns)
        if self._look_ns is None or deadline_ns is None:
            return deadline_ns if self._look_ns is None else self._look_ns
        return min(self._look_ns, deadline_ns)

    def _follow(self) -> None:
        self._motion.follow()
        self.jobs.follow()

    def _accept(self, command: Command, now_ns: int) -> None:
        owned = self.ownership.owns(command)
        if owned:
            self.ownership.heard(now_ns)
        try:
            self._require_admitted(command)
            if self.jobs.in_work and command.opcode not in _ANYTIME:
                self.inbox.hold_back(command, owned=owned)
                self.jobs.note(Finished(command.sequence, CommandState.ERROR, ErrorClass.BUSY))
                return
            result = self._carried_out(command, now_ns, owned=owned)
            job = Job(command, result.execution)
        except Rejected as rejected:
            result = CommandResult(BlockExecution())
            job = Job(command, result.execution)
            job.reject(rejected.error_class, rejected.raw)
        named = self.ownership.answer() if command.opcode == Opcode.OWNERSHIP else Answer()
        self._answer = result.answer or named
        self.inbox.accept(command, owned=owned)
        self.jobs.add(job)

    def _require_admitted(self, command: Command) -> None:
        """Refuse what is refused for every opcode, in the order of docs/reference/mailbox.md."""
        refusal = command.refusal()
        if refusal:
            raise Rejected(refusal)
        if command.opcode not in self._handlers and command.opcode != Opcode.OWNERSHIP:
            raise Rejected(ErrorClass.UNKNOWN_OPCODE)
        if command.boot_id not in (0, self._memory.boot_id):
            raise Rejected(ErrorClass.OTHER_BOOT)
        self.ownership.require(command)
        if not self.permitted and command.needs_permit:
            raise Rejected(ErrorClass.NOT_PERMITTED)

    def _carried_out(self, command: Command, now_ns: int, *, owned: bool) -> CommandResult:
        if command.opcode == Opcode.OWNERSHIP:
            before = self.holder
            moving = not self._group.motion.resting or any(
                axis.moving_alone for axis in self._group.axes
            )
            result = self._halted_for_release(command)
            self.ownership.carry_out(command, now_ns, moving=moving)
            if self.holder not in (0, before):
                self.jobs.end_moving(ErrorClass.NOT_OWNER)
            return result
        result = self._handlers[command.opcode](command)
        if command.opcode == Opcode.JOG:
            self.jobs.note_buttons(owned=owned)
        if command.opcode in _CHANGING_TOOLS:
            self._memory.tool_changed = True
        return result

    def _note_beat(self, now_ns: int) -> None:
        heard = self._watch.note(self.inbox.heartbeat, self._memory.epoch, now_ns)
        if heard and self.ownership.holder:
            self.ownership.heard(now_ns)

    def _halted_for_release(self, command: Command) -> CommandResult:
        """Halt what is unfinished before its owner leaves; done when the group is at rest."""
        leaves = command.operands[:2] in ((0, 0), (0, 1)) and self.ownership.owns(command)
        return CommandResult(self._group.halt()) if leaves and self.jobs.moving else ok()

    def _supervise(self, now_ns: int) -> None:
        """Halt what moves when nobody supervises it any more; the tool stays."""
        moving = self.jobs.moving
        self._watch.watch(moving=bool(moving), now_ns=now_ns)
        if not moving:
            return
        cause = self._reason_to_end(now_ns)
        if cause:
            self.jobs.end_moving(cause)
        elif not self.jobs.expelled:
            return
        self._group.halt()
        self._follow()
        self._watch.watch(moving=bool(self.jobs.moving), now_ns=now_ns)

    def _reason_to_end(self, now_ns: int) -> ErrorClass:
        """Return why nothing may continue moving, NONE when it may."""
        if not self.permitted:
            return ErrorClass.NOT_PERMITTED
        deadline_ns = self._watch.deadline_ns
        late = deadline_ns is not None and now_ns >= deadline_ns
        return ErrorClass.HEARTBEAT_LOST if late or self._watch.zeroed else ErrorClass.NONE

    def _plan_look(self, now_ns: int) -> None:
        if self._look_ns is None:
            self._look_ns = self._next_cycle_ns(now_ns)

    def _next_cycle_ns(self, now_ns: int) -> int:
        return (now_ns // self._cycle_ns + 1) * self._cycle_ns

    def _handlers_of(self, profile: ExportProfile) -> Mapping[int, Handler]:
        handlers: dict[int, Handler] = {**self._tools.opcodes, **self._motion.opcodes}
        handlers |= SignalDesk(self._group).opcodes
        held = opcodes_of(profile)
        return {opcode: handler for opcode, handler in handlers.items() if opcode in held}
