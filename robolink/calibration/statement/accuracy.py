"""What a result is accurate to: its scatter, together with every row of its budget.

    C = C_scatter + sum over the rows of (a^2 / 3) J J'

a being the half width of a row and J by how much the measured components change for one unit of it;
the region of all lengths together follows from C as for the scatter alone. A row of one number is
the same in all looks of a cell, so an error at the very end of it has to be held, too
(docs/reference/evidence.md 7, 19).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Self, TypeVar

from robolink.calibration.core.accuracy import (
    ACCURACY_ROWS,
    Accuracy,
    AccuracyFacts,
    AssessedRow,
    BudgetRow,
    ErrorSource,
    UncertaintyBudget,
)
from robolink.calibration.core.pose_checks import tilted
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import (
    NORMAL_95,
    chi_square_quantile,
    shifted_half95,
    shifted_region95,
)
from robolink.calibration.quality.station import StationPart, scatter_covariance, with_station
from robolink.calibration.statement.sentences import SCATTER, basis_words
from robolink.messages import spoken, tr

if TYPE_CHECKING:
    from robolink.calibration.core.least_squares import Floats

ResultT = TypeVar("ResultT", bound=CalibrationResult)

_PERSON_MM: Final = 0.03
_PROBE_MM: Final = 0.005
_BEAMS_MM: Final = 0.003
_CAMERA_PX: Final = 0.1

_PLANE: Final = 2
"""Number of lengths measured in the plane."""


def usual_look_sigma_mm(
    result: CalibrationResult, facts: AccuracyFacts | None = None
) -> float | None:
    """Return the default standard deviation of one coordinate of one look.

    A person 0.03 mm, a probe or an input 0.005 mm, beams 0.003 mm, a camera 0.1 pixels
    (docs/reference/evidence.md 20). At a pin an input shows that there is contact, and how high; a
    person has aimed the tip sideways, and errs as by eye.

    Args:
        result: What was measured; its error sources say with what.
        facts: Whether an input showed each touch, and who brought the tip there.

    Returns:
        ``None`` where nothing says with what it was measured.
    """
    if result.sources is None:
        return None
    rows = {source.row: source for source in result.sources}
    if "tip_image_px" in rows:
        return _CAMERA_PX * max(map(max, rows["tip_image_px"].gain))
    if "touch_mm" in rows:
        shown = facts is not None and facts.by_contact and not _aimed(result, facts)
        return _PROBE_MM if shown else _PERSON_MM
    return _PROBE_MM if "plate_mm" in rows else _BEAMS_MM


def _aimed(result: CalibrationResult, facts: AccuracyFacts) -> bool:
    """Return whether a person aimed at a pin, although an input showed the contact."""
    if not facts.by_contact or facts.by_program or result.by_surface:
        return False
    return any(source.row == "touch_mm" for source in result.sources or ())


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
    lengths = [i for i, name in enumerate(result.measured) if _is_length(name)]
    if not lengths:
        return replace(result, accuracy=None)
    scattered, basis = result, ""
    if not result.half_width95:
        usual = usual_look_sigma_mm(result, facts)
        sigma_mm = facts.look_sigma_mm if facts.look_sigma_mm is not None else usual
        if sigma_mm is None or result.sources is None:
            return replace(result, accuracy=None)
        height_mm = _PROBE_MM if usual == sigma_mm and _aimed(result, facts) else None
        scattered = _scattering(result, sigma_mm, len(lengths), height_mm=height_mm)
        # There is no usual scatter for angles.
        sources = tuple(one.of_first(len(lengths)) for one in sources)
        basis = "default" if facts.look_sigma_mm is None else "record"
    elif _too_sure_of_its_aim(result, facts, len(lengths)):
        scattered, basis = _scattering(result, _PERSON_MM, len(lengths)), "default"
    parts = list(_parts(sources, facts))
    whole = _with(scattered, parts)
    held = _Held.of(scattered, whole, parts)
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
            within_mm=held.within_mm,
            half_width95=held.half_width95,
            rows=tuple(rows),
            budget=whole.budget or _plain_budget(rows),
            without_defaults_mm=0.0 if basis == "default" else _known_mm(scattered, parts),
        ),
    )


@dataclass(frozen=True, slots=True)
class _Part:
    """The contribution of one row.

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
        """Return it as a row, for the worst known length."""
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


