"""Statements that only print, and a wait: they change nothing and move nothing.

Source: docs/reference/epson.md 3.1, 3.3; docs/reference/spel.md 5.3, 6.1, 7.2, 9.

Those that take a number raise LocalProtocolError when it is out of range.

The three lines of ``Where`` (docs/reference/epson.md 3.3, docs/reference/spel.md 5.6).

The layout below is what a client in the field reads by columns: a label of two characters,
the value, a unit, sixteen columns in all::

    WORLD:  X:  350.000 mm  Y:    0.000 mm  Z:  -20.000 mm  U:   90.000 deg V: ...
    JOINT:  1:   -6.905 deg 2:   91.000 deg 3:  -20.000 mm  4:    5.905 deg
    PULSE:  1:   -15713 pls 2:   207076 pls 3:  -227556 pls 4:    24507 pls
"""

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache
from typing import Final, Literal

from robolink.errors import LocalProtocolError
from robolink.messages import tr
from robolink.protocols.spel._statements import LAST_TOOL, Statement, check_range
from robolink.protocols.spel._values import NUMBER, decimal, parse_integer, unreadable

_LAST_OUTPUT = 0xFFFF
"""Highest bit number that two bytes hold (docs/reference/epson.md 2.2); the hardware decides which
exist."""

_LAST_SPEED = 3
_LAST_ACCELERATION = 6
_LAST_JOINT = 6
_LAST_POINT = 999


_PRINT: Final = "Print "


def print_several(*queries: Statement) -> Statement:
    """Several values in one statement, with commas between (docs/reference/spel.md 3.2).

    Raises:
        LocalProtocolError: One of them is not a ``Print``.

    Example:
        >>> from robolink.protocols import spel
        >>> spel.print_several(spel.print_selected_tool(), spel.print_speed(1))
        'Print Tool, Speed(1)'
    """
    return _listed(queries)


@lru_cache(maxsize=512)
def _listed(queries: tuple[Statement, ...]) -> Statement:
    """Return the statement of a list; the same few are asked for, each with a number of its own."""
    for query in queries:
        if not query.startswith(_PRINT):
            raise LocalProtocolError(tr("{query!r} prints nothing that a list takes.", query=query))
    return Statement(_PRINT + ", ".join(query.removeprefix(_PRINT) for query in queries))


def print_number(number: int) -> Statement:
    """A number that is known, by which the answer is recognized."""
    return Statement(f"{_PRINT}{number}")


def print_known_numbers() -> Statement:
    """Three numbers that are known: they show what this controller prints for a comma.

    :func:`gap_in_known_numbers` reads the answer.
    """
    return Statement("Print 1, 22, 333")


def print_selected_tool() -> Statement:
    """The number of the selected tool."""
    return Statement("Print Tool")


def print_tool_defined(tool: int) -> Statement:
    """Whether tool 1 to 15 has a definition, a Boolean; raises no error if it has none."""
    return Statement(f"Print TLDef({_tool(tool)})")


def print_tool(tool: int) -> Statement:
    """The definition of tool 1 to 15, as a point."""
    return Statement(f"Print TLSet({_tool(tool)})")


def list_tools() -> Statement:
    """All defined tools, a line each."""
    return Statement("TLSet")


def print_real_position() -> Statement:
    """The measured position of the selected tool, as a point."""
    return Statement("Print RealPos")


def print_here() -> Statement:
    """The commanded position of the selected tool, as a point."""
    return Statement("Print Here")


def print_point_defined(number: int) -> Statement:
    """Whether point P0 to P999 is taught, a Boolean (docs/reference/spel.md 5.1)."""
    return Statement(f"Print PDef(P{_point(number)})")


def print_point(number: int) -> Statement:
    """A taught point, P0 to P999; one that is not taught is error 7007.

    Source: docs/reference/spel.md 5.1.
    """
    return Statement(f"Print P{_point(number)}")


def print_robot() -> Statement:
    """The number of the current robot."""
    return Statement("Print Robot")


class RobotType(IntEnum):
    """What RobotType gives (docs/reference/spel.md 9)."""

    JOINT = 1
    CARTESIAN = 2
    SCARA = 3
    SIX_AXIS = 5
    RS = 6
    N = 7


_SIX_JOINTS: Final = frozenset({RobotType.SIX_AXIS, RobotType.N})
_NAMES_OF_TYPES: Final = {
    "joint": RobotType.JOINT,
    "cartesian": RobotType.CARTESIAN,
    "scara": RobotType.SCARA,
    "6-axis": RobotType.SIX_AXIS,
    "six-axis": RobotType.SIX_AXIS,
    "rs": RobotType.RS,
    "rs series": RobotType.RS,
    "n": RobotType.N,
    "n series": RobotType.N,
}


