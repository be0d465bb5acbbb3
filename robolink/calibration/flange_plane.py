"""X and Y of a tip under a flange that leans, or is upside down as is usual on six axes.

With A the upper left 2 x 2 part of R = Rz(U) Ry(V) Rx(W) and c = (R13, R23), a point t of the
flange's axes lies at ``p + A (t_x, t_y) + c t_z`` in X and Y of the base. A can be inverted
unless the flange lies on its side, for det A = R33 = cos V cos W. With V = W = 0 it is Rz(U); at
W = 180 it is Rz(U) with its second column reversed, and c is 0: the sign of the tool's Y flips
(docs/reference/evidence.md 3).

What a method asks of poses whose place in the base counts, and of a height that it was told.

A pin, a beam, a camera or a board has its place in the base. A pose of a local coordinate system
or of another tool is no flange pose there, however well its numbers fit
(docs/reference/evidence.md 4).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, TypeVar

from robolink.calibration.core.pose_checks import UPRIGHT_WITHIN_DEG, refuses_by_name
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import NORMAL_95, chi_square_quantile
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

LARGEST_LEAN_DEG = 10.0
"""Largest lean; above it, more than a sixth of an error in the tip's height reaches X and Y."""


@dataclass(frozen=True, slots=True)
class TipHeight:
    """Z of a tip in the flange's axes, known before X and Y are measured.

    Attributes:
        z_mm: The Z.
        sigma_mm: Its standard deviation, ``None`` where nobody knows it.
    """

    z_mm: float
    sigma_mm: float | None = None


@dataclass(frozen=True, slots=True)
class FlangePlane:
    """How X and Y of the flange's axes lie in X and Y of the base, at one pose.

    Attributes:
        columns: The columns of A: where the flange's X and Y axis point.
        axis: c, where the flange's Z axis points; its length is the sine of the lean.
        level: R31 and R32: how fast the height changes along the flange's X and Y axis.
        r33: det A: 1 for an upright flange, -1 for one upside down.
    """

    columns: tuple[tuple[float, float], tuple[float, float]]
    axis: tuple[float, float]
    level: tuple[float, float]
    r33: float

    @classmethod
    def of(cls, pose: Pose) -> "FlangePlane":
        """Return that of a flange pose."""
        return _turned(pose.u_deg, pose.v_deg, pose.w_deg)

    @property
    def lean_deg(self) -> float:
        """Angle between the flange's axis and the vertical, 0 to 90, up or down."""
        return math.degrees(math.atan2(math.hypot(*self.axis), abs(self.r33)))

    @property
    def heading_deg(self) -> float:
        """The U of an upright flange, or of one upside down, that is turned alike."""
        (xx, yx), (xy, yy) = self.columns
        sign = math.copysign(1.0, self.r33)
        return math.degrees(math.atan2(yx - sign * xy, xx + sign * yy))

    def in_flange(self, dx_mm: float, dy_mm: float, z_mm: float = 0.0) -> tuple[float, float]:
        """Return (t_x, t_y) of what lies ``dx_mm, dy_mm`` from the flange, at ``z_mm`` of its Z.

        Args:
            dx_mm: X of the place in the base, less that of the flange.
            dy_mm: Y likewise.
            z_mm: Z of the place in the axes of the flange; counts where the flange leans.

        Example:
            >>> from robolink import Pose
            >>> from robolink.calibration import FlangePlane
            >>> plane = FlangePlane.of(Pose(300, 100, -60, 90))
            >>> [round(value, 3) for value in plane.in_flange(3.5, 12)]
            [12.0, -3.5]
        """
        (xx, yx), (xy, yy) = self.columns
        dx, dy = dx_mm - self.axis[0] * z_mm, dy_mm - self.axis[1] * z_mm
        return (yy * dx - xy * dy) / self.r33, (xx * dy - yx * dx) / self.r33

    def in_base(self, x_mm: float, y_mm: float, z_mm: float = 0.0) -> tuple[float, float]:
        """Return how far from the flange, in X and Y of the base, a point of its axes lies.

        Args:
            x_mm: X of the point in the axes of the flange.
            y_mm: Y likewise.
            z_mm: Z likewise; counts where the flange leans.

        Example:
            >>> from robolink import Pose
            >>> from robolink.calibration import FlangePlane
            >>> plane = FlangePlane.of(Pose(300, 100, -60, 90))
            >>> [round(value, 3) for value in plane.in_base(12, -3.5)]
            [3.5, 12.0]
        """
        (xx, yx), (xy, yy) = self.columns
        cx, cy = self.axis
        return xx * x_mm + xy * y_mm + cx * z_mm, yx * x_mm + yy * y_mm + cy * z_mm

    def rise_mm(self, tip: ToolOffset) -> float:
        """Return how far above the flange, in the base, a point of its axes lies."""
        return self.level[0] * tip.x_mm + self.level[1] * tip.y_mm + self.r33 * tip.z_mm


