"""Inputs that are switched by hand, or follow something that the robot meets."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from robolink_simulators.epson.memory.bits import BitBank
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

_COUNTERS: Final = 16
_HIGHEST_COUNT: Final = 65535
"""Where a counter stays (docs/reference/spel.md 8; what comes after it is not stated)."""

Sense = Callable[[int | None], bool]
"""Tells what an input shows at an instant of the motion under way, ``None`` for the present."""

InputsAsked = dict[int, bool]
"""What was shown by the inputs that somebody asked for, by their numbers."""


class InputBits(BitBank):
    """Inputs of a controller.

    Attributes:
        listeners: Told of each input that is switched by hand, and whether it is on now.
    """

    def __init__(self, size: int) -> None:
        super().__init__(size)
        self._senses: dict[int, Sense] = {}
        self._instant_ns: int | None = None
        self._asked: InputsAsked | None = None
        self._counts: dict[int, int] = {}
        self.listeners = list[Callable[[int, bool], None]]()

    @property
    def connected(self) -> bool:
        """Whether any input follows the robot."""
        return bool(self._senses)

    @property
    def instant_ns(self) -> int | None:
        """The instant that is looked at inside :meth:`as_at`, ``None`` for the present."""
        return self._instant_ns

    def follows(self, number: int) -> bool:
        """Tell whether an input follows what the robot meets."""
        return number in self._senses

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
        rises = on and not super().get(number)
        super().set(number, on)
        self._senses.pop(number, None)
        if rises and number in self._counts:
            self._counts[number] = min(self._counts[number] + 1, _HIGHEST_COUNT)
        for listener in self.listeners:
            listener(number, on)

    def set_byte(self, port: int, value: int) -> None:
        """Switch eight bits by hand."""
        if not 0 <= value <= 0xFF:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"Not a byte: {value}")
        self._check_byte(port)
        for bit in range(8):
            self.set(8 * port + bit, bool(value >> bit & 1))

    def count_from_zero(self, number: int) -> None:
        """Let an input be counted from now on (CTReset): up to 16 inputs at a time.

        Raises:
            Refusal: There is no such input, 16 others are counted, or it follows what the robot
                meets, whose edges are not counted here.
        """
        self._check(number)
        if number in self._senses:
            raise SpelRefusal(RefusalKind.NOT_SIMULATED, "A counter of a sensor at the tip")
        if number not in self._counts and len(self._counts) >= _COUNTERS:
            raise SpelRefusal(RefusalKind.COUNTERS_USED, f"There are {_COUNTERS} counters")
        self._counts[number] = 0

    def counted(self, number: int) -> int:
        """Return how often an input was switched on since it is counted (Ctr), 0 if it is not."""
        self._check(number)
        return self._counts.get(number, 0)

    @contextmanager
    def as_at(self, instant_ns: int) -> Iterator[None]:
        """Read inputs inside the block as they are at an instant of the motion under way."""
        self._instant_ns = instant_ns
        try:
            yield
        finally:
            self._instant_ns = None

    def show(self, asked: InputsAsked, instant_ns: int) -> bool:
        """Tell whether inputs show at an instant of the motion under way what they showed."""
        # Without a block, of which a search would enter one for each millisecond.
        before_ns, self._instant_ns = self._instant_ns, instant_ns
        try:
            return all(self.get(number) is on for number, on in asked.items())
        finally:
            self._instant_ns = before_ns

    @contextmanager
    def noting(self) -> Iterator[InputsAsked]:
        """Note which inputs are read inside the block, and what they showed."""
        self._asked = asked = InputsAsked()
        try:
            yield asked
        finally:
            self._asked = None


def first_between(before_ns: int, after_ns: int, holds: Callable[[int], bool]) -> int:
    """Return the first instant at which something holds, to the nanosecond."""
    while after_ns - before_ns > 1:
        middle_ns = (before_ns + after_ns) // 2
        if holds(middle_ns):
            after_ns = middle_ns
        else:
            before_ns = middle_ns
    return after_ns