@dataclass(frozen=True, slots=True)
class _Held:
    """What holds the truth in 95 %.

    Attributes:
        within_mm: Of all lengths together.
        half_width95: Of each component alone.
    """

    within_mm: float
    half_width95: tuple[float, ...]

    @classmethod
    def of(
        cls, scattered: CalibrationResult, whole: CalibrationResult, parts: Sequence[_Part]
    ) -> Self:
        """Return it for some rows beside what scatters; ``whole`` is the result with both.

        It is never less than of the scatter alone: a row that is known well lets the effective
        degrees of freedom grow, and with them the factor shrinks, at a few residuals by more than
        the row adds. And it holds an error that lies for good at the end of a row of one number.
        """
        found = [cls._by_covariance(scattered), cls._by_covariance(whole)]
        found += [
            cls._at_the_end(whole, one)
            for one in parts
            if one.half_width > 0 and all(len(line) == 1 for line in one.source.gain)
        ]
        return cls(
            max(one.within_mm for one in found),
            tuple(map(max, *(one.half_width95 for one in found))),
        )

    @classmethod
    def _by_covariance(cls, result: CalibrationResult) -> Self:
        within_mm = result.repeatable_to_mm
        assert within_mm is not None  # noqa: S101 - it has half widths
        return cls(within_mm, result.half_width95)

    @classmethod
    def _at_the_end(cls, whole: CalibrationResult, row: _Part) -> Self:
        """Return it for an error at the end of a row, with all others as a scatter beside it.

        The factors of few degrees of freedom stay those of all rows together.
        """
        import numpy as np  # numpy, not needed for a command's help

        halves, held = whole.half_width95, cls._by_covariance(whole)
        shift = np.array([row.half_width * line[0] for line in row.source.gain])
        shift = np.append(shift, np.zeros(len(halves) - len(shift)))
        total = np.array(whole.covariance)
        others = total - np.outer(shift, shift) / 3
        alone = tuple(
            shifted_half95(off, half / NORMAL_95 * math.sqrt(max(left, 0.0) / both))
            if off
            else half
            for off, half, left, both in zip(
                shift.tolist(),
                halves,
                others.diagonal().tolist(),
                total.diagonal().tolist(),
                strict=True,
            )
        )
        lengths = [i for i, name in enumerate(whole.measured) if _is_length(name)]
        if len(lengths) == 1:
            return cls(alone[lengths[0]], alone)
        if len(lengths) > _PLANE:
            return cls(held.within_mm, alone)  # in space, the factor also covers the shifted end
        among = np.ix_(lengths, lengths)
        known_mm = math.sqrt(
            chi_square_quantile(0.95, _PLANE) * float(np.linalg.eigvalsh(total[among])[-1])
        )
        variances, axes = np.linalg.eigh(others[among])
        wide, narrow = np.sqrt(np.maximum(variances, 0.0)) * held.within_mm / known_mm
        along = axes.T @ shift[lengths]
        within_mm = shifted_region95(
            (float(along[0]), float(along[1])), (float(wide), float(narrow)), least=held.within_mm
        )
        return cls(within_mm, alone)


def _known_mm(scattered: CalibrationResult, parts: Sequence[_Part]) -> float:
    """Return what holds the truth in 95 % by the rows that somebody stated or measured."""
    known = [one for one in parts if one.basis != "default"]
    return _Held.of(scattered, _with(scattered, known), known).within_mm


def _with(scattered: ResultT, parts: Sequence[_Part]) -> ResultT:
    return with_station(scattered, *(one.part for one in parts))


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
    import numpy as np  # numpy, not needed for a command's help

    gain = np.array(source.gain)
    covariance: Floats = gain @ gain.T * (half_width * half_width / 3)
    return covariance


def _too_sure_of_its_aim(result: CalibrationResult, facts: AccuracyFacts, lengths: int) -> bool:
    """Return whether touches agree better than a person can be relied on to aim.

    With a contact input no row holds what the person sees, and that the touches of one run agree
    says nothing of it. So what is usual of a person counts until the cell states its scatter or the
    record tells it.
    """
    if not _aimed(result, facts) or result.sigma_stated or facts.look_sigma_mm is not None:
        return False
    usual_mm = _scattering(result, _PERSON_MM, lengths).repeatable_to_mm
    own_mm = result.repeatable_to_mm
    return usual_mm is not None and own_mm is not None and usual_mm > own_mm


def _is_length(name: str) -> bool:
    return name.endswith("_mm")


def _scattering(
    result: ResultT, sigma_mm: float, lengths: int, *, height_mm: float | None = None
) -> ResultT:
    """Return a result as if ``sigma_mm`` had been stated, and of an upright tool its height.

    Angles that were measured, after the lengths, stay as sure as they are.
    """
    variance = (sigma_mm * result.sigma_gain) ** 2
    variances = [variance] * lengths
    upright = not any(map(tilted, result.inputs))
    if height_mm is not None and upright and result.measured[-1] == "z_mm":
        variances[-1] = (height_mm * result.sigma_gain) ** 2
    halves = (*(NORMAL_95 * math.sqrt(one) for one in variances), *result.half_width95[lengths:])
    variances += [row[i] for i, row in enumerate(result.covariance) if i >= lengths]
    axes = range(len(variances))
    return replace(
        result,
        covariance=tuple(tuple(variances[i] if i == j else 0.0 for j in axes) for i in axes),
        half_width95=halves,
        sigma_stated=True,
        interval_from="stated",
        region95_radius_mm=math.sqrt(chi_square_quantile(0.95, lengths) * variance),
        budget=None,
    )


def _plain_budget(rows: Sequence[AssessedRow]) -> UncertaintyBudget:
    return UncertaintyBudget.of(BudgetRow(row.title, row.u_mm, origin=row.told) for row in rows)