@lru_cache(maxsize=256)
def _turned(u_deg: float, v_deg: float, w_deg: float) -> FlangePlane:
    """Return the plane at these angles; a solver asks for those of its poses again and again."""
    u, v, w = (math.radians(a) for a in (u_deg, v_deg, w_deg))
    cu, su, cv, sv, cw, sw = (f(a) for a in (u, v, w) for f in (math.cos, math.sin))
    return FlangePlane(
        columns=((cu * cv, su * cv), (cu * sv * sw - su * cw, su * sv * sw + cu * cw)),
        axis=(cu * sv * cw + su * sw, su * sv * cw - cu * sw),
        level=(-sv, cv * sw),
        r33=cv * cw,
    )


@refuses_by_name
def carrying(frame: Pose, tip: ToolOffset, place_mm: tuple[float, float, float]) -> Pose:
    """Return where a frame is when the point ``tip`` in its axes is at a place of the base.

    Args:
        frame: Its angles, hand, local and tool.
        tip: X, Y and Z count.
        place_mm: The place.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import carrying
        >>> flange = carrying(Pose(0, 0, 0, 90), ToolOffset(12, -3.5, -20), (300, 100, -80))
        >>> round(flange.x_mm, 3), round(flange.y_mm, 3), round(flange.z_mm, 3), flange.u_deg
        (296.5, 88.0, -60.0, 90)
    """
    plane = FlangePlane.of(frame)
    dx, dy = plane.in_base(tip.x_mm, tip.y_mm, tip.z_mm)
    x_mm, y_mm, z_mm = place_mm
    return replace(frame, x_mm=x_mm - dx, y_mm=y_mm - dy, z_mm=z_mm - plane.rise_mm(tip))


def height_of(stored: ToolOffset | None, given: TipHeight | None = None) -> TipHeight | None:
    """Return the known Z of a tip: as given, else as stored."""
    if given is not None or stored is None:
        return given
    return TipHeight(stored.z_mm)


def solvable_planes(poses: Sequence[Pose], height: TipHeight | None) -> list[FlangePlane]:
    """Return the plane of every pose, where X and Y of a tip can be solved from them.

    Raises:
        CalibrationError: ``tilted_pose``: a flange leans by more than 10 degrees; it leans and
            the tip's height is unknown; or some hang upside down and others do not.
    """
    planes = [FlangePlane.of(pose) for pose in poses]
    for number, plane in enumerate(planes, start=1):
        if plane.lean_deg > LARGEST_LEAN_DEG:
            raise _tilted(number, plane, tr("The limit is {limit:g}.", limit=LARGEST_LEAN_DEG))
        if plane.lean_deg > UPRIGHT_WITHIN_DEG and height is None:
            raise _tilted(number, plane, tr("The height of the tip is not known."))
    if len({plane.r33 > 0 for plane in planes}) > 1:
        raise CalibrationError(
            "tilted_pose",
            tr("Some poses have the flange upright, others upside down."),
            remedy=tr("Record all of them with the flange the same way up."),
        )
    return planes


def known_z_mm(height: TipHeight | None) -> float:
    """Return the Z to solve with: 0 if unknown, which only upright flanges allow."""
    return 0.0 if height is None else height.z_mm


def standing_upright(poses: Sequence[Pose]) -> list[Pose]:
    """Return poses of one way up as upright ones, each turned as its flange is.

    Raises:
        CalibrationError: ``tilted_pose``: one leans, or some are upside down and others are not.
    """
    planes = solvable_planes(poses, None)
    return [
        pose
        if (pose.v_deg, pose.w_deg) == (0.0, 0.0)
        else replace(pose, u_deg=plane.heading_deg, v_deg=0.0, w_deg=0.0)
        for pose, plane in zip(poses, planes, strict=True)
    ]


def _tilted(number: int, plane: FlangePlane, why: str) -> CalibrationError:
    return CalibrationError(
        "tilted_pose",
        tr(
            "In pose {number} the flange leans by {lean:.2f} degrees. {why}",
            number=number,
            lean=plane.lean_deg,
            why=why,
        ),
        remedy=tr(
            "Hold the flange upright or straight upside down, or use the pivot method, which "
            "measures Z as well."
        ),
    )


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
                remedy=tr(
                    "State the value of Tool {tool}, or record the poses in Tool 0.", tool=pose.tool
                ),
            )
        if pose.local:
            raise CalibrationError(
                "local_pose",
                tr(
                    "These positions are in Local {local}, but must be compared with "
                    "positions in the base.",
                    local=pose.local,
                ),
                remedy=tr(
                    "State where Local {local} is, or record the positions in Local 0.",
                    local=pose.local,
                ),
            )


def with_height_error(
    result: ResultT, per_mm: tuple[float, float], height: TipHeight | None
) -> ResultT:
    """Return a result whose X and Y include the uncertainty of the tip's height.

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
        # An upper bound: the two ellipses need not point the same way.
        region_mm = math.hypot(region_mm, _REGION * math.hypot(*errors))
    return replace(
        result,
        covariance=tuple(map(tuple, rows)),
        half_width95=tuple(halves),
        region95_radius_mm=region_mm,
    )
