"""Checks poses that a person gives: their unit, number and flatness, and which tool fits.

Lengths may look like metres or inches (docs/reference/evidence.md 15).

A stored point carries no tool number (docs/reference/epson.md 3.2), so a person says with which
tool it was taught. The geometry can contradict. Let the poses be taken for tip poses of tool j; the
flange poses that follow give the offset m_j. Taken for tip poses of another tool k, they give

    m_k = t_k + Rz(u_k - u_j) (m_j - t_j)

with t the stored offsets and u the stored tool angles. It follows from
``(Rz(U1) - Rz(U2)) t = p2 - p1`` (docs/reference/calibration.md 1.1) with ``p_flange = p - Rz(U -
u) t`` (docs/reference/epson.md 3.1). A changed nozzle sits a few tenths of a millimetre from where
it was; so the right k is one whose m_k lies near the offset stored for the tool that is calibrated.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.calibration.core.pose_checks import refuses_by_name
from robolink.calibration.core.result import CalibrationResult
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, rotate_xy

_FACTORS: Final = (1 / 1000, 1 / 25.4, 25.4, 1000.0)

_WITHIN: Final = 0.05

_LEAST_STORED_MM: Final = 1.0

_REACH_ROOM: Final = 1.05

_INNER_PART: Final = 0.02


@dataclass(frozen=True, slots=True)
class RobotReach:
    """How far a robot reaches about its base axis, mm.

    Attributes:
        reach_mm: The farthest.
        inner_mm: The nearest; ``None`` takes 2 % of the reach. 0 for a gantry or a delta, which
            may stand in the middle.
    """

    reach_mm: float
    inner_mm: float | None = None

    @property
    def least_mm(self) -> float:
        """The nearest distance that is believed."""
        return _INNER_PART * self.reach_mm if self.inner_mm is None else self.inner_mm


def require_within_reach(poses: Sequence[Pose], robot: RobotReach) -> None:
    """Refuse poses out of the robot's reach, such as metres and inches.

    Args:
        poses: Flange poses in the base.
        robot: How far it reaches.

    Raises:
        CalibrationError: ``suspect_units``.
    """
    radii = [math.hypot(pose.x_mm, pose.y_mm) for pose in poses]
    if not radii:
        return
    if max(radii) > _REACH_ROOM * robot.reach_mm:
        raise _suspect(
            tr(
                "A position is {radius:.1f} mm from the base axis; the robot reaches "
                "{reach:.0f} mm.",
                radius=max(radii),
                reach=robot.reach_mm,
            )
        )
    if max(radii) < robot.least_mm:
        raise _suspect(
            tr(
                "All positions are within {radius:.3f} mm of the base axis, where "
                "this robot cannot reach.",
                radius=max(radii),
            )
        )


def require_near(poses: Sequence[Pose], live: Pose) -> None:
    """Refuse poses that fit the robot's present place better in another unit.

    Args:
        poses: Poses as they are taken, in mm.
        live: Where the robot is.

    Raises:
        CalibrationError: ``suspect_units``.
    """

    def away(factor: float) -> float:
        return min(
            (
                math.dist(
                    [factor * value for value in pose.coordinates()[:3]], live.coordinates()[:3]
                )
                for pose in poses
            ),
            default=0.0,
        )

    as_given = away(1.0)
    if any(away(factor) < as_given for factor in (25.4, 1000.0)):
        raise _suspect(tr("Read as metres or inches, they would be nearer to where the robot is."))


def require_stored_scale(result: CalibrationResult, stored: ToolOffset | None) -> None:
    """Refuse an offset that equals the stored one in another unit.

    Raises:
        CalibrationError: ``suspect_units``.
    """
    names = [name for name in result.measured if name.endswith("_mm")]
    if stored is None or not names:
        return
    before = math.hypot(*(getattr(stored, name) for name in names))
    ratio = math.hypot(*(getattr(result.offset, name) for name in names)) / max(before, 1e-9)
    if before >= _LEAST_STORED_MM and any(
        abs(ratio / factor - 1) <= _WITHIN for factor in _FACTORS
    ):
        raise _suspect(
            tr(
                "The offset would be {ratio:.4g} times as long as the stored one: it "
                "looks like metres or inches.",
                ratio=ratio,
            )
        )


def _suspect(what: str) -> CalibrationError:
    return CalibrationError(
        "suspect_units", what, remedy=tr("Give lengths in mm and angles in degrees.")
    )


UNSUSPICIOUS_MM = 1.0
"""Largest change of an ordinary nozzle change, in mm; it raises no doubt about the tool."""

_NEW_NOZZLE_MM = 2.0
"""Largest change that a new nozzle explains, in mm, whatever limit is accepted this time."""

ALIKE_MM = 0.01
"""Largest difference between equal offsets, in mm: whichever tool it was, the same value is
written."""

MUCH_NEARER = 4.0
"""Number of times smaller the change must be with another tool before that tool is named."""


@dataclass(frozen=True, slots=True)
class ToolFit:
    """How well poses fit having been taught with ``tool``.

    ``change_mm`` is by how much the calibrated tool would then have moved against its stored
    value, ``apart_mm`` how far its offset would be from that by the tool that a person named.
    """

    tool: int
    change_mm: float
    apart_mm: float = 0.0


@refuses_by_name
def tool_fits(
    result: CalibrationResult,
    *,
    taught: int,
    stored: Mapping[int, ToolOffset],
    calibrated: int,
) -> tuple[ToolFit, ...]:
    """Return every tool that the poses may have been taught with, the likeliest first.

    Args:
        result: What the poses give when they are taken for tip poses of tool ``taught``.
        taught: The tool that a person named; 0 for the flange.
        stored: The defined tools with their offsets; Tool 0 is added.
        calibrated: The tool that ``result`` is for; without a stored value of it nothing can
            be judged and nothing is returned.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import solve_two_pose, tool_fits
        >>> found = solve_two_pose(Pose(287.5, 103.25, -60, 0), Pose(312.5, 96.75, -60, 180))
        >>> stored = {1: ToolOffset(12.3, -3.3, -20)}
        >>> [fit.tool for fit in tool_fits(found, taught=0, stored=stored, calibrated=1)]
        [0, 1]
    """
    reference = stored.get(calibrated)
    tools = {0: ToolOffset(), **stored}
    if reference is None or taught not in tools:
        return ()
    own, measured = tools[taught], result.offset
    shift = (measured.x_mm - own.x_mm, measured.y_mm - own.y_mm)
    along = "z_mm" in result.measured
    fits = []
    for tool, offset in tools.items():
        if offset.v_deg or offset.w_deg:
            continue
        dx_mm, dy_mm = rotate_xy(*shift, offset.u_deg - own.u_deg)
        x_mm, y_mm = offset.x_mm + dx_mm, offset.y_mm + dy_mm
        z_mm = offset.z_mm + measured.z_mm - own.z_mm
        above = (z_mm - reference.z_mm, z_mm - measured.z_mm) if along else (0.0, 0.0)
        change_mm = math.hypot(x_mm - reference.x_mm, y_mm - reference.y_mm, above[0])
        apart_mm = math.hypot(x_mm - measured.x_mm, y_mm - measured.y_mm, above[1])
        fits.append(ToolFit(tool, change_mm, apart_mm))
    return tuple(sorted(fits, key=lambda fit: (fit.change_mm, fit.tool)))


def better_fit(fits: Sequence[ToolFit], *, taught: int, plausible_mm: float) -> ToolFit | None:
    """Return the tool that explains the poses much better than ``taught``, if one does.

    It has to make the change plausible (at most ``plausible_mm``), and at least
    :data:`MUCH_NEARER` times smaller than ``taught`` makes it; a change that is ordinary
    with ``taught`` (:data:`UNSUSPICIOUS_MM`) is never doubted.

    Args:
        fits: What :func:`tool_fits` returned.
        taught: The tool that a person named; 0 for the flange.
        plausible_mm: Largest change that is believed.

    Example:
        >>> from robolink.calibration import ToolFit, better_fit
        >>> better_fit([ToolFit(2, 0.1), ToolFit(0, 12.6)], taught=0, plausible_mm=2).tool
        2
    """
    declared = next((fit for fit in fits if fit.tool == taught), None)
    if declared is None or declared.change_mm <= UNSUSPICIOUS_MM:
        return None
    best = fits[0]
    much_nearer = best.change_mm * MUCH_NEARER <= declared.change_mm
    return best if much_nearer and best.change_mm <= plausible_mm else None


def fits_alike(fits: Sequence[ToolFit], *, taught: int, plausible_mm: float) -> tuple[ToolFit, ...]:
    """Return other tools that explain the poses as well, but lead to another value.

    A tool whose stored offset is small is near to the flange. Poses of either then mean a change
    that a new nozzle explains, and nothing in them tells which it was; but read as those of the
    wrong one they are wrong by the whole stored offset. One can be told from the other only where
    its change is out of the ordinary (:data:`UNSUSPICIOUS_MM`) and :data:`MUCH_NEARER` times that
    of the tool named.

    Args:
        fits: What :func:`tool_fits` returned.
        taught: The tool that the poses are taken for; 0 for the flange.
        plausible_mm: Largest change that is believed.

    Example:
        >>> from robolink.calibration import ToolFit, fits_alike
        >>> fits = [ToolFit(0, 0.1), ToolFit(1, 0.9, apart_mm=0.9), ToolFit(2, 12.6, apart_mm=12)]
        >>> [fit.tool for fit in fits_alike(fits, taught=0, plausible_mm=2)]
        [1]
    """
    declared = next((fit for fit in fits if fit.tool == taught), None)
    if declared is None or declared.change_mm > plausible_mm:
        return ()
    ordinary_mm = max(UNSUSPICIOUS_MM, min(MUCH_NEARER * declared.change_mm, _NEW_NOZZLE_MM))
    return tuple(
        fit
        for fit in fits
        if fit.tool != taught
        and fit.apart_mm > ALIKE_MM
        and fit.change_mm <= min(ordinary_mm, plausible_mm)
    )
