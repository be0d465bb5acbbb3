"""Touch poses from a file.

JSON, a list of objects::

    [{"x_mm": 287.5, "y_mm": 103.25, "u_deg": 0.0},
     {"x_mm": 312.5, "y_mm": 96.75, "u_deg": 180.0, "z_mm": -20.0, "hand": "right"}]

CSV with a header line, columns in any order; ``z_mm``, ``v_deg``, ``w_deg`` and ``hand`` may be
left out where the method does without them::

    x_mm,y_mm,u_deg,hand
    287.5,103.25,0,right
    312.5,96.75,180,right
"""

import csv
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Hand, Pose
from robolink.pose_files._reading import read_text, unusable

_REQUIRED = ("x_mm", "y_mm", "u_deg")
_KNOWN = frozenset({*_REQUIRED, "z_mm", "v_deg", "w_deg", "hand"})


def read_poses(path: Path, *, needs: Sequence[str] = ()) -> tuple[Pose, ...]:
    """Read poses in mm and degrees from a ``.json`` or ``.csv`` file.

    Args:
        path: The file.
        needs: What every pose must state besides ``x_mm``, ``y_mm`` and ``u_deg``.

    Raises:
        ConfigError: The file cannot be read, or is not laid out as above.
        CalibrationError: ``non_finite`` for a value that is not a finite number.
    """
    readers = {".json": _json_rows, ".csv": _csv_rows}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise unusable(path, tr("its name ends neither in .json nor in .csv"))
    rows = reader(path, read_text(path, encoding="utf-8-sig"))
    required = (*_REQUIRED, *needs)
    return tuple(_pose(path, number, row, required) for number, row in enumerate(rows, start=1))


def _json_rows(path: Path, text: str) -> list[Mapping[str, object]]:
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise unusable(path, tr("it is not JSON ({error})", error=error)) from error
    if not isinstance(document, list) or not all(isinstance(row, dict) for row in document):
        raise unusable(path, tr("it is not a list of objects with x_mm, y_mm and u_deg"))
    return document


def _csv_rows(path: Path, text: str) -> list[Mapping[str, object]]:
    lines = [line for line in text.splitlines() if line.strip()]
    try:
        table = list(csv.reader(lines, strict=True))
    except csv.Error as error:
        raise unusable(path, tr("it is not CSV ({error})", error=error)) from error
    header, *body = table or [[]]
    names = [name.strip() for name in header]
    if len(set(names)) != len(names) or not set(_REQUIRED) <= set(names) <= _KNOWN:
        raise unusable(
            path,
            tr(
                "its first line has to name x_mm,y_mm,u_deg, and z_mm, v_deg, w_deg and hand if "
                "you have them"
            ),
        )
    rows: list[Mapping[str, object]] = []
    for cells in body:
        if len(cells) != len(names):
            raise unusable(
                path, tr("pose {number} has another number of columns", number=len(rows) + 1)
            )
        rows.append({n: c.strip() for n, c in zip(names, cells, strict=True) if c.strip()})
    return rows


def _pose(path: Path, number: int, row: Mapping[str, object], required: Sequence[str]) -> Pose:
    missing = [name for name in required if name not in row]
    unknown = sorted(set(row) - _KNOWN)
    if missing:
        raise unusable(
            path, tr("pose {number} has no {name}", number=number, name=", ".join(missing))
        )
    if unknown:
        raise unusable(
            path, tr("pose {number} has an unknown {name!r}", number=number, name=unknown[0])
        )
    return Pose(
        _number(number, row, "x_mm"),
        _number(number, row, "y_mm"),
        _number(number, {"z_mm": 0.0, **row}, "z_mm"),
        _number(number, row, "u_deg"),
        _number(number, {"v_deg": 0.0, **row}, "v_deg"),
        _number(number, {"w_deg": 0.0, **row}, "w_deg"),
        hand=_hand(path, number, row.get("hand")),
    )


def _number(pose: int, row: Mapping[str, object], name: str) -> float:
    given = row[name]
    try:
        value = math.nan if isinstance(given, bool) else float(given)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        raise CalibrationError(
            "non_finite",
            tr("Pose {number} has {name} = {value!r}.", number=pose, name=name, value=given),
            remedy=tr("Give finite numbers in mm and degrees."),
        )
    return value


def _hand(path: Path, pose: int, given: object) -> Hand | None:
    if given is None:
        return None
    try:
        return Hand(str(given).lower())
    except ValueError as error:
        raise unusable(
            path, tr("pose {number} has a hand other than right or left", number=pose)
        ) from error
