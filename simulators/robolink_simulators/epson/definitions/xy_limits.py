"""The box that XYLim holds a robot in (docs/reference/spel.md 7.2)."""

from collections.abc import Sequence
from typing import Final

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

_PAIRS: Final = (2, 3)
_OFF: Final = (0.0, 0.0)
_SAME_MM: Final = 1e-6

Corner = tuple[float, float, float]


class XYLimits:
    """Lowest and highest X, Y and Z of one robot, in the robot's coordinates.

    Two zeros limit nothing: documented where all are 0, assumed for one of the pairs.

    Attributes:
        strict: XYLimMode 1: the way counts too, not the target alone.
        changes: How often a limit was set.
    """

    def __init__(self) -> None:
        self.strict = False
        self.changes = 0
        self._pairs: tuple[tuple[float, float], ...] = (_OFF, _OFF)

    @property
    def defined(self) -> bool:
        """Whether anything is limited."""
        return any(pair != _OFF for pair in self._pairs)

    @property
    def values(self) -> tuple[float, ...]:
        """The limits as they were given: X, Y, and Z if it was."""
        return tuple(end for pair in self._pairs for end in pair)

    @property
    def corners(self) -> tuple[Corner, Corner]:
        """The lowest and the highest X, Y, Z, 0 where nothing is limited."""
        (x0, x1), (y0, y1), (z0, z1) = (*self._pairs, _OFF)[:3]
        return (x0, y0, z0), (x1, y1, z1)

    def set(self, values: Sequence[float]) -> None:
        """Limit X, Y and, with six values, Z.

        Raises:
            Refusal: Neither four nor six values, or a lowest above its highest.
        """
        pairs = tuple(zip(map(float, values[::2]), map(float, values[1::2]), strict=False))
        if len(values) % 2 or len(pairs) not in _PAIRS:
            raise SpelRefusal(RefusalKind.SYNTAX, f"XYLim does not take {len(values)} values")
        if any(low > high for low, high in pairs):
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "A lower limit lies above its upper")
        self._pairs = pairs
        self.changes += 1

    def clear(self) -> None:
        """Limit nothing."""
        self.set((*_OFF, *_OFF))

    def outside_mm(self, place: Sequence[float]) -> float:
        """Return how far a place (X, Y, Z in mm) lies outside, 0 where it does not."""
        limited = zip(self._pairs, place, strict=False)
        beyond = [max(low - at, at - high) for (low, high), at in limited if (low, high) != _OFF]
        return max([0.0, *(by for by in beyond if by > _SAME_MM)])

    def to_state(self) -> list[float]:
        """Return what survives power-off, ready for JSON."""
        return list(self.values)

    def restore(self, state: object) -> None:
        """Take over what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        if not isinstance(state, list) or len(state) not in (4, 6):
            raise ValueError("not the limits of a robot")
        pairs = [
            (float(low), float(high)) for low, high in zip(state[::2], state[1::2], strict=True)
        ]
        if any(low > high for low, high in pairs):
            raise ValueError("not the limits of a robot")
        self._pairs = tuple(pairs)
