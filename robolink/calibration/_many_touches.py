"""A tip touched onto a pin many times: live residuals, an early end, a pose taken again."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol, TypeVar

from robolink.calibration._result import CalibrationResult
from robolink.calibration._steps import Offer, Procedure, Tell
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose

MOST_RETAKES: Final = 3
"""How often a pose is offered to be taken again; after that the measurement stands as it is."""

LEAST_TO_STOP: Final = 4
"""Touches before an estimated scatter may end a measurement: from three it is a guess, and whoever
stops as soon as a guess is good stops too often on a lucky one."""


LEAST_TO_TELL: Final = 3
"""Touches before there is anything to say about them."""

PlaceT = TypeVar("PlaceT")
_PlaceT_contra = TypeVar("_PlaceT_contra", contravariant=True)


@dataclass(frozen=True, slots=True)
class Course:
    """How a measurement with many touches goes on.

    Attributes:
        until_mm: End early when half the 95 % interval of each measured length is at most this;
            ``None`` for taking all touches.
        retake: Offer to take the pose again that fits worst.
    """

    until_mm: float | None = None
    retake: bool = False


ALL_OF_THEM: Final = Course()


class Touching(Protocol[_PlaceT_contra]):
    """What one method does at each touch, and what it makes of them."""

    @property
    def measured(self) -> str:
        """Which lengths it measures, for a person."""

    def touch(self, touches: Sequence[Pose], place: _PlaceT_contra) -> Procedure[Pose]:
        """Go to a place, let the person touch the pin, and lift off.

        Args:
            touches: Those before; the tip is lifted off the last of them.
            place: Where, or how turned, the next one is.
        """

    def foreseen(self, place: _PlaceT_contra) -> Pose:
        """Return a pose with the orientation of a place."""

    def solve(self, touches: Sequence[Pose]) -> CalibrationResult:
        """Return what the touches say.

        Raises:
            CalibrationError: They say nothing that can be trusted.
        """

    def gain(self, poses: Sequence[Pose]) -> float:
        """Return the standard deviation of the tip as a multiple of one placement's."""

    def named(self, pose: Pose) -> str:
        """Return how the tool stands in a pose, for a person."""


def many_touches(
    method: Touching[PlaceT],
    first: Pose,
    places: Sequence[PlaceT],
    course: Course,
) -> Procedure[CalibrationResult]:
    """Take the touches after the first; the tip is lifted off the pin before and after.

    After each touch from the third on it tells how well they agree, how sure the tip is, and how
    sure one more touch would make it.

    Args:
        method: What is done at each touch.
        first: The first touch.
        places: Where all touches are, the first one too.
        course: When it ends, and whether a pose may be taken again.

    Raises:
        CalibrationError: As ``method.solve``.
    """
    touches, taken = [first], list(places[:1])
    for number, place in enumerate(places[1:], start=2):
        touches.append((yield from method.touch(touches, place)))
        taken.append(place)
        if len(touches) < LEAST_TO_TELL:
            continue
        try:
            fit = method.solve(touches)
        except CalibrationError:
            # What is too little now may be enough in the end.
            continue
        following = None if number == len(places) else method.foreseen(places[number])
        yield Tell(_progress(method, fit, touches, following))
        if following is not None and _enough(fit, course.until_mm):
            yield Tell(tr("That is enough: {count} touches were taken.", count=len(touches)))
            break
    result = method.solve(touches)
    for _ in range(MOST_RETAKES if course.retake and result.residuals_mm else 0):
        worst = worst_pose(result)
        if not (yield Offer(_offer(method, result, worst))):
            break
        place = taken.pop(worst)
        again = yield from method.touch(touches, place)
        # The last one taken is where the tip stands, so that the next way begins there.
        touches, taken = [*touches[:worst], *touches[worst + 1 :], again], [*taken, place]
        result = method.solve(touches)
        yield Tell(_progress(method, result, touches, None))
    return result


def worst_pose(result: CalibrationResult) -> int:
    """Return the index of the pose with the largest residual."""
    distances = result.residual_distances_mm
    return distances.index(max(distances))


def _enough(fit: CalibrationResult, until_mm: float | None) -> bool:
    if until_mm is None or (len(fit.inputs) < LEAST_TO_STOP and not fit.sigma_stated):
        return False
    return bool(fit.half_width95) and max(fit.half_width95) <= until_mm


def _progress(
    method: Touching[PlaceT],
    fit: CalibrationResult,
    touches: Sequence[Pose],
    following: Pose | None,
) -> str:
    """Return what the touches so far say, in one sentence."""
    told = tr(
        "{count} touches agree within {rms:.3f} mm rms, the last within {last:.3f} mm; {measured} "
        "are known to +-{half:.3f} mm.",
        count=len(touches),
        rms=fit.rms_mm,
        last=fit.residual_distances_mm[-1],
        measured=method.measured,
        half=max(fit.half_width95),
    )
    if following is None or fit.sigma_mm is None:
        return told
    better = method.gain([*touches, following]) / method.gain(touches)
    gain = tr(
        "One more, at {where}, leaves {share:.0f} % of that.",
        where=method.named(following),
        share=100 * better,
    )
    return f"{told} {gain}"


def _offer(method: Touching[PlaceT], result: CalibrationResult, worst: int) -> str:
    return tr(
        "Pose {number}, at {where}, fits worst: it is {distance:.3f} mm off. Take it again?",
        number=worst + 1,
        where=method.named(result.inputs[worst]),
        distance=result.residual_distances_mm[worst],
    )
