"""The proposal of a calibration, what was measured of it, and the evidence of its fit."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from struct import iter_unpack
from typing import Final, overload

from robolink.calibration.core.accuracy import Accuracy, ErrorSource, UncertaintyBudget
from robolink.calibration.core.statistics import NORMAL_95
from robolink.calibration.core.turn_claim import TurnJudgement
from robolink.model import (
    Pose,
    ToolOffset,
    json_fields,
    json_value,
)

NOTICEABLE_MM: Final = 0.002
"""Smallest step or drift reported, in mm; less is put down to rounding, however large F is."""


@dataclass(frozen=True, slots=True)
class RunOrder:
    """Whether the touches show that something moved while they were made.

    Attributes:
        step_f: The largest F of a step between two touches; ``None`` where nothing can be told.
        step_f_limit: What it exceeds by chance once in a hundred calibrations.
        step_after: After which touch, counted from 1.
        step_mm: By how much the touched point moved there, x and y.
        drift_f: F of a straight drift.
        drift_f_limit: What it exceeds by chance once in a hundred calibrations.
        drift_mm: From the first touch to the last.
    """

    step_f: float
    step_f_limit: float
    step_after: int
    step_mm: tuple[float, ...]
    drift_f: float
    drift_f_limit: float
    drift_mm: tuple[float, ...]

    @property
    def finding(self) -> str:
        """The name of the finding; empty when chance explains it."""
        step = self.step_f > self.step_f_limit and math.hypot(*self.step_mm) >= NOTICEABLE_MM
        drift = self.drift_f > self.drift_f_limit and math.hypot(*self.drift_mm) >= NOTICEABLE_MM
        if step and (not drift or self.step_f >= self.drift_f):
            return "step_in_run_order"
        return "drift_in_run_order" if drift else ""


@dataclass(frozen=True, slots=True)
class FitEvidence:
    """Figures of the checks that a fit went through (docs/reference/evidence.md 5, 6, 8, 10).

    Attributes:
        distinct: How many different poses there are.
        duplicates: Indices, from 0, of poses that copy an earlier one; they do not count.
        leverage: Of each pose that was kept, in their order: how far it decides alone, 0 to 1.
        high_leverage: Indices of poses over the limit.
        chi_square: Sum of squared residuals over the stated variance.
        chi_square_limit: What it exceeds by chance once in a hundred calibrations.
        birge_ratio: Root of ``chi_square`` over the degrees of freedom.
        run_order: The test of the order, where there are enough touches.
        consensus: How many poses a robust fit kept.
        seed_spread_mm: How far its results under different seeds lie apart.
        grid_mm: Step of the jogs, when it is known.
        approach_bias_mm: By how much touches are off toward where the tip came from.
        approach_bias_u_mm: Its standard uncertainty.
    """

    distinct: int | None = None
    duplicates: tuple[int, ...] = ()
    leverage: tuple[float, ...] = ()
    high_leverage: tuple[int, ...] = ()
    chi_square: float | None = None
    chi_square_limit: float | None = None
    birge_ratio: float | None = None
    run_order: RunOrder | None = None
    consensus: int | None = None
    seed_spread_mm: float | None = None
    grid_mm: float | None = None
    approach_bias_mm: float | None = None
    approach_bias_u_mm: float | None = None

    def as_json(self) -> dict[str, object]:
        """Return the known figures as plain values."""
        found: dict[str, object] = {
            **json_fields(self, "distinct", "duplicates", "leverage", "high_leverage"),
            **json_fields(self, "chi_square", "chi_square_limit", "birge_ratio", "consensus"),
            **json_fields(self, "seed_spread_mm", jog_grid_mm="grid_mm"),
            **json_fields(self, "approach_bias_mm", "approach_bias_u_mm"),
            **(json_value(self.run_order) or {}),
        }
        return {name: value for name, value in found.items() if value not in (None, [])}


class ResidualVectors(Sequence[tuple[float, ...]]):
    """Residual vectors of a fit, which become tuples when somebody reads one.

    To make tuples of the residuals of thousands of poses takes a sixth as long as to solve them.
    It is equal to the tuple of its vectors.

    Args:
        data: The numbers as the machine keeps them, one vector after the other.
        dimensions: How many numbers a vector has.

    Example:
        >>> import numpy as np
        >>> from robolink.calibration import ResidualVectors
        >>> ResidualVectors(np.array([[0.1, -0.2], [0.0, 0.3]]).tobytes(), 2)
        ((0.1, -0.2), (0.0, 0.3))
    """

    __slots__ = ("_data", "_dimensions", "_vectors")

    def __init__(self, data: bytes, dimensions: int) -> None:
        self._data = data
        self._dimensions = dimensions
        self._vectors: tuple[tuple[float, ...], ...] | None = None

    def _looked_at(self) -> tuple[tuple[float, ...], ...]:
        if self._vectors is None:
            self._vectors = tuple(iter_unpack(f"{self._dimensions}d", self._data))
        return self._vectors

    def __len__(self) -> int:
        return len(self._data) // (8 * self._dimensions)

    @overload
    def __getitem__(self, index: int) -> tuple[float, ...]: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[tuple[float, ...], ...]: ...
    def __getitem__(self, index: int | slice) -> tuple[float, ...] | tuple[tuple[float, ...], ...]:
        return self._looked_at()[index]

    def __iter__(self) -> Iterator[tuple[float, ...]]:
        return iter(self._looked_at())

    def __eq__(self, other: object) -> bool:
        if isinstance(other, ResidualVectors):
            return self._looked_at() == other._looked_at()
        return self._looked_at() == other

    def __hash__(self) -> int:
        return hash(self._looked_at())

    def __repr__(self) -> str:
        return repr(self._looked_at())


LEAST_HALF_WIDTH: Final = 0.0005
"""Smallest half width stated: half of the last digit that a controller prints, in mm and in degrees
(docs/reference/evidence.md 6)."""


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """A proposal for a tool offset. Nothing has been written.

    Whatever method made it, an interval of 0 is none: half widths and the region are at least
    :data:`LEAST_HALF_WIDTH`.

    Attributes:
        method: Name of the calibration method, for example ``two-pose``.
        offset: The proposed offset: measured components, and the others as they were kept.
        measured: Names of the components that the measurement determines.
        kept: Names of the components that were not measured and are proposed unchanged.
        changed: Names of the components of which only a change was measured: what it was added to
            never was, so that nothing is stated of the component itself.
        reference_point_mm: Where the reference point lies in the base, (x, y) or (x, y, z);
            empty where a method has none.
        sigma_gain: Standard deviation of each measured length as a multiple of the standard
            deviation of one placement (docs/reference/calibration.md 1.1); the largest when they
            differ.
        warnings: Named doubts that do not forbid the result.
        inputs: The poses that went in.
        covariance: Of the measured components, in their order: mm^2 between two lengths,
            deg^2 between two angles, mm deg between both. Empty when neither a residual nor
            a stated sigma tells how large the errors are.
        half_width95: Half the 95 % interval of each measured component alone, in their order, mm
            or degrees: the widest of what residuals, a stated sigma and the grid of the jogs
            give. Empty when ``covariance`` is.
        sigma_mm: Standard deviation of one coordinate of one placement that the interval rests
            on; ``None`` when it is unknown.
        sigma_stated: Whether ``sigma_mm`` was stated by the caller.
        rms_mm: Root mean square of the residual distances that were kept, ``None`` without a
            degree of freedom.
        max_residual_mm: The largest of them.
        residuals_mm: Residual vector of every pose in base axes, rejected ones included.
        rejected: Indices, from 0, of the poses that a robust fit left out.
        condition_number: Of the whole design matrix, ``None`` for closed forms.
        rank: Of the design matrix.
        dof: Degrees of freedom that are left: equations less unknowns.
        unobservable: Components that these data cannot tell, whatever their number.
        notes: Named facts that are no doubts, for example ``resolution_floor``.
        interval_from: What decided the interval: ``residuals``, ``stated`` or ``resolution``;
            empty without an interval.
        region95_radius_mm: The measured place lies within this distance of the truth in 95 %,
            all its lengths together: the largest half axis of the ellipse.
        budget: Where the uncertainty of the worst length comes from.
        evidence: Figures behind notes and doubts.
        sources: Errors that its scatter cannot show, and how each enters; ``None`` where the method
            does not say it.
        marks_mm: Where the marks that a proof looks at lie on the tool; empty for a tip.
        accuracy: What it is accurate to, once it was held to what the cell knows
            (:func:`~robolink.calibration.assessed`).
    """

    method: str
    offset: ToolOffset
    measured: tuple[str, ...]
    kept: tuple[str, ...]
    reference_point_mm: tuple[float, ...]
    sigma_gain: float
    warnings: tuple[str, ...]
    inputs: tuple[Pose, ...]
    covariance: tuple[tuple[float, ...], ...] = ()
    half_width95: tuple[float, ...] = ()
    sigma_mm: float | None = None
    sigma_stated: bool = False
    rms_mm: float | None = None
    max_residual_mm: float | None = None
    residuals_mm: Sequence[tuple[float, ...]] = ()
    rejected: tuple[int, ...] = ()
    condition_number: float | None = None
    rank: int | None = None
    dof: int | None = None
    unobservable: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    interval_from: str = ""
    region95_radius_mm: float | None = None
    budget: UncertaintyBudget | None = None
    evidence: FitEvidence | None = None
    sources: tuple[ErrorSource, ...] | None = None
    marks_mm: tuple[tuple[float, float], ...] = ()
    accuracy: Accuracy | None = None
    changed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Widen intervals that are narrower than anybody can read."""
        if self.half_width95 and min(self.half_width95) < LEAST_HALF_WIDTH:
            widths = tuple(max(half, LEAST_HALF_WIDTH) for half in self.half_width95)
            object.__setattr__(self, "half_width95", widths)
        if self.region95_radius_mm is not None and self.region95_radius_mm < LEAST_HALF_WIDTH:
            object.__setattr__(self, "region95_radius_mm", LEAST_HALF_WIDTH)

    def details(self) -> dict[str, object]:
        """Return further results of the method, plain JSON; usually none."""
        return {}

    @property
    def found(self) -> tuple[str, ...]:
        """Names of the proposed components: measured themselves, or their change."""
        return (*self.measured, *self.changed)

    @property
    def interval95(self) -> dict[str, tuple[float, float]]:
        """Lower and upper end of each measured component's 95 % interval, by name."""
        if not self.half_width95:
            return {}
        return {
            name: (getattr(self.offset, name) - half, getattr(self.offset, name) + half)
            for name, half in zip(self.measured, self.half_width95, strict=True)
        }

    @property
    def half95_mm(self) -> float | None:
        """Half the 95 % interval of the worst known length; ``None`` without one."""
        widths = zip(self.measured, self.half_width95, strict=False)
        return max((half for name, half in widths if name.endswith("_mm")), default=None)

    @property
    def repeatable_to_mm(self) -> float | None:
        """Radius in which the tip would be found again in 95 %: the region, else the worst length.

        That is what scatter and grid say, no more: :attr:`accurate_to_mm` says how far off the
        truth it may be. A nozzle misses in the plane, not along an axis: two intervals of 95 %
        hold both coordinates in 90 to 92 % only (docs/reference/evidence.md 7). ``None`` where
        nothing tells it.
        """
        region_mm, half_mm = self.region95_radius_mm, self.half95_mm
        return half_mm if region_mm is None or half_mm is None else max(region_mm, half_mm)

    @property
    def known_within_mm(self) -> float | None:
        """The former name of :attr:`repeatable_to_mm`, for one version."""
        return self.repeatable_to_mm

    @property
    def accurate_to_mm(self) -> float | None:
        """Distance from the truth that the tip keeps in 95 %, with every row of the budget counted.

        ``None`` where nothing tells it, or it was not held to a cell yet.
        """
        return None if self.accuracy is None else self.accuracy.within_mm

    @property
    def inputs_per_look(self) -> int:
        """How many inputs determine both coordinates once."""
        return 1

    @property
    def held_to_table_mm(self) -> float | None:
        """How far off a table may be between its rows, if the turn test compares with one."""
        return None

    @property
    def by_surface(self) -> bool:
        """Whether a surface was touched, so that the drift is solved for and not seen."""
        return False

    @property
    def residual_distances_mm(self) -> tuple[float, ...]:
        """Length of each pose's residual, in the order of the poses."""
        return tuple(math.hypot(*residual) for residual in self.residuals_mm)


