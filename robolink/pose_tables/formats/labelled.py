"""Values with their names beside them: ``X: 287.500 Y: 103.250 Z: -50.000 U: 0.000 /R /0``.

So controllers print a position. A name that comes again begins the next pose, so one pose may take
several lines. Position registers of FANUC (``POSREG.VA``) are written in this way too.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.formats.documents import read_document
from robolink.pose_tables.numbers import NUMBER, plain, why_no_number
from robolink.pose_tables.tabular.header import ANGLES, LENGTHS, MEANINGS
from robolink.pose_tables.tabular.separators import table_lines
from robolink.pose_tables.values import RawTable, ReadingChoices, UnusableText, at_line

_PAIR: Final = re.compile(
    r"(?<![\w.])([A-Za-z][A-Za-z_]{0,11})(\s*[:=]\s*|\s+)"
    rf"({NUMBER})(?![0-9.])\s*(mm|cm|m|in|deg|rad|°)?(?!\w)"
)
_LABEL: Final = re.compile(r"(?<![\w.])([A-Za-z][A-Za-z_]{0,11})\s*[:=]")
_LISTS: Final = re.compile(r"^\s*(name|position)\s*:\s*\[", re.MULTILINE)
_JOINT_VALUE: Final = re.compile(
    r"(?:^|(?<=[\s,;{]))((?:j|jt|joint|axis|a|q|theta)[_ ]?[1-7])\s*[:=]\s*[+-]?[.0-9]",
    re.IGNORECASE | re.MULTILINE,
)
_FLAGS: Final = re.compile(r"/\s*(?:[RLABF]|NF|J[1246]F\d+|\d{1,2})(?!\w)")
_FLAG_TWICE: Final = re.compile(r"[0-9]\s+//\s?(?:[RLABF]|NF|\d{1,2})(?:\s|$)")
_FLAG: Final = re.compile(r"/\s*([RL]|\d+)\b")
_POSITION_REGISTERS: Final = re.compile(r"\$POSREG\b")
_FEWEST: Final = 3
_FEWEST_LABELS: Final = 2
_CERTAIN: Final = frozenset({*LENGTHS, "u", "v", "w", "rx", "ry", "rz"})
_COMPONENTS: Final = frozenset({*LENGTHS, *ANGLES})


def read_labelled(lines: Sequence[str], choices: ReadingChoices) -> RawTable | None:
    """Return the poses of values with names; ``None`` for another layout.

    Raises:
        UnclearText: Unit or rule have to be named by a person.
        UnusableText: A pose is not whole.
    """
    kept, _ = table_lines(lines)
    if not any(len(_pairs(plain(text))) >= _FEWEST for _, text in kept):
        return None
    for line, text in enumerate(lines, start=1):
        if _FLAG_TWICE.search(text):
            raise UnusableText(tr("{text!r} is no hand and no local", text="//"), line)
    poses: list[dict[str, object]] = []
    name = ""
    for line, text in kept:
        text = plain(text)
        found = _pairs(text)
        with at_line(line):
            _refuse_pieces(text, found)
        pairs = [(pair[1], pair[3], pair[4]) for pair in found]
        if len(pairs) < _FEWEST:
            quoted = re.search(r"['\"]([^'\"]+)['\"]", text)
            name = quoted[1] if quoted else name
            continue
        if {"x", "y"} <= {label.lower() for label, _, _ in pairs}:
            before = text[: found[0].start()].strip(" \t:=,;({[")
            called = before or name
            poses.append({"name": called} if called else {})
            name = ""
        elif poses and re.search(r"\d", text[: found[0].start()]):
            raise UnusableText(
                tr("{text!r} has no name", text=text[: found[0].start()].strip()), line
            )
        elif not poses:
            raise UnusableText(tr("there is no {name}", name="X, Y"), line)
        for label, value, unit in pairs:
            key = f"{label} [{unit}]" if unit else label
            if key in poses[-1]:
                raise UnusableText(tr("{name} appears twice", name=label), line)
            poses[-1][key] = float(value)
        _add_flags(poses[-1], text)
    if not poses:
        return None
    if choices.euler is None and any(_POSITION_REGISTERS.search(line) for line in lines[:5]):
        choices = replace(choices, euler="fanuc")
    return read_document(poses, choices, layout=tr("values with names"))


def of_joints_only(lines: Sequence[str]) -> bool:
    """Return whether values are those of joints: ``J1: 0.0 J2: -90.0 ..``, or one a line."""
    text = "\n".join(lines)
    if {"x", "y"} <= {found[1].lower() for found in _LABEL.finditer(text)}:
        return False
    keys = {found[1].lower() for found in _LISTS.finditer(text)}
    if {"name", "position"} <= keys:
        return True  # a JointState of ROS
    named = {found[1].lower() for found in _JOINT_VALUE.finditer(text)}
    return len(named) >= _FEWEST


def _pairs(text: str) -> list[re.Match[str]]:
    return [pair for pair in _PAIR.finditer(text) if _is_label(pair)]


def _refuse_pieces(text: str, found: Sequence[re.Match[str]]) -> None:
    """Refuse a line of which something looks like a value and is none.

    Raises:
        UnusableText: A name of a component has no number, or a number has no name.
    """
    taken = {pair.start() for pair in found}
    labels = [one for one in _LABEL.finditer(text) if one[1].lower() in _COMPONENTS]
    alone = next((one for one in labels if one.start() not in taken), None)
    if alone is not None and len(labels) >= _FEWEST_LABELS:
        rest = text[alone.end() :].split(maxsplit=1)
        raise UnusableText(why_no_number(alone[1], rest[0].rstrip(",;") if rest else ""))
    if len(found) < _FEWEST:
        if any(pair[1].lower() in _CERTAIN and pair[2].strip() for pair in found):
            raise UnusableText(tr("the pose is not whole"))
        return
    behind = text[found[-1].end() :].strip(" \t,;)]}")
    if re.search(r"/|^[RL]\b", behind) and not re.fullmatch(
        rf"(?:\s*{_FLAGS.pattern}\s*)*", behind
    ):
        raise UnusableText(tr("{text!r} is no hand and no local", text=behind))
    left = _FLAGS.sub(" ", _PAIR.sub(" ", text[found[0].start() :]))
    stray = re.search(r"\S*[0-9*#?\u2212]\S*", left)
    if stray:
        raise UnusableText(tr("{text!r} has no name", text=stray[0]))


def _is_label(pair: re.Match[str]) -> bool:
    """Return whether a word names a value; without a sign between only known names count."""
    return bool(pair[2].strip()) or pair[1].lower() in MEANINGS


def _add_flags(pose: dict[str, object], text: str) -> None:
    for flag in _FLAG.findall(text):
        pose["local" if flag.isdigit() else "hand"] = flag if not flag.isdigit() else int(flag)
