"""When an outlier search is believed (docs/reference/evidence.md 10)."""

from dataclasses import replace
from typing import Final, TypeVar

import numpy as np

from robolink.calibration.core.evidence import FitEvidence
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.robust import Mask
from robolink.errors import CalibrationError
from robolink.messages import tr

UNSTABLE_BEYOND: Final = 0.1
"""Robust results further apart than this part of the half interval are not believed."""

ResultT = TypeVar("ResultT", bound=CalibrationResult)


def with_consensus(result: ResultT, kept: Mask, spread_mm: float) -> ResultT:
    """Return a robust ``result`` with its consensus, or refuse one that the draws decided.

    Args:
        result: The solution with its interval.
        kept: The poses that agree.
        spread_mm: How far the results of different draws lie apart.

    Raises:
        CalibrationError: ``robust_unstable``.
    """
    half_mm = result.half95_mm
    if spread_mm > UNSTABLE_BEYOND * (half_mm or 0.0):
        raise CalibrationError(
            "robust_unstable",
            tr(
                "Chance decides which poses are left out: the results differ by {apart:.3f} mm.",
                apart=spread_mm,
            ),
            remedy=tr("Take more poses, or state how large an outlier is."),
        )
    count = int(np.count_nonzero(kept))
    evidence = replace(result.evidence or FitEvidence(), consensus=count, seed_spread_mm=spread_mm)
    return replace(result, evidence=evidence)


def require_robust_poses(count: int, minimum: int) -> None:
    """Refuse an outlier search among too few poses.

    Raises:
        CalibrationError: ``robust_too_few``.
    """
    if count < minimum:
        raise CalibrationError(
            "robust_too_few",
            tr(
                "An outlier cannot be found among {count} poses; it takes {minimum}.",
                count=count,
                minimum=minimum,
            ),
            remedy=tr("Take more poses, or solve them without a search for outliers."),
        )
