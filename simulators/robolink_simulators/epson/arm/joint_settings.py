"""The settings of a robot's drives and joints: settings, zeros and ranges.

Settings of a robot's drives: what each may be, and what puts it back.

Source: docs/reference/spel.md 6.3, 7.2, 7.4. Those whose effect a page describes rule how a robot
moves here; of PerformMode, QPDecelR, QPDecelS, OLAccel, SoftCP, SpeedRLimitation, CP_Offset and VSD
none does: they are kept, told and put back.

Hofs, CalPls and MCordr: where the zero of each joint lies (docs/reference/spel.md 7.2).

JRange and Range: how far a program lets each joint go.

Source: docs/reference/spel.md 6.3, 7.2.
"""

from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from functools import lru_cache
from typing import Final, NamedTuple

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal


class RestoredAt(Enum):
    """The occasions that reset a setting; start-up resets each."""

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
"""Settings that only six-axis robots have."""

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
"""Drive settings by statement. Limits, values and listings that the reference does not give are
assumed.
"""


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
        """Return whether a switch is on."""
        return bool(self._values[word][0])

    def takes(self, word: str) -> tuple[int, ...]:
        """Return how many values a setting may have."""
        return _counts(self._axes, DRIVE_SETTINGS[word])

    def set(self, word: str, values: tuple[float, ...]) -> None:
        """Keep the values of a setting; one stands for all that there are."""
        count = self.takes(word)[0]
        self._values[word] = values if len(values) == count else values * count

    def put_back(self, *occasions: RestoredAt) -> None:
        """Reset what some occasions reset."""
        for occasion in occasions:
            self._values.update(_usual_at(self._axes, occasion))


def _counts(axes: int, setting: DriveSetting) -> tuple[int, ...]:
    return tuple(axes if n == OF_EACH_JOINT else n for n in setting.counts)


@lru_cache(maxsize=32)
def _usual_at(axes: int, occasion: RestoredAt) -> Mapping[str, tuple[float, ...]]:
    """Return what an occasion resets on a robot of so many joints; robots share it."""
    return {
        word: (setting.usual,) * _counts(axes, setting)[0]
        for word, setting in DRIVE_SETTINGS.items()
        if setting.put_back is occasion
    }


_UP_FIRST: Final = (0b0100, 0b1011, 0, 0)


def joint_order(axes: int) -> tuple[int, ...]:
    """Return the default of Hordr and MCordr: the joints of each step as bits.

    Of four axes it is documented (docs/reference/spel.md 7.2); that six move at once is assumed.
    """
    return _UP_FIRST if axes == len(_UP_FIRST) else ((1 << axes) - 1, *(0,) * (axes - 1))


class JointOrigins:
    """Pulses between the zero of each encoder and that of its joint, and what they are found by.

    A joint is told to stand at the pulses of its encoder plus its offset (the sign is assumed).
    What it was delivered with counts as right here, and as 0: another offset is one by which the
    joint really stands elsewhere than the controller says.

    Args:
        pulses_per_unit: Encoder pulses per degree or mm of each joint.

    Attributes:
        offsets: Hofs of each joint in pulses.
        reference: CalPls of each joint, ``None`` before it was given.
        order: MCordr: the joints of each step of MCal as bits.
    """

    def __init__(self, pulses_per_unit: Sequence[float]) -> None:
        self._scales = tuple(pulses_per_unit)
        self.offsets: tuple[int, ...] = (0,) * len(self._scales)
        self.reference: tuple[int, ...] | None = None
        self.order = joint_order(len(self._scales))

    @property
    def errors(self) -> tuple[float, ...]:
        """How far each joint really is from where the controller shows it, in degrees or mm."""
        joints = zip(self.offsets, self._scales, strict=True)
        return tuple(-offset / scale for offset, scale in joints)

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        reference = None if self.reference is None else list(self.reference)
        return {"offsets": list(self.offsets), "reference": reference, "order": list(self.order)}

    def restore(self, state: object) -> None:
        """Restore what :meth:`to_state` returned.

        Raises:
            KeyError, TypeError, ValueError: It is something else.
        """
        if not isinstance(state, Mapping):
            raise TypeError(state)
        held = {
            name: None if state[name] is None else tuple(map(int, state[name]))
            for name in ("offsets", "reference", "order")
        }
        for name, values in held.items():
            if len(values or self._scales) != len(self._scales):
                raise ValueError(name)
        self.offsets, self.order = held["offsets"] or self.offsets, held["order"] or self.order
        self.reference = held["reference"]


Ends = tuple[float, float]


class JointRanges:
    """The ranges of one robot's joints: the model's own until they are narrowed.

    That nothing widens the model's own is assumed.

    Args:
        own: Low and high of each joint as the model is built, in degrees or mm.
        pulses_per_unit: Its encoder pulses per degree or mm.

    Attributes:
        ends: Those in force.
    """

    def __init__(self, own: Iterable[Ends], pulses_per_unit: Sequence[float]) -> None:
        self._own = tuple(own)
        self._scales = pulses_per_unit
        self.ends = self._own

    def pulses(self) -> list[int]:
        """Return low and high of each joint in turn."""
        joints = zip(self.ends, self._scales, strict=True)
        return [round(end * scale) for ends, scale in joints for end in ends]

    def set_pulses(self, joint: int, low: int, high: int) -> None:
        """Narrow one joint, 1 to as many as there are.

        Raises:
            Refusal: It is no range, or one beyond the model's own.
        """
        scale, own = self._scales[joint - 1], self._own[joint - 1]
        lowest, highest = (round(end * scale) for end in own)
        if not lowest <= low < high <= highest:
            raise SpelRefusal(
                RefusalKind.VALUE_OUT_OF_RANGE,
                f"Joint {joint} from {low} to {high}: allowed are {lowest} to {highest}",
            )
        # The pulse nearest to the end of the model's range stands for that end.
        ends = (
            own[0] if low == lowest else low / scale,
            own[1] if high == highest else high / scale,
        )
        self.ends = (*self.ends[: joint - 1], ends, *self.ends[joint:])

    def to_state(self) -> list[list[float]]:
        """Return what survives power-off, ready for JSON."""
        return [list(ends) for ends in self.ends]

    def restore(self, state: object) -> None:
        """Restore what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        if not isinstance(state, list) or len(state) != len(self._own):
            raise ValueError(state)
        self.ends = tuple((float(low), float(high)) for low, high in state)
