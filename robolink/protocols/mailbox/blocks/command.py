"""The command block: from a client to the PLC (docs/mailbox.md)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.protocols.mailbox._codes import ErrorClass
from robolink.protocols.mailbox._known import known
from robolink.protocols.mailbox._opcodes import OPCODES, Opcode
from robolink.protocols.mailbox.blocks.layout import (
    BlockError,
    BlockFault,
    Four,
    Six,
    Words,
    decode_name,
    encode_name,
)
from robolink.protocols.mailbox.blocks.register_layouts import COMMAND, VERSION

_RELEASE: Final = 1
"""Operand i0 of a stop that lets the group go."""


@dataclass(frozen=True, slots=True)
class Command:
    """One command; what the fields mean stands in the register map.

    Attributes:
        sequence: 1..65535, never that of the command before.
        opcode: An :class:`Opcode` where this version knows the number.
        group: Always 1.
        operands: i0 to i3.
        pose: X, Y, Z in user units and A, B, C in degrees, or axes.
        dynamics: Velocity, acceleration, deceleration, jerk, per second in user units.
        name: Of a tool, at most 16 characters.
        owner: The client's token, not 0.
        epoch: The epoch that the PLC gave to this owner.
        boot_id: The PLC start that the client has seen; 0 is not checked.
        version: Of the mailbox.
        reserved: 0.
    """

    sequence: int
    opcode: int
    group: int = 1
    operands: tuple[int, int, int, int] = (0, 0, 0, 0)
    pose: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    dynamics: Four = (0.0, 0.0, 0.0, 0.0)
    name: str = ""
    owner: int = 0
    epoch: int = 0
    boot_id: int = 0
    version: int = VERSION
    reserved: int = 0

    @property
    def only_ends(self) -> bool:
        """Whether it can do nothing but bring something to rest; that is always allowed."""
        if self.opcode == Opcode.JOG:
            return not any(self.operands[:2])
        if self.opcode == Opcode.STOP:
            return self.operands[0] != _RELEASE
        return self.opcode in (Opcode.INTERRUPT, Opcode.HALT)

    @property
    def needs_owner(self) -> bool:
        """Whether only the owner of the mailbox may send it; whoever wants a jog to end may."""
        if self.opcode in (Opcode.STOP, Opcode.JOG):
            return not self.only_ends
        return OPCODES[Opcode(self.opcode)].needs_owner

    @property
    def needs_permit(self) -> bool:
        """Whether the machine must permit it: it changes something, and does more than end it."""
        return OPCODES[Opcode(self.opcode)].needs_permit and not self.only_ends

    def refusal(self) -> ErrorClass:
        """Return what a PLC answers to this block whatever the opcode, NONE when it is fit.

        Such a block is acknowledged and executes nothing.
        """
        if self.version >> 8 != VERSION >> 8:
            return ErrorClass.VERSION
        if self.reserved:
            return ErrorClass.RESERVED_NOT_ZERO
        return ErrorClass.NONE if self.group == 1 else ErrorClass.OPERAND


def encode_command(command: Command, *, heartbeat: int = 0) -> Words:
    """Return the 64 words of a command, with ``heartbeat`` in the one word outside the CRC.

    Raises:
        BlockError: A value does not fit its field, the sequence is 0, or the name is longer
            than 16 characters or not printable ASCII.
    """
    if not command.sequence:
        raise BlockError(BlockFault.VALUE)
    return COMMAND.pack(
        {
            "seq_head": command.sequence,
            "opcode": command.opcode,
            "group": command.group,
            "version": command.version,
            **{f"i{n}": operand for n, operand in enumerate(command.operands)},
            "pose": command.pose,
            "dyn": command.dynamics,
            "name": encode_name(command.name),
            "owner": command.owner,
            "epoch": command.epoch,
            "boot_id": command.boot_id,
            "reserved": command.reserved,
            "client_heartbeat": heartbeat,
            "seq_tail": command.sequence,
        }
    )


def decode_command(words: Sequence[int]) -> Command:
    """Return the command in a block, as a PLC reads it.

    A block of another version, or one that must be refused, is a command too, because its
    refusal is acknowledged: see :meth:`Command.refusal`.

    Raises:
        BlockError: There is nothing to acknowledge: LENGTH, EMPTY (no command), TORN or CRC.
    """
    values = COMMAND.unpack(words)
    head = values["seq_head"]
    if not head:
        raise BlockError(BlockFault.EMPTY)
    if head != values["seq_tail"]:
        raise BlockError(BlockFault.TORN)
    if not COMMAND.intact(words):
        raise BlockError(BlockFault.CRC, head=head, crc=values["crc"])
    return Command(
        sequence=head,
        opcode=known(Opcode, values["opcode"]),
        group=values["group"],
        operands=(values["i0"], values["i1"], values["i2"], values["i3"]),
        pose=values["pose"],
        dynamics=values["dyn"],
        name=decode_name(values["name"]),
        owner=values["owner"],
        epoch=values["epoch"],
        boot_id=values["boot_id"],
        version=values["version"],
        reserved=values["reserved"],
    )
