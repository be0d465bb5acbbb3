"""The machine's own program, a second client of the mailbox: it takes it and gives it back."""

from enum import Enum, auto
from typing import Final

from robolink.protocols.mailbox import Command, Opcode, encode_command
from robolink.timing import NS_PER_S
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

_TOKEN: Final = 0x50C0_0001
_PATIENCE_NS: Final = 60_000_000
"""After this long a command has been looked at."""


class _Stage(Enum):
    IDLE = auto()
    TAKING = auto()
    OWNING = auto()


class MailboxProduction:
    """A client that asks for the mailbox politely, holds it for a while and releases it.

    Its blocks go where robolink's go, so an acknowledgement that robolink waits for may be
    overwritten by one of this program's.

    Args:
        simulator: The PLC.
    """

    def __init__(self, simulator: SoftMotionSimulator) -> None:
        self._plc = simulator.plc
        self._sequence = 0
        self._stage = _Stage.IDLE
        self._due_ns = 0
        self._holds_ns = 0

    def begin(self, seconds: float, now_ns: int) -> None:
        """Ask for the mailbox, and hold it for so long where it is given."""
        if self._stage is _Stage.IDLE:
            self._holds_ns = round(seconds * NS_PER_S)
            self._send(Opcode.OWNERSHIP, 1, now_ns)
            self._go_on(_Stage.TAKING, now_ns + _PATIENCE_NS)

    def look(self, now_ns: int) -> None:
        """Do what is due."""
        if self._stage is _Stage.IDLE or now_ns < self._due_ns:
            return
        if self._plc.program.holder != _TOKEN:
            self._stage = _Stage.IDLE  # refused, or another one insisted
        elif self._stage is _Stage.TAKING:
            self._send(Opcode.READ_TOOL, 0, now_ns)
            self._go_on(_Stage.OWNING, now_ns + self._holds_ns)
        else:
            self._send(Opcode.OWNERSHIP, 0, now_ns)
            self._stage = _Stage.IDLE

    def _go_on(self, stage: _Stage, due_ns: int) -> None:
        self._stage, self._due_ns = stage, due_ns

    def _send(self, opcode: Opcode, operand: int, now_ns: int) -> None:
        self._sequence = self._sequence % 0xFFFF + 1
        command = Command(
            self._sequence,
            opcode,
            operands=(operand, 0, 0, 0),
            owner=_TOKEN,
            epoch=self._plc.memory.epoch,
        )
        self._plc.write(0, encode_command(command), now_ns)
