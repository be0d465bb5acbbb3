"""Poses in JSON and in messages of ROS: objects wherever they stand in the document.

An object is a pose when it has X and Y, by the names that the columns of tables have, or a position
and an orientation as ``geometry_msgs/Pose`` (metres, and a quaternion x, y, z, w:
docs/reference/pose_files.md 2), or a matrix of four lines.
"""

import json
import math
from collections.abc import Iterator, Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.formats.matrices import pose_of_rows
from robolink.pose_tables.lengths import metres_question
from robolink.pose_tables.questions import which_columns
from robolink.pose_tables.refusals import UnclearText, UnusableText
from robolink.pose_tables.tabular.columns import PoseColumns
from robolink.pose_tables.tabular.header import (
    column_head,
    column_heads,
    named_by_person,
    names_place,
)
from robolink.pose_tables.values import LengthUnit, RawPose, RawTable, ReadingChoices

_PARTS: Final = ("position", "orientation", "translation", "rotation")
_NO_POSES: Final = frozenset({"twist", "covariance", "velocity", "header", "accel", "wrench"})
_NAMES: Final = ("name", "label", "point")
_DEEPEST: Final = 60

Found = dict[str, object] | list[list[float]]


def read_json(text: str, choices: ReadingChoices) -> RawTable:
    """Return the poses of a JSON text.

    Raises:
        UnclearText: Something has to be named by a person.
        UnusableText: It is no JSON, or holds no poses.
    """
    try:
        documents = list(_documents(text))
    except (ValueError, RecursionError) as error:
        raise UnusableText(tr("it is not JSON ({error})", error=error)) from error
    document = documents[0] if len(documents) == 1 else documents
    return read_document(document, choices, layout="JSON")


def _documents(text: str) -> Iterator[object]:
    """Yield the documents of a text; a command whose output was appended leaves several."""
    decoder, place = json.JSONDecoder(), 0
    while True:
        while text[place : place + 1].isspace():
            place += 1
        document, place = decoder.raw_decode(text, place)
        yield document
        if not text[place:].strip():
            return


def read_document(document: object, choices: ReadingChoices, *, layout: str) -> RawTable:
    """Return the poses of a document of lists and dictionaries; see :func:`read_json`."""
    rows = _rows_of_numbers(document)
    if rows:
        return _listed(rows, choices, layout)
    found = list(_poses_in(document, "", 0))
    if not found:
        raise UnusableText(tr("there is no pose in it"))
    if choices.columns is not None:
        raise UnusableText(tr("columns were given, but the file names its values itself"))
    made = _Made(choices)
    poses = [made.pose(place, one) for place, one in enumerate(found, start=1)]
    return made.table(poses, layout)


class _Made:
    """Makes poses of objects; those with the same keys are understood in the same way."""

    def __init__(self, choices: ReadingChoices) -> None:
        self._choices = choices
        self._known: dict[tuple[str, ...], PoseColumns] = {}
        self._texts: set[str] = set()
        self._lengths: set[LengthUnit | None] = set()
        self._ignored: dict[str, None] = {}
        self._angle = ""
        self._from_ros = False

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
            columns = PoseColumns(column_heads(keys), self._choices, as_number)
            self._known[keys] = columns
            self._ask(columns, place, one)
        columns = self._known[keys]
        (pose,) = columns.poses([(place, list(one.values()))])
        turns = columns.turns
        if turns is not None:
            self._texts.add(turns.text)
            self._angle = str(turns.angle or "")
        self._from_ros = self._from_ros or columns.from_ros
        self._lengths.add(LengthUnit.M if columns.from_ros else columns.length)
        self._ignored |= dict.fromkeys(columns.ignored)
        return pose

    def _ask(self, columns: PoseColumns, place: int, one: dict[str, object]) -> None:
        if columns.questions:
            silent = columns.length is None and not columns.from_ros and not self._choices.length
            asked = metres_question(columns.positions([(place, list(one.values()))]))
            raise UnclearText(*columns.questions, *([asked] if silent and asked else []))


def as_number(value: object) -> float:
    """Return a number, ``nan`` for what is none; a text may hold one."""
    if isinstance(value, bool):
        return math.nan
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return math.nan


def _poses_in(node: object, name: str, depth: int) -> Iterator[Found]:
    """Yield objects and matrices that are poses, in the order of the document."""
    if depth > _DEEPEST:
        raise UnusableText(tr("it is nested too deeply"))
    if isinstance(node, list):
        matrix = _as_matrix(node)
        if matrix:
            yield matrix
            return
        for one in node:
            yield from _poses_in(one, name, depth + 1)
    if not isinstance(node, dict):
        return
    flat = _flat(node)
    called = next((str(node[key]) for key in _NAMES if isinstance(node.get(key), str)), name)
    if names_place([column_head(key) for key in flat]):
        yield flat if not called or any(key in flat for key in _NAMES) else {**flat, "name": called}
        return
    inside = {"poses": node["poses"]} if "poses" in node else node
    for key, value in inside.items():
        if key not in _NO_POSES:
            yield from _poses_in(value, called, depth + 1)


def _flat(node: dict[str, object]) -> dict[str, object]:
    """Return the plain values of an object, those of a position and an orientation too."""
    flat: dict[str, object] = {}
    for key, value in node.items():
        part = str(key).lower()
        if part in _PARTS and isinstance(value, dict):
            flat |= {f"{part}.{inner}": one for inner, one in value.items()}
        elif part in ("position", "translation") and isinstance(value, list) and len(value) == 3:
            flat |= {f"{part}.{axis}": one for axis, one in zip("xyz", value, strict=True)}
        elif part in _PARTS or not isinstance(value, (dict, list)):
            flat[str(key)] = value
    return flat


def _as_matrix(node: list[object]) -> list[list[float]]:
    if len(node) not in (3, 4) or not all(isinstance(row, list) and len(row) == 4 for row in node):
        return []
    rows = [[as_number(value) for value in row] for row in node if isinstance(row, list)]
    return rows if all(map(math.isfinite, (v for row in rows for v in row))) else []


def _rows_of_numbers(document: object) -> list[list[object]]:
    """Return the rows of a list of lists of numbers, none where it is anything else."""
    if not isinstance(document, list) or not document or _as_matrix(document):
        return []
    rows = [row for row in document if isinstance(row, list)]
    numbers = all(not isinstance(value, (list, dict)) for row in rows for value in row)
    return rows if len(rows) == len(document) and numbers else []


def _listed(rows: Sequence[list[object]], choices: ReadingChoices, layout: str) -> RawTable:
    width = max(map(len, rows))
    if choices.columns is None:
        raise UnclearText(which_columns(width))
    heads = named_by_person(choices.columns)
    for place, row in enumerate(rows, start=1):
        if len(row) != len(heads):
            why = tr(
                "it has {count} columns, but {wanted} are named", count=len(row), wanted=len(heads)
            )
            raise UnusableText(why, pose=place)
    columns = PoseColumns(heads, choices, as_number)
    try:
        poses = columns.poses(list(enumerate(rows, start=1)))
    except UnusableText as cause:
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
    )
