"""The plan of a byte stream: what is sent instead of a reply, and what arrives of a request."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from robolink_simulators.faults.counted import CountedFaults
from robolink_simulators.faults.drawn import FaultRates, drawn_faults
from robolink_simulators.faults.links import EPSON_LINKS, PLC_LINKS, LinkKind
from robolink_simulators.faults.stream import Fault, FaultAction


class LinkEnd(Enum):
    """How a link ends, other than by being closed."""

    RESET = auto()
    HALF_OPEN = auto()


@dataclass(frozen=True, slots=True)
class HeldBack:
    """A reply that waits for the next one.

    Attributes:
        data: The reply.
        overtaken: Whether it leaves behind that one.
    """

    data: bytes
    overtaken: bool


Leaving = bytes | HeldBack | LinkEnd | None
Departure = tuple[float, Leaving]
"""Delay in seconds and the data then sent; ``None`` for the end of the link."""

_SPLIT_S: Final = 0.01
"""Time in seconds between the halves of a split reply, unless the fault gives another."""


class FaultPlan(CountedFaults[Fault]):
    """The faults of a byte stream.

    Args:
        faults: What to plan; more may be added at any time.
        seed: Decides what no fault says: which byte and bit is garbled.
        links: The links on which the device may be served.

    Raises:
        FaultNotPossibleError: There is no such fault on any of them.

    Example:
        >>> from robolink_simulators.faults import Fault, FaultAction, FaultPlan
        >>> plan = FaultPlan([Fault(FaultAction.GARBLE_REPLY, position=1, bit=0)])
        >>> plan.departures(b"#Stop,0", plan.take("$Stop"))
        [(0.0, b'#Rtop,0')]
    """

    def __init__(
        self,
        faults: Iterable[Fault] = (),
        seed: int = 1,
        *,
        links: Collection[LinkKind] = EPSON_LINKS | PLC_LINKS,
    ) -> None:
        super().__init__(faults, seed, links=links)
        self._before = b"\r\n"

    @classmethod
    def drawn(cls, seed: int, kind: LinkKind, rates: FaultRates) -> "FaultPlan":
        """Return the plan of a seed for a link: the same seed, the same plan.

        Args:
            seed: Any number.
            kind: The link.
            rates: How many, of which kinds, on which exchanges.

        Example:
            >>> from robolink_simulators.faults import FaultPlan, FaultRates, LinkKind
            >>> rates = FaultRates(rate=1, exchanges=5)
            >>> len(FaultPlan.drawn(7, LinkKind.EPSON_TCP, rates).pending)
            5
        """
        return cls(drawn_faults(seed, kind, rates), seed, links={kind})

    def departures(
        self, reply: bytes, faults: Iterable[Fault], *, after_s: float = 0.0
    ) -> list[Departure]:
        """Return what is sent instead of ``reply``, in order, when ``faults`` meet it.

        Args:
            reply: The reply.
            faults: What it meets.
            after_s: When it would leave without them, in seconds from now.

        Example:
            >>> from robolink_simulators.faults import Fault, FaultAction, FaultPlan
            >>> late = Fault(FaultAction.DELAY, seconds=0.5)
            >>> FaultPlan().departures(b"#Stop,0", [late], after_s=0.25)
            [(0.75, b'#Stop,0')]
        """
        leaving: list[Departure] = [(after_s, reply)]
        for fault in faults:
            leaving = self._met(leaving, fault)
        self._before = reply
        return leaving

    def remember(self, reply: bytes) -> None:
        """Note a reply that meets no fault: the next REPEAT_REPLY sends it again."""
        self._before = reply

    def bent(self, data: bytes, fault: Fault) -> bytes:
        """Return data with one bit of it flipped."""
        index = self._place_in(data, fault)
        flipped = bytearray(data)
        flipped[index] ^= 1 << (self._random.randrange(8) if fault.bit is None else fault.bit)
        return bytes(flipped)

    def _met(self, leaving: list[Departure], fault: Fault) -> list[Departure]:
        if not leaving:
            return leaving
        (after_s, data), rest = leaving[0], leaving[1:]
        if not isinstance(data, bytes) or not data:
            return leaving
        cut_at = len(data) // 2 if fault.position is None else fault.position % len(data)
        match fault.action:
            case FaultAction.DROP_REPLY:
                return []
            case FaultAction.TRUNCATE_REPLY:
                return [(after_s, data[:cut_at])]
            case FaultAction.SPLIT_REPLY:
                later_s = after_s + (fault.seconds or _SPLIT_S)
                return [(after_s, data[:cut_at]), (later_s, data[cut_at:]), *rest]
            case FaultAction.DISCONNECT:
                return [(after_s, data[: fault.position or 0]), (after_s, None)]
            case FaultAction.RESET:
                return [(after_s, LinkEnd.RESET)]
            case FaultAction.HALF_OPEN:
                return [(after_s, LinkEnd.HALF_OPEN)]
            case _:
                return [self._changed(after_s, data, fault), *rest]

    def _changed(self, after_s: float, data: bytes, fault: Fault) -> Departure:
        match fault.action:
            case FaultAction.DELAY:
                return after_s + fault.seconds, data
            case FaultAction.GARBLE_REPLY:
                return after_s, self.bent(data, fault)
            case FaultAction.SWAP_BYTES:
                index = self._place_in(data[:-1], fault) if len(data) > 1 else 0
                pair = data[index : index + 2]
                return after_s, data[:index] + pair[::-1] + data[index + 2 :]
            case FaultAction.DUPLICATE_REPLY:
                return after_s, data + data
            case FaultAction.REPEAT_REPLY:
                return after_s, self._before + data
            case FaultAction.JOIN_REPLY | FaultAction.REORDER_REPLY:
                overtaken = fault.action is FaultAction.REORDER_REPLY
                return after_s, HeldBack(data, overtaken)
            case _:
                return after_s, data

    def _place_in(self, data: bytes, fault: Fault) -> int:
        if fault.position is None:
            return self._random.randrange(len(data))
        return fault.position % len(data)
