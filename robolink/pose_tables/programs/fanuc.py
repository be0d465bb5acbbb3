"""Points in ``.ls`` files of FANUC: ``P[1:"pin"]{ GP1: UF : 0, UT : 0, .. X = 405.800 mm, .. };``.

mm and degrees, R = Rz(R) Ry(P) Rx(W) (docs/reference/pose_files.md 2). Points in joint angles, and
points that are not taught and print stars only, are no poses.
"""

import re
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.encoding import line_counter
from robolink.pose_tables.numbers import plain
from robolink.pose_tables.orientation import RULES
from robolink.pose_tables.programs.program_text import (
    program,
    radians,
    required_number,
    turned,
)
from robolink.pose_tables.values import RawPose, RawTable, UnusableText

_RULE: Final = RULES["fanuc"]
_COMPONENTS: Final = ("X", "Y", "Z", "R", "P", "W")
_UNITS: Final = {**dict.fromkeys("XYZ", "mm"), **dict.fromkeys("WPR", "deg")}

_OURS: Final = re.compile(
    r"(?m)^[ \t]*PR?\s*\[\s*[0-9OlI]+[^\]\n]*\]?\s*\{|^[ \t]*GP[0-9]+\s*:"
    r"|\bU[FT]\s*:\s*\S+\s*,|^[ \t]*/POS\s*$"
)
_POINT: Final = re.compile(
    r"\s*PR?\[\s*(?P<number>[0-9]+)\s*(?::\s*(?:\"(?P<name>[^\"\n]*)\"|(?P<bare>[^\"\]\n]*)))?\s*\]"
    r"\s*\{(?P<body>[^{}]*)\}\s*;?",
    re.ASCII,
)
_LOOSE: Final = re.compile(
    r"(?m)^[ \t]*(?:PR?\s*[\[(]?\s*[0-9OlI]+[^\n;]*\{|P\[[^\n;]*$|GP[0-9]+\s*:|U[FT]\s*:"
    r"|[XYZWPR]\s*=|J[1-9]\s*=|[{}])"
)
_REGION: Final = re.compile(r"(?m)^[ \t]*/POS\s*$")
_SECTION: Final = re.compile(r"\s*/[A-Z]+\b")
_END: Final = re.compile(r"\s*(?:/END\s*)?")
_CONFIG: Final = re.compile(r"CONFIG\s*:\s*'[^'\n]*'\s*(?:,|$)", re.IGNORECASE)
_ITEM: Final = re.compile(r"\s*([^,]*?)\s*(?:,|$)", re.DOTALL)
_GROUP: Final = re.compile(r"\s*GP([0-9]+)\s*:", re.ASCII)
_FRAME: Final = re.compile(r"U([FT])\s*:\s*([0-9]+|F)")
_VALUE: Final = re.compile(r"([A-Z][0-9]*)\s*[=:]\s*([^\s,]+)\s*([A-Za-z]*)")
_JOINT: Final = re.compile(r"[JE][0-9]")
_DECIMALS: Final = re.compile(r"[0-9]+(?: (?:mm|deg))?")
_STARS: Final = re.compile(r"\*+\.?\**")


def read_fanuc(text: str) -> RawTable | None:
    """Return the points of a FANUC ``.ls``; ``None`` where there is none.

    Raises:
        UnusableText: What looks like a point is none; says the line.
    """
    text = plain(text)
    if "{" not in text or not _OURS.search(text):
        return None
    line_at = line_counter(text)
    region = _REGION.search(text)
    first = _LOOSE.search(text)
    if region is None and first is None:
        return None
    place = region.end() if region else first.start() if first else 0
    points = _Points()
    while not _END.fullmatch(text, place):
        found = _POINT.match(text, place)
        begins = _past_blanks(text, place)
        if found is None:
            ends = _SECTION.match(text, place)
            if ends and not _LOOSE.search(text, place):
                break
            raise UnusableText(tr("it is not a point P[..]{..}"), line_at(begins))
        points.add(found, line_at(begins))
        place = found.end()
    if not points.poses and not points.skipped:
        return None
    return program("FANUC", points.poses, _RULE.formula, points.skipped, stated=True)


