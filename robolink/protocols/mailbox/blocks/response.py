"""The response block: from the PLC to every client (docs/mailbox.md)."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import lru_cache
from operator import attrgetter
from typing import Final, NamedTuple

from robolink.protocols.mailbox._codes import (
    Bits,
    Capability,
    CommandState,
    ErrorClass,
    GroupState,
)
from robolink.protocols.mailbox._known import known
from robolink.protocols.mailbox._opcodes import Opcode
from robolink.protocols.mailbox.blocks.answer import Answer
from robolink.protocols.mailbox.blocks.layout import BlockError, BlockFault, Six, Words
from robolink.protocols.mailbox.blocks.register_layouts import PROBE, RESPONSE, VERSION

_NOWHERE: Final[Six] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_NO_BITS: Final = Bits(0)
_UNABLE: Final = Capability(0)


class Finished(NamedTuple):
    """The end of a movement, or of another command that a stop ended or that came too early."""

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


@lru_cache(maxsize=64)  # they stay the same from one snapshot to most others
def _finished(ends: tuple[int, ...]) -> tuple[Finished, ...]:
    return tuple(
        Finished(sequence, known(CommandState, state), known(ErrorClass, error_class))
        for sequence, state, error_class in zip(ends[::3], ends[1::3], ends[2::3], strict=True)
    )