def tilts_tool(kind: int) -> bool:
    """Return whether a robot of that type has V and W."""
    return kind in _SIX_JOINTS


def parse_robot_type(text: str) -> int:
    """Read a printed RobotType: its number, known or not, or its name in any case.

    Raises:
        RemoteProtocolError: It is neither.
    """
    named = _NAMES_OF_TYPES.get(text.strip().casefold())
    return parse_integer(text) if named is None else named


def print_robot_type() -> Statement:
    """The kind of the current robot; :func:`parse_robot_type` reads it."""
    return Statement("Print RobotType")


def print_robot_model() -> Statement:
    """The model of the current robot, a text (docs/reference/spel.md 9)."""
    return Statement("Print RobotModel$")


def print_robot_serial() -> Statement:
    """The serial number of the current robot, a text (docs/reference/spel.md 9)."""
    return Statement("Print RobotSerial$")


def print_output(bit: int) -> Statement:
    """1 when an output is on, else 0. Remote Ethernet has no request for it.

    Source: docs/reference/spel.md 8.

    Raises:
        LocalProtocolError: ``bit`` is not 0 to 65535.
    """
    check_range(tr("An output"), bit, 0, _LAST_OUTPUT)
    return Statement(f"Print Oport({bit})")


def print_motor() -> Statement:
    """1 when the motors are on, else 0."""
    return Statement("Print Motor")


def print_power() -> Statement:
    """1 in high power, 0 in low."""
    return Statement("Print Power")


def print_speed(index: int) -> Statement:
    """Joint speed in percent: 1 travel, 2 departure, 3 approach."""
    return Statement(f"Print Speed({_which(index)})")


def print_speed_s(index: int) -> Statement:
    """Straight-line speed in mm/s: 1 travel, 2 departure, 3 approach."""
    return Statement(f"Print SpeedS({_which(index)})")


def print_accel_s(index: int) -> Statement:
    """How straight movements speed up and brake, in mm/s^2 (docs/reference/spel.md 7.2).

    Args:
        index: 1 acceleration, 2 deceleration; 3 and 4 the same for Jump3's departure, 5 and 6 for
            its approach.

    Raises:
        LocalProtocolError: ``index`` is not 1 to 6.
    """
    check_range(tr("An acceleration's number"), index, 1, _LAST_ACCELERATION)
    return Statement(f"Print AccelS({index})")


def print_accel(index: int) -> Statement:
    """Accel of joint movements in percent: 1 acceleration, 2 deceleration."""
    return Statement(f"Print Accel({index})")


def print_speed_factor() -> Statement:
    """SpeedFactor in percent: it scales the speed and acceleration of all movements."""
    return Statement("Print SpeedFactor")


def print_joint_angle(joint: int) -> Statement:
    """The commanded angle of joint 1 to 6 in degrees, mm for a linear joint."""
    check_range(tr("A joint"), joint, 1, _LAST_JOINT)
    return Statement(f"Print Agl({joint})")


def where() -> Statement:
    """The commanded position in world, joint and pulse notation; command window only."""
    return Statement("Where")


def show_base() -> Statement:
    """The place of the base, from which positions count (docs/reference/spel.md 5.4)."""
    return Statement("Base")


def _tool(tool: int) -> int:
    check_range(tr("A tool that can be defined"), tool, 1, LAST_TOOL)
    return tool


def _point(number: int) -> int:
    check_range(tr("A point"), number, 0, _LAST_POINT)
    return number


def _which(index: int) -> int:
    check_range(tr("A speed's number"), index, 1, _LAST_SPEED)
    return index


def print_plain_point() -> Statement:
    """A point that was given four coordinates.

    Source: docs/reference/epson.md 3.3: four or six are printed.
    """
    return Statement("Print XY(1, 2, 3, 4)")


def print_two_texts() -> Statement:
    """Two texts with a comma between (docs/reference/spel.md 3.2: a blank, or none)."""
    return Statement("Print Chr$(65), Chr$(66)")


def print_tool_x(tool: int) -> Statement:
    """One coordinate of a defined tool, without a format.

    Source: docs/reference/epson.md 3.3: how many digits.
    """
    check_range(tr("A tool that can be defined"), tool, 1, LAST_TOOL)
    return Statement(f"Print CX(TLSet({tool}))")


def wait_half_a_second() -> Statement:
    """Nothing, for half a second; allowed in the command window (docs/reference/spel.md 4.6)."""
    return Statement("Wait 0.5")


_AXES: Final = ("X", "Y", "Z", "U", "V", "W")
_LABELS: Final = ("WORLD:", "JOINT:", "PULSE:")
_ENTRY: Final = re.compile(rf"\s*([XYZUVW1-9]):\s*({NUMBER})\s+(mm|deg|pls)(?=\s|$)", re.ASCII)

