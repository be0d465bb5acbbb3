"""Draws how a figure grows: one line of points, both axes by powers of ten."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final
from xml.etree.ElementTree import Element

from robolink.report._markup import drawing, element

WIDTH: Final = 460
HEIGHT: Final = 300
_LEFT, _RIGHT, _TOP, _BOTTOM = 74, 20, 34, 52
_ROOM = 24
"""Half the width of a value's label: at an edge, the label must not cover the scale."""
_INK, _FAINT, _LINE = "#333333", "#dddddd", "#2b6cb0"
_FONT: Final = "font-family:sans-serif;font-size:12px"


@dataclass(frozen=True, slots=True)
class Growth:
    """What was measured of something that grows.

    Attributes:
        name: Of its file.
        title: What it is.
        across: What grows, with its unit.
        up: What was measured, with its unit.
        points: Pairs of both, each above 0.
    """

    name: str
    title: str
    across: str
    up: str
    points: tuple[tuple[float, float], ...]


def picture(growth: Growth) -> str:
    """Return a drawing as SVG."""
    across = _Scale([x for x, _ in growth.points], _LEFT, WIDTH - _RIGHT)
    up = _Scale([y for _, y in growth.points], HEIGHT - _BOTTOM, _TOP)
    places = [(across.at(x), up.at(y)) for x, y in growth.points]
    dots = [element("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=3, fill=_LINE) for x, y in places]
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
    values = [
        _text(
            _short(y), min(max(x, _LEFT + _ROOM), WIDTH - _RIGHT - _ROOM), at - 8, anchor="middle"
        )
        for (_, y), (x, at) in zip(growth.points, places, strict=True)
    ]
    drawn = element(
        "svg",
        element("rect", width=WIDTH, height=HEIGHT, fill="white"),
        *_grid(across, up),
        element("polyline", points=line, fill="none", stroke=_LINE, stroke_width=2),
        *dots,
        *values,
        _text(growth.title, WIDTH / 2, 16, anchor="middle"),
        _text(growth.across, (_LEFT + WIDTH - _RIGHT) / 2, HEIGHT - 10, anchor="middle"),
        _text(growth.up, 14, (HEIGHT - _BOTTOM + _TOP) / 2, anchor="middle", upright=True),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {WIDTH} {HEIGHT}",
        role="img",
    )
    return drawing(drawn) + "\n"


class _Scale:
    """Powers of ten on a stretch of the drawing."""

    def __init__(self, values: Sequence[float], start: float, end: float) -> None:
        self.low = math.floor(math.log10(min(values)))
        self.high = max(self.low + 1, math.ceil(math.log10(max(values))))
        self._start, self._end = start, end

    def at(self, value: float) -> float:
        """Return where a value stands."""
        share = (math.log10(value) - self.low) / (self.high - self.low)
        return self._start + share * (self._end - self._start)

    def powers(self) -> list[float]:
        """Return the values that get a line."""
        return [10.0**power for power in range(self.low, self.high + 1)]


def _grid(across: _Scale, up: _Scale) -> list[Element]:
    bottom, right = HEIGHT - _BOTTOM, WIDTH - _RIGHT
    made = []
    for value in across.powers():
        x = across.at(value)
        made.append(element("line", x1=x, y1=_TOP, x2=x, y2=bottom, stroke=_FAINT))
        made.append(_text(_short(value), x, bottom + 16, anchor="middle"))
    for value in up.powers():
        y = up.at(value)
        made.append(element("line", x1=_LEFT, y1=y, x2=right, y2=y, stroke=_FAINT))
        made.append(_text(_short(value), _LEFT - 6, y + 4, anchor="end"))
    return made


def _text(words: str, x: float, y: float, *, anchor: str, upright: bool = False) -> Element:
    turn = f"rotate(-90 {x:.0f} {y:.0f})" if upright else None
    place = {"x": f"{x:.1f}", "y": f"{y:.1f}", "transform": turn}
    return element("text", words, **place, text_anchor=anchor, fill=_INK, style=_FONT)


def _short(value: float) -> str:
    for size, sign in ((1e6, "M"), (1e3, "k")):
        if value >= size:
            return f"{value / size:.3g}{sign}"
    return f"{value:.3g}"
