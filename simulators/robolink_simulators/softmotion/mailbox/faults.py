"""Planned faults of a simulated PLC and its fieldbus. Counted, never rolled.

The vocabulary, and the numbers, are those of docs/reference/faults.md.
"""

from dataclasses import dataclass
from enum import Enum, auto


class PlcFaultAction(Enum):
    """What goes wrong with one exchange, or after it."""

    DELAY = auto()
    """The answer leaves ``seconds`` late (F01)."""
    DROP_REPLY = auto()
    """Carried out, but no answer leaves (F25)."""
    GARBLE_REPLY = auto()
    """One bit of the word at ``position`` of the answer is flipped (F07)."""
    TEAR_REPLY = auto()
    """The last word of the answer is of another moment (F31)."""
    GARBLE_WRITE = auto()
    """One bit of the word at ``position`` of what is written arrives flipped (F07)."""
    TEAR_WRITE = auto()
    """The words from ``position`` on arrive ``seconds`` later than those before (F32)."""
    IGNORE_WRITE = auto()
    """Acknowledged, and nothing arrives (F43)."""
    DISCONNECT = auto()
    """Carried out, then the link is cut (F11)."""
    DISCONNECT_BEFORE = auto()
    """The link is cut and nothing is carried out."""
    RESTART = auto()
    """The PLC starts anew ``seconds`` after the request came in (F13)."""
    FREEZE = auto()
    """The mailbox program stands still from ``seconds`` after the request on."""
    ZERO_INPUTS = auto()
    """What clients have written is zeroed ``seconds`` after the request (F30)."""
    ESTOP = auto()
    """The emergency stop is pressed ``seconds`` after the request came in (F21)."""
    AXIS_ERROR = auto()
    """Axis 0 fails with error ``code`` ``seconds`` after the request came in."""
    WITHDRAW_PERMIT = auto()
    """The machine's permit is withdrawn ``seconds`` after the request came in."""


@dataclass(frozen=True, slots=True)
class PlcFault:
    """One planned fault. It fires once.

    Attributes:
        action: What goes wrong.
        on_exchange: Which of the requests that ``match``, counted from 0.
        match: Text that a request must contain to be counted; empty counts all. Requests
            read ``write_command MOVE_LINEAR 7``, ``beat``, ``read_head``, ``read_response``,
            ``read_slot 3``, ``snapshot``.
        seconds: A delay in simulated time, where the action has one.
        code: Error number of AXIS_ERROR.
        position: Index of a word; ``None`` takes the middle.
    """

    action: PlcFaultAction
    on_exchange: int = 0
    match: str = ""
    seconds: float = 0.0
    code: int = 16
    position: int | None = None
