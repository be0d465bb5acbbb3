"""Pallets: points in rows and columns between corners (docs/reference/spel.md 5.4)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

HIGHEST_PALLET: Final = 15
_MOST_PLACES: Final = 32766


@dataclass(frozen=True, slots=True)
class Pallet:
    """Columns run from corner 1 to 2, rows from corner 1 to 3.

    Attributes:
        corners: Corners 1, 2 and 3, and the one opposite to 1 if it was given.
        columns: How many.
        rows: How many.
        outside: Whether places beyond its edges may be named by column and row.
    """

    corners: tuple[Point, ...]
    columns: int
    rows: int
    outside: bool = False

    def place(self, *position: int) -> Point:
        """Return a place by its number, counted along the columns from 1, or by column and row.

        Hand, local, U, V and W are corner 1's (documented). Four corners are interpolated
        bilinearly (inferred; the rule is not given).

        Raises:
            Refusal: There is no such place.
        """
        if len(position) == 1:
            row, column = divmod(position[0] - 1, self.columns)
        else:
            column, row = (number - 1 for number in position)
        named = len(position) > 1 and self.outside
        if not named and not (0 <= column < self.columns and 0 <= row < self.rows):
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"No place {position} on the pallet")
        along, across = _share(column, self.columns), _share(row, self.rows)
        x, y, z = (self._coordinate(axis, along, across) for axis in range(3))
        first = self.corners[0]
        return replace(first, coordinates=(x, y, z, *first.coordinates[3:]))

    def _coordinate(self, axis: int, along: float, across: float) -> float:
        first, second, third = (corner.coordinates[axis] for corner in self.corners[:3])
        flat = first + (second - first) * along + (third - first) * across
        if len(self.corners) == 3:
            return flat
        return flat + (self.corners[3].coordinates[axis] - second - third + first) * along * across


def _share(index: int, count: int) -> float:
    return index / (count - 1) if count > 1 else 0.0


class PalletTable:
    """Pallets 0 to 15."""

    def __init__(self) -> None:
        self._pallets: dict[int, Pallet] = {}

    def get(self, number: int) -> Pallet:
        """Return a pallet.

        Raises:
            Refusal: It is not defined.
        """
        if number not in self._pallets:
            raise SpelRefusal(RefusalKind.PALLET_UNDEFINED, f"Pallet {number} is not defined")
        return self._pallets[number]

    def all(self) -> dict[int, Pallet]:
        """Return the pallets by their numbers."""
        return dict(sorted(self._pallets.items()))

    def define(
        self,
        number: int,
        corners: Sequence[Point],
        columns: int,
        rows: int,
        *,
        outside: bool = False,
    ) -> None:
        """Define a pallet.

        Raises:
            Refusal: There is no such number, or no such size.
        """
        if not 0 <= number <= HIGHEST_PALLET:
            raise SpelRefusal(RefusalKind.PALLET_NUMBER, f"There is no pallet {number}")
        if columns < 1 or rows < 1:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"Pallet {number}, {columns}, {rows}")
        if columns * rows > _MOST_PLACES:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"{columns * rows} places")
        self._pallets[number] = Pallet(tuple(corners), columns, rows, outside)

    def clear(self, number: int) -> None:
        """Forget a pallet; one that is not defined may be forgotten."""
        self._pallets.pop(number, None)
