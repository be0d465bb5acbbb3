"""Values as SPEL+ writes and prints them: numbers, points, the listing of tools.

Numbers are strict, ASCII, without a locale (docs/reference/spel.md 2.1, 3.2). A point as ``Print``
shows it (docs/reference/epson.md 3.3, docs/reference/spel.md 5.6), a real capture::

     X: -182.632 Y:  240.114 Z:  -20.002 U:  -36.156 V:    0.000 W:    0.000 /R /0

The columns of the listing of ``TLSet`` are not documented (docs/reference/epson.md 3.1,
docs/reference/spel.md 6.1). What Epson's own sample relies on: a line per defined tool, ``Tool``,
the number, a colon, and numbers between commas with any blanks.
"""

import math
import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Final, Literal, NamedTuple

from robolink.errors import ConfigError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import Elbow, Hand, Posture, ToolOffset, Wrist

NUMBER: Final = r"[+-]?[0-9]{1,18}(?:\.[0-9]{1,18})?"
"""Pattern of a plain decimal, for use in larger patterns."""

_NUMBER: Final = re.compile(NUMBER + r"(?:E[+-][0-9]{2,3})?")
_INTEGER: Final = re.compile(r"[+-]?[0-9]{1,18}")
_BLANKS: Final = " \t\r\n"
_TRUE: Final = frozenset({"-1", "1", "true"})
_FALSE: Final = frozenset({"0", "false"})

_AXES: Final = "XYZUVW"
_FOUR: Final = r"\s+".join(rf"{axis}:\s*({NUMBER})" for axis in _AXES[:4])
_TWO: Final = "".join(rf"\s+{axis}:\s*({NUMBER})" for axis in _AXES[4:])
_FLAG: Final = rf"/[A-Z0-9]{{1,6}}(?:\({NUMBER}\))?"
_POINT: Final = re.compile(rf"\s*{_FOUR}(?:{_TWO})?(?P<flags>(?:\s*{_FLAG})*)\s*", re.ASCII)
_HANDS: Final = {"R": Hand.RIGHT, "L": Hand.LEFT}
_MARKS: Final = {hand: mark for mark, hand in _HANDS.items()}
_ELBOWS: Final = {"A": Elbow.ABOVE, "B": Elbow.BELOW}
_WRISTS: Final = {"NF": Wrist.NO_FLIP, "F": Wrist.FLIP}
_JOINT_FLAG: Final = re.compile(r"J([1246])F([0-9]{1,3})", re.ASCII)
_JOINT_ANGLE: Final = re.compile(rf"J([14])A\(({NUMBER})\)", re.ASCII)
_HIGHEST_LOCAL: Final = 15

_LINE: Final = re.compile(
    rf"\s*tool\s*([0-9]{{1,2}})\s*:\s*({NUMBER}(?:\s*,\s*{NUMBER}){{3}}(?:\s*,\s*{NUMBER}\s*,\s*{NUMBER})?)\s*",
    re.ASCII | re.IGNORECASE,
)
_HIGHEST_TOOL: Final = 15

Layout = Literal["plain", "padded", "four"]
"""Format of a simulated controller's tool list; see :func:`format_tool_listing`."""


def decimal(value: float, places: int = 3) -> str:
    """Return ``value`` with ``places`` decimals, as a statement may carry it.

    Three places is what controllers print (docs/reference/epson.md 3.3). Zero never carries a sign.

    Raises:
        ConfigError: ``value`` is not finite.
    """
    if not math.isfinite(value):
        raise ConfigError(
            tr("{value!r} cannot be written as a decimal number.", value=value),
            remedy=tr("Give a finite number."),
        )
    text = f"{value:.{places}f}"
    return text if text.strip("-0.") else text.lstrip("-")


def parse_number(text: str) -> float:
    """Read one printed number: ``-3.25`` or ``1.000000E+014``; blanks may surround it.

    Raises:
        RemoteProtocolError: It is anything else.
    """
    stripped = text.strip(_BLANKS)
    if _NUMBER.fullmatch(stripped):
        value = float(stripped)
        if math.isfinite(value):
            return value
    raise unreadable(tr("a number"), text)


