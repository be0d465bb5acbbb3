"""The residuals in the order in which the poses were taken: what moved meanwhile shows here."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final
from xml.etree.ElementTree import Element

from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.report._markup import element
from robolink.report.pictures.panel import Drawing
from robolink.report.pictures.plane import WIDTH, step_up
from robolink.report.pictures.shapes import Place, circle, line, words

_LEFT, _RIGHT, _TOP, _HEIGHT, _BELOW = 46.0, 96.0, 10.0, 130.0, 30.0
_LEAST: Final = 3
"""Fewer residuals have no order to look at."""

_LOWEST_MM: Final = 0.005
_KINDS: Final = ("x", "y", "z")


def order_drawings(
    result: CalibrationResult | None, evidence: Mapping[str, Any]
) -> Iterator[Drawing]:
    """Yield the plot of a measurement of several poses that leave residuals.

    Args:
        result: The measurement.
        evidence: Figures of its checks, those of the order among them where it could be tested.
    """
    if result is None or len(result.residuals_mm) < _LEAST:
        return
    if not any(any(residual) for residual in result.residuals_mm):
        return
    count, axes = len(result.residuals_mm), _axes(result.residuals_mm)
    largest_mm = max(abs(value) for residual in result.residuals_mm for value in residual)
    plot = _Plot(count, max(largest_mm, _LOWEST_MM))
    series = [
        plot.series(name, kind, [residual[axis] for residual in result.residuals_mm])
        for axis, name, kind in axes
    ]
    svg = element(
        "svg",
        element("title", tr("Residuals in run order")),
        element(
            "g",
            *plot.frame(),
            *(part for one in series for part in one),
            transform=f"translate({_LEFT:g} {_TOP:g})",
        ),
        viewBox=f"0 0 {WIDTH:g} {_HEIGHT + _TOP + _BELOW:g}",
        role="img",
    )
    yield Drawing(svg, _said(result, evidence))


def _axes(residuals: Sequence[Sequence[float]]) -> list[tuple[int, str, str]]:
    """Return index, name and kind of the axes that were measured; (0, 0, z) is a height alone."""
    if len(residuals[0]) == 3 and not any(r[0] or r[1] for r in residuals):
        return [(2, "Z", "z")]
    return [(axis, _KINDS[axis].upper(), _KINDS[axis]) for axis in range(len(residuals[0]))]


def _said(result: CalibrationResult, evidence: Mapping[str, Any]) -> str:
    said = [tr("Residuals in the order in which the poses were taken, base.")]
    if "step_in_run_order" in result.warnings:
        said.append(tr("A step shows: something moved between two of them."))
    if "drift_in_run_order" in result.warnings:
        said.append(tr("A drift shows from the first to the last."))
    if "order_not_testable" in result.notes:
        said.append(tr("With so few poses it cannot be seen whether something moved meanwhile."))
    if evidence.get("step_f") is not None:
        said.append(
            tr(
                "Test for a step: F {step:.1f}, beyond {step_limit:.1f} it counts; for a drift: "
                "F {drift:.1f}, beyond {drift_limit:.1f}.",
                step=evidence["step_f"],
                step_limit=evidence["step_f_limit"],
                drift=evidence["drift_f"],
                drift_limit=evidence["drift_f_limit"],
            )
        )
    return " ".join(said)


class _Plot:
    """A level line a millimetre value, an upright place a pose."""

    def __init__(self, count: int, largest_mm: float) -> None:
        self._count = count
        self._reach_mm = largest_mm * 1.15
        self._width = WIDTH - _LEFT - _RIGHT
        # As many lines as can be told apart and named.
        self._step_mm = step_up(self._reach_mm / 3)

    def at(self, number: int, value_mm: float) -> Place:
        """Return where a value of a pose stands; poses count from 0."""
        across = self._width * (number + 0.5) / self._count
        return across, _HEIGHT / 2 * (1 - value_mm / self._reach_mm)

    def frame(self) -> Iterator[Element]:
        """Yield paper, lines with their values, and the numbers of the poses."""
        width = self._width
        yield element("rect", width=f"{width:g}", height=f"{_HEIGHT:g}", class_="paper")
        lines = int(self._reach_mm / self._step_mm)
        for number in range(-lines, lines + 1):
            value = number * self._step_mm
            _, y = self.at(0, value)
            yield line((0, y), (width, y), class_="grid" if number else "bar")
            yield words(f"{value + 0.0:g}", -5, y + 3, class_="tick", text_anchor="end")
        every = -(-self._count // 20)
        for number in range(0, self._count, every):
            x, _ = self.at(number, 0)
            yield words(str(number + 1), x, _HEIGHT + 13, class_="tick", text_anchor="middle")
        yield words("mm", 4, 11, class_="axis")

    def series(self, name: str, kind: str, values_mm: Sequence[float]) -> Iterator[Element]:
        """Yield dots joined in their order, and their name at the right."""
        places = [self.at(number, value) for number, value in enumerate(values_mm)]
        points = " ".join(f"{x:.2f},{y:.2f}" for x, y in places)
        row = 12 + 16 * _KINDS.index(kind)
        yield element(
            "g",
            element("polyline", points=points, class_="joined"),
            *(circle(place, 2.6) for place in places),
            circle((self._width + 12, row - 3.5), 3.2),
            words(name, self._width + 20, row, class_="name"),
            class_=f"series {kind}",
        )
