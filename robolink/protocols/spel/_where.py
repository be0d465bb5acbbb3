"""The three lines of ``Where`` (docs/reference/epson.md 3.3, docs/reference/spel.md 5.6).

The layout below is what a client in the field reads by columns: a label of two characters,
the value, a unit, sixteen columns in all::

    WORLD:  X:  350.000 mm  Y:    0.000 mm  Z:  -20.000 mm  U:   90.000 deg V: ...
    JOINT:  1:   -6.905 deg 2:   91.000 deg 3:  -20.000 mm  4:    5.905 deg
    PULSE:  1:   -15713 pls 2:   207076 pls 3:  -227556 pls 4:    24507 pls
"""

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Final, Literal

from robolink.messages import tr
from robolink.protocols.spel._values import NUMBER, decimal, unreadable

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
    """Read where the base stands that positions count from: X, Y, Z in mm and U, V, W in degrees.

    No page shows how a controller lists it (docs/reference/spel.md 5.4), so six numbers alone are
    taken for it, or four for a base that does not lean; ``None`` for anything else.
    """
    numbers = [float(number) for number in _IN_THE_LISTING.findall(text)]
    if len(numbers) not in _COUNTS_OF_A_BASE:
        return None
    return (*numbers, 0.0, 0.0)[:6]
