"""Lines, arrows, circles and words of a drawing."""

import math
from typing import Final, TypeAlias
from xml.etree.ElementTree import Element

from robolink.report._markup import element

Place: TypeAlias = tuple[float, float]
"""A place on paper, from the upper left corner."""

_HEAD: Final = 7.0
"""Length of an arrow's head."""


def arrow(start: Place, end: Place) -> tuple[Element, ...]:
    """Return shaft and head, or nothing where there is no length to see."""
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
