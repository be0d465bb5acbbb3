"""Limits of the torque: LimitTorque, LimitTorqueStop, TC, CollisionDetect.

Source: docs/reference/spel.md 7.4.
"""

from collections.abc import Callable
from typing import Final

from robolink_simulators.epson.definitions.drive_settings import DriveSettings
from robolink_simulators.epson.drives.guard import TorqueLimit
from robolink_simulators.epson.refusals import RefusalKind

_PERCENT: Final = 100.0
_LEAST: Final = 0.01
"""A limit of 0 counts as 1 %: no share of nothing can be told (assumed)."""

_FELT: Final = 0.05
"""Assumed: from this share of a drive's torque on a thing in the way counts as a collision. A
controller compares speeds (documented)."""


class TorqueLimits:
    """The limits of one robot, as shares of what its drives give for a moment.

    Args:
        drives: Tells its settings.
        power_high: Tells whether its power is high.
    """

    def __init__(self, drives: Callable[[], DriveSettings], power_high: Callable[[], bool]) -> None:
        self._drives, self._power_high = drives, power_high

    def shares(self) -> tuple[float, ...]:
        """Return the highest torque of each joint in the power that is on."""
        word = "limittorque" if self._power_high() else "limittorquelp"
        return tuple(max(percent / _PERCENT, _LEAST) for percent in self._drives().get(word))

    def limits(self) -> tuple[TorqueLimit, ...]:
        """Return at which torques a motion ends.

        Collisions are not looked for under torque control (documented); that it goes before
        LimitTorqueStop is assumed.
        """
        drives, high, found = self._drives(), self._power_high(), list[TorqueLimit]()
        if drives.is_on("tc"):
            given = drives.get("tclim")
            shares = tuple(None if percent < 0 else percent / _PERCENT for percent in given)
            return (TorqueLimit(shares, None),)
        if drives.is_on("limittorquestop" if high else "limittorquestoplp"):
            error = RefusalKind.TORQUE_HIGH_POWER if high else RefusalKind.TORQUE_LOW_POWER
            found.append(TorqueLimit(self.shares(), error))
        felt = tuple(_FELT if on else None for on in drives.get("collisiondetect"))
        if any(felt):
            error = RefusalKind.COLLISION_HIGH_POWER if high else RefusalKind.COLLISION_LOW_POWER
            found.append(TorqueLimit(felt, error, of_contact=True))
        return tuple(found)
