"""A whole tool frame: the tip by a pivot, the orientation by two more points.

After the pivot the tool is moved, without turning, along its own X and then along its own Z
(or anywhere in its XZ plane). The ways of the flange, seen from the flange, are the axes
(docs/reference/calibration.md 2.4).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from robolink.calibration.core.dispersion import require_positive
from robolink.calibration.core.least_squares import Floats, sensitivity
from robolink.calibration.core.pose_checks import check_poses, keep_unmeasured, refuses_by_name
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.rotations import pose_arrays, rotation_of, uvw_deg
from robolink.calibration.pin.pivot import UNKNOWNS, fit_pivot, pivot_design, solve_pivot
from robolink.calibration.quality.doubts import TOUCH_TOLERANCE, Tolerance
from robolink.calibration.quality.fit_quality import judged
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

LEAST_WAY_MM: Final = 5.0
"""Shortest move, in mm, that shows a direction."""

GOOD_WAY_MM: Final = 50.0
"""Length of a good move, in mm: with 0.01 mm of scatter at both ends it shows an axis to 0.02
degrees."""

_TURNED_DEG: Final = 0.01


@refuses_by_name
def axis_displacement(start: Pose, end: Pose, *, wanted_mm: float | None = None) -> Floats:
    """Return the movement of the flange in its own axes, mm.

    Args:
        start: Flange pose at its start.
        end: Flange pose at its end.
        wanted_mm: How long it was to be, ``None`` for long enough to show a direction at all.

    Raises:
        CalibrationError: ``turned_on_the_way``, ``short_axis``.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import axis_displacement
        >>> way = axis_displacement(Pose(300, 100, -60, 90), Pose(300, 150, -60, 90))
        >>> [round(float(part), 3) for part in way]
        [50.0, 0.0, 0.0]
    """
    require_unturned(start, end)
    way: Floats = rotation_of(start).T @ np.subtract(end.coordinates()[:3], start.coordinates()[:3])
    if float(np.linalg.norm(way)) < (wanted_mm or LEAST_WAY_MM):
        raise CalibrationError(
            "short_axis",
            tr("The move along the axis is {way:.2f} mm long.", way=float(np.linalg.norm(way))),
            remedy=tr(
                "Move {least:g} mm or more; the longer the move, the better the "
                "direction is known.",
                least=wanted_mm or GOOD_WAY_MM,
            ),
        )
    return way


def require_unturned(start: Pose, end: Pose) -> None:
    """Refuse a movement during which the tool turned.

    Raises:
        CalibrationError: ``turned_on_the_way``.
    """
    # Half of the Frobenius norm of R1 - R2 is sqrt(2) sin(angle / 2).
    off = float(np.linalg.norm(rotation_of(start) - rotation_of(end)))
    if off > math.sqrt(2) * math.radians(_TURNED_DEG):
        raise CalibrationError(
            "turned_on_the_way",
            tr("The tool turned during the move that shows its axis."),
            remedy=tr("Keep the orientation from the start of the move."),
        )


def between_deg(one: Floats, other: Floats) -> float:
    """Return the angle between two vectors."""
    cosine = float(one @ other / (np.linalg.norm(one) * np.linalg.norm(other)))
    return math.degrees(math.acos(min(1.0, max(-1.0, cosine))))


MOST_OFF_SQUARE_DEG = 2.0
"""Largest deviation of the raw axes from a right angle (docs/reference/calibration.md 2.4)."""

FAR_DEG = 45.0
"""Largest angle between a move and its stored axis; beyond it the move is closer to another axis.
"""

_MOST_ASKEW = 2.0
"""Largest deviation of the moves from a right angle, in half widths of its 95 % interval."""

_LEAST_ASKEW_DEG = 0.001
"""Smallest deviation that raises a doubt: the last digit that a controller prints."""

_START = -3
"""Index of the pose where both moves start; the last two poses are their ends."""

_MEASURED = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")


@dataclass(frozen=True, slots=True, kw_only=True)
class SixPointResult(CalibrationResult):
    """A whole tool frame.

    Attributes:
        off_square_deg: By how much the two raw axes missed a right angle; ``None`` when the
            second one only had to lie in the XZ plane.
    """

    off_square_deg: float | None

    def details(self) -> dict[str, object]:
        """Return what the movements show besides the frame."""
        return {"off_square_deg": self.off_square_deg}


@dataclass(frozen=True, slots=True)
class ToolAxis:
    """Direction of one axis of the tool, from two touches along it.

    Attributes:
        direction: Unit vector in the flange's axes.
        sigma_deg: Standard deviation of its direction across, ``None`` without a stated sigma.
    """

    direction: tuple[float, float, float]
    sigma_deg: float | None

    @property
    def tilt_deg(self) -> float:
        """Angle between this axis and the flange's Z."""
        x, y, z = self.direction
        return math.degrees(math.atan2(math.hypot(x, y), z))


