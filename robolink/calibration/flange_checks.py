"""What a method asks of poses whose place in the base counts, and of a height that it was told.

A pin, a beam, a camera or a board has its place in the base. A pose of a local coordinate system
or of another tool is no flange pose there, however well its numbers fit
(docs/reference/evidence.md 4).
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, TypeVar

from robolink.calibration.core.pose_checks import UPRIGHT_WITHIN_DEG
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import NORMAL_95, chi_square_quantile
from robolink.calibration.flange_plane import TipHeight
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose

_REGION: Final = math.sqrt(chi_square_quantile(0.95, 2))

ResultT = TypeVar("ResultT", bound=CalibrationResult)


def require_flange_in_base(poses: Sequence[Pose]) -> None:
    """Refuse poses that are not of the flange, or not in the base.

    A pose that does not say which tool it is of is taken for one of the flange.

    Raises:
        CalibrationError: ``tool_pose`` or ``local_pose``.
    """
    for pose in poses:
        if pose.tool:
            raise CalibrationError(
                "tool_pose",
                tr("These are positions of Tool {tool}, not of the flange.", tool=pose.tool),
                remedy=tr("Give the value of Tool {tool}, or take them in Tool 0.", tool=pose.tool),
            )
        if pose.local:
            raise CalibrationError(
                "local_pose",
                tr(
                    "These positions are in Local {local}; they are compared with "
                    "positions in the base.",
                    local=pose.local,
                ),
                remedy=tr("Say where Local {local} is, or take them in Local 0.", local=pose.local),
            )


def with_height_error(
    result: ResultT, per_mm: tuple[float, float], height: TipHeight | None
) -> ResultT:
    """Return a result whose X and Y carry what the tip's height is unsure by.

    Args:
        result: With X and Y as its first two measured components.
        per_mm: By how much they change for 1 mm of height; as long as the tangent of the lean.
        height: What the height was solved with. Without a standard deviation nothing is added, and
            where the flange leans the result notes ``height_not_assessed``.
    """
    if height is None or math.hypot(*per_mm) < math.tan(math.radians(UPRIGHT_WITHIN_DEG)):
        return result
    if height.sigma_mm is None:
        return replace(result, notes=(*result.notes, "height_not_assessed"))
    if not result.covariance:
        return result
    errors = tuple(rate * height.sigma_mm for rate in per_mm)
    rows = [list(row) for row in result.covariance]
    for i, one in enumerate(errors):
        for j, other in enumerate(errors):
            rows[i][j] += one * other
    halves = list(result.half_width95)
    for i, error in enumerate(errors):
        halves[i] = (halves[i] ** 2 + (NORMAL_95 * error) ** 2) ** 0.5
    region_mm = result.region95_radius_mm
    if region_mm is not None:
        # At most: the two ellipses need not point the same way.
        region_mm = math.hypot(region_mm, _REGION * math.hypot(*errors))
    return replace(
        result,
        covariance=tuple(map(tuple, rows)),
        half_width95=tuple(halves),
        region95_radius_mm=region_mm,
    )
