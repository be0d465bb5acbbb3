"""Points as ``Print`` shows them (docs/reference/epson.md 3.3, docs/reference/spel.md 5.6).

A real capture::

     X: -182.632 Y:  240.114 Z:  -20.002 U:  -36.156 V:    0.000 W:    0.000 /R /0
"""

import re
from dataclasses import dataclass
from typing import Final, Literal

from robolink.messages import tr
from robolink.model import Hand
from robolink.protocols.spel._numbers import NUMBER, decimal, unreadable

_AXES: Final = "XYZUVW"
_FOUR: Final = r"\s+".join(rf"{axis}:\s*({NUMBER})" for axis in _AXES[:4])
_TWO: Final = "".join(rf"\s+{axis}:\s*({NUMBER})" for axis in _AXES[4:])
_FLAG: Final = rf"/[A-Z0-9]{{1,6}}(?:\({NUMBER}\))?"
_POINT: Final = re.compile(rf"\s*{_FOUR}(?:{_TWO})?(?P<flags>(?:\s*{_FLAG})*)\s*", re.ASCII)
_HANDS: Final = {"R": Hand.RIGHT, "L": Hand.LEFT}
_MARKS: Final = {hand: mark for mark, hand in _HANDS.items()}
_HIGHEST_LOCAL: Final = 15


@dataclass(frozen=True, slots=True)
class PrintedPoint:
    """A point as printed.

    Attributes:
        coordinates: X Y Z in mm and U in degrees, or these and V W in degrees.
        hand: ``/R`` or ``/L``, ``None`` when neither was printed.
        flags: Every flag as printed, without the slash, for example ``("R", "0")``.
        local: The local that the coordinates are in; 0 when none was printed.
    """

    coordinates: tuple[float, ...]
    hand: Hand | None = None
    flags: tuple[str, ...] = ()
    local: int = 0

    @classmethod
    def of(
        cls, coordinates: tuple[float, ...], *, hand: Hand | None = None, local: int = 0
    ) -> "PrintedPoint":
        """Return a point with the flags that a SCARA prints: hand, then local."""
        marks = () if hand is None else (_MARKS[hand],)
        return cls(coordinates, hand, (*marks, str(local)), local)


def parse_point(text: str) -> PrintedPoint:
    """Read a printed point, whatever the width of its columns.

    Raises:
        RemoteProtocolError: It is not a point, or its flags contradict each other.
    """
    match = _POINT.fullmatch(text)
    if match is None:
        raise unreadable(tr("a point"), text)
    *numbers, tail = match.groups()
    flags = tuple(flag.strip() for flag in tail.split("/")[1:])
    hands = [_HANDS[flag] for flag in flags if flag in _HANDS]
    local, *more = [int(flag) for flag in flags if flag.isdigit()] or [0]
    if more or local > _HIGHEST_LOCAL or len(hands) > 1:
        raise unreadable(tr("a point"), text)
    return PrintedPoint(
        coordinates=tuple(float(number) for number in numbers if number is not None),
        hand=hands[0] if hands else None,
        flags=flags,
        local=local,
    )


def format_point(
    point: PrintedPoint,
    *,
    coordinates: Literal["six", "four"] = "six",
    width: Literal[9, 8] = 9,
) -> str:
    """Return ``point`` as a controller prints it; the twin of :func:`parse_point`.

    Args:
        point: What to print.
        coordinates: ``six`` shows V and W, as zeros where the point has none; ``four`` leaves
            them out.
        width: Columns of a value: 9 in the real capture, 8 in one sample
            (docs/reference/spel.md 5.6).
    """
    shown = (*point.coordinates, 0.0, 0.0)[: 6 if coordinates == "six" else 4]
    values = zip(_AXES, shown, strict=False)
    parts = [f"{axis}:{decimal(value).rjust(width)}" for axis, value in values]
    return " " + " ".join([*parts, *(f"/{flag}" for flag in point.flags)])