def _past_blanks(text: str, place: int) -> int:
    while place < len(text) and text[place].isspace():
        place += 1
    return place


class _Points:
    """Gathers the points of a file."""

    def __init__(self) -> None:
        self.poses: list[RawPose] = []
        self.skipped = 0
        self._framed: bool | None = None
        self._seen: set[tuple[str, str]] = set()

    def add(self, found: re.Match[str], line: int) -> None:
        """Add one point; joints and untaught points are counted.

        Raises:
            UnusableText: It is not whole.
        """
        kind = (found[0].lstrip()[:2].rstrip("["), found["number"])
        if kind in self._seen:
            raise UnusableText(tr("{name} appears twice", name=f"{kind[0]}[{kind[1]}]"), line)
        self._seen.add(kind)
        frames, values = _body(found["body"], line)
        framed = {"F", "T"} <= frames.keys()
        if bool(frames) != framed or (self._framed is not None and framed != self._framed):
            raise UnusableText(tr("there is no {name}", name="UF, UT"), line)
        self._framed = framed
        names = [name for name in values if not name.startswith("E")]
        joints = bool(names) and all(map(_JOINT.fullmatch, names))
        untaught = bool(values) and all(_STARS.fullmatch(value) for value in values.values())
        if untaught or joints:
            self.skipped += 1
            return
        missing = [name for name in _COMPONENTS if name not in values]
        if missing:
            raise UnusableText(tr("there is no {name}", name=", ".join(missing)), line)
        numbers = [required_number(name, values[name], line) for name in _COMPONENTS]
        given: dict[str, object] = {"number": int(found["number"])}
        name = (found["name"] or found["bare"] or "").strip()
        given |= {"name": name} if name else {}
        places = {"F": "local", "T": "tool"}
        given |= {places[one]: int(of) for one, of in frames.items() if of != "F"}
        matrix = _RULE.matrix(radians(numbers[3:], line))
        self.poses.append(turned(line, numbers[:3], matrix, given))


def _body(body: str, line: int) -> tuple[dict[str, str], dict[str, str]]:
    """Return frames and values of the first axis group, if all of its items are known."""
    frames: dict[str, str] = {}
    values: dict[str, str] = {}
    group, place = "1", 0
    while body[place:].strip():
        place = _past_blanks(body, place)
        here = line + body[:place].count("\n")
        if begins := _GROUP.match(body, place):
            group, place = begins[1], begins.end()
            continue
        if config := _CONFIG.match(body, place):
            place = config.end()
            continue
        item = _ITEM.match(body, place)
        text = item[1] if item else ""
        place = item.end() if item else len(body)
        frame, value = _FRAME.fullmatch(text), _VALUE.fullmatch(text)
        if frame:
            into, name, what = frames, frame[1], frame[2]
        elif value:
            into, name, what = values, value[1], value[2]
            _require_known(value, here)
        else:
            shown = " ".join(text.split())
            if _DECIMALS.fullmatch(shown):
                why = tr(
                    "{text!r} has no name: write decimals with a point, not a comma", text=shown
                )
                raise UnusableText(why, here)
            raise UnusableText(tr("{text!r} is not a name and a value", text=shown), here)
        if group != "1":
            continue
        if name in into:
            raise UnusableText(tr("{name} appears twice", name=name), here)
        into[name] = what
    return frames, values


def _require_known(value: re.Match[str], line: int) -> None:
    name, text, unit = value.groups()
    if name not in _UNITS and not _JOINT.fullmatch(name):
        raise UnusableText(tr("a pose has no {name}", name=name), line)
    if unit not in ("", _UNITS.get(name, unit if unit in ("mm", "deg") else "")):
        raise UnusableText(tr("{name} is in {unit}", name=name, unit=unit), line)
    if not _STARS.fullmatch(text):
        required_number(name, text, line)
