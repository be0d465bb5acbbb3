"""What somebody does to a machine past the wire, planned by counting requests."""

from robolink_simulators.soak.history import Disturbance


class CountedActs:
    """Counts requests and hands out what is due.

    Attributes:
        met: How much was handed out since the last :meth:`clear`.
    """

    def __init__(self) -> None:
        self.met = 0
        self._waiting: list[tuple[Disturbance, int]] = []

    def plan(self, disturbance: Disturbance) -> None:
        """Let something happen at a request that is still to come."""
        self._waiting.append((disturbance, disturbance.at))

    def due(self, text: str) -> list[Disturbance]:
        """Count one request and return what happens with it."""
        found, waiting = [], []
        for disturbance, left in self._waiting:
            if disturbance.match not in text:
                waiting.append((disturbance, left))
            elif left:
                waiting.append((disturbance, left - 1))
            else:
                found.append(disturbance)
        self._waiting = waiting
        self.met += len(found)
        return found

    def clear(self) -> int:
        """Plan nothing any more; return how much was met."""
        met, self.met = self.met, 0
        self._waiting.clear()
        return met
