"""Faults of a byte stream: Remote Ethernet, and Modbus frames of a PLC with a map of its own."""

from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import known_names, tr


class FaultAction(Enum):
    """What goes wrong with one exchange."""

    DROP_REQUEST = auto()
    """The request is lost: it is not carried out or answered (F25)."""
    DUPLICATE_REQUEST = auto()
    """The request arrives again after ``seconds``, and is answered again (F27)."""
    GARBLE_REQUEST = auto()
    """Bit ``bit`` of the byte at ``position`` of the request arrives flipped (F07)."""
    TRUNCATE_REQUEST = auto()
    """Only the first ``position`` bytes arrive, without a line end (F04)."""
    STALL = auto()
    """The link carries nothing in either direction for ``seconds``. Then the request arrives, and
    all that was sent after it, even the end of the connection (F12).
    """
    DELAY = auto()
    """The reply is sent ``seconds`` late (F01)."""
    DROP_REPLY = auto()
    """The request is carried out, but not answered (F25)."""
    TRUNCATE_REPLY = auto()
    """Only the first ``position`` bytes are sent; the link stays up (F04)."""
    GARBLE_REPLY = auto()
    """Bit ``bit`` of the byte at ``position`` is flipped (F07)."""
    SWAP_BYTES = auto()
    """The byte at ``position`` and the one after it are swapped (F08)."""
    DUPLICATE_REPLY = auto()
    """The reply is sent twice, in one piece (F09)."""
    REPEAT_REPLY = auto()
    """The previous reply, or an empty line if there is none, is sent again before the reply (F10).
    """
    SPLIT_REPLY = auto()
    """The bytes after ``position`` are sent ``seconds`` later (F05)."""
    JOIN_REPLY = auto()
    """The reply is held back and sent in one piece with the next one, ahead of it (F06)."""
    REORDER_REPLY = auto()
    """The reply is held back and sent after the next one (F02)."""
    HALF_OPEN = auto()
    """The request is carried out; then the link carries no more data and neither end notices (F11).
    """
    DISCONNECT = auto()
    """The request is carried out; ``position`` bytes of the reply are sent, then the link is cut
    (F11, F13).
    """
    DISCONNECT_BEFORE = auto()
    """The link is cut and the request is not carried out."""
    RESET = auto()
    """The request is carried out; the connection is reset, and the reply is lost (F75)."""
    RESTART = auto()
    """The controller restarts ``seconds`` after the request arrived (F13)."""
    LOSE_LOGIN = auto()
    """The controller forgets the login ``seconds`` after the request arrived (F15)."""
    TEACH_MODE = auto()
    """The selector is turned to TEACH ``seconds`` after the request arrived (F17)."""
    ESTOP = auto()
    """The emergency stop is pressed ``seconds`` after the request arrived (F21)."""
    GUARD_OPEN = auto()
    """The guard is opened ``seconds`` after the request arrived (F22)."""
    DEVICE_FAULT = auto()
    """Error ``code`` is raised ``seconds`` after the request arrived (F19)."""
    SERIOUS_ERROR = auto()
    """An error that only a restart clears is raised ``seconds`` after the request (F20)."""
    IGNORE_WRITE = auto()
    """The statement is acknowledged, but not carried out (F43)."""
    MODBUS_EXCEPTION = auto()
    """The request is not carried out, and the answer is the Modbus exception ``code``."""
    TEAR_WRITE = auto()
    """OPC UA: the elements or fields of a written variable from ``position`` on arrive ``seconds``
    after those before it, in the PLC's next cycle if no time is given; then the answer leaves. With
    an odd ``bit`` those before it arrive last. The fault waits for a write that can be torn (F32).
    """
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


EXCEPTION_CODES: Final = (1, 2, 3, 4, 5, 6, 7, 8, 10, 11)
"""All Modbus exception codes (Modbus application protocol 1.1b3, chapter 7)."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One planned fault. It fires once, or until it is removed.

    Attributes:
        action: What goes wrong; its name in small letters will do.
        on_exchange: Which of the requests that ``match``, counted from 0.
        match: Text that a request must contain to be counted; empty counts all.
        seconds: A delay in simulated time, where the action has one. With 0 a stop or error
            comes before the request is carried out.
        code: Error number of DEVICE_FAULT; exception of MODBUS_EXCEPTION, which needs one.
        position: Index of a byte; ``None`` takes the middle (DISCONNECT: nothing leaves;
            GARBLE: drawn from the plan's seed). Past the end it counts from the front again.
        bit: Which bit of that byte, 0 to 7; ``None`` draws it from the plan's seed.
        every: 0 for once; else it meets, from that request on, every so many-th one that matches.

    Raises:
        ConfigError: There is no such action, or no such exception.
    """

    action: FaultAction
    on_exchange: int = 0
    match: str = ""
    seconds: float = 0.0
    code: int = 0
    position: int | None = None
    bit: int | None = None
    every: int = 0

    def __post_init__(self) -> None:
        if isinstance(self.action, FaultAction):
            if self.action is FaultAction.MODBUS_EXCEPTION:
                require_exception(self.code)
            return
        named = FaultAction.__members__.get(str(self.action).upper())
        if named is None:
            raise ConfigError(
                tr("There is no fault {action!r}.", action=self.action),
                remedy=known_names(map(str.lower, FaultAction.__members__), self.action),
            )
        object.__setattr__(self, "action", named)
        self.__post_init__()


def require_exception(code: int) -> None:
    """Refuse a number that is no Modbus exception.

    Raises:
        ConfigError: It is none.
    """
    if code not in EXCEPTION_CODES:
        raise ConfigError(
            tr("There is no Modbus exception {code}.", code=code),
            remedy=tr("Give code= one of {codes}.", codes=", ".join(map(str, EXCEPTION_CODES))),
        )
