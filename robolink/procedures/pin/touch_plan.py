"""How a tip is taken off what it touches, and how near the robot brings it again."""

from dataclasses import dataclass, replace
from typing import Final

from robolink import ambient
from robolink.calibration import PERSON_SIGMA_Z_MM, PROBE_SIGMA_Z_MM
from robolink.model import InputEdge, Pose

_SEED_BITS: Final = 48


@dataclass(frozen=True, slots=True)
class TouchPlan:
    """How a tip is taken off the pin and brought back.

    Attributes:
        lift_mm: How far the tip is lifted before anything turns.
        clearance_mm: Least height above the expected contact to which it comes down again; up to
            ``HIGHEST_MM`` more is drawn.
        turn_deg: By how much U differs between the two poses.
        contact: The input that shows contact, ``None`` where a person's eye does.
        sigma_z_mm: Standard deviation of a touch in height, ``None`` for what is usual.
        seed: From which the standoffs are drawn, ``None`` for a new one in each run.
        nominal: Whether it is only looked at: the highest standoffs, nothing drawn or judged.
    """

    lift_mm: float = 10.0
    clearance_mm: float = 2.0
    turn_deg: float = 180.0
    contact: InputEdge | None = None
    sigma_z_mm: float | None = None
    seed: int | None = None
    nominal: bool = False

    @property
    def sigma_in_height_mm(self) -> float:
        """Standard deviation of a touch in height, stated or usual."""
        usual_mm = PERSON_SIGMA_Z_MM if self.contact is None else PROBE_SIGMA_Z_MM
        return self.sigma_z_mm or usual_mm


def fresh_seed() -> int:
    """Return the seed of a run: nobody can know the standoffs of a run before it."""
    return ambient.random_number(_SEED_BITS)


def plain_pose(pose: Pose) -> Pose:
    """Return a pose without how it was taken."""
    kept = Pose(*pose.coordinates(), hand=pose.hand, local=pose.local, tool=pose.tool)
    return replace(kept, posture=pose.posture)
