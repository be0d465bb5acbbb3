"""The proof: how far the tip drifts when the tool turns about it."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from robolink.calibration import Drift
from robolink.messages import tr
from robolink.report._markup import element, figure
from robolink.report._values import Outcome, Report
from robolink.report.sections.offsets import table


def verification(report: Report) -> Iterator[Element]:
    """Yield the drifts, or the sentence that nothing was turned."""
    result = report.verification
    if result is None:
        if report.outcome in (Outcome.WRITTEN, Outcome.SKIPPED):
            yield element("h2", tr("Verification"))
            yield element("p", tr("It was not proved by turning about the new tip."))
        return
    verdict = tr("passed") if result.passed else tr("failed")
    yield element("h2", tr("Verification by turning about the new tip"))
    yield element(
        "p",
        element("strong", verdict),
        tr(": the largest drift is "),
        figure(result.max_drift_mm),
        tr(" mm; "),
        figure(result.tolerance_mm),
        tr(" mm are allowed."),
    )
    heights = any(drift.dz_mm for drift in result.drifts)
    columns = ("U deg", "dX mm", "dY mm", *(["dZ mm"] if heights else []), tr("distance mm"))
    yield table(columns, [_row(drift, heights=heights) for drift in result.drifts])


def _row(drift: Drift, *, heights: bool) -> Element:
    height = (drift.dz_mm,) if heights else ()
    values = (drift.u_deg, drift.dx_mm, drift.dy_mm, *height, drift.distance_mm)
    return element("tr", *(element("td", figure(value)) for value in values))
