"""What readers of robot programs share: brackets that match, and poses of angles in degrees.

A program is read in two passes. What looks like a pose is found loosely; each finding is then read
by a strict grammar. A finding that does not fit is refused with its line, so that nothing that
looks like a pose vanishes.
"""

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink.pose_tables import orientation
from robolink.pose_tables.numbers import number_of, why_no_number
from robolink.pose_tables.values import LengthUnit, RawPose, RawTable, UnusableText

_TURNED_MOST_DEG: Final = 720.0
"""Largest angle in a program, degrees: makers print angles within one turn, and people type at most
two turns."""

_NO_LINE_END: Final = re.compile(r"[^\n]")
_LEADING_ZERO: Final = re.compile(r"[+-]?0[0-9]+")
"""The decimals after a decimal comma; nobody writes a whole number like that."""

_CLOSING: Final = {"{": "}", "[": "]", "(": ")"}


@dataclass(frozen=True, slots=True)
class Group:
    """A pair of brackets with what is inside.

    Attributes:
        start: Place of the opening bracket in the text.
        end: Place behind the closing one.
        body: What stands between.
    """

    start: int
    end: int
    body: str


def groups_of(text: str, brackets: str, line_at: Callable[[int], int]) -> Iterator[Group]:
    """Yield the outermost pairs of brackets; what is inside is theirs.

    Args:
        text: Without comments and strings that could hold brackets.
        brackets: The kinds that are looked at, by the opening ones.
        line_at: Tells the line of a place.

    Raises:
        UnusableText: A bracket has no partner.

    Example:
        >>> from robolink.pose_tables.programs.program_text import groups_of
        >>> [group.body for group in groups_of("a={1,{2}} b={3}", "{", lambda place: 1)]
        ['1,{2}', '3']
    """
    closing = {_CLOSING[one]: one for one in brackets}
    opened: list[int] = []
    for place, sign in enumerate(text):
        if sign in brackets:
            opened.append(place)
        elif sign in closing:
            if not opened or text[opened[-1]] != closing[sign]:
                raise UnusableText(tr("its brackets do not match"), line_at(place))
            start = opened.pop()
            if not opened:
                yield Group(start, place + 1, text[start + 1 : place])
    if opened:
        raise UnusableText(tr("its brackets do not match"), line_at(opened[0]))


def fields_of(body: str, brackets: str = "") -> list[str]:
    """Return what commas separate, apart from commas inside brackets and quotes."""
    fields, depth, quoted, begun = [], 0, False, 0
    closing = {_CLOSING[one] for one in brackets}
    for place, sign in enumerate(body):
        if sign == '"':
            quoted = not quoted
        elif quoted:
            continue
        elif sign in brackets:
            depth += 1
        elif sign in closing:
            depth -= 1
        elif sign == "," and depth == 0:
            fields.append(body[begun:place])
            begun = place + 1
    return [*fields, body[begun:]]


def without(text: str, spans: Sequence[tuple[int, int]]) -> str:
    """Return a text with blanks in place of spans, line ends kept, so that lines stay."""
    parts, place = [], 0
    for start, end in spans:
        parts += [text[place:start], _NO_LINE_END.sub(" ", text[start:end])]
        place = end
    return "".join([*parts, text[place:]])


def left_out(text: str, sign: str, pose: str) -> int:
    """Return how many poses stand in comments of their own: left out on purpose, and counted.

    Args:
        text: With its comments.
        sign: What begins one.
        pose: A pattern of what looks like a pose on one line.

    Raises:
        UnusableText: One follows the sign at once: it may have been typed by mistake.

    Example:
        >>> from robolink.pose_tables.programs.program_text import left_out
        >>> left_out("; {X 1,Y 2}", ";", r"[{]X")
        1
    """
    comment = re.compile(rf"[ \t]*{re.escape(sign)}(?P<apart>[ \t]?).*?(?:{pose})", re.IGNORECASE)
    count = 0
    for number, line in enumerate(text.split("\n") if sign in text else (), start=1):
        found = comment.match(line)
        if found and not found["apart"]:
            raise UnusableText(
                tr("it begins with {sign} and looks like a pose; is it a comment?", sign=sign),
                number,
            )
        count += found is not None
    return count


def required_number(name: str, text: str, line: int) -> float:
    """Return the finite number of a component.

    Raises:
        UnusableText: It is none.
    """
    value = number_of(text)
    if not math.isfinite(value) or _LEADING_ZERO.fullmatch(text.strip()):
        raise UnusableText(why_no_number(name, text), line)
    return value


def radians(degrees: Sequence[float], line: int) -> list[float]:
    """Return angles in radians.

    Raises:
        UnusableText: One is further than anybody turns a flange.
    """
    for value in degrees:
        if abs(value) > _TURNED_MOST_DEG:
            raise UnusableText(
                tr("an angle of {angle:g} degrees is no angle of a flange", angle=value), line
            )
    return [math.radians(value) for value in degrees]


def turned(
    line: int, place: Sequence[float], matrix: orientation.Matrix, given: dict[str, object]
) -> RawPose:
    """Return the pose of a place and a rotation."""
    x, y, z = place
    return RawPose(line, (x, y, z), orientation.uvw_deg(matrix), given)


def blanked(found: re.Match[str]) -> str:
    """Return blanks for what was found, line ends kept, so that places stay."""
    return _NO_LINE_END.sub(" ", found[0])


def program(
    maker: str,
    poses: list[RawPose],
    rotation: str,
    skipped: int,
    *,
    angle: str = "deg",
    stated: bool = False,
) -> RawTable:
    """Return the table of a program.

    Args:
        maker: Name of the format.
        poses: What was found.
        rotation: The rule, for a person.
        skipped: How many entries are joints or not taught.
        angle: Unit of the angles.
        stated: Whether the file says its unit of length.

    Raises:
        UnusableText: There are only entries that are no poses.

    Example:
        >>> from robolink.pose_tables.programs.program_text import program
        >>> from robolink.pose_tables.values import RawPose
        >>> program("KUKA", [RawPose(1, (1, 2, 3), (0, 0, 0))], "R", skipped=0).layout
        'KUKA'
    """
    if not poses:
        raise UnusableText(
            tr("its points are joint angles or not taught, and joint angles are not a pose")
        )
    return RawTable(
        maker,
        poses,
        rotation,
        length=LengthUnit.MM,
        stated_length=stated,
        angle=angle,
        skipped=skipped,
    )
