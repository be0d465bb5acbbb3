"""A piece of the base's XY plane on paper: equal axes, and steps that read well."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

WIDTH: Final = 640.0
"""Width of the plane on paper."""

_LOWEST: Final = 230.0
_HIGHEST: Final = 430.0
_MARGIN: Final = 60.0
"""Room around the outermost points, for their arrows and names."""

_NARROWEST_MM: Final = 40.0
_LOWEST_MM: Final = 10.0
_STEPS: Final = (1.0, 2.0, 5.0)
_FINE_STEPS: Final = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)


@dataclass(frozen=True, slots=True)
class Plane:
    """How millimetres become paper. X goes right and Y up: seen from above.

    Attributes:
        left_mm, bottom_mm: What lies at the lower left corner.
        per_mm: Length of a millimetre on paper.
        height: Height on paper; the width is always :data:`WIDTH`.
    """

    left_mm: float
    bottom_mm: float
    per_mm: float
    height: float

    def at(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        """Return where a place is drawn, from the upper left corner."""
        across = (x_mm - self.left_mm) * self.per_mm
        return across, self.height - (y_mm - self.bottom_mm) * self.per_mm

    def step_mm(self) -> float:
        """Return the distance of grid lines."""
        return step_up(58.0 / self.per_mm)

    def grid_x_mm(self) -> Iterator[float]:
        """Yield where the upright grid lines stand."""
        return _multiples(self.left_mm, WIDTH / self.per_mm, self.step_mm())

    def grid_y_mm(self) -> Iterator[float]:
        """Yield where the level grid lines lie."""
        return _multiples(self.bottom_mm, self.height / self.per_mm, self.step_mm())


def plane_around(places: Sequence[tuple[float, float]]) -> Plane:
    """Return the plane that shows all ``places``, mm."""
    xs, ys = [x for x, _ in places], [y for _, y in places]
    span_x = max(max(xs) - min(xs), _NARROWEST_MM)
    span_y = max(max(ys) - min(ys), _LOWEST_MM)
    inner = WIDTH - 2 * _MARGIN
    height = min(max(span_y * inner / span_x + 2 * _MARGIN, _LOWEST), _HIGHEST)
    per_mm = min(inner / span_x, (height - 2 * _MARGIN) / span_y)
    middle_x, middle_y = (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2
    return Plane(middle_x - WIDTH / per_mm / 2, middle_y - height / per_mm / 2, per_mm, height)


def enlargement(plane: Plane, places: Sequence[tuple[float, float]], longest_mm: float) -> float:
    """Return by how much arrows are enlarged, so that the longest can be seen.

    It is about as long as the usual distance between neighbours, and fits into the margin.
    """
    target = min(max(0.9 * _usual_gap_mm(places) * plane.per_mm, 24.0), 0.9 * _MARGIN)
    return step_down(target / (longest_mm * plane.per_mm))


def step_up(value: float) -> float:
    """Return the next of 1, 2, 5, 10 ... that is not below ``value``."""
    power = 10.0 ** math.floor(math.log10(value))
    return next((s * power for s in _STEPS if s * power >= value), 10.0 * power)


def step_down(value: float) -> float:
    """Return a round number that is not above ``value``."""
    power = 10.0 ** math.floor(math.log10(value))
    return max((s * power for s in _FINE_STEPS if s * power <= value), default=power)


def _usual_gap_mm(places: Sequence[tuple[float, float]]) -> float:
    """Return the median distance from a place to its nearest neighbour."""
    distinct = sorted(set(places))
    if len(distinct) < 2:
        return math.inf
    gaps = sorted(min(math.dist(a, b) for b in distinct if b != a) for a in distinct)
    return gaps[len(gaps) // 2]


def _multiples(start_mm: float, length_mm: float, step_mm: float) -> Iterator[float]:
    first, last = math.ceil(start_mm / step_mm), math.floor((start_mm + length_mm) / step_mm)
    return (number * step_mm for number in range(first, last + 1))
