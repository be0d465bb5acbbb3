"""Where taught points lead afterwards: sentences, picture and table."""

from collections.abc import Iterator
from typing import Final
from xml.etree.ElementTree import Element

from robolink.calibration import Impact, PointImpact
from robolink.messages import tr
from robolink.report._markup import element, figure
from robolink.report._values import Report
from robolink.report.pictures.point_map import draw
from robolink.report.sections.offsets import table

_SAME_MM: Final = 1e-6


def points(report: Report) -> Iterator[Element]:
    """Yield the part about taught points."""
    yield element("h2", tr("Taught points"))
    impact = report.impact
    if impact is None:
        yield element("p", _absence(report))
        return
    if impact.largest is None:
        yield element("p", tr("No point could be judged."))
    else:
        yield _summary(impact, impact.largest, report.tool)
        yield _figure(impact)
        yield _table(impact)
    yield from _left_out(impact)
    if impact.entries:
        yield element("p", _meaning(), class_="small")


def _absence(report: Report) -> str:
    if report.before is None:
        return tr("The tool was undefined: no program can have driven to a point with it.")
    return tr("No taught points were named, so where they lead afterwards is not shown.")


def _summary(impact: Impact, largest: PointImpact, tool: int) -> Element:
    distance_mm = largest.distance_mm
    if distance_mm < _SAME_MM:
        return element("p", tr("The tip stays where it is at every point shown."))
    least_mm = min(entry.distance_mm for entry in impact.entries)
    aside = abs(largest.dx_mm) > _SAME_MM or abs(largest.dy_mm) > _SAME_MM
    alike = aside and len(impact.entries) > 1 and distance_mm - least_mm < _SAME_MM
    return element(
        "p",
        element("strong", tr("Largest: "), figure(distance_mm), f" mm, P{largest.number}."),
        " ",
        tr("It is equal at every point; only its direction turns with U. ") if alike else None,
        tr("It concerns only points that a program drives with tool {tool}.", tool=tool),
        class_="lead",
    )


def _figure(impact: Impact) -> Element:
    picture = draw(impact)
    said = [tr("Taught points in base coordinates, seen from above, with equal axes.")]
    if picture.factor is None:
        said.append(tr("Nothing moves sideways."))
    else:
        said.append(
            tr(
                "Each arrow is the sideways movement of the tip, drawn {factor:g} times as long "
                "as it is; the ring marks the largest.",
                factor=picture.factor,
            )
        )
    if picture.unnamed:
        said.append(tr("{count} numbers have no room; the table has them.", count=picture.unnamed))
    return element("figure", picture.svg, element("figcaption", " ".join(said)))


def _table(impact: Impact) -> Element:
    columns = ("", "X mm", "Y mm", "Z mm", "U deg", "dX mm", "dY mm", "dZ mm")
    rows = [_row(entry, largest=entry is impact.largest) for entry in impact.entries]
    return table((*columns, tr("turn deg"), tr("distance mm")), rows, class_="dense")


def _row(entry: PointImpact, *, largest: bool) -> Element:
    pose = entry.pose
    values = (
        *(pose.x_mm, pose.y_mm, pose.z_mm, pose.u_deg),
        *(entry.dx_mm, entry.dy_mm, entry.dz_mm, entry.turn_deg, entry.distance_mm),
    )
    name = tr("P{number}, largest", number=entry.number) if largest else f"P{entry.number}"
    cells = (element("td", figure(value)) for value in values)
    return element("tr", element("td", name), *cells, class_="largest" if largest else None)


def _left_out(impact: Impact) -> Iterator[Element]:
    lines = []
    if impact.undefined:
        lines.append(tr("Not taught, skipped: {count}.", count=len(impact.undefined)))
    if impact.other_local:
        named = ", ".join(f"P{n} (local {local})" for n, local in impact.other_local.items())
        lines.append(tr("In another local, left out: {points}.", points=named))
    if lines:
        yield element("ul", *(element("li", line) for line in lines), class_="small")


def _meaning() -> str:
    return tr(
        "Shown is where the tip that is on the arm now goes with the new offset, minus where it "
        "goes with the old one. If the nozzle was changed, this is the error that the write "
        "removes. If the nozzle is the same and only the number is corrected, the tip leaves the "
        "places that were taught by this much: teach those points again, or keep the old value."
    )
