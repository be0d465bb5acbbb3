"""A file of poses of any origin: one reader for every command, recipe and program.

First the bytes become text, then the shapes that makers define are looked for, by what nothing else
begins with; what is left is a table. What the file does not say is asked for and never guessed
(docs/poses.md, "Files of poses").
"""

import math
import statistics
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from robolink.files.named import read_named
from robolink.messages import tr
from robolink.model import Hand, Pose
from robolink.pose_tables.encoding import decoded, lines_of
from robolink.pose_tables.formats.documents import read_document, read_json
from robolink.pose_tables.formats.epson_points import read_points_table
from robolink.pose_tables.formats.indented import looks_indented, read_indented
from robolink.pose_tables.formats.labelled import of_joints_only, read_labelled
from robolink.pose_tables.formats.matrices import read_matrices
from robolink.pose_tables.formats.printed_arrays import read_arrays
from robolink.pose_tables.formats.spel_points import read_spel
from robolink.pose_tables.numbers import settled_length
from robolink.pose_tables.orientation import EPSON, rule_named
from robolink.pose_tables.programs.abb import read_abb
from robolink.pose_tables.programs.fanuc import read_fanuc
from robolink.pose_tables.programs.kuka import read_kuka
from robolink.pose_tables.programs.mitsubishi import read_mitsubishi
from robolink.pose_tables.programs.urscript import read_urscript
from robolink.pose_tables.questions import FAR_MM
from robolink.pose_tables.tabular.in_columns import read_in_columns
from robolink.pose_tables.tabular.table import read_table
from robolink.pose_tables.values import (
    HowRead,
    PoseTable,
    RawPose,
    RawTable,
    ReadingChoices,
    TabledPose,
    UnclearText,
    UnusableText,
    refused,
    unclear,
)

_PROGRAMS: Final[tuple[Callable[[str], RawTable | None], ...]] = (
    read_points_table,
    read_fanuc,
    read_abb,
    read_kuka,
    read_mitsubishi,
    read_urscript,
)
"""Readers of programs, in the order in which they are tried; each recognises something that no
other format contains."""

MOST_BYTES: Final = 32_000_000
"""Size limit in bytes: half a million poses; a larger file is not a list of poses."""

_TURNED_DEG: Final = 36_000.0
_AS_FAR: Final = 0.2
"""Largest relative difference between the distances of one pin's touches from the base."""


_NEEDED_AS: Final = {"z_mm": "Z", "v_deg": "V", "w_deg": "W"}


def read_poses(
    path: Path, choices: ReadingChoices | None = None, *, needs: Sequence[str] = ()
) -> PoseTable:
    """Read the poses of a file.

    Args:
        path: The file.
        choices: What a person says because the file does not.
        needs: What every pose must state besides X, Y and U: of ``z_mm``, ``v_deg``, ``w_deg``.

    Raises:
        AmbiguousPosesError: The file can be read in more than one way; says what has to be named.
        ConfigError: It cannot be read, or is no list of poses; says the line.
        CalibrationError: ``non_finite`` for a value that is not a finite number.

    Example:
        >>> from pathlib import Path
        >>> from robolink.pose_tables import read_poses
        >>> with open("touches.csv", "w") as file:
        ...     for line in ("x;y;z;u", "287,5;103,25;-60;0", "312,5;96,75;-60;180"):
        ...         print(line, file=file)
        >>> table = read_poses(Path("touches.csv"), needs=["z_mm"])
        >>> [entry.pose.x_mm for entry in table.entries]
        [287.5, 312.5]
    """
    try:
        data = read_named(path, most_bytes=MOST_BYTES)
        table = parse_poses(data, choices or ReadingChoices(), suffix=path.suffix)
        _require_stated(table, needs)
    except OSError as error:
        raise refused(path, UnusableText(error.strerror or str(error))) from error
    except UnclearText as open_:
        raise unclear(path, open_.questions) from open_
    except UnusableText as cause:
        raise refused(path, cause) from cause
    return table


def parse_poses(data: bytes, choices: ReadingChoices, *, suffix: str = "") -> PoseTable:
    """Return the poses of the bytes of a file.

    Args:
        data: The bytes.
        choices: What a person says because the file does not.
        suffix: How the file's name ends; only JSON and YAML are told by it.

    Raises:
        UnclearText: The file can be read in more than one way.
        UnusableText: It is no list of poses.
    """
    text, encoding = decoded(data)
    raw = _read(text, suffix.lower(), choices)
    if not raw.poses:
        raise UnusableText(tr("there is no pose in it"))
    unit, unit_by = settled_length(raw, choices.length)
    _require_in_reach(raw, unit.mm)
    _require_one_unit(raw)
    return PoseTable(
        tuple(_tabled(one, unit.mm) for one in raw.poses),
        HowRead(
            encoding,
            raw.layout,
            unit,
            unit_by,
            raw.rotation,
            raw.angle,
            raw.separator,
            raw.decimal,
            raw.columns,
            raw.ignored,
            raw.skipped,
        ),
    )


