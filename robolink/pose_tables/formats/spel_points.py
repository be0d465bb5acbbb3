"""Points as SPEL+ writes them: ``P901 = XY(287.5, 103.25, -50, 0) /R /0``.

So PList lists them and programs define them, with four numbers or six, hand and local behind a
slash (docs/reference/spel.md 5.1). Lengths are mm, angles degrees.
"""

import re
from collections.abc import Sequence
from typing import Final

from robolink.messages import tr
from robolink.model import Hand
from robolink.pose_tables.conventions import EPSON
from robolink.pose_tables.refusals import UnusableText
from robolink.pose_tables.values import LengthUnit, RawPose, RawTable

_POINT: Final = re.compile(
    r"\s*(?:P\s*\(?\s*(?P<number>\d+)\s*\)?\s*(?:\(\s*(?P<tag>[A-Za-z_]\w*)\s*\))?"
    r"|(?P<label>[A-Za-z_]\w*))\s*=\s*"
    r"(?P<form>XY\s*\(|(?=[+-]?[\d.]))(?P<values>[^)/:'\n]*)\)?(?P<rest>[^'\n]*)",
    re.IGNORECASE,
)
_ASSIGNED: Final = re.compile(r"\s*P\s*\(?\s*\d+\s*\)?\s*=", re.IGNORECASE)
_COORDINATES_GIVEN: Final = re.compile(r"[^=]*=\s*XY\s*\(", re.IGNORECASE)
_COORDINATES: Final = re.compile(r"\s*(?:XY\b|[+-]?[\d.])", re.IGNORECASE)
_NUMBER: Final = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_HAND: Final = re.compile(r"/\s*([RL])\b", re.IGNORECASE)
_LOCAL: Final = re.compile(r"/\s*(\d+)\b|/\s*Local\s*(\d+)", re.IGNORECASE)
_FLAGS: Final = re.compile(r"(?:\s*/\s*\w+)*\s*", re.ASCII)
_HANDS: Final = {"r": Hand.RIGHT, "l": Hand.LEFT}


def read_spel(lines: Sequence[str]) -> RawTable | None:
    """Return the points of SPEL+ text, ``None`` where it defines none.

    Raises:
        UnusableText: A point is not given in numbers.
    """
    poses: list[RawPose] = []
    skipped = 0
    for line, text in enumerate(lines, start=1):
        text = text.partition("'")[0]
        found = _POINT.fullmatch(text)
        if found is None or not (found["number"] or found["form"]):
            assigned = _ASSIGNED.match(text)
            of_point = assigned and _COORDINATES.match(text, assigned.end())
            if of_point or _COORDINATES_GIVEN.match(text):
                raise UnusableText(tr("the point does not hold four or six numbers"), line)
            skipped += bool(assigned)
            continue
        poses.append(_point(line, found))
    if not poses:
        if skipped:
            raise UnusableText(tr("its points are not given in coordinates"))
        return None
    return RawTable(
        "SPEL+",
        poses,
        EPSON.formula,
        length=LengthUnit.MM,
        angle="deg",
        skipped=skipped,
    )


def _point(line: int, found: re.Match[str]) -> RawPose:
    parts = [part.strip() for part in found["values"].split(",")]
    if len(parts) not in (4, 6) or not all(map(_NUMBER.fullmatch, parts)):
        raise UnusableText(tr("the point does not hold four or six numbers"), line)
    if not _FLAGS.fullmatch(found["rest"]):
        raise UnusableText(tr("the point is changed after its numbers"), line)
    numbers = [float(part) for part in parts]
    x, y, z, u = numbers[:4]
    v, w = numbers[4:] or (0.0, 0.0)
    given: dict[str, object] = {"number": int(found["number"])} if found["number"] else {}
    label = found["label"] or found["tag"]
    given |= {"name": label} if label else {}
    hand, local = _HAND.search(found["rest"]), _LOCAL.search(found["rest"])
    given |= {"hand": _HANDS[hand[1].lower()]} if hand else {}
    given |= {"local": int(local[1] or local[2])} if local else {}
    stated = {"z_mm", "v_deg", "w_deg"} if len(numbers) == 6 else {"z_mm"}
    return RawPose(line, (x, y, z), (u, v, w), given, frozenset(stated))
