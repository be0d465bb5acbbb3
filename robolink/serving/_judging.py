"""What a program's measurement is held to, whatever it measured with."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

if TYPE_CHECKING:
    from robolink.calibration import CalibrationResult

MOST_POSES: Final = 64

_SAME_MM: Final = 0.002
"""Nearer to each other two poses are taken for one that was sent twice."""


@dataclass(frozen=True, slots=True)
class CallbackLimits:
    """What a program's measurement is held to.

    Attributes:
        tolerance_mm: Largest drift about the new tip, and the widest 95 % interval, in mm.
        max_change_mm: Largest change of the offset that is believed, in mm.
        sigma_mm: Standard deviation of one coordinate of one touch, crossing or look, where it
            is known.

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
                raise ConfigError(
                    tr("{name} is {value}, not positive.", name=name, value=value),
                    remedy=tr("Give {name} above 0.", name=name),
                )


def require_believed(
    result: "CalibrationResult", stored: ToolOffset, limits: CallbackLimits
) -> None:
    """Refuse an offset that may not be written with nobody looking on.

    Raises:
        CalibrationError: Its code says why not.
    """
    from robolink.calibration import update_guard, writes_refused_unattended

    doubt = writes_refused_unattended(result)
    if doubt:
        raise CalibrationError(doubt, tr("What was measured contradicts itself."))
    within_mm = result.repeatable_to_mm
    if within_mm is None or within_mm > limits.tolerance_mm:
        raise CalibrationError(
            "uncertain",
            tr("The tip is not known within {limit:g} mm.", limit=limits.tolerance_mm),
        )
    update_guard(result.offset, stored=stored, max_change_mm=limits.max_change_mm)


def require_room(count: int) -> None:
    """Refuse one pose more than anybody needs.

    Raises:
        CalibrationError: ``too_many_poses``.
    """
    if count >= MOST_POSES:
        raise CalibrationError("too_many_poses", tr("There are too many poses."))


def require_poses_sent(count: int, least: int) -> None:
    """Make sure that there are enough.

    Raises:
        CalibrationError: ``too_few_poses``.
    """
    if count < least:
        raise CalibrationError(
            "too_few_poses", tr("{count} poses came; {least} are needed.", count=count, least=least)
        )


def require_own(poses: Sequence[Pose], used: Sequence[Pose]) -> None:
    """Refuse poses of a proof that were used for the measurement: they would prove nothing.

    Raises:
        CalibrationError: ``proof_is_a_copy``.
    """
    before = list(used)
    for pose in poses:
        if any(math.dist(pose.coordinates(), other.coordinates()) < _SAME_MM for other in before):
            raise CalibrationError(
                "proof_is_a_copy", tr("A pose of the turn test was sent before: it proves nothing.")
            )
        before.append(pose)
