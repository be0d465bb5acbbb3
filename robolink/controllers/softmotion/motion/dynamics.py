"""How fast: the four numbers that go with a movement or a jog.

Source: docs/reference/softmotion.md 2.3.
"""

import math
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import MotionProfile, Path
from robolink.protocols.mailbox import Four

_RAMP_S: Final = 0.5
"""In this time a straight movement reaches its speed, and in this time its acceleration: SoftMotion
wants all four numbers above 0, and a tip near a pin gains nothing from a harder start."""

_PAST_AN_EDGE_MM: Final = 0.05
"""A tip that is stopped by an input comes to rest within this, the PLC's cycle apart."""

_EDGE_RAMP_S: Final = 0.02
"""In this time such a movement reaches its deceleration."""

LATCH_CYCLE_S: Final = 0.004
"""The longest usual cycle of a motion task. A program notes where an edge was in the cycle in which
it sees it (the companion's program does), and no mailbox tells how long that is."""

_UM_PER_MM: Final = 1000.0


def factors(percent: int) -> Four:
    """Return the factors of the axes' own limits, for direct movements.

    Raises:
        ConfigError: It is not 1 to 100.
    """
    if not 1 <= percent <= 100:
        raise ConfigError(
            tr("A speed of {percent} % is not possible.", percent=percent),
            remedy=tr("Give 1 to 100."),
        )
    return (percent / 100.0,) * 4


def straight(speed_mm_s: float, *, unit_um: float) -> Four:
    """Return velocity, acceleration, deceleration and jerk in the PLC's units.

    Raises:
        ConfigError: The speed is not above 0, or not finite.
    """
    if not 0 < speed_mm_s < float("inf"):
        raise ConfigError(
            tr("A speed of {speed} mm/s is not possible.", speed=speed_mm_s),
            remedy=tr("Give a number above 0."),
        )
    velocity = speed_mm_s * _UM_PER_MM / unit_um
    acceleration = velocity / _RAMP_S
    return (velocity, acceleration, acceleration, acceleration / _RAMP_S)


def up_to_an_edge(speed_mm_s: float, *, unit_um: float) -> Four:
    """Return the numbers of a movement that an input stops, the tip perhaps in contact.

    Raises:
        ConfigError: The speed is not above 0, or not finite.
    """
    velocity, *_ = straight(speed_mm_s, unit_um=unit_um)
    deceleration = velocity * speed_mm_s / (2 * _PAST_AN_EDGE_MM)
    return (velocity, deceleration, deceleration, deceleration / _EDGE_RAMP_S)


def run_up_mm(speed_mm_s: float) -> float:
    """Return in what way a movement that an input stops reaches its speed, and comes to rest.

    With acceleration a and jerk j the speed v takes v/a + a/j, or 2 sqrt(v/j) where a is never
    reached, and half of v times that is the way.

    Raises:
        ConfigError: The speed is not above 0, or not finite.
    """
    velocity, acceleration, _, jerk = up_to_an_edge(speed_mm_s, unit_um=_UM_PER_MM)
    if velocity < acceleration**2 / jerk:
        took_s = 2 * math.sqrt(velocity / jerk)
    else:
        took_s = velocity / acceleration + acceleration / jerk
    return velocity * took_s / 2


def dynamics_of(profile: MotionProfile, *, unit_um: float) -> Four:
    """Return the numbers of a profile: factors for joint moves, else units per second."""
    if profile.path is Path.JOINT:
        return factors(profile.speed_percent)
    return straight(profile.speed_mm_s, unit_um=unit_um)
