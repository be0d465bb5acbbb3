"""X, Y and Z of a tip that touched one sphere in several orientations and from several sides.

``|p_i + R_i t - c| = r`` with the sphere's centre c. The tip need not hit a point, as on a pin: any
place of the sphere will do. Its radius is known from the drawing or found as well
(docs/reference/calibration.md 2.13).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robolink.calibration.core.dispersion import require_positive
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
from robolink.model import Pose, ToolOffset

_UNKNOWNS = 7

_INSIDE_OUT = 0.2
"""Largest difference between found and stated radius, as a share of the stated radius."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SphereTouchResult(CalibrationResult):
    """A tip, and the sphere that it touched; its centre is the reference point."""

    radius_mm: float

    @property
    def by_surface(self) -> bool:
        """A sphere was touched."""
        return True

    def details(self) -> dict[str, object]:
        """Return the sphere."""
        return {"sphere": {"centre_mm": list(self.reference_point_mm), "radius_mm": self.radius_mm}}


@dataclass(frozen=True, slots=True)
class _State:
    tip: Floats
    centre: Floats
    radius: float


@refuses_by_name
def solve_sphere_touch(
    poses: Sequence[Pose],
    *,
    stored: ToolOffset | None = None,
    radius_mm: float | None = None,
    sigma_mm: float | None = None,
    tolerance: Tolerance = SURFACE_TOLERANCE,
) -> SphereTouchResult:
    """Return X, Y and Z of a tip that touched a sphere.

    Args:
        poses: Flange poses (Tool 0) at the touches: at least eight, seven where the radius is
            known; from several sides, turned and tilted.
        stored: The offset stored now; U, V and W are kept from it, or 0 without one.
        radius_mm: Radius of the sphere, with that of a ball-shaped tip added; found without it.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        CalibrationError: ``too_few_poses``, ``rank_deficient``, ``insufficient_rotation``,
            ``radius_contradicted``, ``diverging``, ``implausible_offset``, ``tool_pose``,
            ``local_pose``, and those of ``pose_checks.check_poses``.
        ConfigError: ``sigma_mm`` or ``radius_mm`` is not positive.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import carrying, solve_sphere_touch
        >>> tip = ToolOffset(12.5, -3.25, 80)
        >>> angles = [(0, 0, 180), (90, 20, 180), (180, 0, 160)]
        >>> angles += [(-90, -20, 180), (0, 20, 180), (90, 0, 200)]
        >>> sides = [(0, 0, 1), (0.6, 0, 0.8), (-0.6, 0, 0.8), (0, 0.6, 0.8), (0, -0.6, 0.8)]
        >>> poses = [
        ...     carrying(Pose(0, 0, 0, *uvw), tip, (300 + 10 * x, 100 + 10 * y, -80 + 10 * z))
        ...     for uvw in angles
        ...     for x, y, z in sides
        ... ]
        >>> found = solve_sphere_touch(poses, radius_mm=10)
        >>> [round(value, 3) for value in (found.offset.x_mm, found.offset.y_mm, found.offset.z_mm)]
        [12.5, -3.25, 80.0]
    """
    if radius_mm is not None:
        require_positive(radius_mm, "radius_mm")
    unknowns = _UNKNOWNS if radius_mm is None else _UNKNOWNS - 1
    poses, warnings = distinct_touches(poses, unknowns + 1)
    p, r = pose_arrays(poses)
    state, fit = _found(p, r, stored, radius_mm)
    remedy = tr("Touch it from several sides, turned and tilted by 20 degrees or more.")
    require_told_apart(fit, unknowns, remedy)
    _require_radius(p + r @ state.tip, radius_mm)
    places = p + r @ state.tip - state.centre
    ways = places / np.linalg.norm(places, axis=1)[:, None]
    x, y, z = state.centre.tolist()
    return tip_result(
        SphereTouchResult,
        "sphere-touch",
        poses,
        stored=stored,
        tip_mm=state.tip,
        fit=fit,
        across=ways,
        unknowns=unknowns,
        sigma_mm=sigma_mm,
        tolerance=tolerance,
        warnings=warnings,
        place_mm=(x, y, z),
        radius_mm=state.radius,
    )