def parse_integer(text: str) -> int:
    """Read one printed whole number; blanks may surround it.

    Raises:
        RemoteProtocolError: It is anything else.
    """
    stripped = text.strip(_BLANKS)
    if _INTEGER.fullmatch(stripped):
        return int(stripped)
    raise unreadable(tr("a whole number"), text)


def parse_boolean(text: str) -> bool:
    """Read a printed Boolean: -1 or 1, 0, or a word; the references disagree.

    Source: docs/reference/spel.md 2.1.

    Raises:
        RemoteProtocolError: It is anything else.
    """
    stripped = text.strip(_BLANKS).lower()
    if stripped in _TRUE:
        return True
    if stripped in _FALSE:
        return False
    raise unreadable(tr("True or False"), text)


_KNOWN: Final = re.compile(r"1(?P<gap>[ \t,;]+)22(?P=gap)333")
_SEPARATORS: Final = " \t,;"


def gap_in_known_numbers(text: str) -> str | None:
    """Return what stands between two numbers of a list; ``None`` if a list cannot be read.

    What a comma of ``Print`` shows is not documented (docs/reference/spel.md 3.2). So it is learnt
    from ``Print 1, 22, 333``: the same blanks, commas or semicolons twice, and nothing else.

    Example:
        >>> from robolink.protocols.spel import gap_in_known_numbers
        >>> gap_in_known_numbers("1 22 333")
        ' '
        >>> gap_in_known_numbers("122333")
    """
    match = _KNOWN.fullmatch(text.strip(_BLANKS))
    return match["gap"] if match else None


def before_last_number(text: str, number: int) -> str | None:
    """Return what a list shows before a number at its end; ``None`` if it has another end."""
    shown, last = text.strip(_BLANKS), str(number)
    if not shown.endswith(last):
        return None
    rest = shown.removesuffix(last)
    before = rest.rstrip(_SEPARATORS)
    return None if before == rest else before  # a longer number ends in these digits, too


def split_numbers(text: str, gap: str, count: int) -> tuple[str, ...] | None:
    """Return the numbers of a list as printed; ``None`` if it has another form.

    Args:
        text: What was printed.
        gap: What stands between two, from :func:`gap_in_known_numbers`.
        count: How many there are.

    Example:
        >>> from robolink.protocols.spel import split_numbers
        >>> split_numbers("1 1 0 5 20", " ", 5)
        ('1', '1', '0', '5', '20')
    """
    numbers = tuple(text.strip(_BLANKS).split(gap))
    whole = len(numbers) == count and all(map(_NUMBER.fullmatch, numbers))
    return numbers if whole else None


def split_before_point(text: str, gap: str, count: int) -> tuple[tuple[str, ...], str] | None:
    """Return numbers and the point after them as printed; ``None`` for another form.

    The label of X shows where the point begins, whatever stands before it.

    Args:
        text: What was printed.
        gap: As for :func:`split_numbers`.
        count: How many numbers there are.

    Example:
        >>> from robolink.protocols.spel import split_before_point
        >>> split_before_point("-1 2 X:  300.000 Y:  100.000", " ", 2)
        (('-1', '2'), 'X:  300.000 Y:  100.000')
    """
    before, label, after = text.partition("X:")
    numbers = split_numbers(before.rstrip(_SEPARATORS), gap, count)
    return (numbers, label + after) if label and numbers else None


def unreadable(wanted: str, text: str) -> RemoteProtocolError:
    """Return the error for a printed text that is not what was asked for."""
    return RemoteProtocolError(
        tr("The controller printed {text!r} instead of {wanted}.", text=text[:200], wanted=wanted),
        remedy=tr("Keep this text and report it with the controller's firmware version."),
        raw=text.encode("utf-8", "backslashreplace"),
    )


