"""Inputs that are switched by hand, or follow something that the robot meets."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from robolink_simulators.epson.memory.bits import BitBank

Sense = Callable[[int | None], bool]
"""Tells what an input shows at an instant of the motion under way, ``None`` for the present."""

InputsAsked = dict[int, bool]
"""What was shown by the inputs that somebody asked for, by their numbers."""


class InputBits(BitBank):
    """Inputs of a controller."""

    def __init__(self, size: int) -> None:
        super().__init__(size)
        self._senses: dict[int, Sense] = {}
        self._instant_ns: int | None = None
        self._asked: InputsAsked | None = None

    @property
    def connected(self) -> bool:
        """Whether any input follows the robot."""
        return bool(self._senses)

    def connect(self, number: int, sense: Sense) -> None:
        """Let an input follow something whose state depends on where the robot is.

        Raises:
            Refusal: There is no such input.
        """
        self._check(number)
        self._senses[number] = sense

    def get(self, number: int) -> bool:
        """Return one bit; see :class:`BitBank`."""
        sense = self._senses.get(number)
        on = super().get(number) if sense is None else sense(self._instant_ns)
        if self._asked is not None:
            self._asked[number] = on
        return on

    def set(self, number: int, on: bool) -> None:
        """Switch one bit by hand; what it was connected to is taken off."""
        super().set(number, on)
        self._senses.pop(number, None)

    @contextmanager
    def as_at(self, instant_ns: int) -> Iterator[None]:
        """Read inputs inside the block as they are at an instant of the motion under way."""
        self._instant_ns = instant_ns
        try:
            yield
        finally:
            self._instant_ns = None

    @contextmanager
    def noting(self) -> Iterator[InputsAsked]:
        """Note which inputs are read inside the block, and what they showed."""
        self._asked = asked = InputsAsked()
        try:
            yield asked
        finally:
            self._asked = None
