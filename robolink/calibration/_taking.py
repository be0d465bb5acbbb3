"""Many taken in turn, touches or crossings: live residuals, an early end, one taken again."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from robolink.calibration._result import CalibrationResult
from robolink.calibration._retaking import (
    PlaceT,
    PlaceT_contra,
    ResultT,
    ResultT_co,
    Retaking,
    TakenT,
    agreement,
    settled,
)
from robolink.calibration._steps import Procedure, Tell
from robolink.errors import CalibrationError
from robolink.messages import tr

LEAST_DOF_TO_STOP: Final = 4
"""Degrees of freedom before an estimated scatter may end a measurement, those of four touches of a
pin at different U: from fewer it is a guess, and whoever stops as soon as a guess is good stops too
often on a lucky one."""


@dataclass(frozen=True, slots=True)
class Course:
    """How a measurement with many touches or crossings goes on.

    Attributes:
        until_mm: End early when half the 95 % interval of each measured length is at most this;
            ``None`` for taking all.
        retake: Offer to take the one again that fits worst.
    """

    until_mm: float | None = None
    retake: bool = False


ALL_OF_THEM: Final = Course()


class Taking(
    Retaking[PlaceT_contra, TakenT, ResultT_co], Protocol[PlaceT_contra, TakenT, ResultT_co]
):
    """What one method takes at each place, and what one more would bring."""

    def foreseen(self, place: PlaceT_contra) -> TakenT:
        """Return what would be taken at a place, as far as :meth:`gain` looks at it."""

    def gain(self, taken: Sequence[TakenT]) -> float:
        """Return the standard deviation of the tip as a multiple of a single one's."""

    def named(self, taken: TakenT) -> str:
        """Return where it was taken, for a person: "U 120.0"."""


def taken_in_turn(
    method: Taking[PlaceT, TakenT, ResultT],
    first: TakenT,
    places: Sequence[PlaceT],
    course: Course,
) -> Procedure[ResultT]:
    """Take all after the first, and return what they say. Ends lifted.

    As soon as they check each other it tells after each how well they agree, how sure the tip is,
    and how sure one more would make it.

    Args:
        method: What is done at each place.
        first: The first one taken.
        places: Where all are taken, the first one too.
        course: When it ends, and whether one may be taken again.

    Raises:
        CalibrationError: Those of ``method``.
    """
    taken = [first]
    for number, place in enumerate(places[1:], start=2):
        taken.append((yield from method.take(place)))
        try:
            fit = method.solve(taken)
        except CalibrationError:
            # What is too little now may be enough in the end.
            continue
        if not fit.dof:
            continue
        following = None if number == len(places) else method.foreseen(places[number])
        yield Tell(_progress(method, fit, taken, following))
        if following is not None and _enough(fit, course.until_mm):
            counted = method.counted(len(taken))
            yield Tell(tr("That is enough: {counted} were taken.", counted=counted))
            break
    return (yield from settled(method, places, taken, retake=course.retake))


def may_end_early(count: int, *, unknowns: int, sigma_stated: bool) -> bool:
    """Tell whether a measurement of ``count`` coordinates can be sure enough before the last one.

    Args:
        count: How many coordinates are measured.
        unknowns: How many numbers the fit has to find.
        sigma_stated: Whether somebody stated the standard deviation.
    """
    return count - 1 - unknowns >= (1 if sigma_stated else LEAST_DOF_TO_STOP)


def _enough(fit: CalibrationResult, until_mm: float | None) -> bool:
    half_mm, dof = fit.half95_mm, fit.dof or 0
    if until_mm is None or half_mm is None:
        return False
    return (fit.sigma_stated or dof >= LEAST_DOF_TO_STOP) and half_mm <= until_mm


def _progress(
    method: Taking[PlaceT, TakenT, ResultT],
    fit: CalibrationResult,
    taken: Sequence[TakenT],
    following: TakenT | None,
) -> str:
    """Return what those so far say."""
    told = agreement(method, fit, last=len(taken) - 1)
    if following is None or fit.half95_mm is None:
        return told
    better = method.gain([*taken, following]) / method.gain(taken)
    gain = tr(
        "One more, at {where}, leaves {share:.0f} % of that.",
        where=method.named(following),
        share=100 * better,
    )
    return f"{told} {gain}"
