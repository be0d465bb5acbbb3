"""Poses in JSON and in messages of ROS: objects anywhere in the document.

An object is a pose when it has X and Y, by the names that the columns of tables have, or a position
and an orientation as ``geometry_msgs/Pose`` (metres, and a quaternion x, y, z, w:
docs/reference/pose_files.md 2), or a matrix of four lines.
"""

import json
import math
from collections.abc import Iterator, Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.formats.matrices import is_matrix, pose_of_rows
from robolink.pose_tables.numbers import metres_question, number_of
from robolink.pose_tables.questions import which_columns
from robolink.pose_tables.tabular.columns import PoseColumns
from robolink.pose_tables.tabular.header import (
    ANGLES,
    LENGTHS,
    MATRIX,
    QUATERNION,
    column_head,
    column_heads,
    is_joint,
    named_by_person,
    names_place,
)
from robolink.pose_tables.values import (
    ColumnHead,
    LengthUnit,
    RawPose,
    RawTable,
    ReadingChoices,
    UnclearText,
    UnusableText,
    at_pose,
)

Found = dict[str, object] | list[list[float]]
"""A pose as an object, with its values by name, or the rows of a matrix."""

COMPONENTS: Final = frozenset({*LENGTHS, *ANGLES, *QUATERNION, *MATRIX})
"""Names of columns or keys for the position and orientation of a pose."""

_PARTS: Final = ("position", "orientation", "translation", "rotation")
_LISTED: Final = {"position": "xyz", "translation": "xyz"}
_NO_POSES: Final = frozenset({"twist", "covariance", "velocity", "header", "accel", "wrench"})
_NAMES: Final = ("name", "label", "point")
_DEEPEST: Final = 60
_FEWEST_JOINTS: Final = 3
_FEWEST_COMPONENTS: Final = 2


def as_number(value: object) -> float:
    """Return a number, ``nan`` for anything else; a text may hold one."""
    if isinstance(value, bool):
        return math.nan
    if isinstance(value, str):
        return number_of(value)
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return math.nan


def poses_in(node: object, name: str, depth: int) -> Iterator[Found]:
    """Yield objects and matrices that are poses, in the order of the document."""
    if depth > _DEEPEST:
        raise UnusableText(tr("it is nested too deeply"))
    if isinstance(node, list):
        matrix = as_matrix(node)
        if matrix:
            yield matrix
            return
        yield from _in_list(node, name, depth)
    if not isinstance(node, dict):
        return
    flat = _flat(node)
    called = next((str(node[key]) for key in _NAMES if isinstance(node.get(key), str)), name)
    if names_place([column_head(key) for key in flat]):
        yield flat if not called or any(key in flat for key in _NAMES) else {**flat, "name": called}
        return
    _refuse_damaged(flat)
    inside = {"poses": node["poses"]} if "poses" in node else node
    for key, value in inside.items():
        if key not in _NO_POSES:
            yield from poses_in(value, called, depth + 1)


def has_joints(node: object, depth: int = 0) -> bool:
    """Return whether a document holds values of joints somewhere."""
    if depth > _DEEPEST or not isinstance(node, (dict, list)):
        return False
    if isinstance(node, dict):
        if sum(map(is_joint, map(str, node))) >= _FEWEST_JOINTS:
            return True
        of_joints = any("joint" in str(key).lower() and node[key] for key in node)
        names = node.get("name")
        state = isinstance(names, list) and isinstance(node.get("position"), list)
        if of_joints or state:
            return True
    inside = node.values() if isinstance(node, dict) else node
    return any(has_joints(one, depth + 1) for one in inside)


def _in_list(node: list[object], name: str, depth: int) -> Iterator[Found]:
    """Yield the poses of a list; where it holds some, all that is in it holds some.

    Raises:
        UnusableText: Something in it is no pose.
    """
    parts = []
    for number, one in enumerate(node, start=1):
        with at_pose(number):
            parts.append(list(poses_in(one, name, depth + 1)))
    if any(parts) and not all(parts):
        raise UnusableText(tr("it is not a pose, as others of its list are"), pose=_first(parts))
    for part in parts:
        yield from part


def _first(parts: Sequence[list[Found]]) -> int:
    """Return the number of the first pose that is missing, from 1."""
    return sum(len(part) for part in parts[: parts.index([])]) + 1


def _refuse_damaged(flat: dict[str, object]) -> None:
    """Refuse an object that has some names of a pose and lacks others.

    Raises:
        UnusableText: It has two components of a place or a turn, and no X or Y.
    """
    numbers = {key: value for key, value in flat.items() if isinstance(value, (int, float, str))}
    meanings = {column_head(key).meaning for key in numbers}
    if len(meanings & COMPONENTS) < _FEWEST_COMPONENTS:
        return
    missing = ", ".join(name.upper() for name in ("x", "y") if name not in meanings)
    raise UnusableText(
        tr("there is no {name} beside {names}", name=missing, names=", ".join(numbers))
    )


