"""What a method takes at each place, what was taken so far, and how one sample is repeated."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Generic, Protocol, TypeVar, runtime_checkable

from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.runner import Notify, Procedure, TakenAgainError

PlaceT = TypeVar("PlaceT")

TakenT = TypeVar("TakenT")

ResultT = TypeVar("ResultT", bound=CalibrationResult)

PlaceT_contra = TypeVar("PlaceT_contra", contravariant=True)

PlaceT_co = TypeVar("PlaceT_co", covariant=True)

TakenT_contra = TypeVar("TakenT_contra", contravariant=True)

ResultT_co = TypeVar("ResultT_co", bound=CalibrationResult, covariant=True)


class Sampler(Protocol[PlaceT_contra, TakenT, ResultT_co]):
    """How one method takes a touch, a look or a crossing, and solves all of them."""

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
        """Lift the tip to where a person may take their time; nothing if it is there."""

    def solve(self, taken: Sequence[TakenT]) -> ResultT_co:
        """Return their result, with their residuals in their order.

        Raises:
            CalibrationError: They say nothing that can be trusted.
        """

    def which(self, number: int, taken: TakenT) -> str:
        """Return which one it is, for a person: "Pose 3, at U 120.0"."""


@runtime_checkable
class AddsSamples(Protocol[PlaceT_co, TakenT_contra]):
    """A method that can take more than its plan says."""

    def next_place(self, taken: Sequence[TakenT_contra]) -> Procedure[PlaceT_co | None]:
        """Return the most informative further place, ``None`` if the arm has no room for it."""


class SequentialSampler(
    Sampler[PlaceT_contra, TakenT, ResultT_co], Protocol[PlaceT_contra, TakenT, ResultT_co]
):
    """What one method takes at each place, and what one more would add."""

    def foreseen(self, place: PlaceT_contra) -> TakenT:
        """Return what would be taken at a place, as far as :meth:`gain` uses it."""

    def gain(self, taken: Sequence[TakenT]) -> float:
        """Return the standard deviation of the tip as a multiple of a single one's."""

    def named(self, taken: TakenT) -> str:
        """Return where it was taken, for a person: "U 120.0"."""


class TouchNames(ABC):
    """Words that samplers of touches share."""

    __slots__ = ()

    def counted(self, count: int) -> str:
        """Return how many were taken."""
        return tr("{count} touches", count=count)

    def which(self, number: int, touch: Any) -> str:  # noqa: ANN401 - what the sampler takes
        """Return which one it is."""
        return tr("Touch {number} at {where}", number=number, where=self.named(touch))

    @abstractmethod
    def named(self, touch: Any) -> str:  # noqa: ANN401
        """Return where one was taken."""


class Samples(Generic[PlaceT, TakenT, ResultT]):
    """What was taken so far, and at which place each.

    Attributes:
        taken: In the order of the places; one that was taken again stands where it stood.

    Args:
        method: How it is taken and solved.
        places: Where it is taken.
        taken: What was taken at the first of them.

    Example:
        >>> from robolink.procedures import Samples
        >>> class Touches:  # in full: robolink.procedures.Sampler
        ...     def take(self, place):
        ...         return f"touch at U {place}"
        ...         yield
        >>> samples = Samples(Touches(), [0, 120, 240], ["touch at U 0"])
        >>> for _ in samples.take(1):
        ...     pass
        >>> samples.taken
        ['touch at U 0', 'touch at U 120']
    """

    def __init__(
        self,
        method: Sampler[PlaceT, TakenT, ResultT],
        places: Sequence[PlaceT],
        taken: Sequence[TakenT],
    ) -> None:
        self._method = method
        self._places = list(places)
        self.taken = list(taken)

    def take(self, index: int) -> Procedure[None]:
        """Take the sample at a place, again or for the first time.

        One that the person asks for again meanwhile comes first.
        """
        while True:
            try:
                one = yield from self._method.take(self._places[index])
            except TakenAgainError as again:
                yield Notify(again.what)
                yield from self.take(again.number - 1)
                continue
            if index < len(self.taken):
                self.taken[index] = one
            else:
                self.taken.append(one)
            return

    def another(self) -> Procedure[bool]:
        """Take one more than planned; return whether there is room for it."""
        if not isinstance(self._method, AddsSamples):
            return False
        place: PlaceT | None = yield from self._method.next_place(self.taken)
        if place is None:
            yield Notify(tr("The arm has no room for one more touch here."))
            return False
        self._places = [*self._places[: len(self.taken)], place]
        yield from self.take(len(self.taken))
        return True

    def solved(self) -> ResultT:
        """Return their result.

        Raises:
            CalibrationError: They say nothing that can be trusted.
        """
        return self._method.solve(self.taken)
