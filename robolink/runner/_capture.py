"""Why a place is not taken yet: what is refused at the moment at which a person says "it is there".

It is refused here and not by whoever shows the question, so that no key, script or program comes
past it. What a whole set of touches proves is for the procedure to say (docs/reference/evidence.md
1); this is what can be seen while the tip is still there.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink.timing import NS_PER_S, Clock

FINEST_STEP: Final = 0.1
"""The last step before a touch is not longer, in mm or degrees: who comes in steps of a millimetre
stops up to half of one away (docs/decisions/0041)."""

SETTLING_S: Final = 0.3
"""So long after a step of its own a hand is not believed: the key was pressed for what came
before."""

OLDEST_READING_S: Final = 1.0
"""What took longer to read is not where the tip is now."""

_ROUNDING: Final = 1e-9


@dataclass(frozen=True, slots=True)
class NotYet:
    """Why a place is not taken.

    Attributes:
        code: By which a program knows it, and with which it ends when it is asked for again and
            again.
        sentence: For a person.
    """

    code: str
    sentence: str


Judge = Callable[[object], NotYet | None]
"""Says of a :class:`~robolink.runner.TouchedAt` why it does not count yet."""


class StepsTaken:
    """The steps of one question.

    Args:
        clock: The controller's.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._last = 0.0
        self._ended_ns: int | None = None

    def add(self, deltas: Mapping[str, float]) -> None:
        """Take a step that has just ended, mm and degrees by axis."""
        self._last = max(map(abs, deltas.values()), default=0.0)
        self._ended_ns = self._clock.now_ns()

    def too_coarse(self) -> NotYet | None:
        """Refuse a place that was reached by a long step."""
        if self._last <= FINEST_STEP + _ROUNDING:
            return None
        return NotYet(
            "coarse_step",
            tr(
                "Not yet: the last step was {mm} mm. Finish with 0.10 mm or less.",
                mm=f"{self._last:.2f}",
            ),
        )

    def too_soon(self) -> NotYet | None:
        """Refuse what a hand cannot have meant."""
        ended_ns = self._ended_ns
        if ended_ns is None or (self._clock.now_ns() - ended_ns) / NS_PER_S >= SETTLING_S:
            return None
        return still_moving()


def still_moving() -> NotYet:
    """Return that the robot moves."""
    return NotYet("still_moving", tr("Wait: the robot is still moving."))


def no_contact(number: int) -> NotYet:
    """Return that the input which is to show contact shows none."""
    return NotYet(
        "not_touched",
        tr("Contact input {n} is off: the tip does not touch.", n=number),
    )


def old_reading(seconds: float) -> NotYet:
    """Return that the controller took so long to say where the tip is."""
    return NotYet("old_reading", tr("No reading from the controller for {s} s.", s=round(seconds)))