def _read(text: str, suffix: str, choices: ReadingChoices) -> RawTable:
    lines = lines_of(text)
    begins = text.lstrip()[:1]
    if suffix == ".json" or begins == "{":
        return read_json(text, choices)
    for known in _PROGRAMS:
        raw = known("\n".join(lines))
        if raw is not None:
            return _undisputed(raw, choices)
    raw = read_spel(lines)
    if raw is not None:
        return _undisputed(raw, choices)
    if begins == "[" and _is_json(text):
        return read_json(text, choices)
    raw = read_matrices(lines) if choices.columns is None else None
    if raw is not None:
        return _undisputed(raw, choices)
    raw = read_arrays("\n".join(lines), choices)
    if raw is not None:
        return raw
    if suffix in (".yaml", ".yml") or looks_indented(lines):
        return read_document(read_indented(lines), choices, layout="YAML")
    if of_joints_only(lines):
        raise UnusableText(tr("its points are joint angles, and joint angles are not a pose"))
    for named in (read_labelled, read_in_columns):
        raw = named(lines, choices)
        if raw is not None:
            return raw
    return read_table(lines, choices)


def _is_json(text: str) -> bool:
    import json

    try:
        json.loads(text)
    except (ValueError, RecursionError):
        return False
    return True


def _require_in_reach(raw: RawTable, mm: float) -> None:
    """Refuse numbers that no robot reaches: a decimal point or a sign between two was lost.

    Raises:
        UnusableText: A place is further away than any axis goes, or an angle is.
    """
    for pose in raw.poses:
        place = {"line": pose.line} if raw.has_lines else {"pose": pose.line}
        far = max(map(abs, pose.position)) * mm
        if far > FAR_MM:
            why = tr("a place is {far:.0f} m from the base; no robot stands there", far=far / 1000)
            raise UnusableText(why, **place)
        turned = max(map(abs, pose.uvw_deg))
        if turned > _TURNED_DEG:
            why = tr("an angle of {angle:g} degrees is no angle of a flange", angle=turned)
            raise UnusableText(why, **place)


def _require_one_unit(raw: RawTable) -> None:
    """Refuse a pose that lies near the others only in metres, or the other way round.

    Raises:
        UnusableText: There is one: a file that was put together from two.
    """
    away = [math.hypot(*pose.position) for pose in raw.poses]
    usual = statistics.median_high(away)
    for pose, one in zip(raw.poses, away, strict=True):
        near = any(abs(one * factor - usual) <= _AS_FAR * usual for factor in (1000.0, 1 / 1000.0))
        if one and near:
            place = {"line": pose.line} if raw.has_lines else {"pose": pose.line}
            raise UnusableText(
                tr("its lengths are in another unit than those of the others"), **place
            )


def _undisputed(raw: RawTable, choices: ReadingChoices) -> RawTable:
    """Refuse a person's statement about a file whose format states it.

    Raises:
        UnusableText: The person named columns, or another rule for angles.
    """
    if choices.columns is not None:
        why = tr("columns were given, but a file of {layout} has none", layout=raw.layout)
        raise UnusableText(why)
    if choices.euler is None:
        return raw
    rule = rule_named(choices.euler)
    if rule.formula != raw.rotation and not (rule is EPSON and raw.rotation == EPSON.formula):
        raise UnusableText(
            tr(
                "its rotations are defined as {own}, but {named} was given",
                own=raw.rotation,
                named=rule.name,
            )
        )
    return raw


def _tabled(raw: RawPose, mm: float) -> TabledPose:
    given = raw.given
    x, y, z = raw.position if mm == 1.0 else (value * mm for value in raw.position)
    hand, name = given.get("hand"), given.get("name")
    number, local, tool = (given.get(key) for key in ("number", "local", "tool"))
    pose = Pose(
        x,
        y,
        z,
        *raw.uvw_deg,
        hand=hand if isinstance(hand, Hand) else None,
        local=local if isinstance(local, int) else 0,
        tool=tool if isinstance(tool, int) else None,
    )
    return TabledPose(
        pose,
        name if isinstance(name, str) else "",
        number if isinstance(number, int) else None,
        raw.line,
        raw.stated | {"local"} if isinstance(local, int) else raw.stated,
    )


def _require_stated(table: PoseTable, needs: Sequence[str]) -> None:
    for place, entry in enumerate(table.entries, start=1):
        missing = [_NEEDED_AS.get(name, name) for name in needs if name not in entry.stated]
        if missing:
            why = tr("there is no {name}, which is needed here", name=", ".join(missing))
            raise UnusableText(why, pose=place)
