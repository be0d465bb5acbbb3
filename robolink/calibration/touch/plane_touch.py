"""X, Y and Z of a tip that touched one plane in several orientations and places.

``n (p_i + R_i t) = d`` with the plane's normal n and distance d. Nothing but a flat surface is
needed, and it need not be level. Touches at different places tell n; tilts tell X and Y of the
tip; Z is told from d only by how much the height of a tilted tip differs, 1 - cos(tilt), so it is
known ten times worse unless the plane is known (docs/reference/calibration.md 2.13).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robolink.calibration.core.least_squares import Floats, LinearFit, linear_fit
from robolink.calibration.core.pose_checks import refuses_by_name
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.rotations import pose_arrays
from robolink.calibration.quality.doubts import Tolerance
from robolink.calibration.touch.surface_fit import (
    SURFACE_TOLERANCE,
    distinct_touches,
    never_settled,
    refined,
    require_told_apart,
    square_sum,
    tip_result,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, json_fields

LEAST_TOUCHES = 7
"""Smallest number of touches: there are six unknowns, and six touches may fit in more than one way.
"""

LEAST_ON_A_KNOWN_PLANE = 4

_UNKNOWNS = 6

_STARTS = 5
"""Number of starting directions, of thirteen, that are refined: those that fit best."""

_SAME_TIP_MM = 0.01

_AS_GOOD = 4.0
"""A second solution counts too if its sum of squares is less than this times the best one."""


@dataclass(frozen=True, slots=True)
class TouchedPlane:
    """A flat surface in the base: its unit normal, and its distance from the origin along it."""

    normal: tuple[float, float, float]
    distance_mm: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaneTouchResult(CalibrationResult):
    """A tip, and the plane that it touched."""

    plane: TouchedPlane

    @property
    def by_surface(self) -> bool:
        """A plane was touched."""
        return True

    def details(self) -> dict[str, object]:
        """Return the plane."""
        return {"plane": json_fields(self.plane, "normal", "distance_mm")}


@dataclass(frozen=True, slots=True)
class _State:
    tip: Floats
    normal: Floats
    distance: float


@refuses_by_name
def solve_plane_touch(
    poses: Sequence[Pose],
    *,
    stored: ToolOffset | None = None,
    plane: TouchedPlane | None = None,
    sigma_mm: float | None = None,
    tolerance: Tolerance = SURFACE_TOLERANCE,
) -> PlaneTouchResult:
    """Return X, Y and Z of a tip that touched a plane.

    Args:
        poses: Flange poses (Tool 0) at the touches: at least seven, spread over the plane, turned
            and tilted to several sides, some upright; four where the plane is known.
        stored: The offset stored now; U, V and W are kept from it, or 0 without one.
        plane: Where the plane is, if that is known; Z is known ten times better then.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: ``too_few_poses``, ``rank_deficient``, ``insufficient_rotation``,
            ``ambiguous_tip``, ``diverging``, ``implausible_offset``, ``tool_pose``,
            ``local_pose``, and those of ``pose_checks.check_poses``.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import TouchedPlane, carrying, solve_plane_touch
        >>> tip, plane = ToolOffset(12.5, -3.25, 80), TouchedPlane((0, 0, 1), -80)
        >>> angles = [(0, 0, 180), (90, 20, 180), (180, 0, 160), (-90, -20, 180), (0, 20, 180)]
        >>> poses = [
        ...     carrying(Pose(0, 0, 0, *uvw), tip, (300 + 7 * at, 100 - at * at, -80))
        ...     for at, uvw in enumerate(angles)
        ... ]
        >>> found = solve_plane_touch(poses, plane=plane)
        >>> [round(value, 3) for value in (found.offset.x_mm, found.offset.y_mm, found.offset.z_mm)]
        [12.5, -3.25, 80.0]
    """
    poses, warnings = distinct_touches(poses, LEAST_ON_A_KNOWN_PLANE if plane else LEAST_TOUCHES)
    p, r = pose_arrays(poses)
    if plane is None:
        state, fit = _found(p, r)
    else:
        state, fit = _on_known(p, r, plane)
    unknowns = 3 if plane else _UNKNOWNS
    remedy = tr(
        "Tilt the tool to several sides, by 20 degrees or more, touch upright too, and spread "
        "the touches over the plane."
    )
    require_told_apart(fit, unknowns, remedy)
    x, y, z = state.normal.tolist()
    return tip_result(
        PlaneTouchResult,
        "plane-touch",
        poses,
        stored=stored,
        tip_mm=state.tip,
        fit=fit,
        across=state.normal,
        unknowns=unknowns,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
        warnings=warnings,
        plane=TouchedPlane((x, y, z), state.distance),
    )


def plane_columns(
    poses: Sequence[Pose], tip: ToolOffset, normal: tuple[float, float, float]
) -> Floats:
    """Return the derivatives of the tip's distance from a plane, one row a pose.

    Columns: X, Y and Z of the tip in the flange, the two leanings of the normal about the middle
    of the places (mm), the plane's distance.

    Args:
        poses: Flange poses.
        tip: About where the tip is.
        normal: About how the plane lies; of any length.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import plane_columns
        >>> upright = [Pose(300, 100, -60, 0), Pose(340, 100, -60, 90)]
        >>> columns = plane_columns(upright, ToolOffset(12, -3.5, -20), (0, 0, 1))
        >>> columns.shape
        (2, 6)
        >>> [float(value) for value in columns[0, :3]]  # upright, only Z of the tip counts
        [0.0, 0.0, 1.0]
    """
    p, r = pose_arrays(poses)
    unit = np.array(normal) / math.hypot(*normal)
    return _columns(r, p + r @ np.array(tip.components()[:3]), unit)


def _columns(r: Floats, places: Floats, normal: Floats) -> Floats:
    return np.column_stack(
        (
            np.einsum("nij,i->nj", r, normal),
            (places - places.mean(axis=0)) @ _tangents(normal),
            -np.ones(len(r)),
        )
    )


def _on_known(p: Floats, r: Floats, plane: TouchedPlane) -> tuple[_State, LinearFit]:
    length = math.hypot(*plane.normal)
    normal = np.array(plane.normal) / length
    fit = linear_fit(np.einsum("nij,i->nj", r, normal), plane.distance_mm / length - p @ normal)
    return _State(fit.x, normal, plane.distance_mm / length), fit


def _found(p: Floats, r: Floats) -> tuple[_State, LinearFit]:
    """Return the best of what Gauss-Newton finds from normals all round.

    Raises:
        CalibrationError: ``diverging``, or ``ambiguous_tip``: another tip fits as well.
    """

    def linear(state: _State) -> tuple[Floats, Floats]:
        places = p + r @ state.tip
        return _columns(r, places, state.normal), places @ state.normal - state.distance

    def stepped(state: _State, by: Floats) -> _State:
        middle = (p + r @ state.tip).mean(axis=0)
        turned = state.normal + _tangents(state.normal) @ by[3:5]
        normal = turned / np.linalg.norm(turned)
        # The distance refers to the middle of the places, about which the normal turns.
        distance = state.distance + by[5] + float((normal - state.normal) @ middle)
        return _State(state.tip + by[:3], normal, distance)

    starts = sorted((_start(p, r, normal) for normal in _directions()), key=lambda one: one[0])
    found = [refined(state, linear, stepped) for _, state in starts[:_STARTS]]
    settled = sorted((one for one in found if one is not None), key=square_sum)
    if not settled:
        raise never_settled()
    best = settled[0]
    for other in settled[1:]:
        apart = float(np.linalg.norm(other[0].tip - best[0].tip))
        full = other[1].rank == best[1].rank == _UNKNOWNS
        if full and apart > _SAME_TIP_MM and square_sum(other) <= _AS_GOOD * square_sum(best):
            raise CalibrationError(
                "ambiguous_tip",
                tr(
                    "Two places of the tip, {apart:.2f} mm apart, fit these touches equally well.",
                    apart=apart,
                ),
                remedy=tr("Touch in more orientations."),
            )
    return best


def _start(p: Floats, r: Floats, normal: Floats) -> tuple[float, _State]:
    """Return the least squares for a normal that is taken as known, and their misfit."""
    rows = np.column_stack((np.einsum("nij,i->nj", r, normal), -np.ones(len(p))))
    fit = linear_fit(rows, -(p @ normal))
    left = float(fit.residuals @ fit.residuals)
    return left, _State(fit.x[:3], normal, float(fit.x[3]))


def _tangents(normal: Floats) -> Floats:
    """Return two unit vectors across a normal, as columns."""
    _, _, axes = np.linalg.svd(normal[None, :])
    tangents: Floats = axes[1:].T
    return tangents


def _directions() -> list[Floats]:
    """Return half of the directions to faces, edges and corners of a cube; a plane has no sides."""
    grid = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)]
    return [np.array(g) / math.hypot(*g) for g in sorted(grid, reverse=True) if g > (0, 0, 0)]
