"""Pictures of a camera, with what was found in them."""

from base64 import b64encode
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final
from xml.etree.ElementTree import Element

from markupsafe import Markup

from robolink.report._markup import drawing, element

_WIDEST: Final = 100.0
"""Pictures share one height of letters and lines: a hundredth of their width is the unit."""


@dataclass(frozen=True, slots=True)
class LookCircle:
    """Something that was found in a picture.

    Attributes:
        x_px, y_px: Its middle: X to the right and Y down, (0, 0) the middle of the first pixel.
        radius_px: Half its width.
        accepted: Whether it was taken for what was looked for.
        name: What stands beside it: its number in a list.
    """

    x_px: float
    y_px: float
    radius_px: float
    accepted: bool
    name: str = ""


@dataclass(frozen=True, slots=True)
class LookPicture:
    """A picture of a camera for a page.

    Attributes:
        png: The picture, a PNG file.
        width_px, height_px: Its size when it was taken; circles count in these pixels.
        circles: What was found in it.
        caption: When it was taken, and what for.
        told: What was found and why something was refused, a sentence each.
    """

    png: bytes
    width_px: int
    height_px: int
    circles: tuple[LookCircle, ...] = ()
    caption: str = ""
    told: tuple[str, ...] = ()


def look_markup(one: LookPicture, source: str = "") -> Markup:
    """Return the picture with a circle around everything that was found.

    A circle that was accepted is whole, one that was refused is dashed: no colour is needed to
    tell them apart.

    Args:
        one: The picture.
        source: Address of the PNG file; empty to put the file itself into the page.
    """
    return Markup(drawing(_drawn(one, source)))


def _drawn(one: LookPicture, source: str) -> Element:
    href = source or f"data:image/png;base64,{b64encode(one.png).decode('ascii')}"
    width, height = one.width_px, one.height_px
    return element(
        "svg",
        # Coordinates count from the middle of the first pixel, not from its corner.
        element("image", href=href, x=-0.5, y=-0.5, width=width, height=height),
        *_circles(one),
        viewBox=f"-0.5 -0.5 {width} {height}",
        role="img",
        aria_label=one.caption or None,
        class_="look",
    )


def _circles(one: LookPicture) -> Iterator[Element]:
    unit = one.width_px / _WIDEST
    for circle in one.circles:
        kind = "accepted" if circle.accepted else "refused"
        x, y, radius = (round(v, 2) for v in (circle.x_px, circle.y_px, circle.radius_px))
        dashes = None if circle.accepted else f"{1.5 * unit:.2f} {unit:.2f}"
        yield element(
            "circle",
            cx=x,
            cy=y,
            r=radius,
            class_=kind,
            stroke_width=round(0.5 * unit, 2),
            stroke_dasharray=dashes,
        )
        if circle.accepted:
            arm = round(min(radius / 2, 2 * unit), 2)
            way = f"M{x - arm} {y}H{x + arm}M{x} {y - arm}V{y + arm}"
            yield element("path", d=way, class_=kind, stroke_width=round(0.3 * unit, 2))
        if circle.name:
            beside = min(x + radius + unit, one.width_px - 4 * unit)
            yield element(
                "text",
                circle.name,
                x=round(beside, 2),
                y=round(max(y - radius, 4 * unit), 2),
                font_size=round(4 * unit, 2),
                class_=kind,
            )
