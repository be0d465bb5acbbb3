"""One exchange on a fieldbus, as the simulated PLC sees it, and what goes wrong with it."""

import random
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
from robolink_simulators.faults import CountedFaults
from robolink_simulators.softmotion.mailbox.faults import PlcFault, PlcFaultAction

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
    """

    words: Words = ()
    delay_s: float = 0.0
    answered: bool = True
    cut: bool = False


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
        super().__init__(faults)
        self._random = random.Random(f"plc faults {seed}")

    def arriving(self, words: Sequence[int], faults: Iterable[PlcFault]) -> Words:
        """Return what arrives of what was written."""
        for fault in faults:
            if fault.action is PlcFaultAction.GARBLE_WRITE:
                words = self._garbled(words, fault)
        return tuple(words)

    def leaving(self, words: Words, faults: Iterable[PlcFault]) -> ServedAccess:
        """Return what leaves instead of an answer."""
        served = ServedAccess(words)
        for fault in faults:
            match fault.action:
                case PlcFaultAction.DELAY:
                    served = replace(served, delay_s=served.delay_s + fault.seconds)
                case PlcFaultAction.DROP_REPLY:
                    served = replace(served, answered=False)
                case PlcFaultAction.DISCONNECT:
                    served = replace(served, answered=False, cut=True)
                case PlcFaultAction.GARBLE_REPLY if words:
                    served = replace(served, words=self._garbled(served.words, fault))
                case PlcFaultAction.TEAR_REPLY if words:
                    torn = (*served.words[:-1], served.words[-1] - 1 & 0xFFFF)
                    served = replace(served, words=torn)
        return served

    def _garbled(self, words: Sequence[int], fault: PlcFault) -> Words:
        index = len(words) // 2 if fault.position is None else fault.position
        flipped = list(words)
        flipped[index] ^= 1 << self._random.randrange(16)
        return tuple(flipped)
