"""One exchange on a fieldbus, as the simulated PLC sees it, and what goes wrong with it."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from robolink.protocols.mailbox import (
    COMMAND,
    COMMAND_WORDS,
    DEVICE_START,
    DEVICE_WORDS,
    RESPONSE_WORDS,
    SLOT_WORDS,
    Words,
)
from robolink_simulators.faults import CountedFaults, LinkKind, PlcFault, PlcFaultAction
from robolink_simulators.faults.drawn import FaultRates, drawn_plc_faults
from robolink_simulators.faults.links import MAILBOX_LINKS

_HEAD_WORDS: Final = 10
_HEARTBEAT: Final = COMMAND["client_heartbeat"].word


@dataclass(frozen=True, slots=True)
class ServedAccess:
    """What a host does after an exchange.

    Attributes:
        words: What was read; empty for a write.
        delay_s: How much later than usual the answer leaves, in simulated time.
        answered: Whether an answer leaves at all.
        cut: Whether the link is cut then.
        met: The faults of this exchange that only the host can do: what becomes of frames, of
            segments, of connections.
    """

    words: Words = ()
    delay_s: float = 0.0
    answered: bool = True
    cut: bool = False
    met: tuple[PlcFault, ...] = ()

    def meets(self, action: PlcFaultAction) -> PlcFault | None:
        """Return the fault of this kind that the host is to do, ``None`` for none."""
        return next((fault for fault in self.met if fault.action is action), None)


_OF_HOSTS: Final = frozenset(
    {
        PlcFaultAction.TRUNCATE_REPLY,
        PlcFaultAction.DUPLICATE_REPLY,
        PlcFaultAction.SPLIT_REPLY,
        PlcFaultAction.RESET,
        PlcFaultAction.HALF_OPEN,
        PlcFaultAction.LOSE_SEGMENT,
        PlcFaultAction.WRONG_TOGGLE,
        PlcFaultAction.FOREIGN_NODE,
        PlcFaultAction.ECHO,
        PlcFaultAction.MODBUS_EXCEPTION,
    }
)


def shown_read(first: int, count: int) -> str:
    """Return a read in words, by what of response and slots it covers."""
    if first == 0 and count in (_HEAD_WORDS, RESPONSE_WORDS):
        return "read_head" if count == _HEAD_WORDS else "read_response"
    if (first, count) == (DEVICE_START, DEVICE_WORDS):
        return "read_device"
    slot, offset = divmod(first - RESPONSE_WORDS, SLOT_WORDS)
    if slot >= 0 and offset == 0 and count == SLOT_WORDS:
        return f"read_slot {slot + 1}"
    return f"read {first} {count}"


def shown_write(first: int, words: Sequence[int], opcode_name: str) -> str:
    """Return a write in words, by what of the command block it covers."""
    if len(words) == COMMAND_WORDS:
        return f"write_command {opcode_name} {words[0]}"
    if (first, len(words)) == (_HEARTBEAT, 1):
        return "beat"
    return f"write {first} {len(words)}"


class WireFaults(CountedFaults[PlcFault]):
    """Applies the planned faults that change what is on the wire.

    Args:
        faults: What to plan; more may be added at any time.
        seed: Decides which bit is garbled.
    """

    def __init__(self, faults: Iterable[PlcFault] = (), seed: int = 1) -> None:
        super().__init__(faults, seed, links=MAILBOX_LINKS)
        self._before: dict[str, Words] = {}

    @classmethod
    def drawn(cls, seed: int, kind: LinkKind, rates: FaultRates) -> "WireFaults":
        """Return the plan of a seed for a link; as ``FaultPlan.drawn``."""
        return cls(drawn_plc_faults(seed, kind, rates), seed)

    def arriving(self, words: Sequence[int], faults: Iterable[PlcFault]) -> Words:
        """Return what arrives of what was written."""
        for fault in faults:
            if fault.action is PlcFaultAction.GARBLE_WRITE:
                words = self._garbled(words, fault)
        return tuple(words)

    def leaving(self, shown: str, words: Words, faults: Iterable[PlcFault]) -> ServedAccess:
        """Return what leaves instead of an answer."""
        served = ServedAccess(words)
        for fault in faults:
            match fault.action:
                case PlcFaultAction.DELAY | PlcFaultAction.STALL:
                    served = replace(served, delay_s=served.delay_s + fault.seconds)
                case PlcFaultAction.DROP_REPLY:
                    served = replace(served, answered=False)
                case PlcFaultAction.DISCONNECT:
                    served = replace(served, answered=False, cut=True)
                case action if action in _OF_HOSTS:
                    served = replace(served, met=(*served.met, fault))
                case _ if served.words:
                    served = replace(served, words=self._bent(shown, served.words, fault))
        if words:
            self._before[shown] = words
        return served

    def _bent(self, shown: str, words: Words, fault: PlcFault) -> Words:
        match fault.action:
            case PlcFaultAction.GARBLE_REPLY:
                return self._garbled(words, fault)
            case PlcFaultAction.TEAR_REPLY:
                return (*words[:-1], words[-1] - 1 & 0xFFFF)
            case PlcFaultAction.ZERO_REPLY:
                return (0,) * len(words)
            case PlcFaultAction.STALE_REPLY if shown in self._before:
                return self._before[shown]
            case PlcFaultAction.STALE_REPLY:
                # There is nothing stale yet: it did not happen, and waits for the next one.
                self.fired.remove(fault)
                self.times_fired -= 1
                if not fault.every:  # else it comes again by itself
                    self.add(replace(fault, on_exchange=0, match=fault.match or shown))
        return words

    def _garbled(self, words: Sequence[int], fault: PlcFault) -> Words:
        index = len(words) // 2 if fault.position is None else fault.position % len(words)
        flipped = list(words)
        flipped[index] ^= 1 << (self._random.randrange(16) if fault.bit is None else fault.bit)
        return tuple(flipped)
