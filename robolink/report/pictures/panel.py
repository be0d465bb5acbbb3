"""A square piece of a plane on paper, with equal axes, and the figure that it stands in."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final
from xml.etree.ElementTree import Element

from robolink.report._markup import element
from robolink.report.pictures.labels import Paper
from robolink.report.pictures.plane import step_down
from robolink.report.pictures.shapes import Place, line, words

SIDE: Final = 250.0
"""Width and height of a panel on paper."""

_AROUND: Final = 8.0
_BELOW: Final = 26.0


@dataclass(frozen=True, slots=True)
class Drawing:
    """A drawing with what stands below it.

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