GUARD_FACTOR: Final = 1.65
"""One-sided 95 % factor: each of the two verdicts is wrong in at most 5 % of cases."""

PERSON_U_DRIFT_MM: Final = 0.03
"""Standard uncertainty of a drift that a person measures at a pin, mm, by eye or with an input."""


class DriftVerdict(Enum):
    """What a drift shows about the tip; the value is its code."""

    PASSED = ""
    UNDECIDED = "drift_undecided"
    CONTRADICTED = "proof_contradicts_accuracy"
    DOUBTED = "proof_contradicts_repeatability"
    FAILED = "large_drift"


_WORST_FIRST: Final = (
    DriftVerdict.FAILED,
    DriftVerdict.CONTRADICTED,
    DriftVerdict.DOUBTED,
    DriftVerdict.UNDECIDED,
)


def judge_drift(drift_mm: float, u_mm: float, tolerance_mm: float) -> DriftVerdict:
    """Return whether one drift is within a tolerance, with a guard band for the scatter of a touch.

    What passes is inside by the uncertainty, what fails outside by it, after ISO 14253-1
    (docs/reference/evidence.md 1).

    Args:
        drift_mm: The drift that was found.
        u_mm: Its standard uncertainty.
        tolerance_mm: What is allowed.

    Example:
        >>> from robolink.calibration import judge_drift
        >>> str(judge_drift(0.08, u_mm=0.01, tolerance_mm=0.2))
        'DriftVerdict.PASSED'
        >>> str(judge_drift(0.19, u_mm=0.02, tolerance_mm=0.2))
        'DriftVerdict.UNDECIDED'
    """
    guard_mm = GUARD_FACTOR * u_mm
    if drift_mm + guard_mm <= tolerance_mm:
        return DriftVerdict.PASSED
    if drift_mm - guard_mm > tolerance_mm:
        return DriftVerdict.FAILED
    return DriftVerdict.UNDECIDED


