"""The command block as clients write it, and which command in it is a new one."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from robolink.protocols.mailbox import (
    COMMAND,
    COMMAND_WORDS,
    DEVICE_START,
    DEVICE_WORDS,
    RESPONSE_WORDS,
    SLOT_WORDS,
    BlockError,
    BlockFault,
    Command,
    WordOrder,
    Words,
    decode_command,
)
from robolink_simulators.faults import (
    CountedFaults,
    Departure,
    LinkKind,
    PlcFault,
    PlcFaultAction,
)
from robolink_simulators.faults.drawn import FaultRates, drawn_plc_faults
from robolink_simulators.faults.links import MAILBOX_LINKS, OF_OPCUA
from robolink_simulators.faults.plan import LinkEnd
from robolink_simulators.softmotion.mailbox.image import arranged

_CRC: Final = COMMAND["crc"].word
_HEARTBEAT: Final = COMMAND["client_heartbeat"].word
_SEQUENCES: Final = 0xFFFF
"""Number of sequence numbers: after 65535 comes 1."""

_MOST_AHEAD: Final = _SEQUENCES // 2
"""Largest distance by which a sequence number can be ahead of the newest one. A larger distance
means that it is behind.

Source: docs/reference/mailbox.md, "When a command counts".
"""


class Inbox:
    """The words that clients write, as the program finds them.

    Args:
        order: How the program lays values of several words.

    Attributes:
        rejected: Distinct blocks whose checksum was wrong.
    """

    def __init__(self, order: WordOrder) -> None:
        self._order = order
        self._image = [0] * COMMAND_WORDS
        self._damaged: set[tuple[int, int]] = set()
        self._settled: list[tuple[int, int, int]] = []
        self._newest: tuple[int, int, int] | None = None
        self.rejected = 0

    @property
    def words(self) -> Words:
        """The words as they stand."""
        return tuple(self._image)

    @property
    def heartbeat(self) -> int:
        """The client's heartbeat word."""
        return self._image[_HEARTBEAT]

    def write(self, first: int, words: Sequence[int]) -> None:
        """Take what a client writes from a word on."""
        self._image[first : first + len(words)] = words

    def lay_words(self, order: WordOrder) -> None:
        """Lay values of several words in another order from now on."""
        self._order = order

    def zero(self) -> None:
        """Zero all, as a fieldbus does when its watchdog expires (documented)."""
        self._image = [0] * COMMAND_WORDS

    def new_command(self) -> Command | None:
        """Return the command that stands there, ``None`` when there is nothing new.

        What is torn, empty or damaged is none; damage is counted, each (head, crc) once.
        """
        try:
            command = decode_command(arranged(COMMAND, self._image, self._order))
        except BlockError as error:
            if error.fault is BlockFault.CRC and (error.head, error.crc) not in self._damaged:
                self._damaged.add((error.head, error.crc))
                self.rejected = self.rejected + 1 & 0xFFFF
            return None
        if self._fingerprint(command) in self._settled or self._is_of_before(command):
            return None
        return command

    def accept(self, command: Command, *, owned: bool) -> None:
        """Remember a command: when it stands there again it is the same one.

        Args:
            command: The command.
            owned: Whether it came from the owner, who numbers its commands upwards.
        """
        self._settled = [self._fingerprint(command)]
        self._note_number(command, owned=owned)

    def hold_back(self, command: Command, *, owned: bool) -> None:
        """Remember a command that came too early: it is not carried out later either."""
        self._settled.append(self._fingerprint(command))
        self._note_number(command, owned=owned)

    def _note_number(self, command: Command, *, owned: bool) -> None:
        if owned:
            self._newest = (command.owner, command.epoch, command.sequence)

    def _is_of_before(self, command: Command) -> bool:
        """Return whether its owner has sent a newer one in this epoch: it comes late, or twice."""
        if self._newest is None or (command.owner, command.epoch) != self._newest[:2]:
            return False
        return not 0 < (command.sequence - self._newest[2]) % _SEQUENCES <= _MOST_AHEAD

    def _fingerprint(self, command: Command) -> tuple[int, int, int]:
        return (command.owner, command.sequence, self._image[_CRC])


