"""Faults of a byte stream: Remote Ethernet, and Modbus frames of a PLC with a map of its own."""

from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import known_names, tr


class FaultAction(Enum):
    """What goes wrong with one exchange."""

    DROP_REQUEST = auto()
    """The request never arrives: nothing is carried out and nothing leaves (F25)."""
    DUPLICATE_REQUEST = auto()
    """The request arrives again ``seconds`` later, and is answered again (F27)."""
    GARBLE_REQUEST = auto()
    """Bit ``bit`` of the byte at ``position`` of the request arrives flipped (F07)."""
    TRUNCATE_REQUEST = auto()
    """Only the first ``position`` bytes arrive, and no line end (F04)."""
    STALL = auto()
    """For ``seconds`` nothing is carried either way; then the request arrives, and what was sent
    after it, the end of the connection too (F12)."""
    DELAY = auto()
    """The reply leaves ``seconds`` late (F01)."""
    DROP_REPLY = auto()
    """Carried out, but no reply leaves (F25)."""
    TRUNCATE_REPLY = auto()
    """Only the first ``position`` bytes leave; the link stays up (F04)."""
    GARBLE_REPLY = auto()
    """Bit ``bit`` of the byte at ``position`` is flipped (F07)."""
    SWAP_BYTES = auto()
    """The bytes at ``position`` and behind it change places (F08)."""
    DUPLICATE_REPLY = auto()
    """The reply leaves twice, in one piece (F09)."""
    REPEAT_REPLY = auto()
    """The reply before it leaves once more, ahead of it (F10); without one, an empty line."""
    SPLIT_REPLY = auto()
    """The bytes after ``position`` leave ``seconds`` later (F05)."""
    JOIN_REPLY = auto()
    """The reply is held back, and leaves in one piece with the next one, ahead of it (F06)."""
    REORDER_REPLY = auto()
    """The reply is held back, and leaves behind the next one (F02)."""
    HALF_OPEN = auto()
    """Carried out; from then on the link carries nothing, and neither end is told (F11)."""
    DISCONNECT = auto()
    """Carried out; ``position`` bytes of the reply leave, then the link is cut (F11, F13)."""
    DISCONNECT_BEFORE = auto()
    """The link is cut and nothing is carried out."""
    RESET = auto()
    """Carried out; the connection is reset, and the reply is lost (F75)."""
    RESTART = auto()
    """The controller starts anew ``seconds`` after the request came in (F13)."""
    LOSE_LOGIN = auto()
    """The controller forgets the login ``seconds`` after the request came in (F15)."""
    TEACH_MODE = auto()
    """The selector is turned to TEACH ``seconds`` after the request came in (F17)."""
    ESTOP = auto()
    """The emergency stop is pressed ``seconds`` after the request came in (F21)."""
    GUARD_OPEN = auto()
    """The guard is opened ``seconds`` after the request came in (F22)."""
    DEVICE_FAULT = auto()
    """Error ``code`` is raised ``seconds`` after the request came in (F19)."""
    SERIOUS_ERROR = auto()
    """An error that only a restart clears comes ``seconds`` after the request (F20)."""
    IGNORE_WRITE = auto()
    """The statement is acknowledged and not carried out (F43)."""
    MODBUS_EXCEPTION = auto()
    """Nothing is carried out, and the answer is the Modbus exception ``code``."""


EXCEPTION_CODES: Final = (1, 2, 3, 4, 5, 6, 7, 8, 10, 11)
"""The exceptions that there are (Modbus application protocol 1.1b3, chapter 7)."""


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
