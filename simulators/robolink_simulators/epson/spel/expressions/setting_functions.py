"""Functions about a robot's retained settings.

Arm, ArmDef and ArmSet, the functions (docs/reference/spel.md 6.2).

Arch, the function (docs/reference/spel.md 7.1).

What Box and Plane tell: whether a tip is inside, and what was defined.

Source: docs/reference/spel.md 5.5. The tip of the selected tool is looked at, whether the motors
are on or off, and in the middle of a motion too.

XYLimDef, XYLimMode and the corners of XYLim (docs/reference/spel.md 5.2, 7.2).

What was set of the drives: LimZMargin, QP, PTPBoost(1) ... (docs/reference/spel.md 7.2).

What Hofs, CalPls, MCordr, HomeSet and Brake give as functions (docs/reference/spel.md 7.2).
"""

from collections.abc import Callable, Sequence
from typing import Final

from robolink.model import Pose
from robolink.timing import NS_PER_S
from robolink_simulators.epson.arm.areas import AreaTable, CheckBox, CheckPlane
from robolink_simulators.epson.arm.joint_settings import DRIVE_SETTINGS
from robolink_simulators.epson.arm.kinematics import tip_of
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.memory.robot import DrivenRobot
from robolink_simulators.epson.spel.expressions.values import Value, as_integer, out_of_range
from robolink_simulators.epson.spel.session import Session


def _value(session: Session, arguments: Sequence[Value]) -> Value:
    number, which = (as_integer(argument) for argument in arguments)
    values = session.machine.kept.arms.values(number)
    if not 1 <= which <= len(values):
        raise out_of_range(f"An arm has no value {which}, only 1 to {len(values)}")
    return values[which - 1]


ARM_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Sequence[Value]], Value]]]] = {
    "arm": (range(1), lambda s, _: s.machine.kept.arms.selected),
    "armdef": (range(1, 2), lambda s, a: s.machine.kept.arms.is_defined(as_integer(a[0]))),
    "armset": (range(2, 3), _value),
}
"""Functions by name, each with its allowed numbers of arguments."""


def _side(session: Session, arguments: Sequence[Value]) -> Value:
    number, side = (as_integer(argument) for argument in arguments)
    arch = session.machine.kept.arches.get(number)
    if arch is None or side not in (1, 2):
        raise out_of_range(f"There is no Arch({number}, {side})")
    return arch[side - 1]


ARCH_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Sequence[Value]], Value]]]] = {
    "arch": (range(2, 3), _side),
}
"""Functions by name, each with its allowed numbers of arguments."""


Arguments = Sequence[Value]

ANY_ROBOT: Final = "all"
"""Value of the argument All of InsideBox and InsidePlane."""


def _robot(session: Session, arguments: Arguments, at: int) -> DrivenRobot:
    """Return the robot whose number is an argument, else the current one."""
    machine = session.machine
    return machine.numbered(as_integer(arguments[at])) if len(arguments) > at else machine.robot


def _table(robot: DrivenRobot, word: str) -> AreaTable[CheckBox] | AreaTable[CheckPlane]:
    areas = robot.kept.areas
    return areas.boxes if word == "box" else areas.planes


def _holds(session: Session, robot: DrivenRobot, area: CheckBox | CheckPlane) -> bool:
    tip = robot.point_at(robot.tip_on_the_way(session.machine.inputs.instant_ns))
    local = area.local if isinstance(area, CheckBox) else 0
    return area.holds(robot.locals.convert(tip, local).coordinates)


def _inside(word: str) -> Callable[[Session, Arguments], Value]:
    """Return InsideBox or InsidePlane; with All, any robot that has the area counts."""

    def tell(session: Session, arguments: Arguments) -> Value:
        number = as_integer(arguments[0])
        if arguments[-1] == ANY_ROBOT:
            return bool(_robots_inside(word, session, number))
        robot = _robot(session, arguments, 1)
        return _holds(session, robot, _table(robot, word).get(number))

    return tell


def _robots_inside(word: str, session: Session, number: int) -> int:
    bits = 0
    for index, robot in enumerate(session.machine.robots):
        area = _table(robot, word).find(number)
        if area is not None and _holds(session, robot, area):
            bits |= 1 << index
    return bits


def _which(word: str) -> Callable[[Session, Arguments], Value]:
    """Return GetRobotInsideBox or GetRobotInsidePlane: a bit for each robot inside."""
    return lambda session, arguments: _robots_inside(word, session, as_integer(arguments[0]))


