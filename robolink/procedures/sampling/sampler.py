"""What a method takes at each place, and what it makes of all of them."""

from collections.abc import Sequence
from typing import Protocol, TypeVar, runtime_checkable

from robolink.calibration import CalibrationResult
from robolink.runner import Procedure

PlaceT = TypeVar("PlaceT")

TakenT = TypeVar("TakenT")

ResultT = TypeVar("ResultT", bound=CalibrationResult)

PlaceT_contra = TypeVar("PlaceT_contra", contravariant=True)

PlaceT_co = TypeVar("PlaceT_co", covariant=True)

TakenT_contra = TypeVar("TakenT_contra", contravariant=True)

ResultT_co = TypeVar("ResultT_co", bound=CalibrationResult, covariant=True)


class Sampler(Protocol[PlaceT_contra, TakenT, ResultT_co]):
    """How one method takes a touch, a look or a crossing, and what it makes of all of them."""

    @property
    def known(self) -> str:
        """Which lengths become known, for a person: "X and Y"."""

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


@runtime_checkable
class AddsSamples(Protocol[PlaceT_co, TakenT_contra]):
    """A method that can take more than its plan says."""

    def another(self, taken: Sequence[TakenT_contra]) -> Procedure[PlaceT_co | None]:
        """Return where one more tells most, ``None`` where the arm has no room for it."""


class SequentialSampler(
    Sampler[PlaceT_contra, TakenT, ResultT_co], Protocol[PlaceT_contra, TakenT, ResultT_co]
):
    """What one method takes at each place, and what one more would bring."""

    def foreseen(self, place: PlaceT_contra) -> TakenT:
        """Return what would be taken at a place, as far as :meth:`gain` looks at it."""

    def gain(self, taken: Sequence[TakenT]) -> float:
        """Return the standard deviation of the tip as a multiple of a single one's."""

    def named(self, taken: TakenT) -> str:
        """Return where it was taken, for a person: "U 120.0"."""
