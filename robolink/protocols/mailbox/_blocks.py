"""The command block: from a client to the PLC (docs/reference/mailbox.md).

The response block: from the PLC to every client (docs/reference/mailbox.md).

The answer words of a response, whose meaning depends on the opcode echoed beside them.

One slot of the tool table (docs/reference/mailbox.md, "Tools").

Which PLC this is: a number that it draws once and retains.

Source: docs/reference/mailbox.md, "Which PLC this is".

The number stands behind the last slot, and in CANopen object 1018h:4, so that a PLC is known
again over TCP, RTU and CAN, and under whatever name or address it is reached.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import lru_cache
from operator import attrgetter
from typing import Final, NamedTuple, Self

from robolink.protocols.mailbox._codes import (
    OPCODES,
    Bits,
    Capability,
    CommandState,
    ErrorClass,
    GroupState,
    Opcode,
    known,
)
from robolink.protocols.mailbox._layout import (
    COMMAND,
    DEVICE,
    PROBE,
    RESPONSE,
    SLOT,
    VERSION,
    BlockError,
    BlockFault,
    Field,
    Four,
    Six,
    Words,
    decode_name,
    encode_name,
)

_RELEASE: Final = 1
"""Operand i0 of a stop that releases the group."""


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
        """Whether it can only stop something; that is always allowed."""
        if self.opcode == Opcode.JOG:
            return not any(self.operands[:2])
        if self.opcode == Opcode.STOP:
            return self.operands[0] != _RELEASE
        return self.opcode in (Opcode.INTERRUPT, Opcode.HALT)

    @property
    def needs_owner(self) -> bool:
        """Whether only the owner of the mailbox may send it; anybody may end a jog."""
        if self.opcode in (Opcode.STOP, Opcode.JOG):
            return not self.only_ends
        return OPCODES[Opcode(self.opcode)].needs_owner

    @property
    def needs_permit(self) -> bool:
        """Whether the machine must permit it: it changes something, and does more than end it."""
        return OPCODES[Opcode(self.opcode)].needs_permit and not self.only_ends

    def refusal(self) -> ErrorClass:
        """Return a PLC's answer to this block whatever the opcode, NONE if it is valid.

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


_ANSWER: Field = RESPONSE["answer"]
_WORDS = _ANSWER.end - _ANSWER.word


@dataclass(frozen=True, slots=True)
class Answer:
    """Twenty-four words: a tool or pose, or who owns the mailbox, or an input's value.

    Raises:
        BlockError: There are not twenty-four 16-bit words.
    """

    words: Words = field(default=(0,) * _WORDS)

    def __post_init__(self) -> None:
        words = self.words
        if len(words) != _WORDS or min(words) < 0 or max(words) > 0xFFFF:
            raise BlockError(BlockFault.LENGTH)

    @classmethod
    def of_pose(cls, pose: Six) -> Self:
        """Return the answer that carries a tool, or a latched TCP."""
        return cls(struct.unpack(f"<{_WORDS}H", struct.pack("<6d", *pose)))

    @classmethod
    def of_owner(cls, holder: int, epoch: int) -> Self:
        """Return the answer to 30005: the holder's token, 0 for nobody, and the epoch."""
        return cls((holder & 0xFFFF, holder >> 16, epoch) + (0,) * (_WORDS - 3))

    @classmethod
    def of_input(cls, value: int) -> Self:
        """Return the answer to 30006."""
        return cls((value,) + (0,) * (_WORDS - 1))

    @property
    def pose(self) -> Six:
        """As a tool or a pose: user units and degrees."""
        x, y, z, a, b, c = struct.unpack("<6d", struct.pack(f"<{_WORDS}H", *self.words))
        return (x, y, z, a, b, c)

    @property
    def holder(self) -> int:
        """As the answer to 30005: the token of who owns the mailbox, 0 for nobody."""
        return self.words[1] << 16 | self.words[0]

    @property
    def epoch(self) -> int:
        """As the answer to 30005: the epoch in force."""
        return self.words[2]

    @property
    def input_value(self) -> int:
        """As the answer to 30006: the input's value."""
        return self.words[0]


_NOWHERE: Final[Six] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_NO_BITS: Final = Bits(0)
_UNABLE: Final = Capability(0)


class Finished(NamedTuple):
    """The end of a movement, or of another command that was stopped or came too early."""

    sequence: int = 0
    state: int = CommandState.EMPTY
    error_class: int = ErrorClass.NONE


@dataclass(frozen=True, slots=True)
class Response:
    """One whole snapshot; fields are named as in the register map.

    Codes are members of their enumeration where this version knows the number. Lengths are
    in the PLC's user units (``unit_um`` micrometres each), angles in degrees.
    """

    version: int = VERSION
    ack_head: int = 0
    state: int = CommandState.EMPTY
    error_class: int = ErrorClass.NONE
    raw_error: int = 0
    opcode_echo: int = 0
    group_state: int = GroupState.DISABLED
    bits: Bits = _NO_BITS
    plc_heartbeat: int = 0
    boot_id: int = 1
    tool_slot: int = 0
    answer: Answer = field(default_factory=Answer)
    tcp: Six = _NOWHERE
    axes: Six = _NOWHERE
    probe: float = PROBE
    kinematics: int = 0
    axis_count: int = 0
    capabilities: Capability = _UNABLE
    unit_um: float = 1000.0
    rejected: int = 0
    active_movement: int = 0
    queue_length: int = 0
    finished: tuple[Finished, Finished, Finished, Finished] = (Finished(),) * 4
    ack_owner: int = 0

    @property
    def position_kinematics(self) -> int:
        """Code of the kinematics, without one that is coupled to it."""
        return self.kinematics & 0xFF

    @property
    def orientation_kinematics(self) -> int:
        """Code of the orientation kinematics coupled to it, 0 for none."""
        return self.kinematics >> 8


