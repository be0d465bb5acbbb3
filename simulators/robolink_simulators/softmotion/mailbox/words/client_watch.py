"""Supervises the client's heartbeat while something moves that a client commanded."""

from typing import Final

from robolink.protocols.mailbox import beats_for
from robolink_simulators.device.wire_time import WireTime

PATIENCE_NS: Final = 500_000_000
"""Without a new beat for this long, what moves is halted (docs/mailbox.md, "What ends by
itself")."""


class ClientWatch:
    """Knows when the last beat came, and when the next one is due.

    Args:
        wire_time: By which the time between beats is counted.
    """

    def __init__(self, wire_time: WireTime) -> None:
        self._wire_time = wire_time
        self._word = 0
        self._heard_ns = 0
        self._since_ns: int | None = None

    def note(self, word: int, epoch: int, now_ns: int) -> bool:
        """Take the heartbeat word as it stands; True when it is a new beat of this epoch."""
        if word == self._word:
            return False
        self._word = word
        if not beats_for(word, epoch):
            return False
        self._heard_ns = self._wire_time.at(now_ns)
        return True

    def watch(self, *, moving: bool, now_ns: int) -> None:
        """Supervise from now on while something moves, and else not."""
        if not moving:
            self._since_ns = None
        elif self._since_ns is None:
            self._since_ns = self._wire_time.at(now_ns)

    @property
    def zeroed(self) -> bool:
        """Whether the word is 0: no client sends that, a fieldbus's watchdog leaves it."""
        return self._word == 0

    @property
    def deadline_ns(self) -> int | None:
        """When patience ends, ``None`` while nothing is supervised."""
        if self._since_ns is None:
            return None
        heard_ns = max(self._since_ns, self._heard_ns)
        return self._wire_time.simulated_at(heard_ns + PATIENCE_NS)
