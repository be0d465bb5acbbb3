"""Whether what a program measured is believed, and whether what it wrote is proved."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

if TYPE_CHECKING:
    from robolink.calibration import CalibrationResult, VerifyResult
    from robolink.procedures import PoseMethod

LEAST_TOUCHES: Final = 4
"""With three touches of a circle little contradicts a wrong one, and nobody looks on."""

MOST_TOUCHES: Final = 64

LEAST_PROOFS: Final = 2

_SAME_MM: Final = 0.002
"""Nearer to each other two poses are taken for one that was sent twice."""


@dataclass(frozen=True, slots=True)
class CallbackLimits:
    """What a program's measurement is held to.

    Attributes:
        tolerance_mm: Largest drift about the new tip, and the widest 95 % interval, in mm.
        max_change_mm: Largest change of the offset that is believed, in mm.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.

    Raises:
        ConfigError: One of them is not positive.
    """

    tolerance_mm: float = 0.1
    max_change_mm: float = 2.0
    sigma_mm: float | None = None

    def __post_init__(self) -> None:
        for name in ("tolerance_mm", "max_change_mm", "sigma_mm"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ConfigError(tr("{name} is {value}, not positive.", name=name, value=value))


@dataclass(slots=True)
class Touches:
    """Poses of the flange at which a program says that its tip was on the pin.

    Attributes:
        poses: They, in the order in which they came.
        unwitnessed: How many nothing shows to be touches: no contact that was off before the
            approach and on at the touch.
    """

    poses: list[Pose] = field(default_factory=list)
    unwitnessed: int = 0

    def add(self, pose: Pose, *, seen_off: bool, seen_on: bool) -> None:
        """Add one.

        Raises:
            CalibrationError: ``too_many_poses``.
        """
        if len(self.poses) >= MOST_TOUCHES:
            raise CalibrationError("too_many_poses", tr("There are too many poses."))
        self.poses.append(pose)
        self.unwitnessed += not (seen_off and seen_on)

    def require(self, least: int) -> None:
        """Make sure that there are enough, and that each was seen.

        Raises:
            CalibrationError: ``touches_not_witnessed`` or ``too_few_poses``.
        """
        if self.unwitnessed:
            raise CalibrationError(
                "touches_not_witnessed",
                tr("{count} touches were seen by no contact.", count=self.unwitnessed),
            )
        if len(self.poses) < least:
            raise CalibrationError(
                "too_few_poses",
                tr("{count} poses came; {least} are needed.", count=len(self.poses), least=least),
            )


def method_named(name: str, limits: CallbackLimits) -> "PoseMethod":
    """Return the method that a program asked for.

    Raises:
        CalibrationError: ``unknown_method``.
    """
    from robolink.methods.n_angle.source import ManyTouches
    from robolink.methods.pivot.source import PivotTouches

    kinds: dict[str, type[ManyTouches] | type[PivotTouches]] = {
        "n-angle": ManyTouches,
        "pivot": PivotTouches,
    }
    if name not in kinds:
        raise CalibrationError("unknown_method", tr("There is no method {name!r}.", name=name))
    return kinds[name](sigma_mm=limits.sigma_mm)


def measured(
    method: "PoseMethod", touches: Touches, stored: ToolOffset, limits: CallbackLimits
) -> "CalibrationResult":
    """Return the offset that touches show, if it may be written with nobody looking on.

    Raises:
        CalibrationError: Its code says why not.
    """
    from robolink.calibration import update_guard, writes_refused_unattended

    touches.require(LEAST_TOUCHES)
    result = method.solve(touches.poses, stored)
    doubt = writes_refused_unattended(result)
    if doubt:
        raise CalibrationError(doubt, tr("The touches contradict each other."))
    within_mm = result.known_within_mm
    if within_mm is None or within_mm > limits.tolerance_mm:
        raise CalibrationError(
            "uncertain",
            tr("The tip is not known within {limit:g} mm.", limit=limits.tolerance_mm),
        )
    update_guard(result.offset, stored=stored, max_change_mm=limits.max_change_mm)
    return result


def proved(
    touches: Touches, result: "CalibrationResult", written: ToolOffset, limits: CallbackLimits
) -> "VerifyResult":
    """Return what touches after the write show about the new offset.

    They have to be touches of their own, of the same point.

    Raises:
        CalibrationError: ``touches_not_witnessed``, ``too_few_poses``, ``proof_is_a_copy``,
            ``point_moved``, or as of :func:`robolink.calibration.verify_drift`.
    """
    from robolink.calibration import tip_pose, verify_drift

    touches.require(LEAST_PROOFS)
    _require_own(touches.poses, result.inputs)
    proof = verify_drift(touches.poses, written, tolerance_mm=limits.tolerance_mm)
    tip = tip_pose(touches.poses[0], written, tool=0)
    place = (tip.x_mm, tip.y_mm, tip.z_mm)
    # The measured point has two coordinates where the height says nothing.
    away_mm = math.dist(place[: len(result.reference_point_mm)], result.reference_point_mm)
    if away_mm > limits.tolerance_mm:
        raise CalibrationError(
            "point_moved",
            tr("The point lies {away:.3f} mm from where it was measured.", away=away_mm),
        )
    return proof


def _require_own(poses: Sequence[Pose], used: Sequence[Pose]) -> None:
    """Refuse poses that were used for the measurement: they would prove nothing."""
    before = list(used)
    for pose in poses:
        if any(math.dist(_numbers(pose), _numbers(other)) < _SAME_MM for other in before):
            raise CalibrationError(
                "proof_is_a_copy", tr("A pose of the proof was sent before: it proves nothing.")
            )
        before.append(pose)


def _numbers(pose: Pose) -> tuple[float, ...]:
    return (pose.x_mm, pose.y_mm, pose.z_mm, pose.u_deg, pose.v_deg, pose.w_deg)
