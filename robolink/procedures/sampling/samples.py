"""What was taken so far, and how one of it is taken again without the others."""

from collections.abc import Sequence
from typing import Generic

from robolink.messages import tr
from robolink.procedures.sampling.sampler import (
    AddsSamples,
    PlaceT,
    ResultT,
    Sampler,
    TakenT,
)
from robolink.runner import Notify, Procedure, TakenAgainError


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
        """Take the one at a place, once more or for the first time.

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
        place: PlaceT | None = yield from self._method.another(self.taken)
        if place is None:
            yield Notify(tr("The arm has no room for one more touch here."))
            return False
        self._places = [*self._places[: len(self.taken)], place]
        yield from self.take(len(self.taken))
        return True

    def solved(self) -> ResultT:
        """Return what they say.

        Raises:
            CalibrationError: They say nothing that can be trusted.
        """
        return self._method.solve(self.taken)
