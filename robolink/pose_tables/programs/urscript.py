"""Poses ``p[..]`` in scripts of Universal Robots.

Metres and a rotation vector in radians, unless the values say other units as the controller prints
them (docs/reference/pose_files.md 2). A pose in a call that moves to it, or with a name of its own,
is a place of the robot; a tool centre point and what is calculated with are not.
"""

import math
import re
from collections.abc import Iterator
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.encoding import line_counter
from robolink.pose_tables.numbers import NUMBER, number_of, plain, seems_number, why_no_number
from robolink.pose_tables.orientation import RULES
from robolink.pose_tables.programs.program_text import blanked, left_out, program, turned
from robolink.pose_tables.values import LengthUnit, RawPose, RawTable, UnusableText

_RULE: Final = RULES["rotvec"]
_OURS: Final = re.compile(
    r"\bp\s*\[|\b(?:move[jlpc]|servo[jc])\s*\(|\bdef\s+\w+\(|\w=\s*p?[\[(0-9.]+.*\]"
)
_COMMENT: Final = re.compile(r"#.*")
_STRING: Final = re.compile(r"\"[^\"\n]*\"|'[^'\n]*'")
_TOKEN: Final = re.compile(r"(?P<call>[A-Za-z_]\w*)\s*\(|(?P<open>\(|\[)|(?P<close>\)|\])|\n")
_VALUE: Final = re.compile(rf"({NUMBER})\s*(mm|m|in|rad|deg|°)?")
_NAMED: Final = re.compile(r"(\w+)\s*=\s*$")
_MOVES: Final = frozenset({"movel", "movej", "movep", "movec", "servoc"})
_NO_PLACES: Final = frozenset(
    {
        *("set_tcp", "set_target_payload", "set_payload_cog", "set_gravity", "force_mode"),
        *("pose_trans", "pose_inv", "pose_add", "pose_sub", "pose_dist", "point_dist"),
        *("interpolate_pose", "speedl", "wrench_trans", "get_inverse_kin", "textmsg", "popup"),
        *("conveyor_pulse_decode", "track_conveyor_linear", "track_conveyor_circular"),
        *("get_inverse_kin_has_solution", "calculate_tcp", "add_frame", "str_cat", "to_str"),
    }
)
"""Functions whose poses are not places that the robot moves to."""
_JOINTS_OF: Final = frozenset({"movej", "movel", "movep", "movec", "servoj", "speedj", "stopj"})
_JOINT_NAME: Final = re.compile(r"(?:.*_)?(?:q|qn|qnear|joints?)\d*", re.IGNORECASE)
_SIX: Final = 6
_CHANGES: Final = re.compile(r"\s*[*+\-/\[]")
_BARE: Final = re.compile(r"(?<![\w.])[A-Za-z_]\w*\s*$")
_CUT: Final = re.compile(
    r"\s*(?:(?:global|local)\b[^=\n]*|\w+(?:[ \t]+\w+)?[ \t]*=(?:[ \t]*p)?|[A-Za-z_]\w*)\s*"
)
_WORDS: Final = frozenset({"end", "halt", "return", "break", "continue", "pass", "else"})


def read_urscript(text: str) -> RawTable | None:
    """Return the poses ``p[..]`` of a script of Universal Robots; ``None`` where there is none.

    Raises:
        UnusableText: What looks like a pose is none, or has units that are none of its.
    """
    whole = plain(text)
    text = whole
    text = _COMMENT.sub(blanked, _STRING.sub(blanked, text))
    if (
        "[" not in text + "]"
        or not _OURS.search(text)
        or not re.search(r"\bp\s*[\[(]|move|_q\b", text)
    ):
        return None
    for number, code in enumerate(text.split("\n"), start=1):
        if _CUT.fullmatch(code) and code.strip() not in _WORDS:
            raise UnusableText(tr("the line is not whole"), number)
    line_at = line_counter(text)
    poses: list[RawPose] = []
    lengths: set[str] = set()
    joints, names = 0, set[str]()
    called: dict[str, int] = {}
    posed: set[str] = set()
    for start, end, calls, written in _lists(text):
        line = line_at(start)
        body = text[start + 1 : end - 1]
        named = _NAMED.search(text[text.rfind("\n", 0, written) + 1 : written])
        name = named[1] if named else ""
        parts = [part.strip() for part in body.split(",")]
        before = text[written:start].strip()
        if before != "p":
            found = _joints(parts, name, calls, line)
            if found and before:
                why = tr("six numbers behind {name}: a pose, or joint angles?", name=before)
                raise UnusableText(why, line)
            joints += found
            called |= {calls[-1]: line} if found and calls else {}
            continue
        posed |= set(calls[-1:])
        if any(call in _NO_PLACES for call in calls):
            continue
        if any(call not in _MOVES for call in calls):
            why = tr("{call}(..) is not known: it may change the pose", call=calls[-1])
            raise UnusableText(why, line)
        if "[" in body or "\n" in body.strip():
            raise UnusableText(tr("its brackets do not match"), line)
        if _CHANGES.match(text, end):
            raise UnusableText(
                tr("what stands beside the pose is not understood; it may change it"), line
            )
        pose, units = _pose(parts, name, line)
        if name in names:
            raise UnusableText(tr("{name} appears twice", name=name), line)
        names |= {name} if name else set()
        poses.append(pose)
        lengths |= units
    for call, line in called.items():
        if call in posed:
            raise UnusableText(_without_p(), line)
    if not poses and not joints:
        return None
    joints += left_out(whole, "#", r"\bp\s*\[")
    if len(lengths) > 1 or not lengths <= {"", "mm", "m", "in"}:
        raise UnusableText(tr("its lengths have different units"))
    raw = program("URScript", poses, _RULE.formula, joints, angle="rad")
    (said,) = lengths
    raw.length, raw.stated_length = LengthUnit(said or "m"), bool(said)
    return raw


