"""What Hofs, CalPls, MCordr, HomeSet and Brake give as functions (docs/reference/spel.md 7.2)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink.timing import NS_PER_S
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.values import Value, as_integer, out_of_range
from robolink_simulators.epson.spel.session import Session

Arguments = Sequence[Value]

NS_PER_HOUR: Final = 3600 * NS_PER_S


def _item(values: Sequence[int], number: Value) -> Value:
    at = as_integer(number)
    if not 1 <= at <= len(values):
        raise out_of_range(f"There is no value {at}, only 1 to {len(values)}")
    return values[at - 1]


def _reference(session: Session, arguments: Arguments) -> Value:
    """CalPls(joint); 0 asks whether it was set."""
    pulses = session.machine.kept.origins.reference
    if as_integer(arguments[0]) == 0:
        return int(pulses is not None)
    return _item(pulses or (0,) * session.machine.model.axes, arguments[0])


def _home(session: Session, arguments: Arguments) -> Value:
    """HomeSet(joint); 0 asks whether it was set."""
    home = session.machine.settings.home_pulses
    if as_integer(arguments[0]) == 0:
        return int(home is not None)
    if home is None:
        raise SpelRefusal(RefusalKind.HOME_UNDEFINED, "No home position is set")
    return _item(home, arguments[0])


def _brake(session: Session, arguments: Arguments) -> Value:
    """Brake(joint): 1 while it holds; those of a SCARA are not simulated."""
    robot = session.machine.robot
    if not robot.model.six_axes:
        raise SpelRefusal(RefusalKind.OTHER_ROBOT, "Brake is for six axes")
    return _item([int(closed) for closed in robot.brakes_closed], arguments[0])


def _motor_hours(session: Session, arguments: Arguments) -> Value:
    """MHour([robot]): hours that the motors were on, from the start of the simulation (assumed)."""
    machine = session.machine
    robot = machine.numbered(as_integer(arguments[0])) if arguments else machine.robot
    return robot.motors_on_ns / NS_PER_HOUR


ORIGIN_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Arguments], Value]]]] = {
    "hofs": (range(1, 2), lambda s, a: _item(s.machine.kept.origins.offsets, a[0])),
    "calpls": (range(1, 2), _reference),
    "mcordr": (range(1, 2), lambda s, a: _item(s.machine.kept.origins.order, a[0])),
    "mcalcomplete": (range(1), lambda *_: True),
    "homeset": (range(1, 2), _home),
    "brake": (range(1, 2), _brake),
    "mhour": (range(2), _motor_hours),
}
"""Name to the numbers of arguments allowed and the function."""
