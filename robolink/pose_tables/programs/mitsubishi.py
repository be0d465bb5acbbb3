"""Position variables of MELFA BASIC, Mitsubishi: ``P1=(+300.00,+100.00,..,+90.00)(7,0)``.

mm and degrees; A, B and C turn about X, Y and Z: R = Rz(C) Ry(B) Rx(A)
(docs/reference/pose_files.md 1). Two numbers for additional axes may follow; the second brackets
hold the flags of the posture and of turns. ``J1=(..)`` are joint angles. The tool is not in it.
"""

import re
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.numbers import plain
from robolink.pose_tables.orientation import RULES
from robolink.pose_tables.programs.program_text import (
    left_out,
    program,
    radians,
    required_number,
    turned,
)
from robolink.pose_tables.values import RawPose, RawTable, UnusableText

_RULE: Final = RULES["mitsubishi"]
_COMPONENTS: Final = ("X", "Y", "Z", "A", "B", "C", "L1", "L2")
_FEWEST: Final = 6
_STEP: Final = r"\s*(?:[0-9]+\s+)?"
_OURS: Final = re.compile(
    rf"(?mi)^{_STEP}P\w*\s*(?:\([^()\n]*\))?\s*=\s*\([^\n()]*\)\s*\([^\n]*\)?|"
    rf"^{_STEP}[PJ]\w*\s*=\s*\((?:[^,()\n]*,){{5,7}}[^,()\n]*\)"
)
_POSITION: Final = re.compile(
    rf"{_STEP}(?P<name>P\w*)\s*(?:\(\s*(?P<index>[0-9]+)\s*\))?\s*=\s*\((?P<values>[^()]*)\)"
    r"\s*\((?P<flags>[^()]*)\)\s*",
    re.IGNORECASE | re.ASCII,
)
_FLAGS: Final = re.compile(
    r"\s*(?:[0-9]+|&[BH][0-9A-F]+)\s*,\s*-?[0-9]+\s*", re.IGNORECASE | re.ASCII
)
_JOINTS: Final = re.compile(
    rf"{_STEP}J\w*\s*(?:\(\s*[0-9]+\s*\))?\s*=\s*\([^()]*\)\s*", re.IGNORECASE
)
_NUMBERED: Final = re.compile(r"P[0-9]+", re.IGNORECASE | re.ASCII)
_END: Final = re.compile(r"^\)|\(\s*[0-9]+\s*,\s*-?[0-9]+\s*\)$|^[+-]?[0-9.]+\)?$", re.ASCII)
_FORMULA: Final = re.compile(
    rf"{_STEP}P\w*\s*(?:\(\s*\w+\s*\))?\s*=\s*[A-Za-z]\w*(?:[^(\n]|\(\s*\w+\s*\))*", re.I
)
_MANY: Final = re.compile(r"(?:[+-]?[0-9][0-9.OoIl]*[^A-Za-z0-9.]+){2,}[+-]?[0-9]")
_ASSIGNS: Final = re.compile(
    rf"{_STEP}P\w*\s*(?:\([^()]*\))?\s*=\s*(?:\(|[+-]?[0-9]|$)|[^=]*=\s*\(", re.I
)


def read_mitsubishi(text: str) -> RawTable | None:
    """Return the positions of MELFA BASIC; ``None`` where there is none.

    Raises:
        UnusableText: What looks like a position is none; says the line.
    """
    text = plain(text)
    if not _OURS.search(text) or re.search(r"=\s*XY\s*\(", text, re.IGNORECASE):
        return None
    poses: list[RawPose] = []
    skipped, names, counts = 0, set[str](), set[int]()
    for line, whole in enumerate(text.split("\n"), start=1):
        code = whole.partition("'")[0]
        if not code.strip():
            continue
        found = _POSITION.fullmatch(code)
        if found:
            pose = _position(found, line)
            name = str(pose.given["name"]).upper()
            if name in names:
                raise UnusableText(tr("{name} appears twice", name=name), line)
            names.add(name)
            counts.add(code.count(","))
            if len(counts) > 1:
                raise UnusableText(tr("it holds other numbers than the positions above"), line)
            poses.append(pose)
        elif _JOINTS.fullmatch(code):
            skipped += 1
        elif _ASSIGNS.match(code) or _MANY.search(code) or _is_cut(code):
            raise UnusableText(tr("it is not a position P1=(..)(..)"), line)
        elif _FORMULA.fullmatch(code):
            skipped += 1
    if not poses and not skipped:
        return None
    skipped += left_out(text, "'", r"\bP\w*\s*=\s*\([^()]*\)\s*\(")
    return program("MELFA BASIC", poses, _RULE.formula, skipped)


def _is_cut(code: str) -> bool:
    """Return whether a line is the beginning of a position and no more."""
    code = code.strip()
    return bool(_NUMBERED.fullmatch(code) or _END.search(code)) or code.upper() == "P"


def _position(found: re.Match[str], line: int) -> RawPose:
    parts = found["values"].split(",")
    if len(parts) not in (_FEWEST, len(_COMPONENTS)):
        raise UnusableText(
            tr("a position holds six numbers, or eight, and this one {count}", count=len(parts)),
            line,
        )
    numbers = [
        required_number(name, part, line) for name, part in zip(_COMPONENTS, parts, strict=False)
    ]
    if not _FLAGS.fullmatch(found["flags"]):
        raise UnusableText(tr("the flags in the second brackets are two whole numbers"), line)
    name, index = found["name"], found["index"]
    given: dict[str, object] = {"name": f"{name}({index})" if index else name}
    if not index and _NUMBERED.fullmatch(name):
        given["number"] = int(name[1:])
    a, b, c = numbers[3:6]
    matrix = _RULE.matrix(radians((c, b, a), line))
    return turned(line, numbers[:3], matrix, given)
