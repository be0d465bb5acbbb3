"""Whether a new offset may replace the stored one.

A correction with the wrong sign makes the next one about twice as large, and the one after
that twice again; the classic bug of every home-made calibration
(docs/reference/calibration.md 2.9). It is caught here by comparing corrections, not by trusting the
sign.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from robolink.calibration.core.result import CalibrationResult
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import ToolOffset

NEEDLE_LIMIT_MM = 2.0
"""Largest plausible change by a new needle; 0.5 mm is usual for a nozzle
(docs/reference/calibration.md 2.9)."""

NOISE_MM = 0.05


TAKEN_AGAIN = ("step_in_run_order", "drift_in_run_order")
"""Doubts after which the touches have to be taken again (docs/reference/evidence.md 8)."""

BIRGE_LIMIT = 3.0
"""Residuals this many times larger than the stated sigma need somebody to look."""


def writes_refused_unattended(result: CalibrationResult) -> str:
    """Return the code of a doubt that only a person may pass over; empty without one.

    Something that moved while the touches were made leaves an offset between two truths, and
    nobody is there to take the run again.
    """
    for code in TAKEN_AGAIN:
        if code in result.warnings:
            return code
    ratio = result.evidence.birge_ratio if result.evidence is not None else None
    return "sigma_contradicted" if ratio is not None and ratio > BIRGE_LIMIT else ""


@dataclass(frozen=True, slots=True)
class Correction:
    """By how much a new offset differs from the stored one, mm in the flange's axes.

    ``ratio`` is its length over that of the correction before, ``None`` for the first.
    """

    dx_mm: float
    dy_mm: float
    dz_mm: float
    ratio: float | None

    @property
    def distance_mm(self) -> float:
        """Length of the correction."""
        return math.hypot(self.dx_mm, self.dy_mm, self.dz_mm)


def update_guard(
    new: ToolOffset,
    *,
    stored: ToolOffset,
    earlier_mm: Sequence[float] = (),
    max_change_mm: float = NEEDLE_LIMIT_MM,
    noise_mm: float = NOISE_MM,
) -> Correction:
    """Return the correction if it is plausible.

    Args:
        new: The offset that is proposed.
        stored: The offset that is in force.
        earlier_mm: Lengths of the corrections made since the tip was mounted, oldest first.
        max_change_mm: Largest change that is believed.
        noise_mm: Corrections up to this may grow: they only repeat the noise.

    Raises:
        CalibrationError: ``implausible_change`` or ``diverging``.

    Example:
        >>> from robolink import ToolOffset
        >>> from robolink.calibration import update_guard
        >>> found = update_guard(ToolOffset(12.3, -3.9, -20), stored=ToolOffset(12, -3.5, -20))
        >>> round(found.distance_mm, 3)
        0.5
    """
    changes = (new.x_mm - stored.x_mm, new.y_mm - stored.y_mm, new.z_mm - stored.z_mm)
    length = math.hypot(*changes)
    # Divergence first: at the end of it the change is implausible as well.
    require_shrinking(length, earlier_mm, noise_mm=noise_mm)
    if length > max_change_mm:
        raise CalibrationError(
            "implausible_change",
            tr(
                "The tip would move {change:.3f} mm; {limit:.3f} mm is allowed. Nothing was "
                "written.",
                change=length,
                limit=max_change_mm,
            ),
            remedy=tr("Is the right needle mounted, and tight? Then measure again."),
        )
    before = earlier_mm[-1] if earlier_mm else None
    return Correction(*changes, ratio=length / before if before else None)


def require_shrinking(
    now_mm: float, earlier_mm: Sequence[float], *, noise_mm: float = NOISE_MM
) -> None:
    """Refuse a correction that is larger than the one before it on the same nozzle.

    Args:
        now_mm: Length of the correction that is proposed.
        earlier_mm: Lengths of those made since the nozzle was mounted, oldest first.
        noise_mm: Corrections up to this may grow: they only repeat the noise.

    Raises:
        CalibrationError: ``diverging``.

    Example:
        >>> from robolink.calibration import require_shrinking
        >>> require_shrinking(0.1, earlier_mm=[0.4])
        >>> require_shrinking(0.04, earlier_mm=[0.01])  # less than what touches scatter
    """
    if not earlier_mm or now_mm <= max(earlier_mm[-1], noise_mm):
        return
    raise CalibrationError(
        "diverging",
        tr(
            "The correction grew from {before:.3f} mm to {now:.3f} mm.",
            now=now_mm,
            before=earlier_mm[-1],
        ),
        remedy=tr(
            "Do not write it. A growing correction has the wrong sign, axis or angle; check how "
            "the camera or the sensor is turned."
        ),
    )
