"""Statements, built from typed values; nothing that a person typed passes unchecked.

A :data:`Statement` is made by a function of this package, which writes strict ASCII numbers into a
fixed form, so that no value can turn into another statement. The one door past them is
:meth:`robolink.controllers.EpsonController.execute_raw`.

Straight moves that an input ends or marks, and what they leave to be read.

Source: docs/reference/spel.md 7.1.

``Till`` brings the robot to rest at the edge; ``TillOn`` tells whether it did. ``Find`` lets it
go on and keeps the position at the edge in ``FindPos``; ``PosFound`` tells whether there is
one. A move takes one of the two. ``Sw(n) = On`` and ``Off`` are the documented inline forms.
"""

from dataclasses import replace
from typing import Final, NewType, TypeVar

from robolink.errors import LocalProtocolError
from robolink.messages import tr
from robolink.model import Hand, Pose, Posture, ToolOffset
from robolink.protocols.spel._values import decimal, posture_marks

Statement = NewType("Statement", str)
"""One SPEL+ statement, valid for Execute."""

MAX_STATEMENT: Final = 4060
"""Largest number of bytes of a statement (docs/reference/epson.md 1.5)."""

_HANDS: Final = {Hand.RIGHT: " /R", Hand.LEFT: " /L"}
LAST_TOOL: Final = 15
_MIN_SPEED_MM_S: Final = 0.1
_MAX_SPEED_MM_S: Final = 2000.0
_MIN_ACCEL_MM_S2: Final = 0.1
_ACCELERATIONS: Final = (2, 6)

_Speed = TypeVar("_Speed", int, float)


def set_tool(tool: int, offset: ToolOffset, *, six_axes: bool) -> Statement:
    """``TLSet 1, XY(...)``: define a tool, mm and degrees. Wears the flash.

    Source: docs/reference/epson.md 3.1.

    Args:
        tool: Number of the tool, 1 to 15.
        offset: What it is to hold, mm and degrees.
        six_axes: Whether the robot has six axes, so that V and W are sent.

    Raises:
        LocalProtocolError: No such tool, or V or W on a robot of four axes.

    Example:
        >>> from robolink import ToolOffset
        >>> from robolink.protocols.spel import set_tool
        >>> set_tool(1, ToolOffset(12.3, -3.7, -20), six_axes=False)
        'TLSet 1, XY(12.300, -3.700, -20.000, 0.000)'
    """
    check_range(tr("A tool that can be set"), tool, 1, LAST_TOOL)
    return Statement(f"TLSet {tool}, {_xy(offset.components(), six_axes=six_axes)}")


def clear_tool(tool: int) -> Statement:
    """``TLClr 1``: remove a tool's definition (docs/reference/epson.md 3.1). Wears the flash.

    Raises:
        LocalProtocolError: No such tool.
    """
    check_range(tr("A tool that can be cleared"), tool, 1, LAST_TOOL)
    return Statement(f"TLClr {tool}")


def select_tool(tool: int) -> Statement:
    """``Tool 1``: select a tool; 0 is the flange (docs/reference/epson.md 3.1).

    Raises:
        LocalProtocolError: No such tool.
    """
    check_range(tr("A tool"), tool, 0, LAST_TOOL)
    return Statement(f"Tool {tool}")


def go(target: Pose, *, six_axes: bool) -> Statement:
    """``Go XY(...)``: move point to point (docs/reference/spel.md 7.1).

    Raises:
        LocalProtocolError: V or W on a robot of four axes, or a local other than 0.
    """
    return Statement(f"Go {_target(target, six_axes=six_axes)}")


def move(target: Pose, *, six_axes: bool) -> Statement:
    """``Move XY(...)``: move along a straight line (docs/reference/spel.md 7.1).

    Raises:
        LocalProtocolError: V or W on a robot of four axes, or a local other than 0.
    """
    return Statement(f"Move {_target(target, six_axes=six_axes)}")


def power_low() -> Statement:
    """``Power Low``: the tip stays below 250 mm/s (docs/reference/epson.md 3.4)."""
    return Statement("Power Low")


def power_high() -> Statement:
    """``Power High``: the speeds that were set take effect (docs/reference/spel.md 7.2)."""
    return Statement("Power High")


def speed(percent: int, depart: int | None = None, approach: int | None = None) -> Statement:
    """``Speed 5``: joint speed in percent; Jump's departure and approach follow it if left out.

    Args:
        percent: Of the largest joint speed.
        depart: The same for the departure of Jump.
        approach: The same for its approach.

    Raises:
        LocalProtocolError: Not 1 to 100 (docs/reference/spel.md 7.2), or only one of the two given.

    Example:
        >>> from robolink.protocols.spel import speed
        >>> speed(5), speed(5, 3, 2)
        ('Speed 5', 'Speed 5, 3, 2')
    """
    values = _three(percent, depart, approach)
    for value in values:
        check_range(tr("A speed in percent"), value, 1, 100)
    return Statement("Speed " + ", ".join(str(value) for value in values))


