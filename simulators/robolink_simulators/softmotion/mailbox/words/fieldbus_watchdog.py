"""The watchdog of a fieldbus: after too long a silence it zeroes what clients have written."""

from typing import Final

from robolink_simulators.device.wire_time import WireTime

_NS_PER_MS: Final = 1_000_000


class FieldbusWatchdog:
    """Knows when a fieldbus gives its clients up (documented, docs/reference/softmotion.md 4.1).

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
        """Tell whether it expires now; once until the next request."""
        due_ns = self.deadline_ns
        if due_ns is None or now_ns < due_ns:
            return False
        self._heard_ns = None
        return True