_IN_THE_LISTING: Final = re.compile(NUMBER, re.ASCII)
_COUNTS_OF_A_BASE: Final = (4, 6)

_World = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class PrintedWhere:
    """A position in three notations.

    Attributes:
        world: X Y Z in mm, U V W in degrees, always six.
        joints: Degrees, or mm for a linear joint.
        pulses: Encoder pulses, one per joint.
    """

    world: _World
    joints: tuple[float, ...]
    pulses: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Entry:
    label: str
    value: str
    unit: str


def parse_where(text: str) -> PrintedWhere:
    """Read what ``Where`` printed.

    Raises:
        RemoteProtocolError: A line, a label or a unit is not what it should be.
    """
    lines = [line.strip() for line in text.replace("\r", "\n").split("\n") if line.strip()]
    if len(lines) == len(_LABELS) and all(map(str.startswith, lines, _LABELS)):
        world, joints, pulses = map(_entries, lines)
        if _is_world(world) and _is_joints(joints) and _is_pulses(pulses, len(joints)):
            x, y, z, u, v, w = (float(entry.value) for entry in world)
            return PrintedWhere(
                world=(x, y, z, u, v, w),
                joints=tuple(float(entry.value) for entry in joints),
                pulses=tuple(int(entry.value) for entry in pulses),
            )
    raise unreadable(tr("a position"), text)


def format_where(
    where: PrintedWhere,
    *,
    width: Literal[9, 8] = 9,
    linear_joints: Collection[int] = (3,),
) -> str:
    """Return ``where`` as a controller prints it; the twin of :func:`parse_where`.

    Args:
        where: What to print.
        width: Columns of a value: 9 as read in the field, 8 in one sample
            (docs/reference/spel.md 5.6).
        linear_joints: Numbers of the joints in mm: the third on a SCARA, none on six axes.

    Example:
        >>> from robolink.protocols.spel import PrintedWhere, format_where, parse_where
        >>> world, joints = (300.0, 100.0, -60.0, 0.0, 0.0, 0.0), (18.4, 36.9, -60.0, -55.3)
        >>> where = PrintedWhere(world, joints, (1000, 2000, -3000, 400))
        >>> parse_where(format_where(where)) == where
        True
    """
    world = zip(_AXES, map(decimal, where.world), ("mm",) * 3 + ("deg",) * 3, strict=True)
    joints = (
        (str(joint), decimal(value), "mm" if joint in linear_joints else "deg")
        for joint, value in enumerate(where.joints, start=1)
    )
    pulses = ((str(joint), str(value), "pls") for joint, value in enumerate(where.pulses, start=1))
    rows = (world, joints, pulses)
    return "\r\n".join(_row(*pair, width) for pair in zip(_LABELS, rows, strict=True))


def _row(label: str, entries: Iterable[tuple[str, str, str]], width: int) -> str:
    shown = (f"{name}:{value.rjust(width)} {unit:<3}" for name, value, unit in entries)
    return f"{label}  {' '.join(shown)}".rstrip()


def _entries(line: str) -> list[_Entry]:
    """Return the entries of a labelled line, none when anything else stands in it."""
    entries: list[_Entry] = []
    at = len(_LABELS[0])
    while match := _ENTRY.match(line, at):
        entries.append(_Entry(*match.groups()))
        at = match.end()
    return entries if at == len(line) else []


def _is_world(entries: list[_Entry]) -> bool:
    units = ["mm"] * 3 + ["deg"] * 3
    return [(e.label, e.unit) for e in entries] == list(zip(_AXES, units, strict=True))


def _is_joints(entries: list[_Entry]) -> bool:
    return _is_numbered(entries) and all(entry.unit != "pls" for entry in entries)


def _is_pulses(entries: list[_Entry], count: int) -> bool:
    whole = all(entry.unit == "pls" and "." not in entry.value for entry in entries)
    return len(entries) == count and _is_numbered(entries) and whole


def _is_numbered(entries: list[_Entry]) -> bool:
    expected = [str(number) for number in range(1, len(entries) + 1)]
    return bool(entries) and [entry.label for entry in entries] == expected


def parse_base(text: str) -> tuple[float, ...] | None:
    """Read the place of the base, from which positions count: X, Y, Z in mm, U, V, W in degrees.

    No page shows how a controller lists it (docs/reference/spel.md 5.4), so six numbers alone are
    taken for it, or four for a base that does not lean; ``None`` for anything else.
    """
    numbers = [float(number) for number in _IN_THE_LISTING.findall(text)]
    if len(numbers) not in _COUNTS_OF_A_BASE:
        return None
    return (*numbers, 0.0, 0.0)[:6]
