"""What a file leaves open, and what is asked then: which columns, which unit, which rule."""

import math
import re
from collections.abc import Iterable, Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.conventions import rules_for
from robolink.pose_tables.refusals import OpenQuestion
from robolink.ways import Way, way

_READINGS: Final = {
    3: "x,y,u",
    4: "x,y,z,u",
    5: "name,x,y,z,u",
    6: "x,y,z,u,v,w; x,y,z,rx,ry,rz",
    7: "x,y,z,qx,qy,qz,qw; x,y,z,qw,qx,qy,qz",
    12: "r11,r12,r13,x,r21,r22,r23,y,r31,r32,r33,z",
}
_UNIT_IN_COMMENT: Final = re.compile(
    r"\b(?:inch(?:es)?|met(?:er|re)s?|cm|feet|foot|radians?|rad)\b|[(\[](?:in|m)[)\]]"
    r"|\bunits?\s*[:=]\s*(?:in|m)\b",
    re.IGNORECASE,
)
_ANGLE_WORD: Final = re.compile(r"rad", re.IGNORECASE)
_METRES_BELOW: Final = 2.0
_FULL_TURN_RAD: Final = 2 * math.pi * (1 + 1e-6)


def which_columns(count: int) -> OpenQuestion:
    """Ask what the columns of a table without a header are."""
    readings = _READINGS.get(count, "x,y,z,u,-,name")
    return OpenQuestion(
        "columns",
        tr("it has no line that names its {count} columns", count=count),
        tr(
            "Name each with {columns}, for example {readings}; '-' skips one.",
            columns=way(Way.COLUMNS),
            readings=readings,
        ),
    )


def which_rotation(names: Sequence[str]) -> OpenQuestion:
    """Ask what the columns mean of which none, or too little, is known to say how a pose turns."""
    return OpenQuestion(
        "columns",
        tr("how a pose turns is not clear from its columns {names}", names=", ".join(names)),
        tr(
            "Name each with {columns}: u, v, w are EPSON's angles, qx, qy, qz, qw a quaternion, "
            "'-' skips one.",
            columns=way(Way.COLUMNS),
        ),
    )


def which_rule(letters: Sequence[str]) -> OpenQuestion:
    """Ask by which rule three angles turn."""
    readings = "; ".join(f"{rule.name}: {rule.formula}" for rule in rules_for(letters))
    return OpenQuestion(
        "euler",
        tr("its angles {letters} may turn in several ways", letters=", ".join(letters).upper()),
        tr("Say which with {euler}: {readings}.", euler=way(Way.EULER), readings=readings),
    )


def which_angle_unit(names: Sequence[str]) -> OpenQuestion:
    """Ask for the unit of angles."""
    columns = "; ".join(",".join(f"{name}_{unit}" for name in names) for unit in ("deg", "rad"))
    return OpenQuestion(
        "columns",
        tr("its angles may be degrees or radians"),
        tr(
            "Name the columns with their unit with {columns}: {names}.",
            columns=way(Way.COLUMNS),
            names=columns,
        ),
    )


def which_length(why: str) -> OpenQuestion:
    """Ask for the unit of length."""
    return OpenQuestion(
        "length", why, tr("Say the unit with {length}: mm, m or in.", length=way(Way.LENGTH_UNIT))
    )


def looks_like_metres(positions: Iterable[Sequence[float]]) -> bool:
    """Tell whether all X and Y lie where in mm no flange is (docs/reference/calibration.md 3)."""
    return all(abs(p[0]) < _METRES_BELOW and abs(p[1]) < _METRES_BELOW for p in positions)


def may_be_radians(rows: Iterable[Sequence[float]]) -> bool:
    """Tell whether angles of which some are not 0 all lie within a turn in radians."""
    largest = max((abs(angle) for row in rows for angle in row), default=0.0)
    return 0 < largest <= _FULL_TURN_RAD


def may_be_degrees(rows: Iterable[Sequence[float]]) -> bool:
    """Tell whether a rotation vector is longer than a turn in radians, which none has to be."""
    return any(math.hypot(*row) > _FULL_TURN_RAD for row in rows)


def unit_in(comments: Iterable[str], *, angle: bool) -> str:
    """Return the first comment that speaks of a unit other than mm and degrees."""
    for comment in comments:
        found = _UNIT_IN_COMMENT.search(comment)
        if found and bool(_ANGLE_WORD.search(found[0])) == angle:
            return comment
    return ""
