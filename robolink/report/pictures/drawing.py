"""Finds room for a name beside a point without covering anything."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final, TypeAlias
from xml.etree.ElementTree import Element

from robolink.report._markup import element

_CELL: Final = 2.0
_TRIES: Final = 2
"""Number of distances tried before a name is left out."""

_DIRECTIONS: Final = ((1, -1), (1, 0), (1, 1), (0, -1), (0, 1), (-1, -1), (-1, 0), (-1, 1))


class Paper:
    """Remembers, in small squares, what is already drawn on.

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


WIDTH: Final = 640.0
"""Width of the plane on paper."""

_LOWEST: Final = 230.0
_HIGHEST: Final = 430.0
_MARGIN: Final = 60.0
"""Space around the outermost points, for their arrows and names."""

_NARROWEST_MM: Final = 40.0
_LOWEST_MM: Final = 10.0
_STEPS: Final = (1.0, 2.0, 5.0)
_FINE_STEPS: Final = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)


@dataclass(frozen=True, slots=True)
class Plane:
    """Maps millimetres to paper. X goes right and Y up: seen from above.

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
        """Yield the positions of the vertical grid lines."""
        return _multiples(self.left_mm, WIDTH / self.per_mm, self.step_mm())

    def grid_y_mm(self) -> Iterator[float]:
        """Yield the positions of the horizontal grid lines."""
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


Place: TypeAlias = tuple[float, float]
"""A position on paper, from the upper left corner."""

_HEAD: Final = 7.0
"""Length of an arrow's head."""


def arrow(start: Place, end: Place) -> tuple[Element, ...]:
    """Return shaft and head, or nothing if the length is too small to see."""
    length = math.dist(start, end)
    if length < 0.5:
        return ()
    along_x, along_y = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    head = min(_HEAD, 0.6 * length)
    back = end[0] - head * along_x, end[1] - head * along_y
    wing_x, wing_y = -0.4 * head * along_y, 0.4 * head * along_x
    corners = (
        end,
        (back[0] + wing_x, back[1] + wing_y),
        (back[0] - wing_x, back[1] - wing_y),
    )
    points = " ".join(f"{x:.2f},{y:.2f}" for x, y in corners)
    return line(start, back, class_="shaft"), element("polygon", points=points)


def line(start: Place, end: Place, *, class_: str) -> Element:
    """Return a straight line."""
    (x1, y1), (x2, y2) = start, end
    ends = {"x1": x1, "y1": y1, "x2": x2, "y2": y2}
    return element("line", class_=class_, **{k: f"{v:.2f}" for k, v in ends.items()})


def circle(centre: Place, radius: float, class_: str | None = None) -> Element:
    """Return a circle."""
    x, y = centre
    return element("circle", cx=f"{x:.2f}", cy=f"{y:.2f}", r=f"{radius:g}", class_=class_)


def ellipse(centre: Place, long: float, short: float, turn_deg: float, *, class_: str) -> Element:
    """Return an ellipse by its half axes; the long one is turned counter-clockwise from X."""
    x, y = centre
    return element(
        "ellipse",
        rx=f"{long:.2f}",
        ry=f"{short:.2f}",
        transform=f"translate({x:.2f} {y:.2f}) rotate({-turn_deg:.2f})",
        class_=class_,
    )


def words(text: str, x: float, y: float, **attributes: object) -> Element:
    """Return a line of text with its foot at (x, y)."""
    return element("text", text, x=f"{x:.2f}", y=f"{y:.2f}", **attributes)


SIDE: Final = 250.0
"""Width and height of a panel on paper."""

_AROUND: Final = 8.0
_BELOW: Final = 26.0


@dataclass(frozen=True, slots=True)
class Drawing:
    """A drawing and its caption.

    Attributes:
        svg: The drawing.
        caption: What it shows, in sentences.
    """

    svg: Element
    caption: str


class PlotPanel:
    """A square piece of a plane.

    Attributes:
        per_mm: Length of a millimetre on paper.

    Args:
        reach_mm: How far it shows to each side of its middle.
        middle_mm: What lies in its middle.
    """

    def __init__(self, reach_mm: float, middle_mm: tuple[float, float] = (0.0, 0.0)) -> None:
        self._reach_mm = reach_mm
        self._middle_mm = middle_mm
        self.per_mm = SIDE / 2 / reach_mm

    def at(self, x_mm: float, y_mm: float) -> Place:
        """Return where a place is drawn: X to the right, Y up."""
        x0, y0 = self._middle_mm
        return SIDE / 2 + (x_mm - x0) * self.per_mm, SIDE / 2 - (y_mm - y0) * self.per_mm

    def drawn(self, title: str, caption: str, *content: Element) -> Drawing:
        """Return the panel with what is in it."""
        svg = element(
            "svg",
            element("title", title),
            element(
                "g",
                *self._frame(),
                *content,
                transform=f"translate({_AROUND:g} {_AROUND:g})",
            ),
            viewBox=f"0 0 {SIDE + 2 * _AROUND:g} {SIDE + _AROUND + _BELOW:g}",
            role="img",
        )
        return Drawing(svg, caption)

    def _frame(self) -> Iterator[Element]:
        """Yield paper, the lines through the middle, and a ruler."""
        bar_mm = step_down(self._reach_mm * 0.8)
        bar, foot = bar_mm * self.per_mm, SIDE + 14
        yield element("rect", width=f"{SIDE:g}", height=f"{SIDE:g}", class_="paper")
        yield line((0, SIDE / 2), (SIDE, SIDE / 2), class_="grid")
        yield line((SIDE / 2, 0), (SIDE / 2, SIDE), class_="grid")
        yield words("X", SIDE - 4, SIDE / 2 - 4, class_="tick", text_anchor="end")
        yield words("Y", SIDE / 2 + 4, 11, class_="tick")
        yield line((0, foot), (bar, foot), class_="bar")
        yield words(f"{bar_mm:g} mm", bar + 8, foot + 4, class_="scale")
        if self._middle_mm != (0.0, 0.0):
            place = "X {:.1f}  Y {:.1f}".format(*self._middle_mm)
            yield words(place, SIDE / 2 + 4, SIDE / 2 + 12, class_="tick")


def dot_names(places: Sequence[Place], texts: Sequence[str]) -> Iterator[Element]:
    """Yield the names of dots in a panel, where there is room for them."""
    paper = Paper(SIDE, SIDE)
    for place in places:
        paper.take_line(place, place)
    for place, text in zip(places, texts, strict=True):
        corner = paper.place(place, 6.4 * len(text), 10.5, gap=5.0)
        if corner is not None:
            yield words(text, corner[0], corner[1] + 9.0, class_="name")
