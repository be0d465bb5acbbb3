"""Poses in programs of KUKA, ABB, FANUC and Universal Robots.

Units and rotations are those that each maker defines: mm and degrees with KUKA (R = Rz(A) Ry(B)
Rx(C)) and FANUC (R = Rz(R) Ry(P) Rx(W)), mm and a quaternion with the scalar first with ABB, metres
and a rotation vector in radians with Universal Robots (docs/reference/pose_files.md 2). What is a
tool, a base or a set of joints is no pose and is left out.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables import orientation
from robolink.pose_tables.conventions import RULES
from robolink.pose_tables.encoding import line_counter
from robolink.pose_tables.refusals import UnusableText
from robolink.pose_tables.values import LengthUnit, RawPose, RawTable

_N: Final = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_ROTATION_VECTOR: Final = RULES["rotvec"]
_KUKA: Final = RULES["kuka"]
_FANUC: Final = RULES["fanuc"]

_KUKA_AGGREGATE: Final = re.compile(
    r"(?:(?P<name>\$?\w+)(?:\[\d+\])?\s*=\s*)?\{\s*(?:(?:E6POS|E3POS|POS|FRAME)\s*:\s*)?"
    r"(?P<body>X\s+[^{}]*)\}",
    re.IGNORECASE,
)
_KUKA_PAIR: Final = re.compile(rf"\b([A-Z]\w*)\s+({_N})", re.IGNORECASE)
_KUKA_JOINTS: Final = re.compile(r"\{\s*(?:E6AXIS\s*:|AXIS\s*:)?\s*A1\s", re.IGNORECASE)
_KUKA_DATA: Final = re.compile(
    r"FDAT\s+F(\w+)\s*=\s*\{[^}]*?TOOL_NO\s+(-?\d+)[^}]*?BASE_NO\s+(-?\d+)", re.IGNORECASE
)
_KUKA_NO_POSE: Final = re.compile(r"\$.*|TOOL_DATA|BASE_DATA|LOAD_\w+|MACHINE\w*", re.IGNORECASE)

_ABB_VALUE: Final = rf"\[\s*\[({_N}(?:\s*,\s*{_N}){{2}})\]\s*,\s*\[({_N}(?:\s*,\s*{_N}){{3}})\]"
_ABB_TARGET: Final = re.compile(
    rf"(?:robtarget\s+(?P<name>\w+)\s*:=\s*|(?P<pose>pose)\s+(?P<called>\w+)\s*:=\s*)?"
    rf"(?P<value>{_ABB_VALUE})\s*(?P<rest>,\s*\[[^\[\]]*\]\s*,\s*\[[^\[\]]*\]\s*)?\]",
    re.IGNORECASE,
)
_ABB_OTHER: Final = re.compile(
    r"\b(?:tooldata|wobjdata|loaddata)\s+\w+[^;]*;", re.IGNORECASE | re.DOTALL
)
_ABB_MOVE: Final = re.compile(
    r"\bMove[A-Z]\w*\s+(?P<target>\w*)[^;]*?,\s*(?P<tool>\w+)\s*(?:\\\s*WObj\s*:=\s*\w+\s*)?;",
    re.IGNORECASE,
)
_ABB_JOINTS: Final = re.compile(r"\bjointtarget\s+\w+", re.IGNORECASE)

_FANUC_POINT: Final = re.compile(
    r"^\s*PR?\[\s*(\d+)\s*(?::\s*\"?([^\"\]]*)\"?)?\s*\]\s*\{(.*?)\}\s*;?", re.MULTILINE | re.DOTALL
)
_FANUC_VALUE: Final = re.compile(rf"\b([XYZWPR])\s*[=:]\s*({_N})\s*(mm|deg)?", re.IGNORECASE)
_FANUC_FRAME: Final = re.compile(r"\bU([FT])\s*:\s*(\d+)")
_FANUC_JOINTS: Final = re.compile(r"\bJ1\s*=")

_UR_POSE: Final = re.compile(
    r"(?:(?P<name>\w+)\s*=\s*)?(?:(?P<call>\w+)\s*\(\s*)?\bp\[(?P<body>[^\[\]]*)\]"
)
_UR_NUMBER: Final = re.compile(rf"({_N})\s*(mm|m|in|rad|deg|°)?")
_UR_MOVES: Final = ("movel", "movej", "movep", "movec", "servoc")
_UR_JOINTS: Final = re.compile(r"\bmove[jlpc]\s*\(\s*\[|\w_q\s*=\s*\[")
_UR_COMMENT: Final = re.compile(r"#.*")


def read_kuka(text: str) -> RawTable | None:
    """Return the poses of a KUKA ``.dat`` or ``.src``; ``None`` where there is none of its sort.

    Raises:
        UnusableText: A pose lacks a component.
    """
    if "{" not in text:
        return None
    text = re.sub(r"^[ \t]*;.*", "", text, flags=re.MULTILINE)
    line_at = line_counter(text)
    data = {name.upper(): (int(tool), int(base)) for name, tool, base in _KUKA_DATA.findall(text)}
    poses: list[RawPose] = []
    for found in _KUKA_AGGREGATE.finditer(text):
        name = found["name"] or ""
        if _KUKA_NO_POSE.fullmatch(name):
            continue
        line = line_at(found.start())
        values = {key.upper(): float(v) for key, v in _KUKA_PAIR.findall(found["body"])}
        numbers = _all_of(values, "XYZABC", line)
        given: dict[str, object] = {"name": name} if name else {}
        # FPIN1 belongs to XPIN1.
        tool, base = data.get(name[1:].upper(), (-1, -1))
        given |= {"tool": tool} if tool >= 0 else {}
        given |= {"local": base} if base >= 0 else {}
        poses.append(_turned(line, numbers[:3], _KUKA.matrix(_radians(numbers[3:])), given))
    joints = len(_KUKA_JOINTS.findall(text))
    if not poses and not joints:
        return None
    return _program("KUKA", poses, _KUKA.formula, joints)


def read_abb(text: str) -> RawTable | None:
    """Return the poses of a RAPID module; ``None`` where there is none of its sort.

    Raises:
        UnusableText: A quaternion has not the length 1.
    """
    if "[" not in text:
        return None
    text = re.sub(r"^([^!\"\n]*)!.*", r"\1", text, flags=re.MULTILINE)
    text = _ABB_OTHER.sub(_blanked, text)
    line_at = line_counter(text)
    poses: list[RawPose] = []
    for found in _ABB_TARGET.finditer(text):
        if not found["rest"] and not found["pose"]:
            continue  # two brackets alone do not say which number is the scalar
        line = line_at(found.start())
        place, (q1, q2, q3, q4) = (_floats(part) for part in found.group(5, 6))
        matrix = orientation.from_quaternion(q2, q3, q4, q1, line)
        name = found["name"] or found["called"] or ""
        _refuse_abb_tool(text, found, name, line)
        poses.append(_turned(line, place, matrix, {"name": name} if name else {}))
    joints = len(_ABB_JOINTS.findall(text))
    if not poses and not joints:
        return None
    return _program("ABB", poses, "quaternion Q1 (scalar) Q2 Q3 Q4", joints, angle="")


def _refuse_abb_tool(text: str, target: re.Match[str], name: str, line: int) -> None:
    """Refuse a target to which the module moves a tool: it is no place of the flange."""
    for move in _ABB_MOVE.finditer(text):
        within = move.start() < target.start() < move.end()
        if (within or (name and move["target"] == name)) and move["tool"].lower() != "tool0":
            raise UnusableText(
                tr("it is a position of the tool {tool}, not of the flange", tool=move["tool"]),
                line,
            )


def read_fanuc(text: str) -> RawTable | None:
    """Return the points of a FANUC ``.ls``; ``None`` where there is none.

    Raises:
        UnusableText: A point lacks a component.
    """
    if "{" not in text:
        return None
    line_at = line_counter(text)
    poses: list[RawPose] = []
    skipped = 0
    for found in _FANUC_POINT.finditer(text):
        number, name, body = found.groups()
        line = line_at(found.start(1))
        if _FANUC_JOINTS.search(body) or "****" in body:
            skipped += 1
            continue
        values = {key.upper(): float(v) for key, v, _ in _FANUC_VALUE.findall(body)}
        numbers = _all_of(values, "XYZRPW", line)
        given: dict[str, object] = {"number": int(number)}
        given |= {"name": name.strip()} if name and name.strip() else {}
        frames = {"F": "local", "T": "tool"}
        given |= {frames[which]: int(value) for which, value in _FANUC_FRAME.findall(body)}
        poses.append(_turned(line, numbers[:3], _FANUC.matrix(_radians(numbers[3:])), given))
    if not poses and not skipped:
        return None
    return _program("FANUC", poses, _FANUC.formula, skipped, stated=True)


def read_urscript(text: str) -> RawTable | None:
    """Return the poses ``p[..]`` of a script of Universal Robots; ``None`` where there is none.

    Raises:
        UnusableText: A pose has not six numbers, or units that are none of its.
    """
    if "[" not in text:
        return None
    poses: list[RawPose] = []
    lengths: set[str] = set()
    line_at = line_counter(text)
    for found in _UR_POSE.finditer(_UR_COMMENT.sub(_blanked, text)):
        name, call = found["name"], found["call"]
        if call is not None and call.lower() not in _UR_MOVES:
            continue  # set_tcp(p[..]) and pose_trans(.., p[..]) are no places of the robot
        line = line_at(found.start("body"))
        parts = [_UR_NUMBER.fullmatch(part.strip()) for part in found["body"].split(",")]
        if len(parts) != 6 or None in parts:
            raise UnusableText(tr("p[..] does not hold six numbers"), line)
        matched = [part for part in parts if part is not None]
        numbers = [float(part[1]) for part in matched]
        lengths |= {part[2] or "" for part in matched[:3]}
        degrees = {part[2] or "" for part in matched[3:]} <= {"deg", "°"}
        turned = _radians(numbers[3:]) if degrees else numbers[3:]
        if math.hypot(*turned) > 2 * math.pi * (1 + 1e-6):
            raise UnusableText(tr("a rotation vector is longer than a turn in radians"), line)
        given: dict[str, object] = {"name": name} if name else {}
        poses.append(_turned(line, numbers[:3], _ROTATION_VECTOR.matrix(turned), given))
    joints = len(_UR_JOINTS.findall(text))
    if not poses and not joints:
        return None
    if len(lengths) > 1 or not lengths <= {"", "mm", "m", "in"}:
        raise UnusableText(tr("its lengths have different units"))
    raw = _program("URScript", poses, _ROTATION_VECTOR.formula, joints, angle="rad")
    (said,) = lengths
    raw.length, raw.stated_length = LengthUnit(said or "m"), bool(said)
    return raw


def _program(
    maker: str,
    poses: list[RawPose],
    rotation: str,
    skipped: int,
    *,
    angle: str = "deg",
    stated: bool = False,
) -> RawTable:
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


def _all_of(values: Mapping[str, float], names: str, line: int) -> list[float]:
    missing = [name for name in names if name not in values]
    if missing:
        raise UnusableText(tr("there is no {name}", name=", ".join(missing)), line)
    return [values[name] for name in names]


def _turned(
    line: int, place: Sequence[float], matrix: orientation.Matrix, given: dict[str, object]
) -> RawPose:
    x, y, z = place
    return RawPose(line, (x, y, z), orientation.uvw_deg(matrix), given)


def _radians(degrees: Sequence[float]) -> list[float]:
    return [math.radians(value) for value in degrees]


def _floats(text: str) -> list[float]:
    return [float(part) for part in text.split(",")]


def _blanked(found: re.Match[str]) -> str:
    return re.sub(r"[^\n]", " ", found[0])


READERS: Final[tuple[Callable[[str], RawTable | None], ...]] = (
    read_fanuc,
    read_abb,
    read_kuka,
    read_urscript,
)
"""Each knows its own by what none of the others writes."""