def worst_of(verdicts: Iterable[DriftVerdict]) -> DriftVerdict:
    """Return what drifts at several angles show together."""
    found = set(verdicts)
    for verdict in _WORST_FIRST:
        if verdict in found:
            return verdict
    return DriftVerdict.PASSED


@dataclass(frozen=True, slots=True)
class Drift:
    """How far the tip left the reference point with the tool at ``u_deg``.

    ``dz_mm`` stays 0 where only the plane is judged. ``u_mm`` is the standard uncertainty of a
    drift that a person showed by touching, 0 where none is counted. It is the mean of ``looks``.
    """

    u_deg: float
    dx_mm: float
    dy_mm: float
    dz_mm: float = 0.0
    u_mm: float = 0.0
    looks: int = 1

    @property
    def distance_mm(self) -> float:
        """Length of the drift."""
        return math.hypot(self.dx_mm, self.dy_mm, self.dz_mm)


@dataclass(frozen=True, slots=True)
class VerifyResult:
    """Drift of the tip about the reference point, one entry per angle.

    ``warnings`` are named doubts about the test itself; ``heights_only`` tells that a surface was
    touched, which shows Z and nothing else, ``in_space`` that drifts have a height, too. Where
    heights were compared beside the drifts, ``height_shows_from_mm`` is the smallest shift in
    height that shows so in 95 %. ``codes`` name why its touches do not count;
    ``inputs`` are their poses, where a person made them. ``judgement`` is what the drifts say about
    the statement of the measurement, once they were held to it
    (:func:`~robolink.calibration.held_to_claim`); ``accurate_to_mm`` is what the tip is accurate to
    after it, by the measurement or by a wider statement that a person took.
    """

    drifts: tuple[Drift, ...]
    tolerance_mm: float
    warnings: tuple[str, ...] = ()
    heights_only: bool = False
    codes: tuple[str, ...] = ()
    inputs: tuple[Pose, ...] = ()
    judgement: TurnJudgement | None = None
    accurate_to_mm: float | None = None
    in_space: bool = False
    height_shows_from_mm: float | None = None

    @property
    def coordinates(self) -> int:
        """The number of coordinates of its drifts."""
        if self.heights_only:
            return 1
        return 3 if self.in_space or any(drift.dz_mm for drift in self.drifts) else 2

    @property
    def max_drift_mm(self) -> float:
        """The largest drift."""
        return max(drift.distance_mm for drift in self.drifts)

    @property
    def verdict(self) -> DriftVerdict:
        """What the drifts show, each with its guard band."""
        found = [judge_drift(one.distance_mm, one.u_mm, self.tolerance_mm) for one in self.drifts]
        if self.judgement is not None and self.judgement.fails:
            found.append(DriftVerdict(self.judgement.code))
        return worst_of(found)

    @property
    def passed(self) -> bool:
        """Whether every drift is within the tolerance, and the statements explain it.

        Its touches have to count, too.
        """
        return not self.codes and self.verdict is DriftVerdict.PASSED


def offset_sigma_mm(result: CalibrationResult) -> float | None:
    """Return the largest standard deviation of a measured length.

    A scatter that was estimated from few poses is itself uncertain, and its 95 % interval is wider
    for that. What is kept is the standard deviation of a normal distribution whose interval is as
    wide, because whoever uses it later no longer knows from how many poses it came.

    Returns:
        ``None`` when nothing tells it.
    """
    widths = zip(result.measured, result.half_width95, strict=False)
    lengths = [half for name, half in widths if name.endswith("_mm")]
    return max(lengths) / NORMAL_95 if lengths else None