class PrintedPoint(NamedTuple):
    """A point as printed.

    Attributes:
        coordinates: X Y Z in mm and U in degrees, or these and V W in degrees.
        hand: ``/R`` or ``/L``, ``None`` when neither was printed.
        flags: Every flag as printed, without the slash, for example ``("R", "0")``.
        local: The local that the coordinates are in; 0 when none was printed.
        posture: Elbow, wrist and joint flags, ``None`` when none of them was printed.
    """

    coordinates: tuple[float, ...]
    hand: Hand | None = None
    flags: tuple[str, ...] = ()
    local: int = 0
    posture: Posture | None = None

    @classmethod
    def of(
        cls,
        coordinates: tuple[float, ...],
        *,
        hand: Hand | None = None,
        local: int = 0,
        posture: Posture | None = None,
        six_axes: bool = False,
    ) -> "PrintedPoint":
        """Return a point with its flags: hand, those of the posture, then local.

        What a six-axis robot prints besides the hand was seen nowhere (assumed).

        Args:
            coordinates: X, Y, Z, U, and V, W where there are six, mm and degrees.
            hand: Hand of the arm, where it is known.
            local: Number of the local.
            posture: The other flags of the arm.
            six_axes: Whether the robot has six axes.

        Example:
            >>> from robolink.model import Hand
            >>> from robolink.protocols.spel import PrintedPoint
            >>> PrintedPoint.of((300.0, 100.0, -60.0, 0.0), hand=Hand.RIGHT).flags
            ('R', '0')
        """
        marks: tuple[str, ...] = () if hand is None else (_MARKS[hand],)
        if posture is not None:
            marks += posture_marks(posture, six_axes=six_axes)
        return cls(coordinates, hand, (*marks, str(local)), local, posture)


def posture_marks(posture: Posture, *, six_axes: bool) -> tuple[str, ...]:
    """Return the flags of a posture without their slashes, ``A NF J4F0 J6F0`` for instance.

    Source: docs/reference/spel.md 5.1; J1F is written where it is not 0, J2F on an arm without
    elbow and wrist only, and the angles of singular places where they are told.
    """
    first = (f"J1F{posture.j1_flag}",) if posture.j1_flag else ()
    if not six_axes:
        folded = (f"J2F{posture.j2_flag}",) if posture.j2_flag else ()
        return (*first, *folded, *_angle_marks(posture))
    elbow = "A" if posture.elbow is Elbow.ABOVE else "B"
    wrist = "NF" if posture.wrist is Wrist.NO_FLIP else "F"
    turns = (*first, f"J4F{posture.j4_flag}", f"J6F{posture.j6_flag}")
    return (elbow, wrist, *turns, *_angle_marks(posture))


def _angle_marks(posture: Posture) -> tuple[str, ...]:
    angles = {1: posture.j1_angle_deg, 4: posture.j4_angle_deg}
    return tuple(f"J{joint}A({decimal(a)})" for joint, a in angles.items() if a is not None)


class _Flags(NamedTuple):
    """What stands behind the coordinates of a printed point; see :class:`PrintedPoint`."""

    flags: tuple[str, ...]
    hand: Hand | None
    local: int
    posture: Posture | None


@lru_cache(maxsize=64)
def _read_flags(text: str) -> _Flags:
    """Read ``/R /0``; each point of a cell ends in one of the same few.

    Raises:
        ValueError: They contradict each other.
    """
    flags = tuple(flag.strip() for flag in text.split("/")[1:])
    hands = [_HANDS[flag] for flag in flags if flag in _HANDS]
    local, *more = [int(flag) for flag in flags if flag.isdigit()] or [0]
    if more or local > _HIGHEST_LOCAL or len(hands) > 1:
        raise ValueError(text)
    return _Flags(flags, hands[0] if hands else None, local, _posture(flags))


