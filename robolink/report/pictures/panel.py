"""A square piece of a plane with its middle at (0, 0), and two of them in a row."""

from collections.abc import Iterator, Sequence
from typing import Final
from xml.etree.ElementTree import Element

from robolink.report._markup import element
from robolink.report.pictures.labels import Paper
from robolink.report.pictures.plane import step_down
from robolink.report.pictures.shapes import Place, line, words

SIDE: Final = 230.0
"""Width and height of a panel on paper."""

_GAP: Final = 60.0


class PlotPanel:
    """A square piece of a plane with its middle at (0, 0).

    Attributes:
        per_mm: Length of a millimetre on paper.

    Args:
        reach_mm: How far it shows to each side.
    """

    def __init__(self, reach_mm: float) -> None:
        self._reach_mm = reach_mm
        self.per_mm = SIDE / 2 / reach_mm

    def at(self, x_mm: float, y_mm: float) -> Place:
        """Return where a place is drawn: X to the right, Y up."""
        return SIDE / 2 + x_mm * self.per_mm, SIDE / 2 - y_mm * self.per_mm

    def frame(self, title: str) -> Iterator[Element]:
        """Yield paper, axes, title and a ruler."""
        bar_mm = step_down(self._reach_mm * 0.8)
        bar, foot = bar_mm * self.per_mm, SIDE + 14
        yield element("rect", width=f"{SIDE:g}", height=f"{SIDE:g}", class_="paper")
        yield line((0, SIDE / 2), (SIDE, SIDE / 2), class_="grid")
        yield line((SIDE / 2, 0), (SIDE / 2, SIDE), class_="grid")
        yield words(title, 0, -6, class_="axis")
        yield words("X", SIDE - 4, SIDE / 2 - 4, class_="tick", text_anchor="end")
        yield words("Y", SIDE / 2 + 4, 10, class_="tick")
        yield line((0, foot), (bar, foot), class_="bar")
        yield words(f"{bar_mm:g} mm", bar + 8, foot + 4, class_="scale")


def dot_names(places: Sequence[Place], texts: Sequence[str]) -> Iterator[Element]:
    """Yield the names of dots in a panel, where there is room for them."""
    paper = Paper(SIDE, SIDE)
    for place in places:
        paper.take_line(place, place)
    for place, text in zip(places, texts, strict=True):
        corner = paper.place(place, 5.6 * len(text), 9.0, gap=5.0)
        if corner is not None:
            yield words(text, corner[0], corner[1] + 8.0, class_="name")


def side_by_side(title: str, panels: Sequence[Element]) -> Element:
    """Return a figure of one or two panels."""
    moved = (
        element("g", panel, transform=f"translate({10 + number * (SIDE + _GAP):g} 18)")
        for number, panel in enumerate(panels)
    )
    svg = element(
        "svg",
        element("title", title),
        *moved,
        viewBox=f"0 0 {2 * SIDE + _GAP + 20:g} {SIDE + 48:g}",
        role="img",
    )
    return element("figure", svg)