_HEAD_WORDS: Final = 10


@dataclass(frozen=True, slots=True)
class ServedAccess:
    """What a host does after an exchange.

    Attributes:
        words: What was read; empty for a write.
        delay_s: How long after the request the answer leaves, in simulated seconds.
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

    def pieces(self, frame: bytes) -> list[tuple[float, bytes]]:
        """Return what leaves instead of a frame: each piece with its seconds behind the answer."""
        late: tuple[float, bytes] | None = None
        for fault in self.met:
            middle = len(frame) // 2 if fault.position is None else fault.position % len(frame)
            if fault.action is PlcFaultAction.SPLIT_REPLY:
                late = fault.seconds or _SPLIT_S, frame[middle:]
            if fault.action in _CUTS:
                frame = _CUTS[fault.action](frame, middle)
        return [(0.0, frame)] if late is None else [(0.0, frame), late]

    def departures(self, frame: bytes) -> list[Departure]:
        """Return what is sent for a request, and when, on a link that is a connection."""
        if self.cut:
            return [(0.0, None)]
        for action, end in _ENDS.items():
            if self.meets(action):
                return [(0.0, end)]
        if not self.answered:
            return []
        return [(self.delay_s + late_s, piece) for late_s, piece in self.pieces(frame)]


_ENDS: Final[dict[PlcFaultAction, LinkEnd]] = {
    PlcFaultAction.RESET: LinkEnd.RESET,
    PlcFaultAction.HALF_OPEN: LinkEnd.HALF_OPEN,
}
_CUTS: Final[dict[PlcFaultAction, Callable[[bytes, int], bytes]]] = {
    PlcFaultAction.TRUNCATE_REPLY: lambda frame, middle: frame[:middle],
    PlcFaultAction.SPLIT_REPLY: lambda frame, middle: frame[:middle],
    PlcFaultAction.DUPLICATE_REPLY: lambda frame, _middle: frame + frame,
}
_SPLIT_S: Final = 0.01
"""Delay in seconds of the second half of a split answer."""

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
        *OF_OPCUA,
    }
)
_REFUSALS: Final = frozenset(
    {
        PlcFaultAction.MODBUS_EXCEPTION,
        PlcFaultAction.OUT_OF_SERVICE,
        PlcFaultAction.LOSE_SESSION,
    }
)
_REFUSED_WRITES: Final = frozenset({PlcFaultAction.READ_ONLY, PlcFaultAction.WRONG_TYPE})


def is_refused(shown: str, actions: Collection[PlcFaultAction]) -> bool:
    """Return whether a request that meets such faults is not carried out, but answered.

    Args:
        shown: The request.
        actions: What it meets.
    """
    refused = _REFUSALS if shown.startswith("read") else _REFUSALS | _REFUSED_WRITES
    return not refused.isdisjoint(actions)


def shown_read(first: int, count: int) -> str:
    """Return a read in words, by what of response and slots it covers."""
    if first == 0 and count in (_HEAD_WORDS, RESPONSE_WORDS):
        return "read_head" if count == _HEAD_WORDS else "read_response"
    if (first, count) == (DEVICE_START, DEVICE_WORDS):
        return "read_device"
    if first == RESPONSE_WORDS and first + count == DEVICE_START + DEVICE_WORDS:
        return "read_slots"
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

    def leaving(
        self, shown: str, words: Words, faults: Iterable[PlcFault], *, after_s: float = 0.0
    ) -> ServedAccess:
        """Return what is sent instead of an answer.

        Args:
            shown: The request.
            words: The answer.
            faults: What it meets.
            after_s: When it would leave without them, in seconds from now.
        """
        served = ServedAccess(words, delay_s=after_s)
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
                # No earlier answer yet: the fault did not fire and waits for the next read.
                self.take_back(fault, shown)
        return words

    def _garbled(self, words: Sequence[int], fault: PlcFault) -> Words:
        index = len(words) // 2 if fault.position is None else fault.position % len(words)
        flipped = list(words)
        flipped[index] ^= 1 << (self._random.randrange(16) if fault.bit is None else fault.bit)
        return tuple(flipped)
