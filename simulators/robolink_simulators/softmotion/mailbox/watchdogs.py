"""Supervises the client's heartbeat while something moves that a client commanded."""

from typing import Final

from robolink.protocols.mailbox import beats_for
from robolink_simulators.device.wire_time import WireTime

PATIENCE_NS: Final = 500_000_000
"""Time in ns without a new beat after which movements are halted (docs/reference/mailbox.md, "What
ends by itself").
"""


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
        """When the time-out ends, ``None`` while nothing is supervised."""
        if self._since_ns is None:
            return None
        heard_ns = max(self._since_ns, self._heard_ns)
        return self._wire_time.simulated_at(heard_ns + PATIENCE_NS)


_NS_PER_MS: Final = 1_000_000


class FieldbusWatchdog:
    """Decides when a fieldbus gives its clients up (documented, docs/reference/softmotion.md 4.1).

    It runs by the clock: nobody has to ask for anything for it to expire.

    Args:
        patience_ms: Silence that it bears; with 0 it never expires.
        wire_time: By which it is counted.
    """

    def __init__(self, patience_ms: int, wire_time: WireTime) -> None:
        self._patience_ns = patience_ms * _NS_PER_MS
        self._wire_time = wire_time
        self._heard_ns: int | None = None

    def hear(self, now_ns: int) -> None:
        """Note a valid request."""
        self._heard_ns = self._wire_time.at(now_ns)

    @property
    def deadline_ns(self) -> int | None:
        """When it expires; ``None`` before the first request, and when it has expired."""
        if self._heard_ns is None or not self._patience_ns:
            return None
        return self._wire_time.simulated_at(self._heard_ns + self._patience_ns)

    def expires(self, now_ns: int) -> bool:
        """Return whether it expires now; once until the next request."""
        due_ns = self.deadline_ns
        if due_ns is None or now_ns < due_ns:
            return False
        self._heard_ns = None
        return True
