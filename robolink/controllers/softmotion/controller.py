"""An axis group of a CODESYS SoftMotion PLC behind its mailbox."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from types import TracebackType
from typing import TYPE_CHECKING, Final, Self

from robolink.controllers.softmotion.facts import MailboxFacts, set_kinematics
from robolink.controllers.softmotion.io import SoftMotionIo
from robolink.controllers.softmotion.link.answers import describe
from robolink.controllers.softmotion.link.condition import condition_of, status_of
from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.controllers.softmotion.link.ownership import take_command
from robolink.controllers.softmotion.link.stopping import REST_S
from robolink.controllers.softmotion.motion.group import SoftMotionGroup
from robolink.controllers.softmotion.tools.preserve import Preserver
from robolink.controllers.softmotion.tools.resolve import SoftMotionResolver
from robolink.controllers.softmotion.tools.table import SoftMotionToolTable
from robolink.errors import ControllerFaultError, RobolinkError
from robolink.messages import tr
from robolink.model import (
    Act,
    Capabilities,
    ControllerFacts,
    ControllerStatus,
    Ledger,
    Marker,
    MarkerKind,
    NewEntry,
    OutcomeLog,
)
from robolink.protocols.mailbox import (
    Capability,
    Command,
    GroupState,
    Kinematics,
    Opcode,
    Response,
)
from robolink.standing import note_standing
from robolink.stop_latch import StopLatch
from robolink.timing import Clock, Deadline

if TYPE_CHECKING:
    from robolink.controllers.softmotion.verify import MailboxFinding


_RESETS: Final = (
    (GroupState.ERRORSTOP, Command(0, Opcode.RESET)),
    (GroupState.STOPPING, Command(0, Opcode.STOP, operands=(1, 0, 0, 0))),
)
"""What brings a group out of a state; after an error a stop may still be held."""

_LEAVING_S: Final = 1.0
"""Longest time from the end of a reset to the state that follows it."""


class SoftMotionController:
    """A PLC mailbox that was met. Use it as a context manager.

    The mailbox is owned from the first command that needs it until :meth:`close`; reading the
    state, the position and the tool slots needs no ownership.

    Attributes:
        io: Inputs and outputs.

    Args:
        mailbox: The mailbox.
    """

    def __init__(self, mailbox: Mailbox) -> None:
        self._mailbox = mailbox
        self._group = SoftMotionGroup(mailbox)
        self._tools = SoftMotionToolTable(mailbox)
        self._preserver = Preserver(mailbox, tools=self._tools, group=self._group)
        self._resolver = SoftMotionResolver(
            mailbox, tools=self._tools, group=self._group, preserver=self._preserver
        )
        self.io = SoftMotionIo(mailbox)

    @property
    def identity(self) -> str:
        """The URL, with those options only that tell mailboxes apart."""
        return self._mailbox.identity

    @property
    def device_id(self) -> int | None:
        """The number that the PLC drew once, the same on every link; ``None`` where it has none."""
        return self._mailbox.device_id

    @property
    def clock(self) -> Clock:
        """The clock on which the PLC's time passes."""
        return self._mailbox.wire.clock

    @property
    def capabilities(self) -> Capabilities:
        """What the mailbox program can be told: the profile ``tools`` moves nothing."""
        able = self._mailbox.snapshots.met.capabilities
        moves = Capability.MOTION in able
        return Capabilities(tool_write=Capability.TOOLS in able, motion=moves, motors=moves)

    @property
    def tools(self) -> SoftMotionToolTable:
        """Slots 1 to 15."""
        return self._tools

    @property
    def groups(self) -> Sequence[SoftMotionGroup]:
        """The one axis group of this mailbox."""
        return (self._group,)

    @property
    def outcomes(self) -> OutcomeLog:
        """Open markers of this PLC."""
        return self._mailbox.markers.outcomes

    @property
    def ledger(self) -> Ledger:
        """What was done here since connecting, and how much of it is proved."""
        return self._mailbox.markers.ledger

    @property
    def resolver(self) -> SoftMotionResolver:
        """Settles what was begun and not proved finished."""
        return self._resolver

    @property
    def exchanges(self) -> int:
        """Requests sent so far."""
        return self._mailbox.wire.exchanges

    def status(self) -> ControllerStatus:
        """Read the state; others see by it that this process is alive.

        It keeps nothing going: a movement or jog ends unless somebody waits on it.
        """
        self._mailbox.markers.beat()
        return status_of(self._mailbox.snapshots.take())

    def facts(self) -> ControllerFacts:
        """Read which machine this is, in the words that all kinds of controllers share."""
        return self.mailbox_facts().shared()

    def mailbox_facts(self) -> MailboxFacts:
        """Read which machine and which mailbox program this is."""
        return MailboxFacts.of(self._mailbox.snapshots.take(), device_id=self.device_id)

    def verify(self) -> "tuple[MailboxFinding, ...]":
        """Look at everything that can be seen without a command; nothing is written."""
        from robolink.controllers.softmotion.verify import verify_mailbox

        return verify_mailbox(self._mailbox)

    def condition(self) -> dict[str, object]:
        """Read the meaning of an error, the tool in force, and what the mailbox shows beside."""
        return condition_of(self._mailbox.snapshots.take())

    def preview(self, act: Act) -> tuple[str, ...]:
        """Return the commands of an act, in words; those of a reset depend on the state."""
        if act is Act.RESET:
            state = self._mailbox.snapshots.take().group_state
            return tuple(describe(draft) for wrong, draft in _RESETS if wrong == state)
        opcodes = {
            Act.STOP: Opcode.STOP,
            Act.MOTORS_ON: Opcode.ENABLE,
            Act.MOTORS_OFF: Opcode.DISABLE,
        }
        return (describe(Command(0, opcodes[act])),)

    def preview_take(self, *, insist: bool = False) -> str:
        """Return what :meth:`take` would send, in words."""
        return describe(take_command(insist=insist))

    def take(self, *, insist: bool = False) -> None:
        """Take the mailbox now, before the first command that needs it.

        Args:
            insist: A person who sees the cell wants it, whoever owns it now.

        Raises:
            LeaseHeldError: Another client owns it.
        """
        self._mailbox.commands.ownership.take(insist=insist)

    @property
    def latch(self) -> StopLatch:
        """What holds everything back from :meth:`stop` until :meth:`release_stop`."""
        return self._mailbox.wire.latch

    def stop(self) -> None:
        """Stop the group and hold it; on the PLC ``reset_fault`` releases it.

        May be called from any thread, whatever another one is doing. From its first instant on
        no movement, jog or write leaves this process until :meth:`release_stop`; whoever is at
        work gets StoppedError.

        Raises:
            OutcomeUnknownError: Rest was not seen; the message says to use the emergency stop.
            RobolinkError: It was not confirmed; the message says the same.
        """
        try:
            self._group.stop()
        except RobolinkError as error:
            error.remedy = " ".join(
                (tr("The stop is not confirmed: press the emergency stop."), error.remedy)
            )
            raise

    def release_stop(self) -> None:
        """Let this process act again after :meth:`stop`, because a person says so."""
        self._mailbox.wire.latch.release()

    def reset_fault(self) -> None:
        """Clear the group's error and release a held stop, because a person asked for it.

        Nothing is sent where there is nothing to reset: SoftMotion calls that an error
        (softmotion.md 2.2).

        Raises:
            NotReadyError: The machine does not permit it.
            ControllerFaultError: The error is still there afterwards.
        """
        mailbox = self._mailbox
        request = tr("reset")
        with mailbox.lock.held(request, calming=True):
            now = mailbox.snapshots.take()
            for state, draft in _RESETS:
                if now.group_state == state:
                    mailbox.prepare(draft, describe(draft))
                    mailbox.commands.ownership.require(describe(draft))
                    now = self._left(state, mailbox.commands.carry_out(draft))
            if any(now.group_state == state for state, _draft in _RESETS):
                raise ControllerFaultError(
                    tr("The reset did not bring the axis group out of its state."),
                    code=now.error_class,
                    remedy=tr("Remove the cause at the drives or the machine, then reset again."),
                    controller=self.identity,
                    request=request,
                )

    def motors(self, on: bool) -> None:
        """Enable or disable the group, and prove it; the PLC's program switches the drives."""
        if on:
            self._group.enable()
        else:
            self._group.disable()

    def set_kinematics(
        self, position: Kinematics, orientation: Kinematics = Kinematics.NONE
    ) -> None:
        """Put another kinematics in force (MC_SetKinTransform), and prove it.

        The tool is identity and no slot is selected afterwards (softmotion.md 0.5).

        Raises:
            NotReadyError: The group moves, or the machine does not permit it.
            RejectedError: The PLC refused it.
            ReadBackError: Another kinematics is in force.
            OutcomeUnknownError: Something earlier is unsettled, or no answer came.
        """
        set_kinematics(self._mailbox, position, orientation)

    def require_settled(self, request: str) -> None:
        """Refuse ``request`` while something earlier is unsettled.

        Raises:
            OutcomeUnknownError: Names it.
        """
        self._mailbox.markers.require_settled(request)

    def begin(
        self,
        kind: MarkerKind,
        request: str,
        details: Mapping[str, object],
        *,
        operation: str = "",
    ) -> Marker:
        """Store the durable marker of a procedure; see the model."""
        return self._mailbox.markers.begin(kind, request, details, operation=operation)

    def finish(self, marker: Marker, *entries: NewEntry) -> None:
        """Forget the marker of a procedure, and journal how it ended."""
        self._mailbox.markers.clear(marker, *entries)

    def uninterrupted(self) -> AbstractContextManager[None]:
        """Hold Ctrl-C back for a block that must be seen through."""
        return self._mailbox.uninterrupted()

    def preserved(self, reason: str) -> AbstractContextManager[None]:
        """Put back the selected tool; see the model."""
        return self._preserver.preserved(reason)

    def close(self) -> None:
        """Halt what nobody waited on, give the mailbox back, close. Idempotent."""
        self.latch.await_stops(REST_S)
        try:
            if self._mailbox.wire.alive:
                self._group.abort_unfinished()
                self._mailbox.commands.ownership.release()
        except RobolinkError:
            pass  # the link is going away in any case; markers keep what is in doubt
        finally:
            self._mailbox.wire.close()
            self.outcomes.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
        if error is not None:
            note_standing(error, self.ledger.standing())

    def _left(self, state: GroupState, now: Response) -> Response:
        """Give the group the cycles that it needs to leave a state (softmotion.md 2.2)."""
        deadline = Deadline.after(self.clock, _LEAVING_S)
        while now.group_state == state and not deadline.expired:
            now = self._mailbox.snapshots.news(now)
        return now
