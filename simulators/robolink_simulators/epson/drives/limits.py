"""Upper limits of the torque: LimitTorque, LimitTorqueStop, TC and their kin.

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

    def limit(self) -> TorqueLimit | None:
        """Return at which torques a motion ends, ``None`` where none does.

        Torque control goes before LimitTorqueStop (assumed).
        """
        drives = self._drives()
        if drives.is_on("tc"):
            given = drives.get("tclim")
            shares = tuple(None if percent < 0 else percent / _PERCENT for percent in given)
            return TorqueLimit(shares, None)
        if self._power_high():
            if drives.is_on("limittorquestop"):
                return TorqueLimit(self.shares(), RefusalKind.TORQUE_HIGH_POWER)
        elif drives.is_on("limittorquestoplp"):
            return TorqueLimit(self.shares(), RefusalKind.TORQUE_LOW_POWER)
        return None