def _lists(text: str) -> Iterator[tuple[int, int, tuple[str, ...], int]]:
    """Yield start and end of each list, the calls around it, and where it starts in the text.

    Raises:
        UnusableText: A bracket has no partner.
    """
    line_at = line_counter(text)
    opened: list[tuple[str, int, str]] = []
    for found in _TOKEN.finditer(text):
        place = found.end() - 1
        if found["call"] is not None:
            opened.append(("(", place, found["call"].lower()))
        elif found["open"]:
            opened.append((found["open"], place, ""))
        elif found["close"]:
            partner = "(" if found["close"] == ")" else "["
            if not opened or opened[-1][0] != partner:
                at = opened[-1][1] if opened else place
                raise UnusableText(tr("its brackets do not match"), line_at(at))
            _, start, call = opened.pop()
            if partner == "[" and not any(one == "[" for one, _, _ in opened):
                calls = tuple(name for _, _, name in opened if name)
                line = text.rfind("\n", 0, start) + 1
                bare = _BARE.search(text, line, start)
                yield start, place + 1, calls, bare.start() if bare else start
            if partner == "(" and call == "p":
                raise UnusableText(tr("p[..] does not hold six numbers"), line_at(start))
    if opened:
        raise UnusableText(tr("its brackets do not match"), line_at(opened[0][1]))


def _joints(parts: list[str], name: str, calls: tuple[str, ...], line: int) -> int:
    """Return 1 for a list of joint angles, 0 for one without a place.

    Raises:
        UnusableText: Six numbers that nothing says to be joints may be a pose without its p.
    """
    numbers = sum(map(seems_number, parts)) + sum(bool(_VALUE.fullmatch(part)) for part in parts)
    if len(parts) < _SIX - 1 or not numbers:
        return 0
    if _JOINT_NAME.fullmatch(name) or (calls and calls[-1] in _JOINTS_OF):
        return 1
    if calls:
        return 0
    raise UnusableText(_without_p(), line)


def _without_p() -> str:
    return tr("six numbers without p before them: a pose, or joint angles?")


def _pose(parts: list[str], name: str, line: int) -> tuple[RawPose, set[str]]:
    if len(parts) != _SIX:
        raise UnusableText(tr("p[..] does not hold six numbers"), line)
    matched = [_VALUE.fullmatch(part) for part in parts]
    for letter, part, one in zip(("X", "Y", "Z", "RX", "RY", "RZ"), parts, matched, strict=True):
        if one is None:
            raise UnusableText(why_no_number(letter, part), line)
    found = [one for one in matched if one is not None]
    numbers = [number_of(one[1]) for one in found]
    units = [one[2] or "" for one in found]
    if len(set(units[3:])) > 1 or not set(units[3:]) <= {"", "rad", "deg", "°"}:
        raise UnusableText(tr("its angles have different units"), line)
    if len(set(units[:3])) > 1:
        raise UnusableText(tr("its lengths have different units"), line)
    degrees = units[3] in ("deg", "°")
    vector = [math.radians(value) for value in numbers[3:]] if degrees else numbers[3:]
    if not math.hypot(*vector) <= 2 * math.pi * (1 + 1e-6):
        raise UnusableText(tr("a rotation vector is longer than a turn in radians"), line)
    given: dict[str, object] = {"name": name} if name else {}
    return turned(line, numbers[:3], _RULE.matrix(vector), given), set(units[:3])
