"""Straight moves that an input ends or marks, and what they leave to be read.

Source: docs/reference/spel.md 7.1.

``Till`` brings the robot to rest at the edge; ``TillOn`` tells whether it did. ``Find`` lets it
go on and keeps the position at the edge in ``FindPos``; ``PosFound`` tells whether there is
one. A move takes one of the two. ``Sw(n) = On`` and ``Off`` are the documented inline forms.
"""

from robolink.messages import tr
from robolink.model import Pose
from robolink.protocols.spel._statements import Statement, check_range, move

_LAST_INPUT = 0xFFFF
"""Two bytes carry a bit number (docs/reference/epson.md 2.2); which exist depends on the
hardware."""


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
    """``Move XY(...) Find Sw(3) = On``: note where the input switches, and go on.

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
