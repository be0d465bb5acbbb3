"""Points and labels of a project, as RC+ writes them (docs/reference/spel.md 16)."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr
from robolink.model import Elbow, Hand, Posture, Wrist
from robolink_simulators.epson.memory.io_labels import (
    BIT,
    BYTE,
    INPUT,
    MEMORY,
    OUTPUT,
    WORD,
    IOLabel,
)
from robolink_simulators.epson.memory.points import HIGHEST_LOCAL, HIGHEST_POINT, Point
from robolink_simulators.epson.spel.source.source_text import decoded

_BLOCK: Final = re.compile(r"([A-Za-z]+?)(\d*)\s*\{$")
_PAIR: Final = re.compile(r"([A-Za-z0-9]+)=(.*)$")
_AXES: Final = "XYZUVW"
_UNDEFINED_AXES: Final = 0b111111
_KINDS: Final = {"Input": INPUT, "Output": OUTPUT, "Memory": MEMORY}
_WIDTHS: Final = {"Bit": BIT, "Byte": BYTE, "Word": WORD}
_LABELS: Final = re.compile(r"(Input|Output|Memory)(Bit|Byte|Word)Labels$")

Pairs = dict[str, str]


def _text(path: Path, encoding: str | None) -> str:
    try:
        return decoded(read_named(path), encoding)
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be read: {why}.", path=path, why=error.strerror or error),
            remedy=tr("Give a file of the project, as RC+ has saved it."),
        ) from error


def _blocks(text: str) -> Iterator[tuple[tuple[str, ...], Pairs]]:
    """Yield each innermost block: the names of what it stands in, and its own pairs."""
    names, pairs = list[str](), Pairs()
    for line in map(str.strip, text.splitlines()):
        opened, pair = _BLOCK.match(line), _PAIR.match(line)
        if opened is not None:
            names.append(opened[1])
            pairs = {}
        elif line == "}" and names:
            if pairs:
                yield tuple(names), pairs
            names.pop()
            pairs = {}
        elif pair is not None:
            pairs[pair[1]] = pair[2].strip().strip('"')


def read_points(path: Path, encoding: str | None = None) -> tuple[dict[int, Point], dict[str, int]]:
    """Return the points of a file by their numbers, and the numbers of their labels.

    A point is left out where one of its first six coordinates is marked undefined.

    Raises:
        ConfigError: It cannot be read, or a point makes no sense.
    """
    points, labels = dict[int, Point](), dict[str, int]()
    for names, pairs in _blocks(_text(path, encoding)):
        if names[-1] != "Point":
            continue
        try:
            number = int(pairs["nNumber"])
            point = _point(pairs)
        except (KeyError, ValueError) as error:
            raise _not_understood(path, str(pairs.get("nNumber", "?"))) from error
        if not 0 <= number <= HIGHEST_POINT or not 0 <= point.local <= HIGHEST_LOCAL:
            raise _not_understood(path, str(number))
        if int(pairs.get("nUndefined", "0")) & _UNDEFINED_AXES:
            continue
        points[number] = point
        if pairs.get("sLabel"):
            labels[pairs["sLabel"]] = number
    return points, labels


def _not_understood(path: Path, number: str) -> ConfigError:
    return ConfigError(
        tr("Point {number} of {path} makes no sense.", number=number, path=path),
        remedy=tr("Save the points again in RC+."),
    )


def _point(pairs: Pairs) -> Point:
    x, y, z, u, v, w = (float(pairs.get(f"r{axis}", "0")) for axis in _AXES)
    flags = {name: int(pairs.get(key, "0")) for name, key in _FLAGS.items()}
    posture = Posture(
        Elbow.BELOW if pairs.get("nElbow") == "2" else Elbow.ABOVE,
        Wrist.FLIP if pairs.get("nWrist") == "2" else Wrist.NO_FLIP,
        **flags,
        j1_angle_deg=float(pairs.get("rJ1Angle", "0")) or None,
        j4_angle_deg=float(pairs.get("rJ4Angle", "0")) or None,
    )
    hand = Hand.LEFT if pairs.get("nHand") == "2" else Hand.RIGHT
    return Point((x, y, z, u, v, w), hand, int(pairs.get("nLocal", "0")), posture=posture)


_FLAGS: Final = {
    "j1_flag": "nJ1Flag",
    "j2_flag": "nJ2Flag",
    "j4_flag": "nJ4Flag",
    "j6_flag": "nJ6Flag",
}


def read_io_labels(path: Path, encoding: str | None = None) -> dict[str, IOLabel]:
    """Return the labels of inputs, outputs and memory bits, by their names in lower case.

    Raises:
        ConfigError: It cannot be read.
    """
    labels = dict[str, IOLabel]()
    for names, pairs in _blocks(_text(path, encoding)):
        kind = _LABELS.match(names[-2]) if len(names) > 1 else None
        number = next((v for k, v in pairs.items() if k in ("nBit", "nByte", "nWord", "nPort")), "")
        name = pairs.get("sLabel", "")
        if kind is None or not name or not number.isdecimal():
            continue
        labels[name.lower()] = IOLabel(_KINDS[kind[1]], _WIDTHS[kind[2]], int(number), name)
    return labels