def _flat(node: dict[str, object]) -> dict[str, object]:
    """Return the plain values of an object, also those of a position and an orientation."""
    flat: dict[str, object] = {}
    for key, value in node.items():
        part = str(key).lower()
        if part in _PARTS and isinstance(value, dict):
            flat |= {f"{part}.{inner}": one for inner, one in value.items()}
        elif part in _LISTED and isinstance(value, list):
            if len(value) != len(_LISTED[part]):
                if not {"orientation", "rotation"} & {str(one).lower() for one in node}:
                    continue  # for example joint positions
                why = tr("{name} holds {count} numbers", name=key, count=len(value))
                raise UnusableText(why)
            flat |= {f"{part}.{axis}": one for axis, one in zip(_LISTED[part], value, strict=True)}
        elif part in _PARTS or not isinstance(value, (dict, list)):
            flat[str(key)] = value
    return flat


def as_matrix(node: list[object]) -> list[list[float]]:
    """Return three or four rows of four numbers, nothing for any other list."""
    if len(node) not in (3, 4) or not all(isinstance(row, list) and len(row) == 4 for row in node):
        return []
    rows = [[as_number(value) for value in row] for row in node if isinstance(row, list)]
    return rows if all(map(math.isfinite, (v for row in rows for v in row))) else []


_OF_FRAME: Final = ("hand", "local", "tool")


def read_json(text: str, choices: ReadingChoices) -> RawTable:
    """Return the poses of a JSON text.

    Raises:
        UnclearText: Something has to be named by a person.
        UnusableText: It is no JSON, or holds no poses.
    """
    try:
        documents = list(_documents(text))
    except (ValueError, RecursionError) as error:
        raise UnusableText(tr("it is not a JSON file ({error})", error=error)) from error
    document = documents[0] if len(documents) == 1 else documents
    return read_document(document, choices, layout="JSON")


def _documents(text: str) -> Iterator[object]:
    """Yield the documents of a text; a command whose output was appended leaves several."""
    decoder, place = json.JSONDecoder(object_pairs_hook=_each_once), 0
    while True:
        while text[place : place + 1].isspace():
            place += 1
        document, place = decoder.raw_decode(text, place)
        yield document
        if not text[place:].strip():
            return


