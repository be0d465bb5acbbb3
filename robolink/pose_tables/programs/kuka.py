"""Poses in ``.dat`` and ``.src`` files of KUKA: ``DECL E6POS XP1={X 405.8,Y -62.9,..}``.

mm and degrees, R = Rz(A) Ry(B) Rx(C) (docs/reference/pose_files.md 2). The ``FDAT`` of a point says
its tool and base. Tools, bases, loads and joints are no poses.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.encoding import line_counter
from robolink.pose_tables.numbers import number_of, plain
from robolink.pose_tables.orientation import RULES
from robolink.pose_tables.programs.program_text import (
    Group,
    blanked,
    fields_of,
    groups_of,
    left_out,
    program,
    radians,
    required_number,
    turned,
    without,
)
from robolink.pose_tables.values import RawPose, RawTable, UnusableText

_RULE: Final = RULES["kuka"]
_COMPONENTS: Final = ("X", "Y", "Z", "A", "B", "C")
_BESIDE: Final = frozenset({"S", "T", *(f"E{axis}" for axis in range(1, 7))})
_JOINT: Final = re.compile(r"A[1-6]")
_TYPES: Final = "E6POS|E3POS|POS|FRAME"

_OURS: Final = re.compile(
    rf"\bDEFDAT\b|\b(?:{_TYPES})\s+\$?\w+\s*(?:\[[^\]\n]*\])?\s*=|\bE[36]AXIS\b|\bE6POS\b"
    r"|\{\s*(?:\w+\s*:\s*)?[XYZABC](?:[ \t]+[+-]?|[+-])[0-9OIl.]"
    r"|,\s*[XYZABC](?:[ \t]+[+-]?|[+-])[0-9OIl.][^\n{]*\}",
    re.IGNORECASE,
)
_COMMENT: Final = re.compile(r"(?m)^([^;\"\n]*(?:\"[^\"\n]*\"[^;\"\n]*)*);.*")
_STRING: Final = re.compile(r"\"[^\"\n]*\"")
_HEAD: Final = re.compile(
    r"\s*(?:(?:GLOBAL|DECL|CONST)\s+)*(?:(?P<type>\w+)\s+)?(?P<name>\$?\w+)"
    r"\s*(?:\[\s*\d*\s*(?:,\s*\d+\s*)*\])?\s*=\s*",
    re.IGNORECASE,
)
_MOVES: Final = re.compile(r"\s*(?:S?(?:PTP|LIN|CIRC)|SPL)\s+|\s*,?\s*", re.IGNORECASE)
_RELATIVE: Final = re.compile(r"\s*S?(?:PTP|LIN|CIRC)_REL\s+|\s*,\s*", re.IGNORECASE)
_BEHIND: Final = re.compile(r"[\s,;#A-Za-z_]*")
_FIELD: Final = re.compile(
    r"\s*([A-Z_][A-Z_0-9]*(?:\[\d*\])?)(?:\s+|(?=[+\-\"{#]))(.+?)\s*", re.I | re.S
)
_TYPED: Final = re.compile(r"\s*(\w+)\s*:(.*)", re.DOTALL)
_NO_POSE: Final = re.compile(r"\$.*|TOOL_DATA|BASE_DATA|LOAD_\w+|MACHINE\w*", re.IGNORECASE)
_LABELLED: Final = re.compile(r"\b[XYZABC][ \t]*[=:]?[ \t]*[+-]?[0-9.]", re.IGNORECASE)
_DECLARED: Final = re.compile(
    rf"(?m)^[ \t]*(?:(?:GLOBAL|DECL|CONST)\s+)*(?:{_TYPES})\s+(\$?\w+)\s*(\[[^\]\n]*\])?"
    r"[ \t]*(=?)[ \t]*$",
    re.IGNORECASE,
)
_LINE_OF_DATA: Final = re.compile(
    r"&.*|(?:PUBLIC\s+)?(?:DEFDAT|ENDDAT)\b.*"
    r"|(?:(?:GLOBAL|DECL|CONST)\s+)*(?:(?!(?:GLOBAL|DECL|CONST)\b)\w+)\s+\$?\w+.*"
    r"|(?:EXT|EXTP|EXTFCT|EXTFCTP|IMPORT|STRUC|ENUM|SIGNAL|CHANNEL)\b.*|\$?\w[\w\[\].,]*\s*=.*",
    re.IGNORECASE,
)
_FEWEST_LABELS: Final = 3


@dataclass(frozen=True, slots=True)
class _Frame:
    """Tool and base of the point of an ``FDAT``."""

    line: int
    tool: int
    base: int


class _Reader:
    """Reads one text, in which comments are blanked."""

    def __init__(self, text: str, line_at: Callable[[int], int]) -> None:
        self._text = text
        self._line_at = line_at
        self._joints: set[str] = set()
        self._frames: dict[str, _Frame] = {}
        self._named: set[str] = set()
        self.poses: list[RawPose] = []
        self.skipped = 0

    def read(self) -> None:
        """Read all aggregates, and refuse what only looks like one."""
        before, taken = 0, list[tuple[int, int]]()
        for group in groups_of(_STRING.sub(blanked, self._text), "{", self._line_at):
            begin = max(before, self._text.rfind("\n", 0, group.start) + 1)
            self._aggregate(group, begin)
            taken.append((begin, group.end))
            before = group.end
        self._refuse_pieces(without(self._text, taken))
        self._add_frames()

    def _aggregate(self, group: Group, begin: int) -> None:
        line = self._line_at(group.start)
        body = self._text[group.start + 1 : group.end - 1]
        head = self._text[begin : group.start]
        found = _HEAD.fullmatch(head)
        name = found["name"] if found else ""
        if _NO_POSE.fullmatch(name):
            return
        typed = _TYPED.fullmatch(body)
        kind = (typed[1] if typed else (found["type"] or "") if found else "").upper()
        fields = dict(self._fields(typed[2] if typed else body, line))
        if kind == "FDAT":
            self._frames[name[1:].upper()] = _frame(fields, line)
        elif _is_pose(fields) or kind in _TYPES.split("|"):
            self._pose(group, head, name, fields, line)
        elif any(map(_JOINT.fullmatch, fields)):
            self._joints.add(name[1:].upper())
            self.skipped += 1

    def _fields(self, body: str, line: int) -> Iterator[tuple[str, str]]:
        seen: set[str] = set()
        for field in fields_of(body, "{"):
            found = _FIELD.fullmatch(field)
            if found is None:
                last = number_of(field) == number_of(field)
                raise UnusableText(
                    tr(
                        "{text!r} has no name: write decimals with a point, not a comma",
                        text=field.strip(),
                    )
                    if last
                    else tr("{text!r} is not a name and a value", text=field.strip()),
                    line,
                )
            name = found[1].upper()
            if name in seen:
                raise UnusableText(tr("{name} appears twice", name=name), line)
            seen.add(name)
            yield name, found[2]

    def _pose(
        self, group: Group, head: str, name: str, fields: Mapping[str, str], line: int
    ) -> None:
        behind = self._text[group.end : _end_of_line(self._text, group.end)].partition("{")[0]
        if _RELATIVE.fullmatch(head) and "_REL" in head.upper():
            self.skipped += 1
            return
        if not (_HEAD.fullmatch(head) or _MOVES.fullmatch(head)) or not _BEHIND.fullmatch(behind):
            raise UnusableText(
                tr("what stands beside the pose is not understood; it may change it"), line
            )
        missing = [one for one in _COMPONENTS if one not in fields]
        if missing:
            raise UnusableText(tr("there is no {name}", name=", ".join(missing)), line)
        unknown = next((one for one in fields if one not in (*_COMPONENTS, *_BESIDE)), None)
        if unknown:
            raise UnusableText(tr("a pose has no {name}", name=unknown), line)
        numbers = [required_number(one, fields[one], line) for one in _COMPONENTS]
        for one in _BESIDE & fields.keys():
            if not re.fullmatch(r"'B[01]+'", fields[one], re.IGNORECASE):
                required_number(one, fields[one], line)
        if name and "[" not in head:
            if name.upper() in self._named:
                raise UnusableText(tr("{name} appears twice", name=name), line)
            self._named.add(name.upper())
        matrix = _RULE.matrix(radians(numbers[3:], line))
        self.poses.append(turned(line, numbers[:3], matrix, {"name": name} if name else {}))

    def _refuse_pieces(self, rest: str) -> None:
        """Refuse lines without an aggregate that look like the rest of one."""
        data = re.search(r"\bDEFDAT\b", rest, re.IGNORECASE) is not None
        for number, line in enumerate(rest.split("\n"), start=1):
            if len(_LABELLED.findall(line)) >= _FEWEST_LABELS:
                raise UnusableText(tr("the pose has no braces"), number)
            if data and line.strip() and not _LINE_OF_DATA.fullmatch(line.strip()):
                raise UnusableText(tr("the line is not whole"), number)
        for found in _DECLARED.finditer(rest):
            given = re.search(
                rf"(?m)^[ \t]*{re.escape(found[1])}\s*(?:\[[^\]\n]*\])?\s*=",
                self._text,
                re.IGNORECASE,
            )
            if found[3] or (data and not found[2] and not given):
                why = tr("{name} has no value", name=found[1])
                raise UnusableText(why, self._line_at(found.start(1)))

    def _add_frames(self) -> None:
        """Give each point the tool and base of its ``FDAT``.

        Raises:
            UnusableText: Some points have one and some do not, or one has no point.
        """
        if not self._frames:
            return
        points = {str(pose.given.get("name", ""))[1:].upper() for pose in self.poses}
        for name, frame in self._frames.items():
            if name not in points | self._joints:
                raise UnusableText(tr("the FDAT of {name} has no point", name=name), frame.line)
        for pose in self.poses:
            name = str(pose.given.get("name", ""))
            own = self._frames.get(name[1:].upper())
            if own is None:
                why = tr("the point {name} has no FDAT, as others have", name=name)
                raise UnusableText(why, pose.line)
            pose.given |= {"tool": own.tool} if own.tool >= 0 else {}
            pose.given |= {"local": own.base} if own.base >= 0 else {}


def read_kuka(text: str) -> RawTable | None:
    """Return the poses of a KUKA ``.dat`` or ``.src``; ``None`` if it has none.

    Raises:
        UnusableText: What looks like a pose is none; says the line.
    """
    text = plain(text)
    commentless = _COMMENT.sub(lambda found: found[1], text)
    if not _OURS.search(commentless):
        return None
    reader = _Reader(commentless, line_counter(commentless))
    reader.read()
    if reader.poses:
        reader.skipped += left_out(text, ";", r"\{[^{}]*\bX[ \t]*[+-]?[0-9.]")
    if not reader.poses and not reader.skipped:
        return None
    return program("KUKA", reader.poses, _RULE.formula, reader.skipped)


def _is_pose(fields: Mapping[str, str]) -> bool:
    return bool({"X", "Y", "Z"} & fields.keys()) or len({"A", "B", "C"} & fields.keys()) > 1


def _frame(fields: Mapping[str, str], line: int) -> _Frame:
    numbers = []
    for name in ("TOOL_NO", "BASE_NO"):
        text = fields.get(name, "")
        if not re.fullmatch(r"-?[0-9]{1,3}", text, re.ASCII):
            raise UnusableText(tr("{name} is not a whole number", name=name), line)
        numbers.append(int(text))
    return _Frame(line, *numbers)


def _end_of_line(text: str, place: int) -> int:
    end = text.find("\n", place)
    return len(text) if end < 0 else end
