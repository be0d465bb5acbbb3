"""Drawings of the screens: the arm on its way, how touches agree, the turn test.

Shape first, then colour: circle, square and triangle stand for X, Y and Z. Lengths are in mm.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final
from xml.etree.ElementTree import Element

from markupsafe import Markup

from robolink.report._markup import drawing, element
from robolink.report.pictures.drawing import circle, line, step_up, words
from robolink_cli.wizard.views.records import ArmPicture, EndView, FitMark, FitView, Point

Tr = Callable[..., str]

_WIDE: Final = 600.0
_HIGH: Final = 360.0
_EDGE: Final = 60.0
_LEAST_MM: Final = 20.0
"""Narrowest part of the plane that is drawn."""


def arm_drawing(picture: ArmPicture, tr: Tr) -> Markup:
    """Return the arm from above, X to the right and Y up, and where it goes."""
    shown = [picture.flange, picture.target]
    if picture.elbow is not None:
        shown += [(0.0, 0.0), picture.elbow]
    at = _plane(shown)
    flange, target = at(picture.flange), at(picture.target)
    parts: list[Element] = []
    if picture.elbow is not None:
        base, elbow = at((0.0, 0.0)), at(picture.elbow)
        parts += [line(base, elbow, class_="link"), line(elbow, flange, class_="link")]
        parts += [circle(base, 13, "base"), circle(elbow, 10, "elbow")]
    parts.append(line(flange, target, class_="way"))
    u = math.radians(picture.u_deg)
    nose = flange[0] + 30 * math.cos(u), flange[1] - 30 * math.sin(u)
    parts += [line(flange, nose, class_="nose"), circle(flange, 12, "flange")]
    (x, y), arm = target, 12
    parts += [
        line((x - arm, y - arm), (x + arm, y + arm), class_="target"),
        line((x - arm, y + arm), (x + arm, y - arm), class_="target"),
    ]
    return _svg(tr("The arm from above"), _WIDE, _HIGH, [*_axes(), *parts])


def _plane(points: Sequence[Point]) -> Callable[[Point], Point]:
    """Return what maps base X and Y to the drawing, all points well inside."""
    xs, ys = [x for x, _ in points], [y for _, y in points]
    wide, high = max(max(xs) - min(xs), _LEAST_MM), max(max(ys) - min(ys), _LEAST_MM)
    per_mm = min((_WIDE - 2 * _EDGE) / wide, (_HIGH - 2 * _EDGE) / high)
    middle = (max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2

    def at(point: Point) -> Point:
        x, y = point[0] - middle[0], point[1] - middle[1]
        return _WIDE / 2 + x * per_mm, _HIGH / 2 - y * per_mm

    return at


def _axes() -> Iterator[Element]:
    """Yield the directions of the base, in the corner."""
    x, y = 24.0, _HIGH - 24.0
    yield line((x, y), (x + 56, y), class_="axis")
    yield line((x, y), (x, y - 56), class_="axis")
    yield words("X", x + 62, y + 6, class_="tick")
    yield words("Y", x - 5, y - 64, class_="tick")


_MOST_MARKS: Final = 12
"""Largest number of touches drawn: more cannot be told apart."""


def fit_drawing(fit: FitView, tr: Tr) -> Markup:
    """Return how far each touch is off, along each axis, with the limit as a band."""
    marks = fit.marks[-_MOST_MARKS:]
    left, right, top, low = 64.0, 12.0, 16.0, 300.0
    farthest = max((abs(off) for mark in marks for off in mark.off_mm), default=0.0)
    reach = 1.25 * max(fit.limit_mm, farthest, 0.001)
    middle = (top + low) / 2
    per_mm = (low - top) / 2 / reach
    wide = _WIDE - left - right
    band = fit.limit_mm * per_mm
    parts: list[Element] = [
        element(
            "rect",
            x=f"{left:g}",
            y=f"{middle - band:.2f}",
            width=f"{wide:g}",
            height=f"{2 * band:.2f}",
            class_="band",
        )
    ]
    for value in (fit.limit_mm, 0.0, -fit.limit_mm):
        y = middle - value * per_mm
        parts.append(line((left, y), (_WIDE - right, y), class_="limit" if value else "zero"))
        text = f"{value:+.3g}" if value else "0"
        parts.append(words(text, left - 8, y + 6, class_="tick", text_anchor="end"))
    gap = wide / max(1, len(marks))
    for index, mark in enumerate(marks):
        x = left + gap * (index + 0.5)
        if mark.worst:
            parts.append(_frame(x, top, gap, low - top))
        parts += _of_touch(mark, x, min(26.0, gap / 4), lambda off: middle - off * per_mm)
        parts.append(words(str(mark.number), x, low + 26, class_="tick", text_anchor="middle"))
    title = tr("How far each touch is off the fit, in mm; band: limit {mm} mm", mm=fit.limit_mm)
    return _svg(title, _WIDE, low + 36, parts)


def _frame(x: float, top: float, gap: float, high: float) -> Element:
    half = min(gap * 0.46, 60.0)
    return element(
        "rect",
        x=f"{x - half:.2f}",
        y=f"{top:g}",
        width=f"{2 * half:.2f}",
        height=f"{high:g}",
        rx="8",
        class_="worst",
    )


def _of_touch(
    mark: FitMark, x: float, apart: float, height: Callable[[float], float]
) -> Iterator[Element]:
    """Yield the signs of one touch: its axes side by side."""
    axes = "z" if len(mark.off_mm) == 1 else "xyz"
    for place, (axis, off) in enumerate(zip(axes, mark.off_mm, strict=False)):
        at = x + (place - (len(mark.off_mm) - 1) / 2) * apart, height(off)
        yield _sign(axis, at)


def _sign(axis: str, at: Point, size: float = 9.0) -> Element:
    x, y = at
    if axis == "x":
        return circle(at, size, "axis-x")
    if axis == "y":
        return element(
            "rect",
            x=f"{x - size:.2f}",
            y=f"{y - size:.2f}",
            width=f"{2 * size:g}",
            height=f"{2 * size:g}",
            class_="axis-y",
        )
    corners = ((x, y - 1.2 * size), (x - 1.1 * size, y + size), (x + 1.1 * size, y + size))
    return element(
        "polygon", points=" ".join(f"{a:.2f},{b:.2f}" for a, b in corners), class_="axis-z"
    )


def turn_drawing(end: EndView, tr: Tr) -> Markup:
    """Return how far the tip was off at each angle of the turn test, with the limit."""
    high, left, foot = 150.0, 64.0, 26.0
    limit = end.limit_mm
    largest = max([limit or 0.0, *(one.off_mm for one in end.angles), 0.001])
    reach = step_up(1.05 * largest)
    wide = _WIDE - left - 12
    gap = wide / max(1, len(end.angles))
    parts: list[Element] = [line((left, high), (_WIDE - 12, high), class_="zero")]
    for index, one in enumerate(end.angles):
        x = left + gap * (index + 0.5)
        tall = one.off_mm / reach * (high - 12)
        kind = "over" if one.within is False else "in"
        parts.append(
            element(
                "rect",
                x=f"{x - 22:.2f}",
                y=f"{high - tall:.2f}",
                width="44",
                height=f"{tall:.2f}",
                class_=f"bar {kind}",
            )
        )
        name = f"U {one.u_deg:.0f}"
        parts.append(words(name, x, high + 22, class_="tick", text_anchor="middle"))
    if limit is not None:
        y = high - limit / reach * (high - 12)
        parts.append(line((left, y), (_WIDE - 12, y), class_="limit"))
        parts.append(words(f"{limit:g}", left - 8, y + 6, class_="tick", text_anchor="end"))
    return _svg(
        tr("Turn test: how far the tip was off at each angle, in mm"), _WIDE, high + foot, parts
    )


def before_after_drawing(end: EndView, tr: Tr) -> Markup:
    """Return how far the tip was off before the change and after it, as two bars."""
    before, after = end.before_mm or 0.0, end.after_mm or 0.0
    reach = max(before, after, end.limit_mm or 0.0, 0.001)
    left, wide = 110.0, _WIDE - 110.0 - 120.0
    parts: list[Element] = []
    rows = ((tr("before"), before, "was"), (tr("after"), after, "in"))
    for row, (name, off, kind) in enumerate(rows):
        y = 8.0 + row * 52
        long = max(2.0, off / reach * wide)
        parts.append(words(name, 0, y + 28, class_="name"))
        parts.append(
            element(
                "rect",
                x=f"{left:g}",
                y=f"{y:g}",
                width=f"{long:.2f}",
                height="40",
                class_=f"bar {kind}",
            )
        )
        parts.append(words(f"{off:.3f} mm", left + long + 10, y + 28, class_="name"))
    if end.limit_mm is not None:
        x = left + end.limit_mm / reach * wide
        parts.append(line((x, 0), (x, 108), class_="limit"))
    return _svg(tr("Before and after"), _WIDE, 112.0, parts)


def _svg(title: str, wide: float, high: float, parts: Sequence[Element]) -> Markup:
    svg = element(
        "svg", element("title", title), *parts, viewBox=f"0 0 {wide:g} {high:g}", role="img"
    )
    return Markup(drawing(svg))
