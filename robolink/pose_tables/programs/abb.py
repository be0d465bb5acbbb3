"""Targets in RAPID modules of ABB: ``robtarget p1:=[[x,y,z],[q1,q2,q3,q4],[..],[..]];``.

mm and a quaternion with the scalar first (docs/reference/pose_files.md 2). Tools, work objects,
loads and joints are no poses.
"""

import re
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from typing import Final, TypeAlias

from robolink.messages import tr
from robolink.pose_tables import orientation
from robolink.pose_tables.encoding import line_counter
from robolink.pose_tables.numbers import plain
from robolink.pose_tables.programs.program_text import (
    blanked,
    fields_of,
    groups_of,
    left_out,
    program,
    required_number,
    turned,
    without,
)
from robolink.pose_tables.values import RawPose, RawTable, UnusableText

Value: TypeAlias = "str | list[Value]"

_ITEM: Final = r"[^\[\],]+"
_OURS: Final = re.compile(
    r"\b(?:robtarget|jointtarget)\b|:=\s*\[|\bMove[A-Z]\w*\b[^;\n]*\[\s*\["
    rf"|\[\s*\[\s*{_ITEM},{_ITEM},{_ITEM}\],\s*\[{_ITEM},{_ITEM},{_ITEM},{_ITEM}\]\s*,"
    rf"\s*\[{_ITEM},{_ITEM},{_ITEM},{_ITEM}\]",
    re.IGNORECASE,
)
_STRING: Final = re.compile(r"\"[^\"\n]*\"")
_COMMENT: Final = re.compile(r"!.*")
_HEAD: Final = re.compile(
    r"(?:\b(?:LOCAL|TASK|CONST|VAR|PERS)\s+)*\b(?P<type>\w+)\s+(?P<name>\w+)\s*(?:\{[^{}]*\})?"
    r"\s*:=\s*$",
    re.IGNORECASE,
)
_ASSIGNED: Final = re.compile(r"(?P<name>\w+)\s*(?:\{[^{}]*\})?\s*:=\s*$")
_OTHERS: Final = frozenset({"tooldata", "wobjdata", "loaddata"})
_POSES: Final = frozenset({"robtarget", "pose"})
_MOVE: Final = re.compile(
    r"\bMove[A-Z]\w*\s+(?P<target>\w*)[^;]*?,\s*(?P<tool>\w+)\s*(?:\\\s*WObj\s*:=\s*\w+\s*)?;",
    re.IGNORECASE,
)
_NO_VALUE: Final = re.compile(r"\b(?:robtarget|pose)\b[^;\n]*:=\s*;?\s*$", re.IGNORECASE)
_DECLARES: Final = re.compile(r"\s*(?:LOCAL|TASK|CONST|VAR|PERS)\b", re.IGNORECASE)
_STRUCTURE: Final = re.compile(
    r"\s*(?:%%%|VERSION|LANGUAGE|(?:LOCAL\s+)?(?:PROC|FUNC|TRAP|RECORD)\b|MODULE\b|END\w+|\w+\s*:$)",
    re.IGNORECASE,
)
_GOES_ON: Final = re.compile(r"\s*(?:[\w.+\-]+,|[\])])")
_ROUTINE: Final = re.compile(r"\s*(?:LOCAL\s+)?(?:PROC|FUNC|TRAP)\b", re.IGNORECASE)
_NUMBERS: Final = re.compile(r"(?:^|[,\[:=])\s*[+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?(?=\s*[,\];]|\s*$)")
_FEWEST_NUMBERS: Final = 6
_PLACE: Final = ("X", "Y", "Z")
_QUATERNION: Final = ("Q1", "Q2", "Q3", "Q4")


def read_abb(text: str) -> RawTable | None:
    """Return the poses of a RAPID module; ``None`` if it has none.

    Raises:
        UnusableText: What looks like a target is none; says the line.
    """
    whole = plain(text)
    text = _COMMENT.sub(blanked, _STRING.sub(_quotes, whole))
    if not _OURS.search(text):
        return None
    line_at = line_counter(text)
    poses: list[RawPose] = []
    joints, names = 0, set[str]()
    before, spans = 0, list[tuple[int, int]]()
    moves = _Moves(text)
    for group in groups_of(text, "[", line_at):
        begin = max(before, text.rfind(";", 0, group.start) + 1)
        head = text[begin : group.start]
        before = group.end
        declared = _HEAD.search(head)
        taken = begin + declared.start() if declared else group.start
        spans.append((taken, group.end))
        kind = declared["type"].lower() if declared else ""
        if kind in _OTHERS:
            continue
        line = line_at(group.start)
        value = _value(group.body)
        if kind == "jointtarget" or (kind not in _POSES and _are_joints(value)):
            joints += 1
            continue
        assigned = declared or _ASSIGNED.search(head)
        name = assigned["name"] if assigned else ""
        if declared and name.lower() in names:
            raise UnusableText(tr("{name} appears twice", name=name), line)
        names |= {name.lower()} if declared else set()
        found = list(_targets(value, line, kind))
        if found and re.search(r"[)\w]\s*[*+-]\s*$|\(\s*$", head):
            raise UnusableText(
                tr("what stands beside the pose is not understood; it may change it"), line
            )
        for place, matrix in found:
            moves.refuse_tool(group.start, name, line)
            poses.append(turned(line, place, matrix, {"name": name} if name else {}))
    _refuse_pieces(without(text, spans))
    if not poses and not joints:
        return None
    joints += left_out(whole, "!", r"\[\s*\[[^\[\]]*\]\s*,\s*\[")
    return program("ABB", poses, "quaternion Q1 (scalar) Q2 Q3 Q4", joints, angle="")