_NAMES: Final = tuple(field.name for field in fields(Response))
_in_order: Final = attrgetter(*_NAMES)


def encode_response(response: Response) -> Words:
    """Return the 112 words of a snapshot.

    Args:
        response: What it says.

    Raises:
        BlockError: A value does not fit its field.
    """
    values = dict(zip(_NAMES, _in_order(response), strict=True))
    return RESPONSE.pack(
        values
        | {
            "answer": response.answer.pose,
            "finished": tuple(number for end in response.finished for number in end),
            "ack_tail": response.ack_head,
        }
    )


def decode_response(words: Sequence[int]) -> Response:
    """Return what a snapshot says.

    The probe is not judged here: a client compares it with ``PROBE`` before it believes any
    number of more than one word.

    Raises:
        BlockError: LENGTH, EMPTY (nobody has filled it), VERSION (another major), TORN or
            CRC. What a single broken read can cause is worth reading again.
    """
    values = RESPONSE.unpack(words)
    _require_whole(words, values["version"], values["ack_head"], values.pop("ack_tail"))
    del values["crc"]
    return Response(
        **values
        | {
            "answer": Answer(tuple(words[RESPONSE.at("answer")])),
            "finished": _finished(values["finished"]),
            "state": known(CommandState, values["state"]),
            "error_class": known(ErrorClass, values["error_class"]),
            "opcode_echo": known(Opcode, values["opcode_echo"]),
            "group_state": known(GroupState, values["group_state"]),
            "bits": Bits(values["bits"]),
            "capabilities": Capability(values["capabilities"]),
        }
    )


def _require_whole(words: Sequence[int], version: int, head: int, tail: int) -> None:
    if not any(words):
        raise BlockError(BlockFault.EMPTY)
    if version >> 8 != VERSION >> 8:
        raise BlockError(BlockFault.VERSION)
    if head != tail:
        raise BlockError(BlockFault.TORN)
    if not RESPONSE.intact(words):
        raise BlockError(BlockFault.CRC)


@lru_cache(maxsize=64)  # the same in most successive snapshots
def _finished(ends: tuple[int, ...]) -> tuple[Finished, ...]:
    return tuple(
        Finished(sequence, known(CommandState, state), known(ErrorClass, error_class))
        for sequence, state, error_class in zip(ends[::3], ends[1::3], ends[2::3], strict=True)
    )


@dataclass(frozen=True, slots=True)
class Slot:
    """What a slot holds; ``tool`` is in user units and degrees and counts when ``defined``."""

    counter: int = 0
    defined: bool = False
    tool: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    name: str = ""


def encode_slot(slot: Slot) -> Words:
    """Return the 36 words of a slot.

    Raises:
        BlockError: A value does not fit its field, or the name is no printable ASCII.
    """
    return SLOT.pack(
        {
            "counter": slot.counter,
            "defined": slot.defined,
            "tool": slot.tool,
            "name": encode_name(slot.name),
            "counter_tail": slot.counter,
        }
    )


def decode_slot(words: Sequence[int]) -> Slot:
    """Return what a slot holds.

    Raises:
        BlockError: LENGTH, EMPTY (nobody has filled it), TORN or CRC.
    """
    values = SLOT.unpack(words)
    if not any(words):
        raise BlockError(BlockFault.EMPTY)
    if values["counter"] != values["counter_tail"]:
        raise BlockError(BlockFault.TORN)
    if not SLOT.intact(words):
        raise BlockError(BlockFault.CRC)
    return Slot(
        counter=values["counter"],
        defined=values["defined"] != 0,
        tool=values["tool"],
        name=decode_name(values["name"]),
    )


_ALL_BITS: Final = 0xFFFF_FFFF


def encode_device_id(device_id: int) -> Words:
    """Return the four words of the device block.

    Raises:
        BlockError: It is no number of a PLC: 1 to 2**32 - 1.
    """
    if not 0 < device_id <= _ALL_BITS:
        raise BlockError(BlockFault.VALUE)
    return DEVICE.pack({"device_id": device_id, "device_id_complement": device_id ^ _ALL_BITS})


def decode_device_id(words: Sequence[int]) -> int | None:
    """Return the PLC's number, ``None`` where its program has none.

    Words that do not belong together are none either: a program without this block may keep
    something else in their place.

    Raises:
        BlockError: LENGTH.
    """
    values = DEVICE.unpack(words)
    device_id: int = values["device_id"]
    complement: int = values["device_id_complement"]
    return device_id if device_id and device_id ^ complement == _ALL_BITS else None