@refuses_by_name
def solve_six_point(
    pivot_poses: Sequence[Pose],
    along_x: Pose,
    second: Pose,
    *,
    start: Pose | None = None,
    second_is: Literal["z", "xz"] = "z",
    stored: ToolOffset | None = None,
    sigma_mm: float | None = None,
    tolerance: Tolerance = TOUCH_TOLERANCE,
) -> SixPointResult:
    """Return position and orientation of a tool.

    Args:
        pivot_poses: Flange poses (Tool 0) with the tip on one point, at least three.
        along_x: Flange pose after a way along the tool's +X, not turned.
        second: Flange pose after a way from the same start, not turned.
        start: Flange pose at which both ways start, anywhere; ``None`` for the last pivot pose.
        second_is: ``z``: along the tool's +Z; ``xz``: in its XZ plane, on the side of +Z.
        stored: The offset stored now. An orientation far from its own is doubted, with
            ``turned_from_stored``: where a way went along another axis nothing else shows it.
        sigma_mm: Standard deviation of one coordinate of one placement, when it is known. Ways
            that are less square than it, or the scatter of the touches, explains are doubted,
            with ``ways_askew``.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: ``short_axis``, ``axes_not_square``, ``turned_on_the_way``, and
            those of :func:`solve_pivot`.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import carrying, solve_six_point
        >>> tip, pin_mm = ToolOffset(12.5, -3.25, 80), (300, 100, -80)
        >>> angles = [(90, 20, 180), (180, 0, 160), (-90, -20, 180), (0, 0, 180)]
        >>> poses = [carrying(Pose(0, 0, 0, *uvw), tip, pin_mm) for uvw in angles]
        >>> along_x = carrying(Pose(0, 0, 0, 0, 0, 180), tip, (350, 100, -80))  # Z points down
        >>> along_z = carrying(Pose(0, 0, 0, 0, 0, 180), tip, (300, 100, -130))
        >>> found = solve_six_point(poses, along_x, along_z)
        >>> [round(value, 3) + 0.0 for value in (found.offset.z_mm, found.offset.u_deg)]
        [80.0, 0.0]
    """
    pivot = solve_pivot(pivot_poses, tolerance=tolerance)
    ways = (along_x, second) if start is None else (start, along_x, second)
    poses = (*pivot_poses, *ways)
    check_poses(poses, allow_mixed_hand=False)
    begun = poses[_START]
    x_axis, second_axis = axis_displacement(begun, along_x), axis_displacement(begun, second)
    off = None if second_is == "xz" else 90.0 - between_deg(x_axis, second_axis)
    if off is not None and abs(off) > MOST_OFF_SQUARE_DEG:
        raise CalibrationError(
            "axes_not_square",
            tr("The moves along X and Z are {angle:.1f} degrees off a right angle.", angle=off),
            remedy=tr("Move along the tool's own axes; start both moves at the same pose."),
        )
    frame = _frame(x_axis, second_axis, square=second_is == "xz")
    u, v, w = uvw_deg(frame)
    positions, turned = pose_arrays(poses)
    touches = len(pivot_poses)
    unit = _unit_covariance(positions, turned, frame, touches=touches, square=second_is == "xz")
    result = SixPointResult(
        method="six-point",
        offset=keep_unmeasured(pivot.offset, u_deg=u, v_deg=v, w_deg=w),
        measured=_MEASURED,
        kept=(),
        reference_point_mm=pivot.reference_point_mm,
        sigma_gain=pivot.sigma_gain,
        warnings=(
            *(doubt for doubt in pivot.warnings if not doubt.startswith("large_")),
            *_far_from(stored, frame),
        ),
        inputs=poses,
        residuals_mm=pivot.residuals_mm,
        condition_number=pivot.condition_number,
        rank=pivot.rank,
        sources=pivot.sources,
        off_square_deg=off,
    )
    result = judged(
        result,
        np.array(pivot.residuals_mm),
        unit,
        unknowns=UNKNOWNS,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
    )
    return _doubted(result, (x_axis, second_axis))


