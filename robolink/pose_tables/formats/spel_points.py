"""Points as SPEL+ writes them: ``P901 = XY(287.5, 103.25, -50, 0) /R /0``.

So PList lists them and programs define them, with four numbers or six, hand and local behind a
slash (docs/reference/spel.md 5.1). Lengths are mm, angles degrees.
"""

import math
import re
from collections.abc import Sequence
from typing import Final

from robolink.messages import tr
from robolink.model import Hand
from robolink.pose_tables.numbers import number_of, plain, why_no_number
from robolink.pose_tables.orientation import EPSON
from robolink.pose_tables.programs.program_text import left_out
from robolink.pose_tables.values import LengthUnit, RawPose, RawTable, UnusableText

_POINT: Final = re.compile(
    r"\s*(?:P\s*\(?\s*(?P<number>\d+)\s*\)?\s*(?:\(\s*(?P<tag>[A-Za-z_]\w*)\s*\))?"
    r"|(?P<label>[A-Za-z_]\w*))\s*=\s*"
    r"(?P<form>XY\s*\(|(?=[+-]?[\d.]))(?P<values>[^)/:'\n]*)(?P<closed>\)?)(?P<rest>[^'\n]*)",
    re.IGNORECASE,
)
_ASSIGNED: Final = re.compile(r"\s*P\s*\(?\s*\d+\s*\)?\s*=", re.IGNORECASE)
_COORDINATES_GIVEN: Final = re.compile(r"[^=]*=\s*XY\s*\(", re.IGNORECASE)
_COORDINATES: Final = re.compile(r"\s*(?:XY\b|[+-]?[\d.])", re.IGNORECASE)
_NO_COORDINATES: Final = re.compile(
    r"\s*(?:AglToPls|JA|Pulse|Here|RealPos|CurPos|InPos|Pallet|Align|VxTrans|P\s*[(\d*]|[A-Za-z_]\w*\s*$"
    r"|[A-Za-z_]\w*\s*(?:[+:/@]|\((?![^)]*,[^)]*,)))",
    re.IGNORECASE,
)
"""Values other than coordinates that may be assigned to a point."""
_STATEMENT: Final = re.compile(
    r"\s*(?:Go|Jump3?(?:CP)?|Move|Arc3?|TGo|TMove|BGo|BMove|CVMove|Pass|TLSet|Local|Base|Arm(?:Set)?|Box"
    r"|Plane|Pallet|ECPSet|Tool|Speed[RS]?|Accel[RS]?|Weight|Print|Input|If|ElseIf|While|For|Do|Loop"
    r"|Select|Case|Function|Call|XQT|Wait|On|Off|Out|Till|Find|Sense|Trap|VSet|VGet|VRun|Fine|Home\w*"
    r"|MCal\w*|Range|XYLim|JRange|Inertia|LimZ|Arch|Global|Preserve|Integer|Real|Double|Long|Short"
    r"|Boolean|Byte|String|U(?:Byte|Short|Int32|Int64)|Int(?:32|64)|#\w+)\b",
    re.IGNORECASE,
)
_PIECE: Final = re.compile(
    r"\bXY\b|^\s*P\s*\W?\s*\d+\s*\W*$|/\s*(?:[RLABF]|NF|\d{1,2})\b|^\s*P\s*\d+\s*\(|=\s*\w*\s*\(|\(\s*[+-]?[\d.]|^\s*P\w{0,4}\s*\d*\s*=|^\s*P\s*$",
    re.IGNORECASE,
)
_SEVERAL: Final = re.compile(r"(?<![\d.])(?:[+-]?[\d.]+(?:\s*[,;]\s*|\s+)){2,}[+-]?[\d.]")
"""Numbers beside each other, looked for at the first digit of a run only: some lines have many."""
_LIKE_A_NUMBER: Final = re.compile(r"P[\dOoIlSB]+", re.ASCII)
_HAND: Final = re.compile(r"/\s*([RL])\b", re.IGNORECASE)
_LOCAL: Final = re.compile(r"/\s*(\d+)\b|/\s*Local\s*(\d+)", re.IGNORECASE)
_FLAGS: Final = re.compile(
    r"(?:\s*/\s*(?:[RLABF]|NF|J[1246]F\d{1,3}|J[14]A\s*\(?[-+.\d]+\)?|\d{1,2}|Local\s*\d{1,2}))*\s*",
    re.ASCII | re.IGNORECASE,
)
_FEWEST_ALIKE: Final = 4
_HANDS: Final = {"r": Hand.RIGHT, "l": Hand.LEFT}


