"""How a result becomes accurate to something: its scatter, together with every row of its budget.

    C = C_scatter + sum over the rows of (a^2 / 3) J J'

a being the half width of a row and J by how much the measured components change for one unit of it;
the region of all lengths together follows from C as for the scatter alone
(docs/reference/evidence.md 7, 19).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, TypeVar

from robolink.calibration.core.accuracy import (
    ACCURACY_ROWS,
    Accuracy,
    AccuracyFacts,
    AssessedRow,
    ErrorSource,
)
from robolink.calibration.core.budget import BudgetRow, UncertaintyBudget
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import NORMAL_95, chi_square_quantile
from robolink.calibration.quality.station_part import StationPart, scatter_covariance, with_station
from robolink.calibration.statement.sentences import SCATTER, basis_words
from robolink.messages import spoken, tr

if TYPE_CHECKING:
    from robolink.calibration.core.robust import Floats

ResultT = TypeVar("ResultT", bound=CalibrationResult)

_PERSON_MM: Final = 0.03
_PROBE_MM: Final = 0.005
_BEAMS_MM: Final = 0.003
_CAMERA_PX: Final = 0.1


def usual_look_sigma_mm(result: CalibrationResult, *, by_contact: bool = False) -> float | None:
    """Return the standard deviation of one coordinate of one look where nothing else tells it.

    A person 0.03 mm, a probe or an input 0.005 mm, beams 0.003 mm, a camera 0.1 pixels
    (docs/reference/evidence.md 20).

    Args:
        result: What was measured; its error sources say with what.
        by_contact: Whether an input showed each touch.

    Returns:
        ``None`` where nothing says with what it was measured.
    """
    if result.sources is None:
        return None
    rows = {source.row: source for source in result.sources}
    if "tip_image_px" in rows:
        return _CAMERA_PX * max(map(max, rows["tip_image_px"].gain))
    if "touch_mm" in rows:
        return _PROBE_MM if by_contact else _PERSON_MM
    return _PROBE_MM if "plate_mm" in rows else _BEAMS_MM


def assessed(result: ResultT, facts: AccuracyFacts) -> ResultT:
    """Return a result with what it is accurate to.

    Where its own scatter tells nothing, one that is usual for what it was measured with takes its
    place, as a default; a method that does not say what its errors can be has no accuracy then.

    Args:
        result: What was measured; its lengths are its first components.
        facts: How large the rows are in this cell.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import AccuracyFacts, assessed, solve_two_pose
        >>> touches = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
        >>> found = assessed(solve_two_pose(*touches, sigma_mm=0.02), AccuracyFacts())
        >>> round(found.repeatable_to_mm, 3), round(found.accurate_to_mm, 3)
        (0.035, 0.079)
        >>> found.accuracy.largest.key
        'touch_mm'
    """
    sources = result.sources or ()
    lengths = [i for i, name in enumerate(result.measured) if name.endswith("_mm")]
    if not lengths:
        return replace(result, accuracy=None)
    scattered, basis = result, ""
    if not result.half_width95:
        usual = usual_look_sigma_mm(result, by_contact=facts.by_contact)
        sigma_mm = facts.look_sigma_mm if facts.look_sigma_mm is not None else usual
        if sigma_mm is None or result.sources is None:
            return replace(result, accuracy=None)
        scattered = _scattering(result, sigma_mm, len(lengths))
        # Nothing usual is known of angles.
        sources = tuple(one.of_first(len(lengths)) for one in sources)
        basis = "default" if facts.look_sigma_mm is None else "record"
    parts = list(_parts(sources, facts))
    whole = with_station(scattered, *(one.part for one in parts))
    known = with_station(scattered, *(one.part for one in parts if one.basis != "default"))
    worst = max(lengths, key=whole.half_width95.__getitem__)
    scatter = math.sqrt(max(float(scatter_covariance(scattered)[worst, worst]), 0.0))
    rows = [
        AssessedRow(
            SCATTER,
            tr("how well it repeats"),
            None,
            "",
            basis,
            "",
            scatter,
        ),
        *(one.row(worst) for one in parts),
    ]
    rows.sort(key=lambda row: row.u_mm, reverse=True)
    return replace(
        result,
        accuracy=Accuracy(
            within_mm=_at_least(whole, scattered),
            half_width95=tuple(map(max, whole.half_width95, scattered.half_width95)),
            rows=tuple(rows),
            budget=whole.budget or _plain_budget(rows),
            without_defaults_mm=_at_least(known, scattered) if basis != "default" else 0.0,
        ),
    )


def _at_least(whole: CalibrationResult, scattered: CalibrationResult) -> float:
    """Return what a result is known within, never better than its scatter alone lets it be.

    A row that is known well lets the effective degrees of freedom grow, and with them the factor
    shrinks, at a few residuals by more than the row adds.
    """
    within_mm = [result.repeatable_to_mm for result in (whole, scattered)]
    assert None not in within_mm  # noqa: S101 - they have half widths
    return max(one for one in within_mm if one is not None)


@dataclass(frozen=True, slots=True)
class _Part:
    """What one row brings.

    Attributes:
        part: Its covariance.
        source: How it enters.
        half_width: Half its width, growth included.
        basis: What tells it.
        told: Where, in words.
    """

    part: StationPart
    source: ErrorSource
    half_width: float
    basis: str
    told: str

    def row(self, worst: int) -> AssessedRow:
        """Return it as a row, for the length that is known worst."""
        kind = ACCURACY_ROWS[self.source.row]
        covariance = self.part.covariance
        variance = float(covariance[worst][worst]) if worst < len(covariance) else 0.0
        return AssessedRow(
            kind.key,
            spoken(kind.title),
            self.half_width,
            kind.unit,
            self.basis,
            self.told,
            math.sqrt(max(variance, 0.0)),
        )


def _parts(sources: Sequence[ErrorSource], facts: AccuracyFacts) -> Iterator[_Part]:
    for source in sources:
        if source.row == "touch_mm" and facts.by_contact:
            continue
        fact = facts.of(source.row)
        half_width = fact.half_width + fact.growth
        covariance = row_covariance(source, half_width)
        name = spoken(ACCURACY_ROWS[source.row].title)
        part = StationPart(name, covariance.tolist(), origin=fact.told or basis_words(fact.basis))
        yield _Part(part, source, half_width, fact.basis, fact.told)


def row_covariance(source: ErrorSource, half_width: float) -> "Floats":
    """Return the covariance that a row of rectangular half width brings, mm^2.

    Args:
        source: How it enters.
        half_width: Half its width, in the unit of the row.
    """
    import numpy as np  # which the help of a command does without

    gain = np.array(source.gain)
    covariance: Floats = gain @ gain.T * (half_width * half_width / 3)
    return covariance


def _scattering(result: ResultT, sigma_mm: float, lengths: int) -> ResultT:
    """Return a result as if ``sigma_mm`` had been stated."""
    variance = (sigma_mm * result.sigma_gain) ** 2
    axes = range(lengths)
    return replace(
        result,
        covariance=tuple(tuple(variance if i == j else 0.0 for j in axes) for i in axes),
        half_width95=(NORMAL_95 * math.sqrt(variance),) * lengths,
        sigma_stated=True,
        interval_from="stated",
        region95_radius_mm=math.sqrt(chi_square_quantile(0.95, lengths) * variance),
        budget=None,
    )


def _plain_budget(rows: Sequence[AssessedRow]) -> UncertaintyBudget:
    return UncertaintyBudget.of(BudgetRow(row.title, row.u_mm, origin=row.told) for row in rows)