def speed_s(mm_s: float, depart: float | None = None, approach: float | None = None) -> Statement:
    """``SpeedS 20.000``: straight-line speed in mm/s; the other two follow it if left out.

    Args:
        mm_s: Speed of the tool on a straight line.
        depart: The same for the departure of Jump.
        approach: The same for its approach.

    Raises:
        LocalProtocolError: Not 0.1 to 2000 mm/s (docs/reference/spel.md 7.2), or only one of the
            two given.

    Example:
        >>> from robolink.protocols.spel import speed_s
        >>> speed_s(20)
        'SpeedS 20.000'
    """
    values = _three(mm_s, depart, approach)
    written = ", ".join(decimal(value) for value in values)
    for value in values:
        if not _MIN_SPEED_MM_S <= value <= _MAX_SPEED_MM_S:
            raise LocalProtocolError(
                tr("A straight-line speed of {value} mm/s cannot be set.", value=value),
                remedy=tr("Use 0.1 to 2000 mm/s."),
            )
    return Statement(f"SpeedS {written}")


def accel_s(*values_mm_s2: float) -> Statement:
    """``AccelS 150.000, 100.000``: acceleration and deceleration of straight movements.

    The highest value depends on the robot, so it is left to the controller.

    Args:
        values_mm_s2: Both; or six, with those of Jump3's departure and approach.

    Raises:
        LocalProtocolError: Another number of them, or one below 0.1 mm/s^2 (docs/reference/spel.md
            7.2).

    Example:
        >>> from robolink.protocols.spel import accel_s
        >>> accel_s(150, 100)
        'AccelS 150.000, 100.000'
    """
    if len(values_mm_s2) not in _ACCELERATIONS or min(values_mm_s2) < _MIN_ACCEL_MM_S2:
        raise LocalProtocolError(
            tr("These accelerations cannot be set: {values}.", values=values_mm_s2),
            remedy=tr("Give two or six values of 0.1 mm/s^2 or more."),
        )
    return Statement("AccelS " + ", ".join(map(decimal, values_mm_s2)))


def _point(target: Pose, *, six_axes: bool) -> str:
    if target.local != 0:
        raise LocalProtocolError(
            tr("A target in local {local} cannot be moved to.", local=target.local),
            remedy=tr("Give the target in local 0, the robot's base."),
        )
    flags = "" if target.hand is None else _HANDS[target.hand]
    if target.posture is not None:
        marks = posture_marks(target.posture, six_axes=six_axes)
        flags += "".join(f" /{mark}" for mark in marks)
    return f"{_xy(target.coordinates(), six_axes=six_axes)}{flags} /0"


def _target(target: Pose, *, six_axes: bool) -> str:
    """Return a point to move to.

    On six axes its joints 1, 4 and 6 take the turns nearest to where they are: a tool that is
    turned by a few degrees is not to go round the other way, with its cables, because a flag of the
    place it came from says so. Hand, elbow and wrist stay those of the point (LJM with flag 2,
    docs/reference/epson-robots.md, "Flags").
    """
    point = _point(target, six_axes=six_axes)
    return f"LJM({point}, Here, 2)" if six_axes and target.posture is not None else point


def print_reachable(target: Pose, *, six_axes: bool) -> Statement:
    """Whether a point can be reached, a Boolean; raises no error if it cannot.

    Source: docs/reference/spel.md 5.3.

    Raises:
        LocalProtocolError: As :func:`go`.
    """
    posture = target.posture
    if posture is not None and six_axes:
        # In the first turn of each joint: the turn that a movement uses is a separate question.
        posture = Posture(posture.elbow, posture.wrist)
    plain = replace(target, posture=posture)
    return Statement(f"Print TargetOK({_point(plain, six_axes=six_axes)})")


def print_joint_of(target: Pose, joint: int, *, six_axes: bool) -> Statement:
    """The value of one joint at a point, in degrees or mm (docs/reference/spel.md 5.3).

    Args:
        target: The point.
        joint: Number of the joint, from 1.
        six_axes: Whether the robot has six axes, so that V and W are sent.

    Raises:
        LocalProtocolError: As :func:`go`, or no such joint.

    Example:
        >>> from robolink import Pose
        >>> from robolink.protocols.spel import print_joint_of
        >>> print_joint_of(Pose(300, 100, -60, 0), 2, six_axes=False)
        'Print PAgl(XY(300.000, 100.000, -60.000, 0.000) /0, 2)'
    """
    check_range(tr("A joint"), joint, 1, 6)
    return Statement(f"Print PAgl({_target(target, six_axes=six_axes)}, {joint})")


