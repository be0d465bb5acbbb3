"""Planned faults: on which exchange what goes wrong. Counted, never rolled.

The vocabulary, and the numbers, are those of docs/reference/faults.md.
"""

import random
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Generic, Protocol, TypeVar


class FaultAction(Enum):
    """What goes wrong with one exchange."""

    DELAY = auto()
    """The reply leaves ``seconds`` late (F01)."""
    DROP_REPLY = auto()
    """Carried out, but no reply leaves (F25)."""
    TRUNCATE_REPLY = auto()
    """Only the first ``position`` bytes leave; the link stays up (F04)."""
    GARBLE_REPLY = auto()
    """One bit of the byte at ``position`` is flipped (F07)."""
    DUPLICATE_REPLY = auto()
    """The reply leaves twice (F09)."""
    SPLIT_REPLY = auto()
    """The bytes after ``position`` leave ``seconds`` later (F05)."""
    DISCONNECT = auto()
    """Carried out; ``position`` bytes of the reply leave, then the link is cut (F11, F13)."""
    DISCONNECT_BEFORE = auto()
    """The link is cut and nothing is carried out."""
    ESTOP = auto()
    """The emergency stop is pressed ``seconds`` after the request came in (F21)."""
    GUARD_OPEN = auto()
    """The guard is opened ``seconds`` after the request came in (F22)."""
    DEVICE_FAULT = auto()
    """Error ``code`` is raised ``seconds`` after the request came in (F20)."""
    IGNORE_WRITE = auto()
    """The statement is acknowledged and not carried out (F43)."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One planned fault. It fires once.

    Attributes:
        action: What goes wrong.
        on_exchange: Which of the requests that ``match``, counted from 0.
        match: Text that a request must contain to be counted; empty counts all.
        seconds: A delay in simulated time, where the action has one. With 0 a stop or error
            comes before the request is carried out.
        code: Error number of DEVICE_FAULT.
        position: Byte index in the reply; ``None`` takes the middle (DISCONNECT: nothing
            leaves; GARBLE_REPLY: drawn from the plan's seed).
    """

    action: FaultAction
    on_exchange: int = 0
    match: str = ""
    seconds: float = 0.0
    code: int = 0
    position: int | None = None


Departure = tuple[float, bytes | None]
"""Seconds from now, and the bytes that leave then; ``None`` for the end of the link."""

_SPLIT_S = 0.01
"""Between the halves of a split reply for which no other time is given."""


class Planned(Protocol):
    """A fault that waits for its request."""

    @property
    def on_exchange(self) -> int:
        """Which of the requests that match, counted from 0."""

    @property
    def match(self) -> str:
        """Text that a request must contain to be counted; empty counts all."""


AnyFault = TypeVar("AnyFault", bound=Planned)


class CountedFaults(Generic[AnyFault]):
    """Counts requests and hands out the faults that are due.

    Args:
        faults: What to plan; more may be added at any time.

    Attributes:
        fired: What has been handed out.
    """

    def __init__(self, faults: Iterable[AnyFault] = ()) -> None:
        self._waiting: list[tuple[AnyFault, int]] = []
        self.fired: list[AnyFault] = []
        for fault in faults:
            self.add(fault)

    def add(self, fault: AnyFault) -> None:
        """Plan one more; its count starts with the next request."""
        self._waiting.append((fault, fault.on_exchange))

    @property
    def pending(self) -> tuple[AnyFault, ...]:
        """What has not fired yet."""
        return tuple(fault for fault, _ in self._waiting)

    def forget(self) -> None:
        """Plan nothing any more, and forget what has been handed out."""
        self._waiting = []
        self.fired = []

    def take(self, request: str) -> tuple[AnyFault, ...]:
        """Count one request and return the faults that it meets."""
        if not self._waiting:
            return ()
        due: list[AnyFault] = []
        waiting: list[tuple[AnyFault, int]] = []
        for fault, left in self._waiting:
            if fault.match not in request:
                waiting.append((fault, left))
            elif left == 0:
                due.append(fault)
            else:
                waiting.append((fault, left - 1))
        self._waiting = waiting
        self.fired += due
        return tuple(due)


class FaultPlan(CountedFaults[Fault]):
    """The faults of a byte stream.

    Args:
        faults: What to plan; more may be added at any time.
        seed: Decides what no fault says: which byte and bit is garbled.
    """

    def __init__(self, faults: Iterable[Fault] = (), seed: int = 1) -> None:
        super().__init__(faults)
        self._random = random.Random(f"faults {seed}")

    def departures(self, reply: bytes, faults: Iterable[Fault]) -> list[Departure]:
        """Return what leaves instead of ``reply``, in order, when ``faults`` meet it."""
        leaving: list[Departure] = [(0.0, reply)]
        for fault in faults:
            leaving = self._met(leaving, fault)
        return leaving

    def _met(self, leaving: list[Departure], fault: Fault) -> list[Departure]:
        if not leaving:
            return leaving
        (after_s, data), rest = leaving[0], leaving[1:]
        if data is None:
            return leaving
        cut_at = len(data) // 2 if fault.position is None else fault.position
        match fault.action:
            case FaultAction.DELAY:
                return [(after_s + fault.seconds, data), *rest]
            case FaultAction.DROP_REPLY:
                return []
            case FaultAction.TRUNCATE_REPLY:
                return [(after_s, data[:cut_at])]
            case FaultAction.GARBLE_REPLY:
                return [(after_s, self._garbled(data, fault.position)), *rest]
            case FaultAction.DUPLICATE_REPLY:
                return [(after_s, data + data), *rest]
            case FaultAction.SPLIT_REPLY:
                later_s = after_s + (fault.seconds or _SPLIT_S)
                return [(after_s, data[:cut_at]), (later_s, data[cut_at:]), *rest]
            case FaultAction.DISCONNECT:
                return [(after_s, data[: fault.position or 0]), (after_s, None)]
            case _:
                return leaving

    def _garbled(self, data: bytes, position: int | None) -> bytes:
        index = self._random.randrange(len(data)) if position is None else position
        flipped = bytearray(data)
        flipped[index] ^= 1 << self._random.randrange(8)
        return bytes(flipped)