def sphere_columns(
    poses: Sequence[Pose], tip: ToolOffset, centre_mm: tuple[float, float, float]
) -> Floats:
    """Return the derivatives of the tip's distance from a sphere, one row a pose.

    Columns: X, Y and Z of the tip in the flange, those of the centre in the base, the radius.

    Args:
        poses: Flange poses.
        tip: About where the tip is.
        centre_mm: About where the centre is.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import sphere_columns
        >>> on_top = Pose(288, 103.5, -50, 0)  # its tip is 10 mm above the centre
        >>> columns = sphere_columns([on_top], ToolOffset(12, -3.5, -20), (300, 100, -80))
        >>> [round(float(value), 3) + 0.0 for value in columns[0]]
        [0.0, 0.0, 1.0, 0.0, 0.0, -1.0, -1.0]
    """
    p, r = pose_arrays(poses)
    places = p + r @ np.array(tip.components()[:3]) - np.array(centre_mm)
    ways = places / np.linalg.norm(places, axis=1)[:, None]
    return np.hstack((np.einsum("nij,ni->nj", r, ways), -ways, -np.ones((len(p), 1))))


def _found(
    p: Floats, r: Floats, stored: ToolOffset | None, radius_mm: float | None
) -> tuple[_State, LinearFit]:
    def linear(state: _State) -> tuple[Floats, Floats]:
        places = p + r @ state.tip - state.centre
        distances = np.linalg.norm(places, axis=1)
        ways = places / distances[:, None]
        columns = [np.einsum("nij,ni->nj", r, ways), -ways]
        if radius_mm is None:
            columns.append(-np.ones((len(p), 1)))
        return np.hstack(columns), distances - state.radius

    def stepped(state: _State, by: Floats) -> _State:
        radius = state.radius + (float(by[6]) if radius_mm is None else 0.0)
        return _State(state.tip + by[:3], state.centre + by[3:6], radius)

    found = [refined(start, linear, stepped) for start in _starts(p, r, stored, radius_mm)]
    settled = sorted(
        (one for one in found if one is not None and one[0].radius > 0), key=square_sum
    )
    if not settled:
        raise never_settled()
    return settled[0]


def _starts(
    p: Floats, r: Floats, stored: ToolOffset | None, radius_mm: float | None
) -> list[_State]:
    """Return guesses: from the stored tip, and as if all had touched one point."""
    wide = np.concatenate((r, np.broadcast_to(-np.eye(3), r.shape)), axis=2).reshape(-1, 6)
    tips = [linear_fit(wide, -p.ravel()).x[:3]]
    if stored is not None:
        tips.append(np.array(stored.components()[:3]))
    starts = []
    for tip in tips:
        centre, radius = sphere_through(p + r @ tip)
        starts.append(_State(tip, centre, radius if radius_mm is None else radius_mm))
    return starts


def sphere_through(places_mm: Floats) -> tuple[Floats, float]:
    """Return centre and radius of the algebraic sphere through four places and more, mm.

    It is linear: |q|^2 = 2 c q + (r^2 - |c|^2).
    """
    middle = places_mm.mean(axis=0)
    q = places_mm - middle
    fit = linear_fit(np.column_stack((2 * q, np.ones(len(q)))), (q**2).sum(axis=1))
    centre = fit.x[:3]
    return centre + middle, float(np.sqrt(max(fit.x[3] + centre @ centre, 1e-6)))


def _require_radius(places: Floats, radius_mm: float | None) -> None:
    """Refuse a stated radius that the places do not have."""
    if radius_mm is None:
        return
    _, found_mm = sphere_through(places)
    if abs(found_mm / radius_mm - 1) > _INSIDE_OUT:
        raise CalibrationError(
            "radius_contradicted",
            tr(
                "The touches fit a sphere with a radius of {found:.2f} mm; "
                "{stated:.2f} mm was stated.",
                found=found_mm,
                stated=radius_mm,
            ),
            remedy=tr(
                "Give the radius, not the diameter, or leave it out: robolink then finds it."
            ),
        )
