"""Finding poses in documents of lists and dictionaries, wherever they stand.

What is nearly a pose is refused: an object with two components of a place or a turn and without X
or Y, or something else in a list of poses.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.numbers import number_of
from robolink.pose_tables.refusals import UnusableText, at_pose
from robolink.pose_tables.tabular.header import (
    ANGLES,
    LENGTHS,
    MATRIX,
    QUATERNION,
    column_head,
    is_joint,
    names_place,
)

Found = dict[str, object] | list[list[float]]
"""An object that is a pose, its values by their names; or the rows of a matrix."""

COMPONENTS: Final = frozenset({*LENGTHS, *ANGLES, *QUATERNION, *MATRIX})
"""What columns or keys are called that say where a pose is and how it turns."""

_PARTS: Final = ("position", "orientation", "translation", "rotation")
_LISTED: Final = {"position": "xyz", "translation": "xyz"}
_NO_POSES: Final = frozenset({"twist", "covariance", "velocity", "header", "accel", "wrench"})
_NAMES: Final = ("name", "label", "point")
_DEEPEST: Final = 60
_FEWEST_JOINTS: Final = 3
_FEWEST_COMPONENTS: Final = 2


def as_number(value: object) -> float:
    """Return a number, ``nan`` for what is none; a text may hold one."""
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
    """Tell whether a document holds values of joints somewhere."""
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
    """Return the plain values of an object, those of a position and an orientation too."""
    flat: dict[str, object] = {}
    for key, value in node.items():
        part = str(key).lower()
        if part in _PARTS and isinstance(value, dict):
            flat |= {f"{part}.{inner}": one for inner, one in value.items()}
        elif part in _LISTED and isinstance(value, list):
            if len(value) != len(_LISTED[part]):
                if not {"orientation", "rotation"} & {str(one).lower() for one in node}:
                    continue  # positions of joints, for example
                why = tr("{name} holds {count} numbers", name=key, count=len(value))
                raise UnusableText(why)
            flat |= {f"{part}.{axis}": one for axis, one in zip(_LISTED[part], value, strict=True)}
        elif part in _PARTS or not isinstance(value, (dict, list)):
            flat[str(key)] = value
    return flat


def as_matrix(node: list[object]) -> list[list[float]]:
    """Return three or four rows of four numbers, nothing where a list is anything else."""
    if len(node) not in (3, 4) or not all(isinstance(row, list) and len(row) == 4 for row in node):
        return []
    rows = [[as_number(value) for value in row] for row in node if isinstance(row, list)]
    return rows if all(map(math.isfinite, (v for row in rows for v in row))) else []
