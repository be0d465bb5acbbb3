"""The limits of a program's measurement, whatever it measured with."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

if TYPE_CHECKING:
    from robolink.calibration import AccuracyFacts, CalibrationResult


MOST_POSES: Final = 64

_SAME_MM: Final = 0.002
"""Smallest distance between two poses, in mm; closer ones count as one pose sent twice."""


@dataclass(frozen=True, slots=True)
class CallbackLimits:
    """The limits of a program's measurement.

    Attributes:
        tolerance_mm: Largest drift about the new tip, and how far from the truth it may be in
            95 %, in mm.
        max_change_mm: Largest change of the offset that is believed, in mm.
        sigma_mm: Standard deviation of one coordinate of one touch, crossing or look, where it
            is known.

    Raises:
        ConfigError: One of them is not positive.
    """

    tolerance_mm: float = 0.1
    max_change_mm: float = 2.0
    sigma_mm: float | None = None

    def __post_init__(self) -> None:
        for name in ("tolerance_mm", "max_change_mm", "sigma_mm"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ConfigError(
                    tr("{name} is {value}, not positive.", name=name, value=value),
                    remedy=tr("Give {name} above 0.", name=name),
                )


def believed(
    result: "CalibrationResult",
    stored: ToolOffset,
    limits: CallbackLimits,
    facts: "AccuracyFacts",
) -> "CalibrationResult":
    """Return a result with its accuracy; refuse what nobody watching would catch.

    Args:
        result: What was measured.
        stored: The offset that stands.
        limits: What it is held to.
        facts: What the cell knows of the rows of its budget.

    Raises:
        CalibrationError: Its code says why not.
    """
    from robolink.calibration import assessed, update_guard, writes_refused_unattended

    result = assessed(result, facts)

    doubt = writes_refused_unattended(result)
    if doubt:
        raise CalibrationError(doubt, tr("What was measured contradicts itself."))
    _require_known(result, limits.tolerance_mm)
    update_guard(result.offset, stored=stored, max_change_mm=limits.max_change_mm)
    return result


def _require_known(result: "CalibrationResult", limit_mm: float) -> None:
    """Refuse an offset that may be further off than is allowed, or whose accuracy is unknown.

    Raises:
        CalibrationError: ``uncertain``, or ``not_judged``.
    """
    accuracy = result.accuracy
    if accuracy is None:
        raise CalibrationError("not_judged", tr("Nothing says how far off the tip may be."))
    if accuracy.within_mm > limit_mm:
        raise CalibrationError(
            "uncertain",
            tr(
                "The tip is accurate to {within:.3f} mm; the limit is {limit:g} mm. Largest "
                "row: {row}.",
                within=accuracy.within_mm,
                limit=limit_mm,
                row=accuracy.largest.title,
            ),
        )


def require_room(count: int) -> None:
    """Refuse one pose more than anybody needs.

    Raises:
        CalibrationError: ``too_many_poses``.
    """
    if count >= MOST_POSES:
        raise CalibrationError("too_many_poses", tr("There are too many poses."))


def require_poses_sent(count: int, least: int) -> None:
    """Make sure that there are enough.

    Raises:
        CalibrationError: ``too_few_poses``.
    """
    if count < least:
        raise CalibrationError(
            "too_few_poses", tr("{count} poses came; {least} are needed.", count=count, least=least)
        )


def require_own(poses: Sequence[Pose], used: Sequence[Pose]) -> None:
    """Refuse test poses that the measurement used: they would confirm nothing.

    Raises:
        CalibrationError: ``proof_is_a_copy``.
    """
    before = list(used)
    for pose in poses:
        if any(math.dist(pose.coordinates(), other.coordinates()) < _SAME_MM for other in before):
            raise CalibrationError(
                "proof_is_a_copy", tr("A pose of the turn test was sent before: it proves nothing.")
            )
        before.append(pose)
