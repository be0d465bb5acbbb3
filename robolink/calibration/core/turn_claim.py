"""What a turn test is compared with, and its verdict: plain values that a marker can keep."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Self

from robolink.model import from_fields, json_fields

CONTRADICTS_REPEATABILITY: Final = "proof_contradicts_repeatability"
CONTRADICTS_ACCURACY: Final = "proof_contradicts_accuracy"
SMALL_ANGLE: Final = "tested_at_small_angle"
REPEATED: Final = "turn_test_repeated"


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnClaim:
    """What a measurement predicts for its turn test (docs/reference/evidence.md 20).

    Attributes:
        look_sigma_mm: Standard deviation of one coordinate of one look.
        look_nu: Its degrees of freedom, ``None`` where it is taken as known.
        offset_sigma_mm: What scatter leaves of the offset, the worst length.
        headings_deg: U of the tool at each look of the measurement, in their order.
        inputs_per_look: How many of these together tell both coordinates once.
        finds_place: Whether the measurement found the place that it turns about.
        place_u_mm: Standard uncertainty of the place where it did not, without its growth by age.
        offset_u_mm: Standard uncertainty of the offset by rows that a turn shows.
        tilted_leverage: What the scatter of the measurement brings to each drift, as a multiple of
            the variance of one look, where the tool was tilted; ``None`` where ``headings_deg``
            tell it.
        mark_leverage: What it brings besides to a drift of a mark that is not in the middle of the
            tool, or is held to a table.
        mark_u_mm: Standard uncertainty of where on the tool the mark of each drift is: how
            fiducials are printed, how far a table misses between its rows.
        by_surface: Whether a surface is touched, so that each drift tells itself how sure it is.
        repeatable_mm: What the measurement says it is repeatable to, ``None`` for nothing.
        accurate_mm: What it says it is accurate to, ``None`` for nothing.
        by_camera: Whether the drift itself is seen through a camera whose scale, turn or mirror
            may be what is wrong.
        measures_z: Whether Z was measured, or its change.
    """

    look_sigma_mm: float
    look_nu: float | None = None
    offset_sigma_mm: float
    headings_deg: tuple[float, ...]
    inputs_per_look: int = 1
    finds_place: bool
    place_u_mm: float = 0.0
    offset_u_mm: float = 0.0
    tilted_leverage: float | None = None
    mark_leverage: float = 0.0
    mark_u_mm: float = 0.0
    by_surface: bool = False
    repeatable_mm: float | None = None
    accurate_mm: float | None = None
    by_camera: bool = False
    measures_z: bool = False


@dataclass(frozen=True, slots=True)
class DriftLimits:
    """The limits of one drift.

    Attributes:
        repeatable_mm: By scatter alone.
        accurate_mm: By scatter and all rows that turn into drift.
        turn_deg: How far the tool was turned from where it was measured.
    """

    repeatable_mm: float
    accurate_mm: float
    turn_deg: float


@dataclass(frozen=True, slots=True)
class TurnJudgement:
    """What the drifts of a turn test show about the statements of a measurement.

    Attributes:
        code: ``proof_contradicts_accuracy``, ``proof_contradicts_repeatability`` or empty.
        limits: What each drift may be, in their order.
        worst: Index of the drift that is furthest over its limit, or nearest to it.
        small_angle: Whether the tool was turned too little to call it tested.
        wider_mm: Within what of the truth the tip is by these drifts, never below what was said;
            ``None`` where no turn was large enough to tell.
        offers_wider: Whether that may be taken as a statement: not while the drifts were seen
            through what may be wrong itself.
        covered: Whether it is no more than what was said.
        tests: How often the test was made, the first of them contradicted; all looks count
            together.
        apart_mm: How far two looks at one angle lie apart where that is more than they scatter.
        shows_from_mm: The smallest shift of the tip in X, Y between measurement and test that this
            test shows in 95 %; ``None`` where it tells heights only, did not pass, or is on record
            from before this was told.
        shows_z_from_mm: The same of a shift in height; ``None`` also where Z was not measured.
        misses_z: Whether Z was measured and the test tells no height at all.
        accurate_mm: What the measurement said it is accurate to, ``None`` for nothing.
    """

    code: str
    limits: tuple[DriftLimits, ...]
    worst: int = 0
    small_angle: bool = False
    wider_mm: float | None = None
    offers_wider: bool = True
    covered: bool = False
    tests: int = 1
    apart_mm: float | None = None
    shows_from_mm: float | None = None
    shows_z_from_mm: float | None = None
    misses_z: bool = False
    accurate_mm: float | None = None

    @property
    def contradicts_accuracy(self) -> bool:
        """Whether the test contradicts what the result says it is accurate to."""
        return self.code == CONTRADICTS_ACCURACY

    @property
    def contradicts_repeatability(self) -> bool:
        """Whether the test contradicts only what the result says it is repeatable to."""
        return self.code == CONTRADICTS_REPEATABILITY

    @property
    def fails(self) -> bool:
        """Whether it fails until a person accepts a wider statement.

        What contradicts the repeatability alone, and is covered by the accuracy, is a doubt.
        """
        return bool(self.code) and not (self.contradicts_repeatability and self.covered)

    @property
    def good(self) -> bool:
        """Whether nothing was ever contradicted, and the turn was large enough to show it."""
        return not self.codes

    @property
    def codes(self) -> tuple[str, ...]:
        """Names of what is contradicted or doubtful."""
        named = (self.code, SMALL_ANGLE * self.small_angle, REPEATED * (self.tests > 1))
        return tuple(filter(None, named))

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Self:
        """Return what :meth:`as_json` wrote.

        Raises:
            KeyError, TypeError, ValueError: It is none.
        """
        later = {"tests": 1, "apart_mm": None, "shows_from_mm": None, "shows_z_from_mm": None}
        later |= {"misses_z": False, "accurate_mm": None}
        return from_fields(cls, {**later, **document, "code": document["code"] or ""})

    def as_json(self) -> dict[str, object]:
        """Return it as plain values."""
        return {**json_fields(self), "code": self.code or None}