def read_spel(lines: Sequence[str]) -> RawTable | None:
    """Return the points of SPEL+ text, ``None`` where it defines none.

    Raises:
        UnusableText: A point is not given in numbers.
    """
    poses: list[RawPose] = []
    skipped, pieces, names = 0, list[int](), set[object]()
    for line, text in enumerate(lines, start=1):
        text = plain(text.partition("'")[0])
        found = _POINT.fullmatch(text)
        if found is None or not (found["number"] or found["form"]):
            assigned = _ASSIGNED.match(text)
            of_point = assigned and _COORDINATES.match(text, assigned.end())
            if of_point or _COORDINATES_GIVEN.match(text):
                raise UnusableText(tr("the point does not hold four or six numbers"), line)
            if assigned and _NO_COORDINATES.match(text, assigned.end()):
                skipped += 1
            elif assigned or _is_piece(text):
                pieces.append(line)
            continue
        poses.append(_point(line, found))
        called = poses[-1].given.get("number", poses[-1].given.get("name"))
        if called in names:
            raise UnusableText(tr("{name} appears twice", name=called), line)
        names.add(called)
    if poses and pieces:
        raise UnusableText(tr("it is not a point P1 = XY(..), and looks like one"), pieces[0])
    counts = [len(pose.stated) for pose in poses]
    if len(set(counts)) > 1:
        odd = next(place for place, count in enumerate(counts) if count != counts[0])
        why = tr("the point has other numbers than those above: four, or six")
        raise UnusableText(why, poses[odd].line)
    _refuse_other_flags(poses)
    if poses:
        skipped += left_out("\n".join(lines), "'", r"=\s*XY\s*\(")
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


def _refuse_other_flags(poses: Sequence[RawPose]) -> None:
    """Refuse the only point without hand or local: PList prints them for all, so it was cut."""
    for key in ("hand", "local"):
        without = [pose for pose in poses if key not in pose.given]
        if len(without) == 1 and len(poses) >= _FEWEST_ALIKE:
            raise UnusableText(
                tr("there is no {name}, as all others have", name=key), without[0].line
            )


def _is_piece(text: str) -> bool:
    """Return whether a line that is no statement may be the rest of a point."""
    if not text.strip() or _STATEMENT.match(text):
        return False
    return bool(_PIECE.search(text) or _SEVERAL.search(text))


def _point(line: int, found: re.Match[str]) -> RawPose:
    parts = [part.strip() for part in found["values"].split(",")]
    if len(parts) not in (4, 6):
        raise UnusableText(tr("the point does not hold four or six numbers"), line)
    for name, part in zip("XYZUVW", parts, strict=False):
        if not math.isfinite(number_of(part)):
            why = tr("the point does not hold four or six numbers")
            raise UnusableText(f"{why}; {why_no_number(name, part)}", line)
    if found["label"] and _LIKE_A_NUMBER.fullmatch(found["label"]):
        raise UnusableText(tr("{name} is no number of a point", name=found["label"]), line)
    if ("(" in (found["form"] or "")) != (found["closed"] == ")"):
        raise UnusableText(tr("its brackets do not match"), line)
    if not _FLAGS.fullmatch(found["rest"]):
        raise UnusableText(tr("the point is changed after its numbers"), line)
    numbers = [number_of(part) for part in parts]
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
