"""A tip that a program moved onto a pin, touch by touch."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field
from typing import TYPE_CHECKING, ClassVar, Final

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.serving._callback_limits import (
    CallbackLimits,
    require_own,
    require_poses_sent,
    require_room,
)

if TYPE_CHECKING:
    from robolink.calibration import CalibrationResult, VerifyResult
    from robolink.procedures import PoseMethod


LEAST_TOUCHES: Final = 4
"""Smallest number of touches: with three on a circle, little contradicts a wrong touch, and nobody
is watching."""

LEAST_PROOFS: Final = 2


@dataclass(slots=True)
class _Touches:
    """Poses of the flange at which a program reports that its tip was on the pin.

    Attributes:
        poses: They, in the order in which they came.
        unwitnessed: How many nothing shows to be touches: no contact that was off before the
            approach and on at the touch.
    """

    poses: list[Pose] = field(default_factory=list)
    unwitnessed: int = 0

    def require(self, least: int) -> None:
        if self.unwitnessed:
            raise CalibrationError(
                "touches_not_witnessed",
                tr("{count} touches gave no contact signal.", count=self.unwitnessed),
            )
        require_poses_sent(len(self.poses), least)


class ProgramTouches:
    """Touches of one pin, by ``n-angle`` or ``pivot``; implements ``ProgramMeasure``.

    Each pose is followed by 1 if the contact was seen off before the approach, and 1 if it was
    seen on at the touch.

    Args:
        method: Solves them.
        limits: What they are held to.
    """

    length: ClassVar[int] = 2
    by_contact: ClassVar[bool] = True

    def __init__(self, method: "PoseMethod", limits: CallbackLimits) -> None:
        self._method, self._limits = method, limits
        self._measured, self._proving = _Touches(), _Touches()

    def add(self, flange: Pose, seen: Sequence[str], *, proof: bool) -> int:
        """Add a touch; see ``ProgramMeasure``."""
        touches = self._proving if proof else self._measured
        require_room(len(touches.poses))
        touches.poses.append(flange)
        touches.unwitnessed += tuple(seen) != ("1", "1")
        return len(touches.poses)

    def solve(self, stored: ToolOffset) -> "CalibrationResult":
        """Return the offset; see ``ProgramMeasure``."""
        self._measured.require(LEAST_TOUCHES)
        return self._method.solve(self._measured.poses, stored)

    def prove(self, result: "CalibrationResult", written: ToolOffset) -> "VerifyResult":
        """Return what separate touches of the same point show; see ``ProgramMeasure``.

        Raises:
            CalibrationError: ``touches_not_witnessed``, ``too_few_poses``, ``proof_is_a_copy``,
                ``point_moved``, or as of :func:`robolink.calibration.verify_drift`.
        """
        from robolink.calibration import tip_pose, verify_drift

        touches, limit_mm = self._proving, self._limits.tolerance_mm
        touches.require(LEAST_PROOFS)
        require_own(touches.poses, result.inputs)
        proof = verify_drift(touches.poses, written, tolerance_mm=limit_mm)
        tip = tip_pose(touches.poses[0], written, tool=0)
        place = (tip.x_mm, tip.y_mm, tip.z_mm)
        # The measured point has two coordinates if the height is not determined.
        away_mm = math.dist(place[: len(result.reference_point_mm)], result.reference_point_mm)
        if away_mm > limit_mm:
            raise CalibrationError(
                "point_moved",
                tr("The point is {away:.3f} mm from where it was measured.", away=away_mm),
            )
        return proof

    def from_place(
        self, result: "CalibrationResult", written: ToolOffset, proof: "VerifyResult"
    ) -> "VerifyResult":
        """Return the same touches as drifts from the measured place; see ``ProgramMeasure``."""
        from robolink.calibration import Drift, VerifyResult, tip_pose

        place, drifts = result.reference_point_mm, []
        for pose in self._proving.poses:
            tip = tip_pose(pose, written, tool=0)
            seen = (tip.x_mm, tip.y_mm, tip.z_mm)
            dx_mm, dy_mm, *dz_mm = (a - b for a, b in zip(seen, place, strict=False))
            drifts.append(Drift(pose.u_deg, dx_mm, dy_mm, dz_mm[0] if dz_mm else 0.0))
        return VerifyResult(tuple(drifts), proof.tolerance_mm)

    def on_record(self) -> Mapping[str, object]:
        """Return what was measured; see ``ProgramMeasure``."""
        return {"flange": [list(astuple(pose)[:6]) for pose in self._measured.poses]}


def touches_by(method: str, limits: CallbackLimits) -> ProgramTouches:
    """Return an empty set of touches of a pin, ``n-angle`` or ``pivot``."""
    if method == "pivot":
        from robolink.methods.pivot import PivotTouches

        return ProgramTouches(PivotTouches(sigma_mm=limits.sigma_mm), limits)
    from robolink.methods.n_angle import ManyTouches

    return ProgramTouches(ManyTouches(sigma_mm=limits.sigma_mm), limits)
