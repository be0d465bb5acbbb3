"""Where a name can stand beside a point without covering anything."""

import math
from collections.abc import Iterator
from itertools import product
from typing import Final

_CELL: Final = 2.0
_TRIES: Final = 2
"""How many distances are tried before a name is given up."""

_DIRECTIONS: Final = ((1, -1), (1, 0), (1, 1), (0, -1), (0, 1), (-1, -1), (-1, 0), (-1, 1))


class Paper:
    """Remembers, in small squares, what is drawn on already.

    Args:
        width, height: Size of the paper; nothing may stand outside.
    """

    def __init__(self, width: float, height: float) -> None:
        self._width = width
        self._height = height
        self._taken: set[tuple[int, int]] = set()

    def take_line(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Remember a line, or with equal ends a dot."""
        pieces = max(1, math.ceil(math.dist(start, end) / _CELL))
        for piece in range(pieces + 1):
            share = piece / pieces
            x, y = (a + share * (b - a) for a, b in zip(start, end, strict=True))
            self._taken.update(_cells(x - 2, y - 2, 4, 4))

    def place(
        self, point: tuple[float, float], width: float, height: float, *, gap: float
    ) -> tuple[float, float] | None:
        """Find and take room for a name at ``point``.

        Returns:
            The upper left corner, ``None`` when there is no room on any side.
        """
        for (across, down), near in product(_DIRECTIONS, range(1, _TRIES + 1)):
            x = point[0] + across * (near * gap + width / 2) - width / 2
            y = point[1] + down * (near * gap + height / 2) - height / 2
            inside = 0 <= x <= self._width - width and 0 <= y <= self._height - height
            cells = set(_cells(x, y, width, height))
            if inside and not cells & self._taken:
                self._taken |= cells
                return x, y
        return None


def _cells(x: float, y: float, width: float, height: float) -> Iterator[tuple[int, int]]:
    for column in range(math.floor(x / _CELL), math.ceil((x + width) / _CELL)):
        for row in range(math.floor(y / _CELL), math.ceil((y + height) / _CELL)):
            yield column, row
