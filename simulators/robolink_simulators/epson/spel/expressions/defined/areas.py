"""What Box and Plane tell: whether a tip is inside, and what was defined.

Source: docs/reference/spel.md 5.5. The tip of the selected tool is looked at, whether the motors
are on or off, and in the middle of a motion too.
"""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.definitions.areas import AreaTable, CheckBox, CheckPlane
from robolink_simulators.epson.memory.driven_robot import DrivenRobot
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.values import Value, as_integer, out_of_range
from robolink_simulators.epson.spel.session import Session

Arguments = Sequence[Value]

ANY_ROBOT: Final = "all"
"""What stands for All among the arguments of InsideBox and InsidePlane."""


def _robot(session: Session, arguments: Arguments, at: int) -> DrivenRobot:
    """Return the robot whose number is an argument, else the one in force."""
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
"""Name to the numbers of arguments allowed and the function."""
