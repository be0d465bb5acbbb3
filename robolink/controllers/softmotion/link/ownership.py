"""Who may command the mailbox: one client at a time, known by a token and an epoch.

The PLC gives the mailbox to whoever asks when nobody owns it, when its owner has been silent
for 10 s with nothing moving, or when a person insists; each time under a new epoch, so that a
client that slept through it is refused (docs/mailbox.md, "Owners"; docs/reference/faults.md F46,
F47). So is a block that was sent before and arrives late: to own the mailbox is to fence it off.
"""

from collections.abc import Callable
from typing import Final

from robolink.controllers.softmotion.link.answers import Ended
from robolink.controllers.softmotion.link.wire import MailboxWire
from robolink.errors import LeaseHeldError, LeaseLostError, RejectedError
from robolink.messages import tr
from robolink.protocols.mailbox import Command, CommandState, ErrorClass, Opcode
from robolink.timing import Deadline

_LONGEST_STOP_S: Final = 1.0
_LONGEST_COMMAND_S: Final = 10.0
_AGAIN_S: Final = 0.05
_SILENT_S: Final = 10.5
"""An owner without a sign for 10 s is gone; the rest is for the two clocks."""

_LOOK_S: Final = 0.5
"""From one look at a link to the next while nothing is asked of it."""


def take_command(*, insist: bool) -> Command:
    """Return the command that takes the mailbox.

    Args:
        insist: A person who sees the cell wants it, whoever owns it now.
    """
    return Command(0, Opcode.OWNERSHIP, operands=(1, int(insist), 0, 0))


class Ownership:
    """Takes the mailbox, once, and gives it back.

    Args:
        wire: The session; its ``epoch`` is 0 while we own nothing.
        send: Sends a command and returns how it ended.
    """

    def __init__(self, wire: MailboxWire, send: Callable[[Command], Ended]) -> None:
        self._wire = wire
        self._send = send
        self._lost = self._fenced = False

    def require(self, request: str) -> None:
        """Take the mailbox unless it is ours already.

        Raises:
            LeaseHeldError: Another client owns it.
            LeaseLostError: It was ours and another client took it; this session may not take
                it back behind that client's back.
        """
        if self._lost:
            raise LeaseLostError(
                tr("{request!r} was not sent: another client took the mailbox.", request=request),
                remedy=tr("Connect again when it has ended."),
                controller=self._wire.identity,
                request=request,
            )
        if not self._wire.epoch:
            self.take()

    def take(self, *, insist: bool = False) -> None:
        """Take the mailbox.

        Args:
            insist: A person who sees the cell wants it, whoever owns it now.

        Raises:
            LeaseHeldError: Another client owns it; the error names its token.
        """
        # A Ctrl-C before the answer is read would leave it taken by nobody who knows of it.
        with self._wire.uninterrupted():
            end = self._send(take_command(insist=insist))
            answer = end.now.answer
            if end.state != CommandState.DONE or answer.holder != self._wire.owner:
                raise self._held_by(answer.holder)
            self._wire.epoch = answer.epoch
            self._lost, self._fenced = False, True

    def fence(self) -> None:
        """Make sure that no block of an earlier session is carried out from here on.

        A block may arrive long after its client has given it up. The PLC refuses it once the
        mailbox was taken since, by this session or, after this session, by another one: its epoch
        is old (docs/mailbox.md, "Owners"). A process that died keeps the mailbox for ten seconds;
        they are waited out, in which nothing is sent that could stand in another client's way.

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
            except LeaseHeldError:
                if waited:
                    raise
                self._wait_for_silence()
                waited = True
            except RejectedError as error:
                if error.code != ErrorClass.BUSY or deadline.expired:
                    raise
                self._wire.clock.sleep(_AGAIN_S)
            else:
                return

    def lose(self) -> None:
        """Note that the PLC says it is not ours any more."""
        self._wire.epoch = 0
        self._lost = True

    def release(self) -> None:
        """Give the mailbox back, if it is ours; what is unfinished is halted first.

        Ctrl-C waits for that: else the next program would be refused for ten seconds.
        """
        with self._wire.uninterrupted():
            if self._wire.epoch:
                if self._wire.motions.unfinished:
                    self._send(Command(0, Opcode.HALT))
                self._give_back()
                self._wire.epoch = 0

    def _held_by(self, holder: int) -> LeaseHeldError:
        error = LeaseHeldError(
            tr(
                "Another program (client {holder:08X}) commands the PLC {identity}.",
                holder=holder,
                identity=self._wire.identity,
            ),
            remedy=tr(
                "Close the other program; 10 s after its last sign the mailbox is "
                "free. A person at the cell can take it over: 'robolink robot "
                "take-ownership'."
            ),
            controller=self._wire.identity,
        )
        error.holder = f"{holder:08X}"
        return error

    def _wait_for_silence(self) -> None:
        deadline = Deadline.after(self._wire.clock, _SILENT_S)
        while not deadline.expired:
            self._wire.clock.sleep(_LOOK_S)
            self._wire.read_head()  # the end of a link is noticed meanwhile

    def _give_back(self) -> None:
        """Release the ownership, after the stop of another client that may be in work yet."""
        deadline = Deadline.after(self._wire.clock, _LONGEST_STOP_S)
        while True:
            try:
                self._send(Command(0, Opcode.OWNERSHIP))
            except RejectedError as error:
                if error.code != ErrorClass.BUSY or deadline.expired:
                    raise
                self._wire.clock.sleep(_AGAIN_S)
            else:
                return
