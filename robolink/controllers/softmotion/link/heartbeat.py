"""Two heartbeats: whether the PLC's motion task still runs, and when ours is due."""

from typing import Final

from robolink.protocols.mailbox import heartbeat_word
from robolink.timing import NS_PER_S

FROZEN_S: Final = 1.0
"""A motion task counts every few milliseconds; after this long without a count it is dead."""

BUSY_BEAT_S: Final = 0.05
"""Between beats while something moves: the PLC halts it after 0.5 s without one.

The rest of that half second is for a computer that has something else to do.
"""

MOST_LOOK_S: Final = 0.4
"""Where the line alone takes longer for a whole look and a beat, nothing may move: there is no
beat within the PLC's 0.5 s, of which the PLC itself and the adapters need the rest."""

IDLE_BEAT_S: Final = 1.0
"""Between beats otherwise: an owner that is silent for 10 s may be displaced."""


class PlcHeartbeat:
    """Notes the PLC's heartbeat wherever it is read."""

    def __init__(self) -> None:
        self._count = -1
        self._since_ns = 0
        self._looks = 0

    def note(self, count: int, now_ns: int) -> None:
        """Take what was read just now."""
        if count != self._count:
            self._count, self._since_ns, self._looks = count, now_ns, 0
        self._looks += 1

    def frozen(self, now_ns: int) -> bool:
        """Whether the count has stood still under close observation.

        Two equal counts far apart prove nothing: the counter wraps.
        """
        return self._looks > 2 and now_ns - self._since_ns >= FROZEN_S * NS_PER_S


class ClientHeartbeat:
    """Makes the client's heartbeat words."""

    def __init__(self) -> None:
        self._count = 0
        self._last_ns: int | None = None

    def due(self, now_ns: int, *, busy: bool, ahead: bool = False) -> bool:
        """Whether it is time for the next word.

        Args:
            now_ns: The time.
            busy: Whether something moves.
            ahead: Whether an exchange follows that takes a good part of the PLC's patience.
        """
        period_s = (0.0 if ahead else BUSY_BEAT_S) if busy else IDLE_BEAT_S
        return self._last_ns is None or now_ns - self._last_ns >= period_s * NS_PER_S

    def word(self, epoch: int, now_ns: int) -> int:
        """Return the next word of the owner of ``epoch``."""
        self._last_ns = now_ns
        self._count += 1
        return heartbeat_word(epoch, self._count)

    def again(self, epoch: int) -> int:
        """Return the last word once more, which is no sign of life; 0 would be an end."""
        return heartbeat_word(epoch, self._count)
