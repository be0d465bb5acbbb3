"""Where the flange stood at each pose, from above, and how it was turned."""

import math
from collections.abc import Iterator, Sequence
from typing import Final
from xml.etree.ElementTree import Element

from robolink.messages import tr
from robolink.model import Pose
from robolink.report._markup import element
from robolink.report._values import Report
from robolink.report.pictures.labels import Paper
from robolink.report.pictures.plane import WIDTH, Plane, plane_around
from robolink.report.pictures.point_map import grid
from robolink.report.pictures.shapes import Place, arrow, circle, line, words

_LEFT, _TOP, _BELOW = 46.0, 10.0, 34.0
_TURN: Final = 26.0
"""Length of the arrow that shows U, on paper."""

_CROSS: Final = 6.0


def pose_plan(report: Report) -> Iterator[Element]:
    """Yield the drawing, for a measurement whose poses and reference point are known."""
    if report.fit is None or len(report.fit.inputs) < 2:
        return
    poses, point = report.fit.inputs, report.fit.reference_point_mm[:2]
    places = [(pose.x_mm, pose.y_mm) for pose in poses]
    plane = plane_around([*places, (point[0], point[1])] if point else places)
    height = plane.height + _TOP + _BELOW
    svg = element(
        "svg",
        element("title", tr("The poses of the flange from above")),
        element(
            "g",
            *grid(plane),
            *_reference(plane, point),
            *_stands(plane, poses, report.fit.rejected),
            transform=f"translate({_LEFT:g} {_TOP:g})",
        ),
        viewBox=f"0 0 {WIDTH + _LEFT + 10:g} {height:g}",
        role="img",
    )
    said = tr("The poses of the flange from above; an arrow shows the direction of U.")
    if point:
        said = tr(
            "The poses of the flange from above; an arrow shows the direction of U, the cross the "
            "reference point."
        )
    yield element("figure", svg, element("figcaption", said))


def _stands(plane: Plane, poses: Sequence[Pose], rejected: Sequence[int]) -> Iterator[Element]:
    paper = Paper(WIDTH, plane.height)
    lines = [_turned(plane, pose) for pose in poses]
    for start, end in lines:
        paper.take_line(start, end)
    for number, (start, end) in enumerate(lines):
        kind = "largest" if number in rejected else "point"
        yield element("g", *arrow(start, end), circle(start, 3.0), class_=kind)
        text = str(number + 1)
        corner = paper.place(start, 5.6 * len(text), 9.0, gap=5.0)
        if corner is not None:
            yield words(text, corner[0], corner[1] + 8.0, class_="name")


def _turned(plane: Plane, pose: Pose) -> tuple[Place, Place]:
    x, y = plane.at(pose.x_mm, pose.y_mm)
    angle = math.radians(pose.u_deg)
    # Paper counts downwards, so a positive turn has a negative step.
    return (x, y), (x + _TURN * math.cos(angle), y - _TURN * math.sin(angle))


def _reference(plane: Plane, point: Sequence[float]) -> Iterator[Element]:
    if point:
        x, y = plane.at(point[0], point[1])
        yield line((x - _CROSS, y), (x + _CROSS, y), class_="bar")
        yield line((x, y - _CROSS), (x, y + _CROSS), class_="bar")
