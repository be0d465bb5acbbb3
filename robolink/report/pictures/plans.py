"""Where the flange was at each pose, from above, and how it was turned."""

import math
from collections.abc import Iterator, Sequence
from typing import Final
from xml.etree.ElementTree import Element

from robolink.calibration import CalibrationResult, Impact, PointImpact, VerifyResult
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.report._markup import element
from robolink.report._values import Report
from robolink.report.pictures.drawing import (
    SIDE,
    WIDTH,
    Drawing,
    Paper,
    Place,
    Plane,
    PlotPanel,
    arrow,
    circle,
    dot_names,
    enlargement,
    line,
    plane_around,
    step_down,
    words,
)

_TURN: Final = 26.0
"""Length on paper of the arrow that shows U."""

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
    # On paper Y points down, so a positive turn has a negative step.
    return (x, y), (x + _TURN * math.cos(angle), y - _TURN * math.sin(angle))


def _reference(panel: PlotPanel, point: Sequence[float]) -> Iterator[Element]:
    if len(point) == 2:
        x, y = panel.at(point[0], point[1])
        yield line((x - _CROSS, y), (x + _CROSS, y), class_="bar")
        yield line((x, y - _CROSS), (x, y + _CROSS), class_="bar")


_LEFT, _TOP, _BELOW = 46.0, 10.0, 66.0
_STILL_MM: Final = 5e-7
"""Largest displacement that is only rounding and has no direction, in mm."""


def draw(impact: Impact) -> Drawing:
    """Draw the points of ``impact``, of which there is at least one."""
    places = [(entry.pose.x_mm, entry.pose.y_mm) for entry in impact.entries]
    plane = plane_around(places)
    longest_mm = max(math.hypot(entry.dx_mm, entry.dy_mm) for entry in impact.entries)
    factor = enlargement(plane, places, longest_mm) if longest_mm > _STILL_MM else None
    marks = _Marks(plane, factor, impact.farthest)
    drawn = [marks.draw(entry) for entry in _largest_last(impact)]
    names, unnamed = marks.names(impact)
    content = [*_grid(plane), *drawn, *names]
    height = plane.height + _TOP + _BELOW
    svg = element(
        "svg",
        element("title", tr("Taught points from above, with the displacement of the tip")),
        element("g", *content, transform=f"translate({_LEFT:g} {_TOP:g})"),
        _scales(plane, factor, longest_mm),
        viewBox=f"0 0 {WIDTH + _LEFT + 10:g} {height:g}",
        role="img",
    )
    return Drawing(svg, _caption(factor, unnamed, ringed=impact.farthest is not None))


def _caption(factor: float | None, unnamed: int, *, ringed: bool) -> str:
    """Return the text that belongs beside it.

    Args:
        factor: How many times longer than true the arrows are, ``None`` without arrows.
        unnamed: How many points have no room for their number.
        ringed: Whether one of them is the largest.
    """
    said = [tr("Taught points in base coordinates, seen from above, with equal axes.")]
    if factor is None:
        said.append(tr("Nothing moves sideways."))
    else:
        said.append(
            tr(
                "Each arrow is the sideways movement of the tip, drawn {factor:g} times as long "
                "as it is.",
                factor=factor,
            )
        )
        if ringed:
            said.append(tr("The ring marks the largest."))
    if unnamed:
        said.append(tr("{count} numbers have no room; the table has them.", count=unnamed))
    return " ".join(said)


class _Marks:
    """Draws points, arrows and names, and keeps them off each other."""

    def __init__(self, plane: Plane, factor: float | None, largest: PointImpact | None) -> None:
        self._plane = plane
        self._factor = factor or 0.0
        self._largest = largest
        self._paper = Paper(WIDTH, plane.height)

    def draw(self, entry: PointImpact) -> Element:
        """Return one point with its arrow."""
        start, end = self._line(entry)
        self._paper.take_line(start, end)
        chosen = entry is self._largest
        return element(
            "g",
            element("title", f"P{entry.number}: {entry.distance_mm:.3f} mm"),
            circle(start, 7.5, class_="ring") if chosen else None,
            *arrow(start, end),
            circle(start, 2.6),
            class_="largest" if chosen else "point",
        )

    def names(self, impact: Impact) -> tuple[list[Element], int]:
        """Return the names that have room, and how many have none; the largest always has."""
        drawn: list[Element] = []
        unnamed = 0
        for entry in reversed(_largest_last(impact)):
            chosen = entry is self._largest
            text = f"P{entry.number}: {entry.distance_mm:.3f} mm" if chosen else str(entry.number)
            size = (6.9 * len(text), 13.0) if chosen else (5.3 * len(text), 9.0)
            start, _ = self._line(entry)
            corner = self._paper.place(start, *size, gap=9.0 if chosen else 4.0)
            if corner is None and chosen:
                corner = start[0] - size[0] / 2, start[1] - size[1] - 9.0
            if corner is None:
                unnamed += 1
                continue
            middle, foot = corner[0] + size[0] / 2, corner[1] + 0.82 * size[1]
            kind = "name largest" if chosen else "name"
            drawn.append(words(text, middle, foot, class_=kind, text_anchor="middle"))
        return drawn[::-1], unnamed

    def _line(self, entry: PointImpact) -> tuple[Place, Place]:
        x_mm, y_mm = entry.pose.x_mm, entry.pose.y_mm
        along = (x_mm + self._factor * entry.dx_mm, y_mm + self._factor * entry.dy_mm)
        return self._plane.at(x_mm, y_mm), self._plane.at(*along)