def _defined(word: str) -> Callable[[Session, Arguments], Value]:
    def tell(session: Session, arguments: Arguments) -> Value:
        return (
            _table(_robot(session, arguments, 1), word).find(as_integer(arguments[0])) is not None
        )

    return tell


def corner_of_box(session: Session, arguments: Arguments) -> Point:
    """Return Box(n[, robot], 1 | 2): the lowest or the highest X, Y and Z.

    Raises:
        Refusal: It is not defined, or there is no such corner.
    """
    *named, corner = arguments
    which = as_integer(corner)
    box = _robot(session, named, 1).kept.areas.boxes.get(as_integer(arguments[0]))
    if which not in (1, 2):
        raise out_of_range(f"A box has no corner {which}")
    x, y, z = (span[which - 1] for span in box.spans)
    return Point((x, y, z, 0.0, 0.0, 0.0), local=box.local)


def plane_as_point(session: Session, arguments: Arguments) -> Point:
    """Return Plane(n[, robot]): its coordinate system.

    Raises:
        Refusal: It is not defined.
    """
    planes = _robot(session, arguments, 1).kept.areas.planes
    return Point(planes.get(as_integer(arguments[0])).coordinates)


AREA_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Arguments], Value]]]] = {
    "insidebox": (range(1, 3), _inside("box")),
    "insideplane": (range(1, 3), _inside("plane")),
    "getrobotinsidebox": (range(1, 2), _which("box")),
    "getrobotinsideplane": (range(1, 2), _which("plane")),
    "boxdef": (range(1, 3), _defined("box")),
    "planedef": (range(1, 3), _defined("plane")),
}
"""Functions by name, each with its allowed numbers of arguments."""


def corner_of_limits(session: Session, arguments: Sequence[Value]) -> Point:
    """Return XYLim(1), the lower limits, or XYLim(2), the upper ones.

    Raises:
        Refusal: There is no such corner.
    """
    which = as_integer(arguments[0])
    if which not in (1, 2):
        raise out_of_range(f"There is no XYLim({which})")
    return Point((*session.machine.kept.limits.corners[which - 1], 0.0, 0.0, 0.0))


def outside_limits_mm(session: Session, flange: Pose) -> float:
    """Return how far a place of the flange brings the robot outside the limits of XYLim.

    Whether they hold the tip of the selected tool or the flange, the documents leave open.
    """
    machine, place = session.machine, flange
    if session.options.xylim_counts == "tip":
        place = tip_of(machine.model, flange, machine.offset)
    return machine.kept.limits.outside_mm(place.coordinates()[:3])


LIMIT_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Sequence[Value]], Value]]]] = {
    "xylimdef": (range(1), lambda s, _: s.machine.kept.limits.defined),
    "xylimmode": (range(1), lambda s, _: int(s.machine.kept.limits.strict)),
}
"""Functions by name, each with its allowed numbers of arguments."""


def _told(word: str) -> Callable[[Session, Sequence[Value]], Value]:
    def tell(session: Session, arguments: Sequence[Value]) -> Value:
        machine = session.machine
        robot, at = machine.robot, as_integer(arguments[0]) if arguments else 1
        if word == "performmode" and arguments:
            robot, at = machine.numbered(at), 1
        values = robot.drives.get(word)
        if not 1 <= at <= len(values):
            raise out_of_range(f"{word} has no value {at}")
        value = values[at - 1]
        return int(value) if value == int(value) else value

    return tell


def _end_of_range(session: Session, arguments: Sequence[Value]) -> Value:
    """Return JRange(joint, 1 or 2): the lower or the upper end in pulses."""
    joint, end = (as_integer(argument) for argument in arguments)
    if not 1 <= joint <= session.machine.model.axes or end not in {1, 2}:
        raise out_of_range(f"There is no end {end} of a joint {joint}")
    return session.machine.robot.kept.ranges.pulses()[2 * joint - 3 + end]


DRIVE_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Sequence[Value]], Value]]]] = {
    **{word: (range(2), _told(word)) for word in DRIVE_SETTINGS},
    "jrange": (range(2, 3), _end_of_range),
    "finestatus": (range(1), lambda s, _: int(s.machine.robot.drives.get("finedist")[0] > 0)),
}
"""Functions by name, each with its allowed numbers of arguments."""


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
"""Functions by name, each with its allowed numbers of arguments."""
