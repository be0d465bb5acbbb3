"""Faults of a PLC with a mailbox, and of the field bus to it."""

from dataclasses import dataclass
from enum import Enum, auto
from typing import Literal

from robolink_simulators.faults.stream import require_exception


class PlcFaultAction(Enum):
    """What goes wrong with one exchange, or after it."""

    DROP_REQUEST = auto()
    """The request is lost: it is not carried out or answered (F25)."""
    DUPLICATE_REQUEST = auto()
    """The written data arrives again after ``seconds`` (F27)."""
    STALL = auto()
    """The request arrives ``seconds`` late, even if its sender has stopped waiting (F12)."""
    REORDER_WRITE = auto()
    """The write is acknowledged, but arrives after the next write (F28)."""
    DELAY = auto()
    """The answer is sent ``seconds`` late (F01)."""
    DROP_REPLY = auto()
    """The request is carried out, but not answered (F25)."""
    GARBLE_REPLY = auto()
    """Bit ``bit`` of the word at ``position`` of the answer is flipped (F07)."""
    TEAR_REPLY = auto()
    """The last word of the answer comes from another moment (F31)."""
    STALE_REPLY = auto()
    """The answer is the previous one to the same read. The fault waits until there is one (F02)."""
    ZERO_REPLY = auto()
    """Every word of the answer is zero (F30)."""
    TRUNCATE_REPLY = auto()
    """Only the first ``position`` bytes of the answer's frame are sent (F04)."""
    DUPLICATE_REPLY = auto()
    """The answer's frame is sent twice (F09)."""
    SPLIT_REPLY = auto()
    """The bytes of the frame after ``position`` are sent ``seconds`` later (F05)."""
    GARBLE_WRITE = auto()
    """Bit ``bit`` of the word at ``position`` of the written data arrives flipped (F07)."""
    TEAR_WRITE = auto()
    """The words from ``position`` on arrive ``seconds`` after those before it (F32)."""
    IGNORE_WRITE = auto()
    """The write is acknowledged, but does not arrive (F43)."""
    DISCONNECT = auto()
    """The request is carried out, then the link is cut (F11)."""
    DISCONNECT_BEFORE = auto()
    """The link is cut and the request is not carried out."""
    RESET = auto()
    """The request is carried out, then the connection is reset (F75)."""
    HALF_OPEN = auto()
    """The request is carried out; then the connection carries no more data and neither end notices
    (F11).
    """
    RESTART = auto()
    """The PLC restarts ``seconds`` after the request arrived (F13)."""
    FREEZE = auto()
    """The mailbox program stops running ``seconds`` after the request."""
    FREEZE_HEARTBEAT = auto()
    """The PLC's heartbeat stops ``seconds`` after the request; everything else continues (F69)."""
    ZERO_INPUTS = auto()
    """The data written by clients is zeroed ``seconds`` after the request (F30)."""
    WORD_ORDER = auto()
    """From ``seconds`` after the request on, the program stores values in ``order`` (F33)."""
    SHIFT_MAP = auto()
    """From ``seconds`` after the request on, clients read and write ``position`` words after the
    intended ones; 1 if no position is given (F34).
    """
    TAKE_OWNERSHIP = auto()
    """Another client takes over the mailbox ``seconds`` after the request (F46)."""
    ESTOP = auto()
    """The emergency stop is pressed ``seconds`` after the request arrived (F21)."""
    AXIS_ERROR = auto()
    """Axis 0 fails with error ``code`` ``seconds`` after the request arrived."""
    WITHDRAW_PERMIT = auto()
    """The machine's permit is withdrawn ``seconds`` after the request arrived."""
    LOSE_SEGMENT = auto()
    """CAN: segment ``position`` of the answer is never sent (F52)."""
    WRONG_TOGGLE = auto()
    """CAN: segment ``position`` of the answer repeats the toggle bit of the previous one (F52)."""
    FOREIGN_NODE = auto()
    """CAN: another node with this node's number answers for an object that nobody requested (F51).
    """
    ECHO = auto()
    """CAN: the bus returns the client's own frame (F51)."""
    MODBUS_EXCEPTION = auto()
    """The request is not carried out, and the answer is the Modbus exception ``code``."""
    TEAR_ARRAY = auto()
    """OPC UA: the elements of an array from ``position`` on are from ``seconds`` later; from the
    PLC's next cycle if no time is given. With an odd ``bit`` those before it are. The fault waits
    for an answer that is a mixture then (F31).
    """
    TEAR_NODES = auto()
    """OPC UA: the variables of a request from ``position`` on are from ``seconds`` later, from the
    PLC's next cycle if no time is given. With an odd ``bit`` those before it are. The fault waits
    for an answer that is a mixture then (F31).
    """
    WRONG_TYPE = auto()
    """OPC UA: the values are of another type, as REAL for LREAL; a write is refused with
    BadTypeMismatch.
    """
    SHORT_ARRAY = auto()
    """OPC UA: arrays in the answer end before element ``position``, before the last one if none is
    given.
    """
    READ_ONLY = auto()
    """OPC UA: the write is refused with BadNotWritable."""
    OUT_OF_SERVICE = auto()
    """OPC UA: the request is not carried out; each variable is answered with BadOutOfService."""
    LOSE_SESSION = auto()
    """OPC UA: the server has forgotten the session. Neither the request nor any after it is carried
    out.
    """
    DROP_CHANNEL = auto()
    """OPC UA: the request is carried out; then the server closes the secure channel."""
    EXPIRED_CERTIFICATE = auto()
    """OPC UA: from now on the server shows a certificate that ended yesterday. Open connections
    stay.
    """


Order = Literal["low_first", "high_first", "pairs_swapped", "halves_swapped"]
"""The four word orders in which a PLC may store a value."""


@dataclass(frozen=True, slots=True)
class PlcFault:
    """One planned fault. It fires once, or until it is removed.

    Attributes:
        action: What goes wrong.
        on_exchange: Which of the requests that ``match``, counted from 0.
        match: Text that a request must contain to be counted; empty counts all. Requests
            read ``write_command MOVE_LINEAR 7``, ``beat``, ``read_head``, ``read_response``,
            ``read_slot 3``, ``snapshot``.
        seconds: A delay in simulated time, where the action has one.
        code: Error number of AXIS_ERROR; exception of MODBUS_EXCEPTION, which needs one.
        position: Index of a word, a byte of a frame, or a segment; ``None`` takes the middle.
            Past the end it counts from the front again.
        bit: Which bit of that word, 0 to 15; ``None`` draws it from the plan's seed.
        order: Of WORD_ORDER.
        every: 0 for once; else it meets, from that request on, every so many-th one that matches.

    Raises:
        ConfigError: There is no such exception.
    """

    action: PlcFaultAction
    on_exchange: int = 0
    match: str = ""
    seconds: float = 0.0
    code: int = 16
    position: int | None = None
    bit: int | None = None
    order: Order = "high_first"
    every: int = 0

    def __post_init__(self) -> None:
        if self.action is PlcFaultAction.MODBUS_EXCEPTION:
            require_exception(self.code)
