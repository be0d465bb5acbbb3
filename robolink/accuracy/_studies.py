"""Rows that are measured for their own sake: an artefact test, a gauge study, turned nozzles."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from robolink.accuracy._row_measurements import MeasuredRow, artefact_test, paired_half_width
from robolink.calibration import GaugeStudy, require_positive
from robolink.errors import CalibrationError, ConfigError, RobolinkError
from robolink.messages import tr
from robolink.methods import AnyMethod, find_method
from robolink.model import EntryKind, Recorded, read_offset
from robolink.stations import StationKind

_LEAST_PERSONS = 3


@dataclass(frozen=True, slots=True)
class MeasuredTip:
    """One recorded calibration, as a study of the cell uses it.

    Attributes:
        number: Number of its entry.
        at: When, ISO 8601 UTC.
        tool: Number of the tool.
        method: Name of the method.
        person: Who measured; empty where nobody gave a name.
        nozzle: Id of the nozzle; empty where nobody gave one.
        station: Where; empty where nobody said.
        by_camera: Whether a camera saw it, not a person who touched.
        xy_mm: X and Y of the tip as it was measured.
    """

    number: int
    at: str
    tool: int
    method: str
    person: str
    nozzle: str
    station: str
    by_camera: bool
    xy_mm: tuple[float, float]


def measured_tips(entries: Iterable[Recorded]) -> Iterator[MeasuredTip]:
    """Yield calibrations with X and Y of a tip that a person touched or a camera saw.

    Beams have no person, one touch tells only what changed, and a touch that an input showed was
    seen by nobody: these are none.

    Args:
        entries: Calibrations on record, in any order; what cannot be read is passed over.
    """
    for entry in entries:
        said, method = entry.details, _method(entry.details.get("method"))
        xy_mm = _measured_xy(said)
        if entry.kind is not EntryKind.CALIBRATION or entry.tool is None or method is None:
            continue
        if xy_mm is None:
            continue
        by_camera = method.needs.station is StationKind.CAMERA
        if not by_camera and not _by_eye(method, said.get("touches")):
            continue
        yield MeasuredTip(
            entry.number,
            entry.at,
            entry.tool,
            method.name,
            entry.signature.operator,
            entry.signature.nozzle,
            entry.signature.station,
            by_camera,
            xy_mm,
        )


def artefact_row(
    tips: Sequence[MeasuredTip],
    known_mm: tuple[float, float],
    *,
    known_u_mm: float = 0.0,
    station: str = "",
) -> MeasuredRow:
    """Return the row for judging contact by eye, from a gauge tip at a known place.

    Args:
        tips: Its measurements; five or more.
        known_mm: X and Y of its offset, by its certificate or by a better instrument.
        known_u_mm: Standard uncertainty of each of them.
        station: The pin that it holds for; empty for the whole cell.

    Raises:
        CalibrationError: ``too_few_records``.

    Example:
        >>> from robolink.accuracy import MeasuredTip, artefact_row
        >>> xs = (12.03, 12.05, 12.04, 12.03, 12.05)
        >>> tips = [
        ...     MeasuredTip(n, "", 1, "two-pose", "", "", "", False, (x, -4.0))
        ...     for n, x in enumerate(xs, start=7)
        ... ]
        >>> row = artefact_row(tips, (12.0, -4.0))
        >>> row.row, round(row.half_width, 3), row.records
        ('touch_mm', 0.057, (7, 8, 9, 10, 11))
    """
    test = artefact_test([tip.xy_mm for tip in tips], known_mm, known_u_mm=known_u_mm)
    return MeasuredRow(
        row="touch_mm",
        half_width=test.half_width_mm,
        by="artefact-test",
        station=station,
        count=test.count,
        records=tuple(tip.number for tip in tips),
        details={
            "known_mm": list(known_mm),
            "known_u_mm": known_u_mm,
            "bias_mm": list(test.bias_mm),
            "sigma_mm": test.sigma_mm,
        },
    )


def study_row(study: GaugeStudy, *, persons: int, station: str = "") -> MeasuredRow:
    """Return the row for how differently persons see contact, from a gauge study of the cell.

    What all of them see alike is not in it: an artefact test shows that.

    Args:
        study: The study.
        persons: How many measured; three or more.
        station: The pin that it holds for; empty for the whole cell.

    Raises:
        CalibrationError: ``too_few_records``: fewer than three persons.

    Example:
        >>> from robolink.accuracy import study_row
        >>> from robolink.calibration import gauge_study
        >>> values = [[[n + 0.02 * p, n + 0.02 * p + 0.01] for p in range(3)] for n in range(5)]
        >>> row = study_row(gauge_study(values), persons=3)
        >>> row.row, round(row.half_width, 2)
        ('touch_mm', 0.15)
    """
    bound_mm = study.reproducibility_upper95_mm
    if persons < _LEAST_PERSONS or bound_mm is None:
        raise CalibrationError(
            "too_few_records",
            tr(
                "{count} persons measured; {least} are needed.", count=persons, least=_LEAST_PERSONS
            ),
            remedy=tr("Nothing was recorded. Let more persons measure the same nozzles."),
        )
    return MeasuredRow(
        row="touch_mm",
        half_width=math.sqrt(3) * bound_mm,
        by="gauge-study",
        station=station,
        count=persons,
        details={
            "reproducibility_mm": study.reproducibility_mm,
            "reproducibility_upper95_mm": bound_mm,
        },
    )


Pair = tuple[MeasuredTip, MeasuredTip]


def turned_pairs(tips: Iterable[MeasuredTip]) -> list[Pair]:
    """Return the last two measurements of each nozzle that has an id, oldest first.

    Nothing on record says how a nozzle sits in its mount: whoever asks for the row says that it
    was turned by half a turn between the two.

    Args:
        tips: Measurements by one camera with one tool, in any order.
    """
    of: dict[str, list[MeasuredTip]] = {}
    for tip in sorted(tips, key=lambda one: one.number):
        if tip.nozzle:
            of.setdefault(tip.nozzle, []).append(tip)
    return [(seen[-2], seen[-1]) for seen in of.values() if len(seen) > 1]


def tip_image_row(pairs: Sequence[Pair], *, mm_per_px: float, station: str) -> MeasuredRow:
    """Return the row for how well a camera sees the middle of tips, from nozzles that were turned.

    Args:
        pairs: Each nozzle before and after half a turn in its mount; five or more.
        mm_per_px: Length of a pixel.
        station: The camera.

    Raises:
        CalibrationError: ``too_few_records``.
        ConfigError: ``mm_per_px`` is not positive.

    Example:
        >>> from robolink.accuracy import MeasuredTip, tip_image_row
        >>> def seen(number, nozzle, x_mm):
        ...     return MeasuredTip(number, "", 1, "camera", "", nozzle, "CAM-01", True, (x_mm, 0))
        >>> pairs = [(seen(n, f"N{n}", 5.0), seen(n + 5, f"N{n}", 5.02)) for n in range(5)]
        >>> round(tip_image_row(pairs, mm_per_px=0.02, station="CAM-01").half_width, 2)
        0.98
    """
    require_positive(mm_per_px, "mm_per_px")
    bound = paired_half_width([one.xy_mm for one, _ in pairs], [two.xy_mm for _, two in pairs])
    return MeasuredRow(
        row="tip_image_px",
        half_width=bound.half_width / mm_per_px,
        by="turned-nozzles",
        station=station,
        count=bound.count,
        records=tuple(tip.number for pair in pairs for tip in pair),
        details={"sigma_mm": bound.sigma, "mm_per_px": mm_per_px},
    )


def _measured_xy(said: Mapping[str, object]) -> tuple[float, float] | None:
    """Return X and Y of the tip, ``None`` if they were not measured or are unreadable."""
    measured = said.get("measured")
    if not isinstance(measured, list) or not {"x_mm", "y_mm"} <= {*map(str, measured)}:
        return None
    try:
        tip = read_offset(said.get("tip") or said.get("proposed"))
    except (RobolinkError, TypeError, ValueError):
        return None
    return None if tip is None else (tip.x_mm, tip.y_mm)


def _method(name: object) -> AnyMethod | None:
    try:
        return find_method(name) if isinstance(name, str) else None
    except ConfigError:
        return None


def _by_eye(method: AnyMethod, touches: object) -> bool:
    """Return whether a person judged the touches by eye, with a method that relies on no place."""
    needs = method.needs
    if needs.by_sensor or not (needs.finds_pin or needs.station is StationKind.TOUCH):
        return False
    shown = isinstance(touches, list) and any(
        isinstance(one, dict) and one.get("contact") is True for one in touches
    )
    return not shown
