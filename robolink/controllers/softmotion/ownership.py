"""Who may command the mailbox: one client at a time, identified by a token and an epoch.

The PLC gives the mailbox to whoever asks when nobody owns it, when its owner has been silent
for 10 s with nothing moving, or when a person insists; each time under a new epoch, so that a
client that slept through it is refused (docs/reference/mailbox.md, "Owners";
docs/reference/faults.md F46, F47). So is a block that was sent before and arrives late: to own the
mailbox is to fence it off.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from robolink.controllers.softmotion.answers import DISPOSSESSED, Ended, describe
from robolink.controllers.softmotion.wire import MailboxWire
from robolink.errors import Concerning, LeaseHeldError, LeaseLostError, RejectedError
from robolink.messages import tr
from robolink.model import ClientRun, OutcomeLog
from robolink.protocols.mailbox import Command, CommandState, ErrorClass, Opcode
from robolink.timing import Deadline, local_label

SILENCE_S: Final = 10.0
"""Time in s without a sign of its owner after which a PLC releases the mailbox."""

_LONGEST_SILENCE_S: Final = SILENCE_S + 2.0
"""Longest wait in s for a run that has ended: its last sign came before its end, and the margin is
for a computer and a PLC that are busy."""

_ASK_S: Final = 0.5
"""Pause between two requests for a mailbox that becomes free by itself, in s."""

_LONGEST_STOP_S: Final = 1.0
_LONGEST_COMMAND_S: Final = 10.0
_AGAIN_S: Final = 0.05
_GIVE_BACK: Final = Command(0, Opcode.OWNERSHIP)
_LOOK_S: Final = 0.5
"""Interval between two looks at an idle link, in s."""


def take_command(*, insist: bool) -> Command:
    """Return the command that takes the mailbox.

    Args:
        insist: A person who sees the cell wants it, whoever owns it now.
    """
    return Command(0, Opcode.OWNERSHIP, operands=(1, int(insist), 0, 0))


@dataclass(frozen=True, slots=True)
class Bystanders:
    """Who is involved in the ownership besides the PLC.

    Attributes:
        outcomes: Knows which run a token belongs to; ``None`` where nothing is ever taken.
        tell: Told, in sentences, what is waited for.
    """

    outcomes: OutcomeLog | None = None
    tell: Callable[[str], None] = lambda _sentence: None


class Ownership:
    """Takes the mailbox, once, and releases it.

    Args:
        wire: The session; its ``epoch`` is 0 while we own nothing.
        send: Sends a command and returns how it ended.
        bystanders: Who knows runs by their tokens, and who is told of a wait.
    """

    def __init__(
        self, wire: MailboxWire, send: Callable[[Command], Ended], bystanders: Bystanders
    ) -> None:
        self._wire = wire
        self._send = send
        self._outcomes, self._tell = bystanders.outcomes, bystanders.tell
        self._lost = self._fenced = False

    def require(self, request: str) -> None:
        """Take the mailbox unless it is ours already.

        Raises:
            LeaseHeldError: Another client owns it.
            LeaseLostError: It was ours and another client took it; this session may not take
                it back behind that client's back.
        """
        if self._lost:
            raise self._lost_error(request)
        if not self._wire.epoch:
            self.take()

    def take(self, *, insist: bool = False, patient: bool = True) -> None:
        """Take the mailbox; from an ended run of this computer, when its silence is over.

        Args:
            insist: A person who sees the cell wants it, whoever owns it now.
            patient: Whether the silence of a run that has ended is waited out.

        Raises:
            LeaseHeldError: Another client owns it; the error names its token, and its run where
                that is known.
            StoppedError: A stop came while it was waited.
            KeyboardInterrupt: Ctrl-C came then.
        """
        try:
            self._ask(insist=insist)
        except LeaseHeldError as held:
            run = self._run_of(held.holder)
            if run is None or run.lives is not False or not patient:
                raise
            self._outwait(held, run)

    def _outwait(self, held: LeaseHeldError, run: ClientRun) -> None:
        """Ask repeatedly until the PLC releases what an ended run left."""
        self._tell(
            tr(
                "{who} locked the mailbox of the PLC on {since} and ended without "
                "releasing it. Waiting until it is free, {seconds:.0f} s at most.",
                who=run.who,
                since=local_label(run.since),
                seconds=_LONGEST_SILENCE_S,
            )
        )
        latch, request = self._wire.latch, tr("locking the mailbox")
        stopped = latch.closed
        deadline = Deadline.after(self._wire.clock, _LONGEST_SILENCE_S)
        while not deadline.expired:
            self._wire.clock.sleep(_ASK_S)
            if self._wire.interrupted:
                raise KeyboardInterrupt  # held back until here: nothing has been sent
            if not stopped:
                latch.require_open(request)
            try:
                self._ask(insist=False)
            except LeaseHeldError as again:
                if again.holder != held.holder:
                    raise
            else:
                self._tell(tr("The mailbox is free."))
                return
        raise held

    def _ask(self, *, insist: bool) -> None:
        token = f"{self._wire.owner:08X}"
        if self._outcomes is not None:
            # Recorded before it is sent: after a kill, the token is known.
            self._outcomes.note_client(token)
        # Ctrl-C before the answer is read would leave the mailbox taken without a known owner.
        with self._wire.uninterrupted():
            end = self._sent(take_command(insist=insist))
            answer = end.now.answer
            if end.state != CommandState.DONE or answer.holder != self._wire.owner:
                self._forget()
                raise self._held_by(answer.holder)
            self._wire.epoch = answer.epoch
            self._lost, self._fenced = False, True

    def fence(self) -> None:
        """Make sure that no block of an earlier session is carried out from here on.

        A block may arrive long after its client has given it up. The PLC refuses it once the
        mailbox was taken since, by this session or, after this session, by another one: its epoch
        is old (docs/reference/mailbox.md, "Owners"). A process that died keeps the mailbox for ten
        seconds; they are waited out, in which nothing is sent that could stand in another client's
        way.

        Raises:
            LeaseHeldError: Another client owns it, and is alive.
            RejectedError: The PLC has been at work on a command of before for ten seconds.
        """
        if self._fenced:
            return
        deadline = Deadline.after(self._wire.clock, _LONGEST_COMMAND_S)
        waited = False
        while True:
            try:
                self.take()
            except LeaseHeldError as held:
                run = self._run_of(held.holder)
                if waited or (run is not None and run.lives is not None):
                    raise  # its owner lives, or the silence has been waited out
                self._wait_for_silence(held)
                waited = True
            except RejectedError as error:
                if error.code != ErrorClass.BUSY or deadline.expired:
                    raise
                self._wire.clock.sleep(_AGAIN_S)
            else:
                return

    def lose(self) -> None:
        """Note that the PLC reports that it is not ours any more."""
        self._wire.epoch = 0
        self._lost = True
        self._forget()

    def release(self) -> None:
        """Release the mailbox, if it is ours; what is unfinished is halted first.

        Ctrl-C waits for that: else the next program would be refused for ten seconds.

        Raises:
            LeaseLostError: It is not ours any more: another client took it.
        """
        with self._wire.uninterrupted():
            if self._wire.epoch:
                if self._wire.motions.unfinished:
                    self._sent(Command(0, Opcode.HALT))
                self._give_back()
                self._wire.epoch = 0
                self._forget()

    def _sent(self, command: Command) -> Ended:
        with Concerning(self._wire.identity, describe(command)):
            return self._send(command)

    def _forget(self) -> None:
        if self._outcomes is not None:
            self._outcomes.forget_client(f"{self._wire.owner:08X}")

    def _run_of(self, holder: str) -> ClientRun | None:
        return None if self._outcomes is None else self._outcomes.run_of(holder)

    def _lost_error(self, request: str) -> LeaseLostError:
        return LeaseLostError(
            tr(
                "{request!r} was not sent: another client has taken over the mailbox.",
                request=request,
            ),
            remedy=tr("Connect again when it has ended."),
        )

    def _held_by(self, holder: int) -> LeaseHeldError:
        run = self._run_of(f"{holder:08X}")
        insist = "'robolink robot take-ownership'"
        if run is None:
            what = tr(
                "Another program (client {holder:08X}) commands the PLC {identity}.",
                holder=holder,
                identity=self._wire.identity,
            )
            remedy = tr(
                "Close it and wait {seconds:.0f} s, or at the cell type {command}.",
                seconds=SILENCE_S,
                command=insist,
            )
        else:
            what = tr(
                "{who} has commanded the PLC {identity} since {since} (client {holder:08X}).",
                who=run.who,
                identity=self._wire.identity,
                since=local_label(run.since),
                holder=holder,
            )
            remedy = (
                tr("Wait, end it, or at the cell type {command}.", command=insist)
                if run.lives
                else tr(
                    "If it ended, wait {seconds:.0f} s; or at the cell type {command}.",
                    seconds=SILENCE_S,
                    command=insist,
                )
            )
        error = LeaseHeldError(what, remedy=remedy)
        error.holder = f"{holder:08X}"
        return error

    def _wait_for_silence(self, held: LeaseHeldError) -> None:
        self._tell(
            tr(
                "Client {holder} has the mailbox of the PLC locked. If it has ended, the "
                "mailbox is free within {seconds:.0f} s. Waiting until then.",
                holder=held.holder,
                seconds=_LONGEST_SILENCE_S,
            )
        )
        deadline = Deadline.after(self._wire.clock, _LONGEST_SILENCE_S)
        while not deadline.expired:
            self._wire.clock.sleep(_LOOK_S)
            self._wire.read_head()  # detects meanwhile if the link ends

    def _give_back(self) -> None:
        """Release the ownership, after the stop of another client that may be in work yet."""
        deadline = Deadline.after(self._wire.clock, _LONGEST_STOP_S)
        while True:
            try:
                end = self._sent(_GIVE_BACK)
            except RejectedError as error:
                if error.code != ErrorClass.BUSY or deadline.expired:
                    raise
                self._wire.clock.sleep(_AGAIN_S)
            else:
                if end.state == CommandState.ERROR and end.error_class in DISPOSSESSED:
                    self.lose()
                    raise self._lost_error(describe(_GIVE_BACK))
                return
