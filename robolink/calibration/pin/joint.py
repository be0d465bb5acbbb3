"""Several tools on one pin, or one tool on several pins, solved together.

Every touch says ``p + R t = P`` with the offset t of its tool and the place P of its pin.
Tools that share a pin share its error, so the differences between them are known better than
each alone; a tool may even have a single touch, if others find the pin
(docs/reference/calibration.md 2.1).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from robolink.calibration.core.dispersion import Dispersion
from robolink.calibration.core.least_squares import Floats, LinearFit, linear_fit
from robolink.calibration.core.pose_checks import (
    check_poses,
    components,
    refuses_by_name,
    require_poses,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.rotations import pose_arrays
from robolink.calibration.quality.doubts import PLANAR_TOLERANCE, TOUCH_TOLERANCE, Tolerance
from robolink.calibration.quality.fit_quality import judged
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import COMPONENTS, Pose, ToolOffset

MAX_CONDITION = 100.0


@dataclass(frozen=True, slots=True)
class JointTouch:
    """One touch: the flange pose (Tool 0), which tool, and which pin."""

    flange: Pose
    tool: int
    pin: int = 0


@dataclass(frozen=True, slots=True)
class ToolDifference:
    """Offset of one tool less that of another, in flange axes.

    Attributes:
        vector_mm: The difference.
        half_width95_mm: Half its 95 % interval by axis; empty when nothing tells the scatter.
    """

    vector_mm: tuple[float, ...]
    half_width95_mm: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class JointResult:
    """What touches of several tools or pins show together.

    Attributes:
        tools: A result for each tool; residuals and degrees of freedom are the common ones.
        pins_mm: Where the pins are, (x, y) or (x, y, z) in the base.
        covariance: Of all offsets, tool by tool in ascending order, mm^2; empty when nothing
            tells the scatter.
        factor95: What a standard deviation is multiplied by for half a 95 % interval.
    """

    tools: Mapping[int, CalibrationResult] = field(hash=False)
    pins_mm: Mapping[int, tuple[float, ...]] = field(hash=False)
    covariance: tuple[tuple[float, ...], ...]
    factor95: float | None

    def difference(self, tool: int, other: int) -> ToolDifference:
        """Return the difference between ``tool`` and ``other``; what they share cancels."""
        order = sorted(self.tools)
        measured = self.tools[tool].measured
        size = len(measured)
        vector = tuple(
            getattr(self.tools[tool].offset, name) - getattr(self.tools[other].offset, name)
            for name in measured
        )
        if self.factor95 is None:
            return ToolDifference(vector, ())
        c, a, b = self.covariance, order.index(tool) * size, order.index(other) * size
        variances = [
            c[a + k][a + k] + c[b + k][b + k] - c[a + k][b + k] - c[b + k][a + k]
            for k in range(size)
        ]
        factor = self.factor95
        return ToolDifference(vector, tuple(factor * math.sqrt(max(v, 0.0)) for v in variances))


@refuses_by_name
def solve_joint(
    touches: Sequence[JointTouch],
    *,
    stored: Mapping[int, ToolOffset] | None = None,
    sigma_mm: float | None = None,
    tolerance: Tolerance | None = None,
) -> JointResult:
    """Return the offsets of all tools and the places of all pins.

    X and Y are measured, and Z as well when poses are tilted.

    Args:
        touches: Tips on pins, mm and degrees.
        stored: The offsets stored now; what is not measured is kept from them.
        sigma_mm: Standard deviation of one coordinate of one placement, when it is known.
        tolerance: Residuals above which the results carry a warning.

    Raises:
        CalibrationError: ``too_few_poses``, ``rank_deficient``, ``insufficient_rotation``,
            ``implausible_offset``, and those of ``pose_checks.check_poses``.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import JointTouch, carrying, solve_joint
        >>> tips = {1: ToolOffset(12.5, -3.25, -20), 2: ToolOffset(-30, 8, -20)}
        >>> pins = {0: (300, 100, -80), 1: (250, 180, -80)}
        >>> touches = [
        ...     JointTouch(carrying(Pose(0, 0, 0, u_deg), tips[tool], pins[pin]), tool, pin)
        ...     for tool in tips
        ...     for pin in pins
        ...     for u_deg in (0, 120, 240)
        ... ]
        >>> found = solve_joint(touches)
        >>> round(found.tools[2].offset.x_mm, 3), round(found.tools[2].offset.y_mm, 3)
        (-30.0, 8.0)
    """
    poses = [touch.flange for touch in touches]
    require_poses(len(poses), 2)
    warnings = check_poses(poses, allow_mixed_hand=False)
    size = 3 if any(pose.v_deg or pose.w_deg for pose in poses) else 2
    tools = sorted({touch.tool for touch in touches})
    pins = sorted({touch.pin for touch in touches})
    require_poses(len(poses), len(tools) + len(pins))
    a, b = _system(touches, tools, pins, size)
    fit = linear_fit(a, b)
    _require_observable(fit, a.shape[1])
    unit = fit.unit_covariance[: len(tools) * size, : len(tools) * size]
    usual = TOUCH_TOLERANCE if size == 3 else PLANAR_TOLERANCE
    results = {}
    for index, tool in enumerate(tools):
        span = slice(index * size, (index + 1) * size)
        result = _result(
            poses,
            fit,
            dict(zip(COMPONENTS, fit.x[span].tolist(), strict=False)),
            float(unit.diagonal()[span].max()),
            warnings=warnings,
            stored=(stored or {}).get(tool),
        )
        results[tool] = judged(
            result,
            fit.residuals.reshape(-1, size),
            unit[span, span],
            unknowns=a.shape[1],
            sigma_mm=sigma_mm,
            tolerance=tolerance or usual,
        )
    places = fit.x[len(tools) * size :].reshape(-1, size).tolist()
    scatter = Dispersion.of(float(fit.residuals @ fit.residuals), len(b) - a.shape[1], sigma_mm)
    covariance = (unit * scatter.sigma_mm**2).tolist() if scatter else []
    return JointResult(
        tools=results,
        pins_mm=dict(zip(pins, map(tuple, places), strict=True)),
        covariance=tuple(map(tuple, covariance)),
        factor95=scatter.factor95 if scatter else None,
    )


def _system(
    touches: Sequence[JointTouch], tools: Sequence[int], pins: Sequence[int], size: int
) -> tuple[Floats, Floats]:
    positions, turned = pose_arrays([touch.flange for touch in touches])
    a = np.zeros((len(touches), size, (len(tools) + len(pins)) * size))
    for row, touch in enumerate(touches):
        tool, pin = tools.index(touch.tool), len(tools) + pins.index(touch.pin)
        a[row, :, tool * size : (tool + 1) * size] = turned[row, :size, :size]
        a[row, :, pin * size : (pin + 1) * size] = -np.eye(size)
    return a.reshape(-1, a.shape[2]), -positions[:, :size].ravel()


def _require_observable(fit: LinearFit, unknowns: int) -> None:
    if fit.rank < unknowns:
        raise CalibrationError(
            "rank_deficient",
            tr("The touches leave {count} numbers unknown.", count=unknowns - fit.rank),
            remedy=tr(
                "Turn at least one tool between touches of each pin, or let tools share pins."
            ),
        )
    if fit.condition_number > MAX_CONDITION:
        raise CalibrationError(
            "insufficient_rotation",
            tr(
                "The orientations differ too little (condition {condition:.0f}).",
                condition=fit.condition_number,
            ),
            remedy=tr("Turn the tools further between the touches."),
        )


def _result(
    poses: Sequence[Pose],
    fit: LinearFit,
    found: dict[str, float],
    variance: float,
    *,
    warnings: tuple[str, ...],
    stored: ToolOffset | None,
) -> CalibrationResult:
    return CalibrationResult(
        method="joint",
        **components(stored, **found),
        reference_point_mm=(),
        sigma_gain=math.sqrt(variance),
        warnings=warnings,
        inputs=tuple(poses),
        residuals_mm=tuple(map(tuple, (-fit.residuals).reshape(-1, len(found)).tolist())),
        condition_number=fit.condition_number,
        rank=fit.rank,
    )
