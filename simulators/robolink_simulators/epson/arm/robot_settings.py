"""A robot's settings for its load, its arm and its joints.

Source: docs/reference/spel.md 6.2, 6.3, 7.2.
"""

from dataclasses import dataclass, field
from typing import Final

from robolink_simulators.epson.arm.joint_settings import joint_order

FINE_PULSES: Final = 10
"""Default of Fine in pulses. The reference gives it per model, and 10 in its sample
(docs/reference/spel.md 7.3).
"""


@dataclass(frozen=True, slots=True)
class SingularSurroundings:
    """How far the neighbourhoods of singular places reach (docs/reference/epson-robots.md).

    Attributes:
        angle_deg: SingularityAngle: of joint 5 from 0.
        speed_percent: SingularitySpeed: from which speed of joint 4 that counts.
        distance_mm: SingularityDist: of the wrist from the axis of joint 1.
    """

    angle_deg: float = 10.0
    speed_percent: float = 10.0
    distance_mm: float = 30.0


@dataclass(slots=True)
class RobotSettings:
    """Settings that do not affect where the robot goes, except for the last four.

    The defaults of Weight and Inertia are per model; these are assumed. Which statement resets
    which of them is documented (docs/reference/spel.md 6.3).

    Attributes:
        weight_kg: Weight: hand and part.
        weight_at_mm: Weight: distance of its centre from joint 2.
        inertia_kg_m2: Inertia of the load.
        eccentricity_mm: Inertia: distance of its centre from joint 4.
        fine_pulses: Fine of each joint.
        continuous_path: CP.
        speed_factor: SpeedFactor in percent; it scales speeds and accelerations.
        free_joints: Joints that SFree has released.
        home_pulses: HomeSet of each joint, ``None`` before one was given.
        home_order: Hordr: the joints of each step of Home as bits.
        avoid_singularity: AvoidSingularity, 0 to 4.
        surroundings: Of singular places; AvoidSingularity sets them back.
    """

    fine_pulses: tuple[int, ...]
    home_order: tuple[int, ...]
    weight_kg: float = 2.0
    weight_at_mm: float = 200.0
    inertia_kg_m2: float = 0.01
    eccentricity_mm: float = 0.0
    continuous_path: bool = False
    speed_factor: int = 100
    free_joints: set[int] = field(default_factory=set)
    home_pulses: tuple[int, ...] | None = None
    avoid_singularity: int = 1
    surroundings: SingularSurroundings = SingularSurroundings()

    @property
    def avoided(self) -> SingularSurroundings | None:
        """Return what a straight movement keeps clear of, ``None`` for nothing."""
        return self.surroundings if self.avoid_singularity else None

    @classmethod
    def of(cls, axes: int) -> "RobotSettings":
        """Return the settings of a new robot with so many joints."""
        return cls((FINE_PULSES,) * axes, joint_order(axes))

    def reset(self) -> None:
        """Set what start-up, Motor On, SFree, SLock and Reset set back."""
        self.fine_pulses = (FINE_PULSES,) * len(self.fine_pulses)
        self.continuous_path = False
