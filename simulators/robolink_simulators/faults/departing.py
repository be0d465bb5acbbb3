"""The replies of one link on their way out: late, held back, or stuck on a dead link."""

from collections.abc import Sequence

from robolink.timing import NS_PER_S
from robolink_simulators.faults.plan import Departure, HeldBack, LinkEnd


class DepartingReplies:
    """What leaves on one link, and when. One stream: nothing overtakes what was sent before it.

    Attributes:
        half_open: Whether the link carries nothing any more, either way, and nobody knows.
        stalled_until_ns: Until when it carries nothing; 0 for a link that works.
    """

    __slots__ = (
        "_held",
        "_waiting",
        "half_open",
        "stalled_until_ns",
    )

    def __init__(self) -> None:
        # Usually one or none: an empty deque would take 760 bytes per connection.
        self._waiting: list[tuple[int, bytes | LinkEnd | None]] = []
        self._held: list[HeldBack] = []
        self.half_open = False
        self.stalled_until_ns = 0

    @property
    def idle(self) -> bool:
        """Whether nothing waits, and the link carries what is posted."""
        return not (self._waiting or self.half_open or self.stalled_until_ns)

    def depart(self, departures: Sequence[Departure], now_ns: int) -> bool:
        """Send replies as planned; False when the device has ended the link with them."""
        for after_s, leaving in departures:
            if isinstance(leaving, bytes):
                data = self._with_held(leaving) if self._held else leaving
                self.post(data, now_ns + round(after_s * NS_PER_S))
            elif leaving is LinkEnd.HALF_OPEN:
                self.half_open = True
            elif isinstance(leaving, HeldBack):
                self._held.append(leaving)
            else:
                self.post(leaving, now_ns + round(after_s * NS_PER_S))
                return False
        return True

    def post(self, leaving: bytes | LinkEnd | None, at_ns: int) -> None:
        """Send something at an instant, or as soon as what was sent before it has left."""
        self._waiting.append((max(at_ns, self._waiting[-1][0] if self._waiting else 0), leaving))

    def take(self, now_ns: int) -> bytes:
        """Take what has left by now."""
        ready = b""
        if not self._waiting:
            return ready
        if len(self._waiting) == 1 and self._due(now_ns):  # as in nearly every exchange
            only = self._waiting[0][1]
            if isinstance(only, bytes):
                self._waiting.clear()
                return only
        while self._due(now_ns) and isinstance(data := self._waiting[0][1], bytes):
            ready += data
            del self._waiting[0]
        return ready

    def ended(self, now_ns: int) -> bool:
        """Return whether the device has ended the link, after its pending data."""
        return self._due(now_ns) and not isinstance(self._waiting[0][1], bytes)

    def reset(self, now_ns: int) -> bool:
        """Return whether it ended the link with a reset."""
        return self._due(now_ns) and self._waiting[0][1] is LinkEnd.RESET

    def next_change(self, now_ns: int) -> int | None:
        """Return when something leaves, or the link carries again."""
        if self.half_open:
            return None
        if self.stalled_until_ns > now_ns:
            return self.stalled_until_ns
        # Data that is due may not have been taken yet, and later data may wait behind it.
        for at_ns, _ in self._waiting:
            if at_ns > now_ns:
                return at_ns
        return None

    def empty(self, now_ns: int) -> bool:
        """Return whether nothing more will be sent."""
        return self.half_open or not self._waiting or self.ended(now_ns)

    def _due(self, now_ns: int) -> bool:
        if not self._waiting or self.half_open or now_ns < self.stalled_until_ns:
            return False
        return self._waiting[0][0] <= now_ns

    def _with_held(self, data: bytes) -> bytes:
        for held in self._held:
            data = data + held.data if held.overtaken else held.data + data
        self._held.clear()
        return data
