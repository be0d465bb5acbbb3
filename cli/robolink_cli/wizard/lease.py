"""A held jog: steps as long as a finger is surely on the key. Pure, but for the time it is told.

Every sign by which a browser tells that a finger was lifted is missing in some case. So the page
says ten times a second that it is still there. A finger that was silent for the time of a lease, or
was lifted, never jogs again, whatever comes of it later. And each sign is good for one step: after
the last one, one more step begins at most.
"""

from dataclasses import dataclass, replace
from typing import Final

LEASE_S: Final = 0.25
"""Time in seconds after the last sign of a finger for which steps may begin."""

LONGEST_HELD_STEP: Final = 0.5
"""Longest step of a held jog, mm or degrees. Longer ones take a tap each."""

_MOST_FINGERS: Final = 10_000
"""Most fingers of one job that are remembered as lifted; after that no key can be held."""


@dataclass(frozen=True, slots=True)
class Hold:
    """A key that is held.

    Attributes:
        number: Of the question that was on the screen when the finger went down.
        axis: The key: ``x+``.
        finger: Which finger-down it is.
        seen_s: When it was known to be down last.
        fresh: Whether no step was made since then.
    """

    number: int
    axis: str
    finger: str
    seen_s: float
    fresh: bool = True


class JogLease:
    """The one key that is held, if any; and the fingers that count no longer."""

    def __init__(self) -> None:
        self._hold: Hold | None = None
        self._dead: set[str] = set()

    def hold(self, number: int, axis: str, finger: str, now_s: float) -> None:
        """Note that a finger went down; a second one beside it ends both."""
        before = self.held(now_s)
        if before is not None and before.finger != finger:
            self.end()
            self._forget(finger)
            return
        if before is not None or finger in self._dead or len(self._dead) >= _MOST_FINGERS:
            return  # the same again begins nothing anew
        self._hold = Hold(number, axis, finger, now_s)

    def beat(self, finger: str, now_s: float) -> None:
        """Note that a finger is still down; of another one, or too late, it counts for nothing."""
        hold = self.held(now_s)
        if hold is not None and hold.finger == finger:
            self._hold = replace(hold, seen_s=now_s, fresh=True)

    def release(self, finger: str) -> None:
        """Note that a finger was lifted; also if its ``hold`` should arrive later."""
        if self._hold is not None and self._hold.finger == finger:
            self.end()
        else:
            self._forget(finger)

    def end(self) -> None:
        """End what is held; its finger counts no longer."""
        if self._hold is not None:
            self._forget(self._hold.finger)
        self._hold = None

    def held(self, now_s: float) -> Hold | None:
        """Return the key that is held now; ``None`` for none."""
        hold = self._hold
        if hold is not None and now_s - hold.seen_s > LEASE_S:
            self.end()
            return None
        return hold

    def spend(self, now_s: float) -> bool:
        """Return whether the next step may begin now; the last sign of the finger is spent then."""
        hold = self.held(now_s)
        if hold is None or not hold.fresh:
            return False
        self._hold = replace(hold, fresh=False)
        return True

    def _forget(self, finger: str) -> None:
        if len(self._dead) < _MOST_FINGERS:
            self._dead.add(finger)
