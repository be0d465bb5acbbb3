"""ATRQ(j), PTRQ(j), RealTorque(j), TCPSpeed and their kin (docs/reference/spel.md 7.4)."""

import math
from collections.abc import Callable, Sequence
from typing import Final

from robolink.timing import NS_PER_S
from robolink_simulators.epson.arm.trajectory import JointLeg
from robolink_simulators.epson.arm.ways.arch import ArchedLeg
from robolink_simulators.epson.drives.guard import CutLeg
from robolink_simulators.epson.drives.observer import DriveObserver, DriveQuantity
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.values import Value, as_integer
from robolink_simulators.epson.spel.session import Session

DriveValue = Callable[[DriveObserver, int], float]
MachineFunction = Callable[[Session, Sequence[Value]], Value]

_STEP_NS: Final = 500_000
_DIGITS: Final = 6


def _of(quantity: DriveQuantity) -> DriveValue:
    return lambda observer, joint: observer.value(quantity, joint)


DRIVE_VALUES: Final[dict[str, DriveValue]] = {
    "atrq": _of(DriveQuantity.MEAN_TORQUE),
    "ptrq": _of(DriveQuantity.PEAK_TORQUE),
    "avgspeed": _of(DriveQuantity.MEAN_SPEED),
    "peakspeed": _of(DriveQuantity.PEAK_SPEED),
    "olrate": DriveObserver.overload,
    "realtorque": DriveObserver.present,
}
"""Name to what tells the value of a joint; the shares are told to six digits (assumed)."""


def joint_number(machine: Machine, number: int) -> int:
    """Return the number of a joint.

    Raises:
        Refusal: The robot has none of that number.
    """
    if not 1 <= number <= machine.model.axes:
        raise SpelRefusal(RefusalKind.JOINT_NUMBER, f"There is no joint {number}")
    return number


def _told(tell: DriveValue) -> MachineFunction:
    def read(session: Session, arguments: Sequence[Value]) -> Value:
        joint = joint_number(session.machine, as_integer(arguments[0]))
        return round(tell(session.machine.robot.observer, joint), _DIGITS)

    return read


def _speed_of_tip(session: Session, _: Sequence[Value]) -> Value:
    """Return the commanded speed of the tip in mm/s, 0 point to point (documented)."""
    machine = session.machine
    leg, now_ns = machine.arm.leg, machine.arm.now_ns
    if isinstance(leg, CutLeg):
        leg = leg.leg
    if leg is None or isinstance(leg, JointLeg | ArchedLeg):
        return 0.0
    ends = [machine.robot.tip_on_the_way(now_ns + step) for step in (-_STEP_NS, _STEP_NS)]
    way_mm = math.dist(*(end.coordinates()[:3] for end in ends))
    return round(way_mm / (2 * _STEP_NS) * NS_PER_S, _DIGITS)


TORQUE_FUNCTIONS: Final[dict[str, tuple[range, MachineFunction]]] = {
    **{word: (range(1, 2), _told(tell)) for word, tell in DRIVE_VALUES.items()},
    "tcpspeed": (range(1), _speed_of_tip),
}
"""Name to the numbers of arguments allowed and the function."""
