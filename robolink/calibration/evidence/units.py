"""Lengths that look like metres or inches (docs/reference/evidence.md 15)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.calibration.core.result import CalibrationResult
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

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
        """The nearest that is believed."""
        return _INNER_PART * self.reach_mm if self.inner_mm is None else self.inner_mm


def require_within_reach(poses: Sequence[Pose], robot: RobotReach) -> None:
    """Refuse poses that the robot cannot take, as metres and inches are.

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
    """Refuse poses that lie nearer to where the robot is when they are read in another unit.

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
    """Refuse an offset that is the stored one in another unit.

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
