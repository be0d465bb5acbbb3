"""What was taken place by place, and the one that fits worst taken again if a person wants it."""

from collections.abc import Sequence
from typing import Final, Protocol, TypeVar

from robolink.calibration._result import CalibrationResult
from robolink.calibration._steps import Offer, Procedure, Tell
from robolink.messages import tr

MOST_RETAKES: Final = 3
"""How often one is offered to be taken again; after that the measurement stands as it is."""

_DIGITS: Final = 6
"""Residuals that are equal in so many decimals of a millimetre differ by rounding alone."""

PlaceT = TypeVar("PlaceT")
TakenT = TypeVar("TakenT")
ResultT = TypeVar("ResultT", bound=CalibrationResult)
PlaceT_contra = TypeVar("PlaceT_contra", contravariant=True)
ResultT_co = TypeVar("ResultT_co", bound=CalibrationResult, covariant=True)


class Retaking(Protocol[PlaceT_contra, TakenT, ResultT_co]):
    """How one method takes a touch, a look or a crossing, and what it makes of all of them."""

    @property
    def known(self) -> str:
        """Which lengths become known, for a person: "X and Y are known"."""

    def counted(self, count: int) -> str:
        """Return how many were taken, for a person: "6 touches"."""

    def take(self, place: PlaceT_contra) -> Procedure[TakenT]:
        """Go to a place from wherever the one before ended, and take one there.

        Raises:
            CalibrationError: The sensor says nothing of use; the tip is drawn back.
        """

    def away(self) -> Procedure[None]:
        """Lift the tip to where a person may take their time; nothing where it is there."""

    def solve(self, taken: Sequence[TakenT]) -> ResultT_co:
        """Return what they say, with their residuals in their order.

        Raises:
            CalibrationError: They say nothing that can be trusted.
        """

    def which(self, number: int, taken: TakenT) -> str:
        """Return which one it is, for a person: "Pose 3, at U 120.0"."""


def settled(
    method: Retaking[PlaceT, TakenT, ResultT],
    places: Sequence[PlaceT],
    taken: Sequence[TakenT],
    *,
    retake: bool,
) -> Procedure[ResultT]:
    """Return what was taken says, after the worst of it was taken again or not. Ends lifted.

    Args:
        method: How it is taken and solved.
        places: Where it was taken.
        taken: What was taken there.
        retake: Whether the one that fits worst is offered to be taken again.

    Raises:
        CalibrationError: Those of ``method``.
    """
    yield from method.away()
    held, times = list(taken), [0] * len(taken)
    result = method.solve(held)
    for _ in range(MOST_RETAKES if retake and result.dof else 0):
        distances = result.residual_distances_mm
        # Two that are checked by each other alone fit equally badly; then it is the other's turn.
        worst = min(range(len(held)), key=lambda i: (-round(distances[i], _DIGITS), times[i]))
        question = tr(
            "{which}, fits worst: it is {distance:.3f} mm off. Take it again?",
            which=method.which(worst + 1, held[worst]),
            distance=distances[worst],
        )
        if not (yield Offer(question)):
            break
        times[worst] += 1
        held[worst] = yield from method.take(places[worst])
        yield from method.away()
        result = method.solve(held)
        yield Tell(agreement(method, result, last=worst))
    return result


def agreement(
    method: Retaking[PlaceT, TakenT, ResultT], fit: CalibrationResult, *, last: int
) -> str:
    """Return how well those agree that were taken so far, and how sure the tip is, as a sentence.

    Args:
        method: How they are named.
        fit: What they say; it has a degree of freedom.
        last: Index of the one that was taken last.
    """
    half_mm = fit.half95_mm
    known = (
        ""
        if half_mm is None
        else tr("; {known} to +-{half:.3f} mm", known=method.known, half=half_mm)
    )
    return tr(
        "{counted} agree within {rms:.3f} mm rms, the last within {last:.3f} mm{known}.",
        counted=method.counted(len(fit.residuals_mm)),
        rms=fit.rms_mm,
        last=fit.residual_distances_mm[last],
        known=known,
    )