def _posture(flags: tuple[str, ...]) -> Posture | None:
    """Return the posture that flags name; what they leave out is that of a point without flags.

    Raises:
        ValueError: They contradict each other.
    """
    named: dict[str, Elbow | Wrist | int | float] = {}
    for flag in flags:
        entry: tuple[str, Elbow | Wrist | int | float]
        joint, angle = _JOINT_FLAG.fullmatch(flag), _JOINT_ANGLE.fullmatch(flag)
        if joint is not None:
            entry = f"j{joint[1]}_flag", int(joint[2])
        elif angle is not None:
            entry = f"j{angle[1]}_angle_deg", float(angle[2])
        elif flag in _ELBOWS:
            entry = "elbow", _ELBOWS[flag]
        elif flag in _WRISTS:
            entry = "wrist", _WRISTS[flag]
        else:
            continue
        if named.setdefault(*entry) != entry[1]:
            raise ValueError(flag)
    return Posture(**named) if named else None  # type: ignore[arg-type]


def parse_point(text: str) -> PrintedPoint:
    """Read a printed point, whatever the width of its columns.

    Raises:
        RemoteProtocolError: It is not a point, or its flags contradict each other.
    """
    match = _POINT.fullmatch(text)
    if match is None:
        raise unreadable(tr("a point"), text)
    *numbers, tail = match.groups()
    try:
        found = _read_flags(tail)
    except ValueError as error:
        raise unreadable(tr("a point"), text) from error
    coordinates = tuple([float(number) for number in numbers if number is not None])
    return PrintedPoint(coordinates, found.hand, found.flags, found.local, found.posture)


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

    Example:
        >>> from robolink.model import Hand
        >>> from robolink.protocols.spel import PrintedPoint, format_point
        >>> point = PrintedPoint.of((300.0, 100.0, -60.0, 0.0), hand=Hand.RIGHT)
        >>> format_point(point, coordinates="four").split()
        ['X:', '300.000', 'Y:', '100.000', 'Z:', '-60.000', 'U:', '0.000', '/R', '/0']
    """
    shown = (*point.coordinates, 0.0, 0.0)[: 6 if coordinates == "six" else 4]
    values = zip(_AXES, shown, strict=False)
    parts = [f"{axis}:{decimal(value).rjust(width)}" for axis, value in values]
    return " " + " ".join([*parts, *(f"/{flag}" for flag in point.flags)])


def parse_tool_listing(text: str) -> dict[int, ToolOffset]:
    """Read the defined tools; a text without the word Tool lists none.

    Four values are X Y Z in mm and U in degrees; six add V and W. Once a tool is listed,
    every line must be one: a line skipped could be the rest of a value.

    Raises:
        RemoteProtocolError: A line cannot be read, or a tool is listed twice.
    """
    tools: dict[int, ToolOffset] = {}
    if "tool" not in text.lower():
        return tools
    for line in text.replace("\r", "\n").split("\n"):
        if not line.strip():
            continue
        match = _LINE.fullmatch(line)
        number = int(match[1]) if match else -1
        if match is None or number > _HIGHEST_TOOL or number in tools:
            raise unreadable(tr("a list of tools"), text)
        tools[number] = ToolOffset(*(float(value) for value in match[2].split(",")))
    return tools


def format_tool_listing(tools: Mapping[int, ToolOffset], *, layout: Layout = "plain") -> str:
    """Return the listing of ``tools``; the twin of :func:`parse_tool_listing`.

    Args:
        tools: The defined tools by number.
        layout: ``plain`` as ``Tool 1: 12.000, -3.250, ...`` (the likeliest,
            docs/reference/spel.md 6.1), ``padded`` with values nine columns wide, ``four`` without
            V and W, which such a controller cannot show.
    """
    return "\r\n".join(_line(tool, tools[tool], layout) for tool in sorted(tools))


def _line(tool: int, offset: ToolOffset, layout: Layout) -> str:
    values = [decimal(value) for value in offset.components()]
    if layout == "four":
        values = values[:4]
    if layout == "padded":
        values = [value.rjust(9) for value in values]
    return f"Tool {tool}: " + ", ".join(values)
