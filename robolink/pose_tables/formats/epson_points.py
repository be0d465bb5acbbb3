"""Point files of EPSON RC+ (``robot1.pts``).

The layout is not documented; this is what public RC+ projects of 2009 to 2026 hold, all with
``sVersion="2.0.0"``: a first line with a checksum, ``key=value`` lines, and a block per
point::

    Point1 {
            nNumber=0
            sLabel="pick"
            nUndefined=0
            rX=88.952
            rU=-101.024
            nLocal=0
            nHand=1
    }

``nUndefined`` counts in bits. Deleted points show 262143, all eighteen; points whose X to W
are in use show 0 or 448, which is R, S and T when the bits follow the order of the fields.
That order is inferred. ``nHand`` is 1 for right and 2 for left, as the function Hand
(docs/reference/spel.md 5.1); nElbow, nWrist and the joint flags likewise.
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr
from robolink.model import Elbow, Hand, Pose, Posture, Wrist
from robolink.pose_tables.encoding import decoded, line_counter
from robolink.pose_tables.orientation import EPSON
from robolink.pose_tables.values import LengthUnit, RawPose, RawTable, UnusableText, refused

_FIELDS: Final = ("nNumber", "nUndefined", "rX", "rY", "rZ", "rU", "rV", "rW", "nLocal", "nHand")
_FLAGS: Final = ("nElbow", "nWrist", "nJ1Flag", "nJ2Flag", "nJ4Flag", "nJ6Flag")
_ANGLES: Final = ("rJ1Angle", "rJ4Angle")
_NAMES: Final = "|".join((*_FIELDS, *_FLAGS, *_ANGLES))
_BLOCK: Final = re.compile(r"^Point[0-9]+ *\{\s*?\n(.*?)^\s*\}", re.MULTILINE | re.DOTALL)
_FIELD: Final = re.compile(
    rf"^\s*({_NAMES})=(-?[0-9]{{1,9}}(?:\.[0-9]{{1,9}})?(?:E[+-][0-9]{{1,3}})?)\s*$",
    re.MULTILINE | re.ASCII,
)
_COUNT: Final = re.compile(r"^nNumberOfPoints=([0-9]{1,6})\s*$", re.MULTILINE | re.ASCII)
_LINE: Final = re.compile(
    r"\s*(?=(?:[nr]\w*=-?[0-9][0-9.]*(?:E[+-][0-9]+)?|b\w*=(?:True|False)|s\w*=\"[^\"]*\")\s*$)"
    r"(\w+)=.*"
)
"""A key whose first letter gives the type of its value: n and r a number, b a boolean, s a text."""
_LABEL: Final = re.compile(r'^\s*sLabel="(.*)"\s*$', re.MULTILINE)
_XYZU: Final = 0b1111
_HANDS: Final = {1: Hand.RIGHT, 2: Hand.LEFT}
_ELBOWS: Final = {1: Elbow.ABOVE, 2: Elbow.BELOW}
_WRISTS: Final = {1: Wrist.NO_FLIP, 2: Wrist.FLIP}


def read_pts(path: Path) -> dict[int, Pose | None]:
    """Read the points of a ``.pts`` file by number, ``None`` for a deleted one.

    The poses carry no tool; a point does not know with which it was taught.

    Raises:
        ConfigError: It cannot be read or is no such file.
    """
    try:
        return _points(decoded(read_named(path))[0])
    except OSError as error:
        raise refused(path, UnusableText(error.strerror or str(error))) from error
    except UnusableText as cause:
        raise refused(path, cause) from cause


def parse_pts(text: str) -> dict[int, Pose | None]:
    """Read the text of a ``.pts`` file; see :func:`read_pts`.

    Raises:
        ConfigError: It is not one, or a point of it cannot be read.
    """
    try:
        return _points(text)
    except UnusableText as cause:
        raise ConfigError(cause.why, remedy=tr("Export the points again.")) from cause


def read_points_table(text: str) -> RawTable | None:
    """Return the points of a ``.pts`` text, the deleted ones left out; ``None`` for another text.

    Raises:
        UnusableText: A point of it cannot be read.
    """
    if "nNumberOfPoints" not in text:
        return None
    if not text.startswith("ENVT") and not (_COUNT.search(text) and _BLOCK.search(text)):
        return None
    poses: list[RawPose] = []
    skipped = 0
    for line, fields, label in _blocks(text):
        pose = _pose(fields)
        if pose is None:
            skipped += 1
            continue
        given: dict[str, object] = {"number": int(fields["nNumber"]), "local": pose.local}
        given |= {"hand": pose.hand} if pose.hand else {}
        given |= {"name": label} if label else {}
        place = (pose.x_mm, pose.y_mm, pose.z_mm)
        poses.append(RawPose(line, place, (pose.u_deg, pose.v_deg, pose.w_deg), given))
    return RawTable(
        "EPSON .pts", poses, EPSON.formula, length=LengthUnit.MM, angle="deg", skipped=skipped
    )


def _points(text: str) -> dict[int, Pose | None]:
    return {int(fields["nNumber"]): _pose(fields) for _, fields, _ in _blocks(text)}


def _blocks(text: str) -> Iterator[tuple[int, dict[str, float], str]]:
    """Yield the line, the numbers and the label of each point.

    Raises:
        UnusableText: A block cannot be read, or some are missing.
    """
    text = text.replace("\r\n", "\n")
    line_at = line_counter(text)
    counted = _COUNT.search(text)
    blocks = list(_BLOCK.finditer(text))
    if counted is None or int(counted[1]) != len(blocks):
        line = line_at(counted.start(1)) if counted else 1
        raise UnusableText(tr("it is not a complete point file of EPSON RC+"), line)
    seen: set[float] = set()
    first: tuple[str, ...] = ()
    for number, block in enumerate(blocks, start=1):
        fields = {name: float(value) for name, value in _FIELD.findall(block[1])}
        line = line_at(block.start())
        keys = _keys(block[1], line)
        first = first or keys
        if not set(_FIELDS) <= set(fields) or fields["nNumber"] in seen or keys != first:
            raise UnusableText(tr("point block {number} cannot be read", number=number), line)
        if any(name in keys and name not in fields for name in (*_FLAGS, *_ANGLES)):
            raise UnusableText(tr("point block {number} cannot be read", number=number), line)
        seen.add(fields["nNumber"])
        label = _LABEL.search(block[1])
        yield line_at(block.start()), fields, label[1] if label else ""


def _keys(block: str, line: int) -> tuple[str, ...]:
    """Return the keys of a block; all blocks of a file have the same ones.

    Raises:
        UnusableText: A line is none of a key and its value, or a key stands twice.
    """
    keys: list[str] = []
    for at, text in enumerate(block.split("\n"), start=line + 1):
        found = _LINE.fullmatch(text)
        if text.strip() and (found is None or found[1] in keys):
            raise UnusableText(tr("{text!r} is not a name and a value", text=text.strip()), at)
        keys += [found[1]] if found else []
    return tuple(keys)


def _pose(fields: Mapping[str, float]) -> Pose | None:
    if int(fields["nUndefined"]) & _XYZU:
        return None
    return Pose(
        fields["rX"],
        fields["rY"],
        fields["rZ"],
        fields["rU"],
        fields["rV"],
        fields["rW"],
        hand=_HANDS.get(int(fields["nHand"])),
        local=int(fields["nLocal"]),
        posture=_posture(fields),
    )


def _posture(fields: Mapping[str, float]) -> Posture | None:
    """Return the flags of a point, ``None`` if they are those of any point of a SCARA.

    An angle of a singular place is 0 in every point that has none.
    """
    numbers = {name: int(fields.get(name, 0)) for name in _FLAGS}
    posture = Posture(
        elbow=_ELBOWS.get(numbers["nElbow"], Elbow.ABOVE),
        wrist=_WRISTS.get(numbers["nWrist"], Wrist.NO_FLIP),
        j1_flag=numbers["nJ1Flag"],
        j2_flag=numbers["nJ2Flag"],
        j4_flag=numbers["nJ4Flag"],
        j6_flag=numbers["nJ6Flag"],
        j1_angle_deg=fields.get("rJ1Angle") or None,
        j4_angle_deg=fields.get("rJ4Angle") or None,
    )
    tilted = fields["rV"] != 0 or fields["rW"] != 0
    return posture if tilted or posture != Posture() else None
