"""Settings of a robot's drives: what each may be, and what puts it back.

Source: docs/reference/spel.md 6.3, 7.2, 7.4. Those whose effect a page describes rule how a robot
moves here; of PerformMode, QPDecelR, QPDecelS, OLAccel, SoftCP, SpeedRLimitation, CP_Offset and VSD
none does: they are kept, told and put back.
"""

from collections.abc import Mapping
from enum import Enum
from functools import lru_cache
from typing import Final, NamedTuple


class RestoredAt(Enum):
    """What puts a setting back; start-up puts each back."""

    FIVE = "Motor On, SFree, SLock, Reset, the end of tasks"
    DRIVES = "Motor On, SFree, SLock"
    START = "start-up alone"


class DriveSetting(NamedTuple):
    """What one statement sets.

    Attributes:
        counts: How many values it takes; -1 for one of each joint.
        low: The lowest that a value may be.
        high: The highest.
        usual: What each value is at first.
        put_back: What puts it back.
        switched: Whether it takes On and Off.
        listing: How its statement lists it, ``{}`` standing for the value.
    """

    counts: tuple[int, ...]
    low: float
    high: float
    usual: float
    put_back: RestoredAt
    switched: bool = False
    listing: str = "{}"


def _switch(put_back: RestoredAt, listing: str = "{}", *, on: bool = False) -> DriveSetting:
    return DriveSetting((1,), 0, 1, float(on), put_back, switched=True, listing=listing)


OF_EACH_JOINT: Final = -1

OF_SIX_AXES: Final = frozenset({"vsd"})
"""Settings that other robots do not have."""

DRIVE_SETTINGS: Final[dict[str, DriveSetting]] = {
    "limzmargin": DriveSetting((1,), 0, 1000, 0.02, RestoredAt.DRIVES),
    "finedist": DriveSetting((1,), 0.001, 10, 0, RestoredAt.DRIVES),
    "performmode": DriveSetting((1,), 0, 2, 0, RestoredAt.DRIVES),
    "ptpboost": DriveSetting((3, 1), 0, 100, 0, RestoredAt.FIVE),
    "qpdecelr": DriveSetting((1,), 0.1, 5000, 5000, RestoredAt.FIVE),
    "qpdecels": DriveSetting((1,), 0.1, 25000, 25000, RestoredAt.FIVE),
    "tclim": DriveSetting((OF_EACH_JOINT,), -1, 100, -1, RestoredAt.FIVE),
    "tcspeed": DriveSetting((1,), 1, 100, 100, RestoredAt.FIVE),
    "limittorque": DriveSetting((OF_EACH_JOINT, 1), 0, 100, 100, RestoredAt.FIVE),
    "limittorquelp": DriveSetting((OF_EACH_JOINT, 1), 0, 100, 100, RestoredAt.START),
    "limittorquestop": _switch(RestoredAt.START),
    "limittorquestoplp": _switch(RestoredAt.START),
    "collisiondetect": DriveSetting(
        (OF_EACH_JOINT, 1), 0, 1, 0, RestoredAt.START, switched=True, listing="{}"
    ),
    "vsd": _switch(RestoredAt.START),
    "qp": _switch(RestoredAt.START, "QP {}", on=True),
    "olaccel": _switch(RestoredAt.FIVE, "OLACCEL is {}"),
    "softcp": _switch(RestoredAt.FIVE),
    "autoljm": _switch(RestoredAt.FIVE),
    "speedrlimitation": _switch(RestoredAt.FIVE),
    "cp_offset": _switch(RestoredAt.FIVE),
    "tc": _switch(RestoredAt.FIVE),
}
"""By their statements. Where the reference gives no limit, value or listing, those are assumed."""


class DriveSettings:
    """The settings of one robot.

    Args:
        axes: How many joints it has.
    """

    def __init__(self, axes: int) -> None:
        self._axes = axes
        self._values: dict[str, tuple[float, ...]] = {}
        self.put_back(RestoredAt.FIVE, RestoredAt.DRIVES, RestoredAt.START)

    def get(self, word: str) -> tuple[float, ...]:
        """Return the values of a setting."""
        return self._values[word]

    def is_on(self, word: str) -> bool:
        """Tell whether a switch is on."""
        return bool(self._values[word][0])

    def takes(self, word: str) -> tuple[int, ...]:
        """Return how many values a setting may be given."""
        return _counts(self._axes, DRIVE_SETTINGS[word])

    def set(self, word: str, values: tuple[float, ...]) -> None:
        """Keep the values of a setting; one stands for all that there are."""
        count = self.takes(word)[0]
        self._values[word] = values if len(values) == count else values * count

    def put_back(self, *occasions: RestoredAt) -> None:
        """Put back what some occasions put back."""
        for occasion in occasions:
            self._values.update(_usual_at(self._axes, occasion))


def _counts(axes: int, setting: DriveSetting) -> tuple[int, ...]:
    return tuple(axes if n == OF_EACH_JOINT else n for n in setting.counts)


@lru_cache(maxsize=32)
def _usual_at(axes: int, occasion: RestoredAt) -> Mapping[str, tuple[float, ...]]:
    """Return what an occasion puts back on a robot of so many joints; robots share it."""
    return {
        word: (setting.usual,) * _counts(axes, setting)[0]
        for word, setting in DRIVE_SETTINGS.items()
        if setting.put_back is occasion
    }
