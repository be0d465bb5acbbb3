"""Whether pictures are older than the look: what is seen changes while the robot stands still."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from robolink import runtime
from robolink.errors import CalibrationError
from robolink.procedures.camera_watch import SpotWatch
from robolink.runner import Procedure, SeenAt
from robolink.sensing import UNSEEN, stale_picture

LookAgain = Callable[[], Procedure[SeenAt | None]]
"""Takes one more look without a movement; ``None`` from a camera whose pictures are never late."""

_AS_IF_STILL: Final = frozenset({"tip_did_not_move", "camera_changed"})
"""Refusals of a spot of which late pictures may be the reason."""

_LOOKS: Final = 8
"""Looks, after one that does not fit, in which a late picture may still come."""

_STAYS: Final = 4
"""Looks in a row in which a spot that came late has to stay, as one found now and then does not."""


@dataclass(slots=True)
class PictureLateness:
    """Looks again from where the robot stands, a bounded number of times.

    Attributes:
        watch: Compares what was seen.
        known_mm: How far the robot moved before a look that does not fit.
        found: The refusal of the pictures as too old, once what is seen has changed at rest.
    """

    watch: SpotWatch
    known_mm: float
    found: CalibrationError | None = None

    def of_a_spot(
        self, mark: int, beside: SeenAt | None, look: SeenAt, again: LookAgain
    ) -> Procedure[None]:
        """Look again at a spot that had not moved as the robot had.

        Args:
            mark: What was looked at.
            beside: The look before the last movement, ``None`` where nothing was seen.
            look: The look after it.
            again: Takes one more look, without a movement.

        Raises:
            CalibrationError: ``stale_picture``: the spot moved as the robot had moved, after the
                robot had come to rest; and those of a look, except that nothing is seen.
        """
        if beside is not None and self.watch.nearly_follows(beside, look):
            return
        now = yield from self._came_to(look, again)
        if now is None or self.found is None or beside is None:
            return
        if self.watch.came_late(mark, beside, look, now):
            raise self.found

    def at_rest(self, look: SeenAt, again: LookAgain) -> Procedure[None]:
        """Look again, unless it is known already that pictures are late.

        Args:
            look: The look so far.
            again: Takes one more look, without a movement.

        Raises:
            CalibrationError: Those of a look, except that nothing is seen.
        """
        if self.found is None:
            yield from self._came_to(look, again)

    def reason(self, error: CalibrationError) -> CalibrationError:
        """Return the refusal of a spot: as told, or that of late pictures if these explain it."""
        if self.found is None or error.code not in _AS_IF_STILL:
            return error
        return self.found

    def _came_to(self, look: SeenAt, again: LookAgain) -> Procedure[SeenAt | None]:
        """Return the look at which a spot arrived once and stayed; ``None`` if it did not."""
        watch, begun_ns = self.watch, runtime.monotonic_ns()
        came, late, left = None, None, _LOOKS
        while left:
            left -= 1
            try:
                now = yield from again()
            except CalibrationError as error:
                if error.code not in UNSEEN:
                    raise
                now = None
            else:
                if now is None:
                    return None
            if came is None:
                if now is not None and watch.moved_at_rest(look, now, self.known_mm):
                    came, late, left = now, stale_picture(begun_ns), _STAYS - 1
            elif now is None or watch.moved_at_rest(came, now, self.known_mm):
                return None
        self.found = self.found or late
        return came