@refuses_by_name
def solve_tool_axis(first: Pose, second: Pose, *, sigma_mm: float | None = None) -> ToolAxis:
    """Return the direction of a tool axis along which the tip went from ``first`` to ``second``.

    Args:
        first: Flange pose (Tool 0) at the start.
        second: Flange pose at the end of the way, not turned.
        sigma_mm: Standard deviation of one coordinate of one placement.

    Raises:
        CalibrationError: ``short_axis``, ``turned_on_the_way``, and those of
            ``pose_checks.check_poses``.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import solve_tool_axis
        >>> axis = solve_tool_axis(Pose(300, 100, -60, 90), Pose(300, 150, -60, 90))
        >>> [round(float(part), 3) for part in axis.direction]
        [1.0, 0.0, 0.0]
    """
    check_poses((first, second), allow_mixed_hand=False)
    way = axis_displacement(first, second)
    length = float(np.linalg.norm(way))
    x, y, z = (way / length).tolist()
    if sigma_mm is None:
        return ToolAxis((x, y, z), None)
    require_positive(sigma_mm, "sigma_mm")
    return ToolAxis((x, y, z), math.degrees(math.sqrt(2) * sigma_mm / length))


def _frame(x_axis: Floats, second: Floats, *, square: bool) -> Floats:
    """Return the rotation nearest to the measured axes, or with X exact when ``square``."""
    x = x_axis / np.linalg.norm(x_axis)
    z = second / np.linalg.norm(second)
    if square:
        z = z - (z @ x) * x
        z = z / np.linalg.norm(z)
    y = _cross(z, x)
    u, _, v = np.linalg.svd(np.column_stack((x, y / np.linalg.norm(y), z)))
    frame: Floats = u @ v
    return frame


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross product; numpy's own takes ten times as long for one pair."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))


def _doubted(result: SixPointResult, ways: tuple[Floats, Floats]) -> SixPointResult:
    """Return the result, with ``ways_askew`` where the touches do not explain the angle.

    Both ends of both ways err by sigma across, and the ways share a start at which their errors
    are square to each other: var = 2 sigma^2 (1 / a^2 + 1 / b^2).
    """
    off, sigma_mm = result.off_square_deg, result.sigma_mm
    if off is None or abs(off) < _LEAST_ASKEW_DEG or not sigma_mm:
        return result
    lengths = np.linalg.norm(ways, axis=1)
    sigma_deg = math.degrees(sigma_mm * math.sqrt(2 * float((1 / lengths**2).sum())))
    half_widths = result.half_width95[0] / math.sqrt(result.covariance[0][0])
    if abs(off) <= _MOST_ASKEW * half_widths * sigma_deg:
        return result
    return replace(result, warnings=(*result.warnings, "ways_askew"))


def _far_from(stored: ToolOffset | None, frame: Floats) -> Iterator[str]:
    """Yield the doubt that one axis was confused with another."""
    if stored is None:
        return
    before = rotation_of(Pose(0.0, 0.0, 0.0, *stored.components()[3:]))
    if any(between_deg(before[:, axis], frame[:, axis]) > FAR_DEG for axis in range(3)):
        yield "turned_from_stored"


def _unit_covariance(
    positions: Floats, turned: Floats, frame: Floats, *, touches: int, square: bool
) -> Floats:
    """Return the covariance of x, y, z and of small changes of u, v, w, for sigma = 1 mm.

    Numeric, because one pose serves both axes, and the tip too where the ways start at the pin.
    """
    condition = pivot_design(turned[:touches]).condition_number
    start_turn = turned[_START].T
    around = np.array(uvw_deg(frame))

    def tip(p: Floats) -> Floats:
        return fit_pivot(p, turned[:touches], condition_number=condition).tip

    def angles(p: Floats) -> Floats:
        start, along_x, second = p
        ways = (start_turn @ (along_x - start), start_turn @ (second - start))
        # Centred on zero, away from the jump at 180 degrees.
        turns: Floats = (np.array(uvw_deg(_frame(*ways, square=square))) - around + 180.0) % 360.0
        return turns - 180.0

    derivative = np.zeros((positions.size, len(_MEASURED)))
    derivative[: 3 * touches, :3] = sensitivity(tip, positions[:touches])
    derivative[3 * _START :, 3:] = sensitivity(angles, positions[_START:])
    unit: Floats = derivative.T @ derivative
    return unit