def _targets(
    value: Value, line: int, kind: str
) -> Iterator[tuple[list[float], orientation.Matrix]]:
    """Yield place and rotation of each target in a value."""
    if isinstance(value, list) and value and all(_nested(one) for one in value):
        for one in value:
            yield from _targets(one, line, kind)
        return
    parts = value if isinstance(value, list) and _nested(value) else []
    if not parts:
        if kind in _POSES:
            raise UnusableText(tr("it is not a target"), line)
        return  # a flat list: a speed, a zone, an array of numbers
    lists = [part for part in parts if isinstance(part, list)]
    if len(lists) != len(parts) or any(_nested(part) for part in lists):
        raise UnusableText(tr("it is not a target"), line)
    if len(parts) == 2 and kind != "pose":
        # Two brackets alone do not show which number is the scalar.
        raise UnusableText(tr("it is not a target: a pose has to be declared as one"), line)
    if len(parts) not in (2, 4) or (len(parts) == 4 and kind == "pose"):
        raise UnusableText(tr("it is not a target"), line)
    for part, names in zip(
        lists, (_PLACE, _QUATERNION, ("CF1", "CF4", "CF6", "CFX")), strict=False
    ):
        if len(part) != len(names):
            raise UnusableText(
                tr("{names} are {count} numbers", names=", ".join(names), count=len(part)), line
            )
    numbers = [
        [required_number(f"{name}", str(item), line) for name, item in _named(part, place)]
        for place, part in enumerate(lists)
    ]
    q1, q2, q3, q4 = numbers[1]
    yield numbers[0], orientation.from_quaternion(q2, q3, q4, q1, line)


def _named(part: Sequence[Value], place: int) -> Iterator[tuple[str, Value]]:
    names = (_PLACE, _QUATERNION)[place] if place < 2 else ()
    for number, item in enumerate(part, start=1):
        yield (names[number - 1] if names else str(number)), item


def _value(body: str) -> Value:
    """Return what stands in brackets as lists of texts."""
    items: list[Value] = []
    for field in fields_of(body, "["):
        inner = field.strip()
        if inner[:1] == "[" and inner[-1:] == "]":
            items.append(_value(inner[1:-1]))
        else:
            items.append(inner)
    return items


def _nested(value: Value) -> bool:
    return isinstance(value, list) and any(isinstance(one, list) or "[" in one for one in value)


def _are_joints(value: Value) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 2
        and all(isinstance(one, list) and len(one) == 6 for one in value)
    )


def _refuse_pieces(rest: str) -> None:
    """Refuse what is left of a target: cut short, or without its brackets."""
    data = re.search(r"\bMODULE\b", rest, re.IGNORECASE) is not None
    complete = True
    for number, line in enumerate(rest.split("\n"), start=1):
        data = data and not _ROUTINE.match(line)
        ended = line.rstrip()[-1:] in ("", ";")
        whole = ended or _STRUCTURE.match(line) is not None
        headless = complete and _GOES_ON.match(line) is not None
        cut = not whole and (data or _DECLARES.match(line) is not None)
        if _NO_VALUE.search(line) or headless or cut:
            raise UnusableText(tr("the line is not whole"), number)
        complete = whole
        if len(_NUMBERS.findall(line)) >= _FEWEST_NUMBERS:
            raise UnusableText(tr("its brackets do not match"), number)


class _Moves:
    """The movements of a module, and the tools that they name."""

    def __init__(self, text: str) -> None:
        found = [one for one in _MOVE.finditer(text) if one["tool"].lower() != "tool0"]
        self._starts = [one.start() for one in found]
        self._found = found
        self._by_target = {one["target"]: one["tool"] for one in reversed(found) if one["target"]}

    def refuse_tool(self, start: int, name: str, line: int) -> None:
        """Refuse a target to which the module moves a tool: it is no place of the flange.

        Raises:
            UnusableText: Names the tool.
        """
        before = bisect_left(self._starts, start) - 1
        inside = before >= 0 and start < self._found[before].end()
        tool = self._found[before]["tool"] if inside else self._by_target.get(name)
        if tool is not None:
            why = tr("it is a position of the tool {tool}, not of the flange", tool=tool)
            raise UnusableText(why, line)


def _quotes(found: re.Match[str]) -> str:
    return f'"{" " * (len(found[0]) - 2)}"'