def _largest_last(impact: Impact) -> list[PointImpact]:
    """Return the points so that the largest is drawn over the others."""
    return sorted(impact.entries, key=lambda entry: entry is impact.farthest)


def _grid(plane: Plane) -> list[Element]:
    """Return paper, grid lines and axes of a plane."""
    width, height = WIDTH, plane.height
    parts = [element("rect", width=f"{width:g}", height=f"{height:.1f}", class_="paper")]
    for x_mm in plane.grid_x_mm():
        x, _ = plane.at(x_mm, 0)
        parts.append(line((x, 0), (x, height), class_="grid"))
        parts.append(words(f"{x_mm:g}", x, height + 13, class_="tick", text_anchor="middle"))
    for y_mm in plane.grid_y_mm():
        _, y = plane.at(0, y_mm)
        parts.append(line((0, y), (width, y), class_="grid"))
        parts.append(words(f"{y_mm:g}", -5, y + 3, class_="tick", text_anchor="end"))
    parts.append(words("X mm", width, height + 25, class_="axis", text_anchor="end"))
    parts.append(words("Y mm", 6, 13, class_="axis"))
    return parts


def _scales(plane: Plane, factor: float | None, longest_mm: float) -> Element:
    """Return the two rulers below: one for the points, one for the arrows."""
    y = plane.height + 48
    bar_mm = plane.step_mm()
    bar = bar_mm * plane.per_mm
    ends = [line((x, y - 4), (x, y + 4), class_="bar") for x in (0.0, bar)]
    parts = [line((0, y), (bar, y), class_="bar"), *ends]
    parts.append(words(tr("points: {length:g} mm", length=bar_mm), bar + 8, y + 4, class_="scale"))
    if factor is not None:
        shown_mm = step_down(longest_mm)
        start, length = WIDTH / 2, shown_mm * factor * plane.per_mm
        said = tr(
            "arrows: {length:g} mm, drawn {factor:g} times as long", length=shown_mm, factor=factor
        )
        shaft = arrow((start, y), (start + length, y))
        parts.append(element("g", *shaft, class_="point"))
        parts.append(words(said, start + length + 8, y + 4, class_="scale"))
    return element("g", *parts, transform=f"translate({_LEFT:g} {_TOP:g})")


_LOWEST_SCALE_MM: Final = 0.05
"""Smallest range of a panel to each side, in mm: less is noise."""


def tip_drawings(report: Report) -> Iterator[Drawing]:
    """Yield the drawings of a recorded change that measured or turned something."""
    if report.record is None or not report.compared:
        return
    if report.before is not None and report.after is not None:
        yield _change(report.before, report.after)
    if report.verification is not None and report.verification.drifts:
        yield _drift(report.verification)


def _change(before: ToolOffset, after: ToolOffset) -> Drawing:
    """Draw the movement of the tip in the flange's XY plane, from above, both axes to one scale."""
    dx_mm, dy_mm = after.x_mm - before.x_mm, after.y_mm - before.y_mm
    panel = PlotPanel(max(math.hypot(dx_mm, dy_mm), _LOWEST_SCALE_MM) * 1.35)
    start, end = panel.at(0, 0), panel.at(dx_mm, dy_mm)
    said = tr(
        "Tip on the flange, from before (grey) to after: X {dx:+.3f} mm, Y {dy:+.3f} mm.",
        dx=dx_mm + 0.0,
        dy=dy_mm + 0.0,
    )
    return panel.drawn(
        tr("The tip before and after"),
        said,
        element("g", circle(start, 4.0), class_="old"),
        element("g", *arrow(start, end), class_="point"),
    )


def _drift(result: VerifyResult) -> Drawing:
    """Draw where the tip was at each angle, and the circle of its limit."""
    largest_mm = max(result.max_drift_mm, result.tolerance_mm, _LOWEST_SCALE_MM)
    panel = PlotPanel(largest_mm * 1.2)
    middle = panel.at(0, 0)
    places = [panel.at(drift.dx_mm, drift.dy_mm) for drift in result.drifts]
    dots = [circle(place, 3.2) for place in places]
    names = dot_names(places, [f"U {drift.u_deg:g}" for drift in result.drifts])
    allowed = circle(middle, round(result.tolerance_mm * panel.per_mm, 2), class_="allowed")
    return panel.drawn(
        tr("Drift of the turned tip"),
        tr("Drift of the tip when the tool turned; the dashed circle is allowed."),
        allowed,
        element("g", *dots, *names, class_="point" if result.passed else "largest"),
    )