def _each_once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Return an object whose keys are all different.

    Raises:
        UnusableText: One stands twice; of two values nobody can tell which counts.
    """
    found: dict[str, object] = {}
    for key, value in pairs:
        if key in found:
            raise UnusableText(tr("{name} appears twice", name=key))
        found[key] = value
    return found


def read_document(document: object, choices: ReadingChoices, *, layout: str) -> RawTable:
    """Return the poses of a document of lists and dictionaries; see :func:`read_json`."""
    rows = _rows_of_numbers(document, choices)
    if rows:
        return read_rows(list(enumerate(rows, start=1)), choices, layout, has_lines=False)
    with at_pose(1):
        found = list(poses_in(document, "", 0))
    if not found:
        if has_joints(document):
            raise UnusableText(
                tr(
                    "there is no pose in it: its values are joint angles, and joint angles are "
                    "not a pose"
                )
            )
        raise UnusableText(tr("there is no pose in it"))
    made = _Made(choices)
    poses = [made.pose(place, one) for place, one in enumerate(found, start=1)]
    return made.table(poses, layout)


class _Made:
    """Makes poses of objects; objects with the same keys are read in the same way."""

    def __init__(self, choices: ReadingChoices) -> None:
        self._choices = choices
        self._known: dict[tuple[str, ...], PoseColumns] = {}
        self._texts: set[str] = set()
        self._lengths: set[LengthUnit | None] = set()
        self._ignored: dict[str, None] = {}
        self._angle = ""
        self._from_ros = False
        self._shape: tuple[frozenset[str], frozenset[str]] | None = None

    def pose(self, place: int, one: Found) -> RawPose:
        try:
            return self._matrix(place, one) if isinstance(one, list) else self._object(place, one)
        except UnusableText as cause:
            cause.line, cause.pose = 0, place
            raise

    def table(self, poses: list[RawPose], layout: str) -> RawTable:
        if len(self._lengths) > 1:
            raise UnusableText(tr("its lengths have different units"))
        (length,) = self._lengths
        return RawTable(
            layout,
            poses,
            "; ".join(sorted(self._texts)),
            length=length,
            stated_length=length is not None and not self._from_ros,
            angle=self._angle,
            ignored=tuple(self._ignored),
            has_lines=False,
        )

    def _matrix(self, place: int, rows: list[list[float]]) -> RawPose:
        pose = pose_of_rows(rows, 0)
        if pose is None:
            raise UnusableText(tr("its matrix is not that of a pose"))
        pose.line = place
        self._texts.add(tr("matrix"))
        self._lengths.add(None)
        return pose

    def _object(self, place: int, one: dict[str, object]) -> RawPose:
        keys = tuple(one)
        if keys not in self._known:
            heads = column_heads(keys)
            if self._choices.columns is not None:
                heads = self._named(heads)
            columns = PoseColumns(heads, self._choices, as_number)
            self._known[keys] = columns
            self._ask(columns, place, one)
        columns = self._known[keys]
        self._require_alike(one)
        (pose,) = columns.poses([(place, list(one.values()))])
        turns = columns.turns
        if turns is not None:
            self._texts.add(turns.text)
            self._angle = str(turns.angle or "")
        self._from_ros = self._from_ros or columns.from_ros
        self._lengths.add(LengthUnit.M if columns.from_ros else columns.length)
        self._ignored |= dict.fromkeys(columns.ignored)
        return pose

    def _named(self, heads: Sequence[ColumnHead]) -> tuple[ColumnHead, ...]:
        """Return the columns as a person names them, in the order of the file.

        Raises:
            UnusableText: They are not as many, or another component than the file names.
        """
        named = named_by_person(self._choices.columns or "")
        if len(named) != len(heads):
            raise UnusableText(
                tr(
                    "it has {count} values, but {wanted} are named",
                    count=len(heads),
                    wanted=len(named),
                )
            )
        for own, said in zip(heads, named, strict=True):
            if own.meaning in LENGTHS and own.meaning != said.meaning:
                raise UnusableText(tr("columns were given, but the file names its values itself"))
        return named

    def _require_alike(self, one: dict[str, object]) -> None:
        """Refuse a pose that says less, or more, than the first.

        Raises:
            UnusableText: A component, or what else a pose has, is in one of them only.
        """
        meanings = {column_head(key).meaning: value for key, value in one.items()}
        for name in _OF_FRAME:
            if meanings.get(name) == "":
                raise UnusableText(tr("there is no {name}", name=name))
        says = frozenset(name for name in meanings if name in (*COMPONENTS, *_OF_FRAME))
        filled = frozenset(
            name
            for name in says & COMPONENTS
            if meanings[name] is not None and meanings[name] != ""
        )
        first = self._shape = self._shape or (says, filled)
        odd = (first[0] ^ says) | (first[1] ^ filled)
        if odd:
            names = ", ".join(sorted(name.upper() for name in odd))
            raise UnusableText(tr("not all poses have {names}", names=names))

    def _ask(self, columns: PoseColumns, place: int, one: dict[str, object]) -> None:
        if columns.questions:
            silent = columns.length is None and not columns.from_ros and not self._choices.length
            asked = metres_question(columns.positions([(place, list(one.values()))]))
            raise UnclearText(
                *columns.asked([(place, list(one.values()))]),
                *([asked] if silent and asked else []),
            )


def _rows_of_numbers(document: object, choices: ReadingChoices) -> list[list[object]]:
    """Return the rows of a list of lists of numbers, none for anything else."""
    if not isinstance(document, list) or not document:
        return []
    if choices.columns is None and is_matrix(as_matrix(document)):
        return []
    rows = [row for row in document if isinstance(row, list)]
    numbers = all(not isinstance(value, (list, dict)) for row in rows for value in row)
    return rows if len(rows) == len(document) and numbers else []


def read_rows(
    rows: Sequence[tuple[int, Sequence[object]]],
    choices: ReadingChoices,
    layout: str,
    *,
    has_lines: bool,
) -> RawTable:
    """Return the poses of rows without names.

    Args:
        rows: Each with its line, or its number where there are no lines.
        choices: What a person says; without columns they are asked.
        layout: Name of the format.
        has_lines: Whether the numbers of the rows are lines.

    Raises:
        UnclearText: The columns have to be named.
        UnusableText: A row is no pose.

    Example:
        >>> from robolink.pose_tables import ReadingChoices
        >>> from robolink.pose_tables.formats.documents import read_rows
        >>> named = ReadingChoices(columns="x,y,u")
        >>> read_rows([(1, [287.5, 103.25, 90.0])], named, "rows", has_lines=True).poses[0].uvw_deg
        (90.0, 0.0, 0.0)
    """
    width = max(len(row) for _, row in rows)
    if choices.columns is None:
        numbers = [[as_number(value) for value in row] for _, row in rows if len(row) == width]
        numeric = [all(map(math.isfinite, column)) for column in zip(*numbers, strict=True)]
        kept = [[v for v, n in zip(row, numeric, strict=True) if n] for row in numbers]
        raise UnclearText(which_columns(numeric, kept))
    heads = named_by_person(choices.columns)
    columns = PoseColumns(heads, choices, as_number)
    try:
        for number, row in rows:
            if len(row) != len(heads):
                why = tr(
                    "it has {count} columns, but {wanted} are named",
                    count=len(row),
                    wanted=len(heads),
                )
                raise UnusableText(why, number)
        poses = columns.poses(rows)
    except UnusableText as cause:
        if not has_lines:
            cause.line, cause.pose = 0, cause.line
        raise
    turns = columns.turns
    return RawTable(
        layout,
        poses,
        turns.text if turns else "",
        length=columns.length,
        stated_length=columns.length is not None,
        angle=str(turns.angle or "") if turns else "",
        columns=tuple(head.meaning for head in heads),
        has_lines=has_lines,
    )
