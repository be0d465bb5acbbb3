"""Where the flange stood at each pose, from above, and how it was turned."""

import math
from collections.abc import Iterator, Sequence
from typing import Final
from xml.etree.ElementTree import Element

from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.model import Pose
from robolink.report._markup import element
from robolink.report.pictures.labels import Paper
from robolink.report.pictures.panel import SIDE, Drawing, PlotPanel
from robolink.report.pictures.shapes import Place, arrow, circle, line, words

_TURN: Final = 26.0
"""Length of the arrow that shows U, on paper."""

_CROSS: Final = 6.0
_LOWEST_MM: Final = 2.0


def pose_drawings(result: CalibrationResult | None) -> Iterator[Drawing]:
    """Yield the drawing of a measurement whose poses are known."""
    if result is None or len(result.inputs) < 2:
        return
    poses, point = result.inputs, result.reference_point_mm[:2]
    places = [(pose.x_mm, pose.y_mm) for pose in poses]
    if len(point) == 2:
        places.append((point[0], point[1]))
    lowest, highest = (tuple(map(chosen, zip(*places, strict=True))) for chosen in (min, max))
    middle = ((lowest[0] + highest[0]) / 2, (lowest[1] + highest[1]) / 2)
    reach_mm = max(highest[0] - lowest[0], highest[1] - lowest[1], _LOWEST_MM) / 2
    panel = PlotPanel(reach_mm * 1.4, middle)
    said = tr("Poses of the flange from above; an arrow shows the direction of U.")
    if len(point) == 2:
        said = tr(
            "Poses of the flange from above; an arrow shows the direction of U, the cross the "
            "reference point."
        )
    yield panel.drawn(
        tr("The poses of the flange from above"),
        said,
        *_reference(panel, point),
        *_stands(panel, poses, result.rejected),
    )


def _stands(panel: PlotPanel, poses: Sequence[Pose], rejected: Sequence[int]) -> Iterator[Element]:
    paper = Paper(SIDE, SIDE)
    lines = [_turned(panel, pose) for pose in poses]
    for start, end in lines:
        paper.take_line(start, end)
    for number, (start, end) in enumerate(lines):
        kind = "largest" if number in rejected else "point"
        yield element("g", *arrow(start, end), circle(start, 3.0), class_=kind)
        text = str(number + 1)
        corner = paper.place(start, 6.4 * len(text), 10.5, gap=5.0)
        if corner is not None:
            yield words(text, corner[0], corner[1] + 9.0, class_="name")


def _turned(panel: PlotPanel, pose: Pose) -> tuple[Place, Place]:
    x, y = panel.at(pose.x_mm, pose.y_mm)
    angle = math.radians(pose.u_deg)
    # Paper counts downwards, so a positive turn has a negative step.
    return (x, y), (x + _TURN * math.cos(angle), y - _TURN * math.sin(angle))


def _reference(panel: PlotPanel, point: Sequence[float]) -> Iterator[Element]:
    if len(point) == 2:
        x, y = panel.at(point[0], point[1])
        yield line((x - _CROSS, y), (x + _CROSS, y), class_="bar")
        yield line((x, y - _CROSS), (x, y + _CROSS), class_="bar")