_ZERO: Final = decimal(0.0)


def _xy(values: tuple[float, ...], *, six_axes: bool) -> str:
    written = [decimal(value) for value in values]
    if not six_axes:
        if any(value != _ZERO for value in written[4:]):
            raise LocalProtocolError(
                tr(
                    "A four-axis robot cannot take V = {v} and W = {w}.",
                    v=values[4],
                    w=values[5],
                ),
                remedy=tr("Leave V and W at 0."),
            )
        del written[4:]
    return f"XY({', '.join(written)})"


def _three(first: _Speed, depart: _Speed | None, approach: _Speed | None) -> tuple[_Speed, ...]:
    if depart is None and approach is None:
        return (first,)
    if depart is None or approach is None:
        raise LocalProtocolError(
            tr("Departure and approach speed are set together."),
            remedy=tr("Give both, or neither."),
        )
    return (first, depart, approach)


def check_range(what: str, value: int, low: int, high: int) -> None:
    """Refuse a number outside ``low`` to ``high``.

    Raises:
        LocalProtocolError: Says what the range is.
    """
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise LocalProtocolError(
            tr(
                "{what} is {low} to {high}, not {value!r}.",
                what=what,
                low=low,
                high=high,
                value=value,
            ),
            remedy=tr("Nothing was sent. Correct the number."),
        )


_LAST_INPUT = 0xFFFF
"""Highest bit number that two bytes hold (docs/reference/epson.md 2.2); the hardware decides which
exist."""


def move_till(target: Pose, bit: int, *, on: bool, six_axes: bool) -> Statement:
    """``Move XY(...) Till Sw(3) = On``: stop where the input switches.

    Args:
        target: Where the movement ends when the input does not switch.
        bit: Number of the input.
        on: Whether it is waited for until it is on, or off.
        six_axes: Whether the robot has six axes, so that V and W are sent.

    Raises:
        LocalProtocolError: As :func:`move`, or no such input.

    Example:
        >>> from robolink import Pose
        >>> from robolink.protocols.spel import move_till
        >>> move_till(Pose(300, 100, -60, 0), 3, on=True, six_axes=False)
        'Move XY(300.000, 100.000, -60.000, 0.000) /0 Till Sw(3) = On'
    """
    return _move_with("Till", target, bit, on=on, six_axes=six_axes)


def move_find(target: Pose, bit: int, *, on: bool, six_axes: bool) -> Statement:
    """``Move XY(...) Find Sw(3) = On``: note where the input switches, and continue.

    Args:
        target: Where the movement ends.
        bit: Number of the input.
        on: Whether it is waited for until it is on, or off.
        six_axes: Whether the robot has six axes, so that V and W are sent.

    Raises:
        LocalProtocolError: As :func:`move`, or no such input.

    Example:
        >>> from robolink import Pose
        >>> from robolink.protocols.spel import move_find
        >>> move_find(Pose(300, 100, -60, 0), 3, on=True, six_axes=False)
        'Move XY(300.000, 100.000, -60.000, 0.000) /0 Find Sw(3) = On'
    """
    return _move_with("Find", target, bit, on=on, six_axes=six_axes)


def print_input(bit: int) -> Statement:
    """1 when an input is on, else 0 (docs/reference/spel.md 8).

    Raises:
        LocalProtocolError: ``bit`` is not 0 to 65535.
    """
    return Statement(f"Print Sw({_input(bit)})")


def print_till_on() -> Statement:
    """Whether the last move was stopped by its ``Till``, a Boolean.

    Source: docs/reference/spel.md 7.1, p. 831.
    """
    return Statement("Print TillOn")


def print_position_found() -> Statement:
    """Whether the last ``Find`` met its condition, a Boolean (docs/reference/spel.md 7.1)."""
    return Statement("Print PosFound")


def print_found_position() -> Statement:
    """Where the last ``Find`` met its condition, as a point.

    Source: docs/reference/spel.md 5.3, p. 328.
    """
    return Statement("Print FindPos")


def _move_with(word: str, target: Pose, bit: int, *, on: bool, six_axes: bool) -> Statement:
    state = "On" if on else "Off"
    return Statement(f"{move(target, six_axes=six_axes)} {word} Sw({_input(bit)}) = {state}")


def _input(bit: int) -> int:
    check_range(tr("An input"), bit, 0, _LAST_INPUT)
    return bit
