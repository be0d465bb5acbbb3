"""Who may command the mailbox (docs/reference/mailbox.md)."""

from typing import Final

from robolink.protocols.mailbox import Answer, Command, ErrorClass, next_number
from robolink.timing import NS_PER_S
from robolink_simulators.device.wire_time import WireTime
from robolink_simulators.softmotion.mailbox.jobs import Rejected
from robolink_simulators.softmotion.mailbox.retained import RetainedMemory

SILENCE_NS: Final = 10 * NS_PER_S
"""Silence of the owner in ns after which another client may take over a mailbox, if nothing moves.
"""

_A_STRANGER: Final = 0x5EE7_0001


class MailboxOwnership:
    """The owner's token; a PLC start clears it, and keeps the epoch.

    Args:
        memory: Keeps the epoch.
        wire_time: By which the owner's silence is counted.

    Attributes:
        holder: Token of the owner, 0 for nobody.
    """

    def __init__(self, memory: RetainedMemory, wire_time: WireTime) -> None:
        self._memory = memory
        self._wire_time = wire_time
        self._heard_ns = 0
        self.holder = 0

    def answer(self) -> Answer:
        """Return the answer of 30005, taken or not."""
        return Answer.of_owner(self.holder, self._memory.epoch)

    def heard(self, now_ns: int) -> None:
        """Note a sign of life of the owner."""
        self._heard_ns = self._wire_time.at(now_ns)

    def owns(self, command: Command) -> bool:
        """Return whether a command comes from the owner, in its present epoch."""
        return self.holder != 0 and (command.owner, command.epoch) == (
            self.holder,
            self._memory.epoch,
        )

    def require(self, command: Command) -> None:
        """Refuse a command that only the owner may send, if another sent it.

        Raises:
            Rejected: NOT_OWNER, or STALE_EPOCH.
        """
        if not command.needs_owner:
            return
        if self.holder == 0 or command.owner != self.holder:
            raise Rejected(ErrorClass.NOT_OWNER)
        if command.epoch != self._memory.epoch:
            raise Rejected(ErrorClass.STALE_EPOCH)

    def carry_out(self, command: Command, now_ns: int, *, moving: bool) -> None:
        """Let a client take the mailbox, or release it.

        The owner itself may take it again, under a new epoch (assumed).

        Raises:
            Rejected: Another one holds it, or an operand is wrong.
        """
        take, insists, *_ = command.operands
        if {take, insists} - {0, 1} or not command.owner:
            raise Rejected(ErrorClass.OPERAND)
        if take:
            self._take(command.owner, now_ns, insists=bool(insists), moving=moving)
        elif self.owns(command):
            self.holder = 0
        else:
            stale = command.owner == self.holder
            raise Rejected(ErrorClass.STALE_EPOCH if stale else ErrorClass.NOT_OWNER)

    def seize(self, now_ns: int) -> None:
        """Let an unknown client take it, because its user insists."""
        self._take(_A_STRANGER, now_ns, insists=True, moving=False)

    def _take(self, owner: int, now_ns: int, *, insists: bool, moving: bool) -> None:
        silent_ns = self._wire_time.at(now_ns) - self._heard_ns
        silent = silent_ns >= SILENCE_NS and not moving
        if self.holder not in (0, owner) and not silent and not insists:
            raise Rejected(ErrorClass.NOT_OWNER)
        self.holder = owner
        self._memory.epoch = next_number(self._memory.epoch)
        self.heard(now_ns)
