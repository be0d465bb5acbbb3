"""A tip touched onto a pin with the tool tilted and turned: X, Y and Z, on five axes and six.

Nothing ever tilts in contact: the tip is lifted, tilted in the air in small steps that keep it
above the pin, and comes down to a clearance; the last bit is done by the person.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.calibration import (
    CalibrationResult,
    Drift,
    VerifyResult,
    pose_arrays,
    sigma_gain,
    solve_pivot,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.pivot.tilts import UPRIGHT, OverPin, Tilt, apart_deg, tilt_path
from robolink.model import Path, Pose, ToolOffset
from robolink.procedures import TAKE_ALL, SamplingPolicy, TouchPlan, lift_off, sample_sequentially
from robolink.runner import Ask, Move, Procedure
from robolink.ways import Way, way

MOST_DEVIATION_DEG: Final = 1.0
"""A robot that stands further from the orientation it was sent to cannot take it up."""


def measure_pivot(
    plan: TouchPlan,
    *,
    tilts: Sequence[Tilt],
    stored: ToolOffset,
    sigma_mm: float | None = None,
    sampling: SamplingPolicy = TAKE_ALL,
) -> Procedure[CalibrationResult]:
    """Measure a tip on a pin in tilted orientations. Runs in Tool 0.

    It ends lifted, and in the orientation in which it began.

    Args:
        plan: Lift and clearance.
        tilts: Orientations of the further touches, counted from the first one.
        stored: The offset stored now; the approaches use it. Where it is wrong by e, the tip comes
            down nearer to the pin by up to 2 e sin(tilt / 2).
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
        sampling: When it ends, and whether a pose may be taken again.

    Raises:
        CalibrationError: ``not_tilted``, and as :func:`solve_pivot`.
    """
    result, _ = yield from pivot_then_lift(
        plan, tilts=tilts, stored=stored, sigma_mm=sigma_mm, sampling=sampling
    )
    return result


def pivot_then_lift(
    plan: TouchPlan,
    *,
    tilts: Sequence[Tilt],
    stored: ToolOffset,
    sigma_mm: float | None,
    sampling: SamplingPolicy,
) -> Procedure[tuple[CalibrationResult, Pose]]:
    """Do what :func:`measure_pivot` does; return the pose of the lifted flange as well."""
    first: Pose = yield Ask(tr("Bring the tip onto the pin."))
    yield lift_off(plan, first)
    swing = _Swing(plan, OverPin.touched(first, stored))
    tilting = _PivotSampler(swing, stored, sigma_mm)
    result = yield from sample_sequentially(tilting, first, [UPRIGHT, *tilts], sampling)
    yield from swing.to(UPRIGHT)
    return result, swing.over.pose(UPRIGHT, plan.lift_mm)


def verify_by_tilting(
    plan: TouchPlan, *, over: OverPin, tilts: Sequence[Tilt], tolerance_mm: float
) -> Procedure[VerifyResult]:
    """Tilt about the new tip and let a person show where it went. Runs in the new tool.

    Args:
        plan: Lift and clearance.
        over: The pin, and where the tip is in the frame in force.
        tilts: Orientations in which the tip is brought back onto the pin.
        tolerance_mm: Largest drift that passes, in all three directions together.

    The tip starts lifted and upright. The distance that the person jogs it, from where it should
    have been to the pin, is the drift. It ends as it started.

    Raises:
        CalibrationError: ``not_tilted``.
    """
    swing = _Swing(plan, over)
    drifts = []
    for tilt in tilts:
        found = yield from swing.touch(
            tilt, tr("Bring the tip back onto the pin; what you jog is the drift.")
        )
        place = over.pose(tilt, 0.0)
        moved = (found.x_mm - place.x_mm, found.y_mm - place.y_mm, found.z_mm - place.z_mm)
        drifts.append(Drift(place.u_deg, *moved))
    yield from swing.to(UPRIGHT)
    return VerifyResult(tuple(drifts), tolerance_mm)


class _Swing:
    """Tilts a lifted tool over a pin, and has the pin touched.

    Args:
        plan: Lift and clearance.
        over: The pin.
    """

    def __init__(self, plan: TouchPlan, over: OverPin) -> None:
        self.over = over
        self._plan = plan
        self._stands = UPRIGHT

    def to(self, goal: Tilt) -> Procedure[None]:
        """Tilt in the air.

        Raises:
            CalibrationError: ``not_tilted``: the robot stands otherwise than it was told.
        """
        for tilt in tilt_path(self._stands, goal):
            target = self.over.pose(tilt, self._plan.lift_mm)
            reached: Pose = yield Move(target, Path.JOINT, tr("tilt and turn in the air"))
            amiss_deg = apart_deg(target, reached)
            if amiss_deg > MOST_DEVIATION_DEG:
                raise CalibrationError(
                    "not_tilted",
                    tr(
                        "The tool stands {amiss:.1f} degrees from the orientation it was sent to.",
                        amiss=amiss_deg,
                    ),
                    remedy=tr(
                        "This robot cannot take it up. It stands with the tip lifted. Tilt less "
                        "with {tilt}, or teach the poses and give {points}.",
                        tilt=way(Way.TILT),
                        points=way(Way.TAUGHT_POINTS),
                    ),
                )
        self._stands = goal

    def touch(self, tilt: Tilt, instruction: str) -> Procedure[Pose]:
        """Tilt in the air, come down, let the person touch the pin, and lift off."""
        yield from self.to(tilt)
        down = self.over.pose(tilt, self._plan.clearance_mm)
        yield Move(down, Path.STRAIGHT, tr("come down to the clearance"))
        touch: Pose = yield Ask(instruction)
        yield lift_off(self._plan, touch)
        return touch


@dataclass(frozen=True, slots=True)
class _PivotSampler:
    """Tilted touches; implements ``SequentialSampler``. Each ends lifted off the pin."""

    swing: _Swing
    stored: ToolOffset
    sigma_mm: float | None

    @property
    def known(self) -> str:
        return tr("X, Y and Z are known")

    def counted(self, count: int) -> str:
        return tr("{count} touches", count=count)

    def take(self, place: Tilt) -> Procedure[Pose]:
        return self.swing.touch(
            place, tr("Bring the tip onto the pin again, with the tool tilted.")
        )

    def away(self) -> Procedure[None]:
        yield from ()

    def foreseen(self, place: Tilt) -> Pose:
        return self.swing.over.pose(place, 0.0)

    def solve(self, touches: Sequence[Pose]) -> CalibrationResult:
        return solve_pivot(touches, stored=self.stored, sigma_mm=self.sigma_mm)

    def gain(self, poses: Sequence[Pose]) -> float:
        return sigma_gain(pose_arrays(poses)[1])

    def named(self, pose: Pose) -> str:
        return tr("U {u:.1f} V {v:.1f} W {w:.1f}", u=pose.u_deg, v=pose.v_deg, w=pose.w_deg)

    def which(self, number: int, pose: Pose) -> str:
        return tr("Pose {number}, at {where}", number=number, where=self.named(pose))
