"""DiffPoint and DiffToolOrientation: how two points differ.

The reference names them without saying what they give; what their names say is assumed.
"""

import math
from collections.abc import Sequence
from typing import Final

from robolink_simulators.cell.frames import Frame
from robolink_simulators.epson.arm.kinematics import frame_of
from robolink_simulators.epson.definitions.local_frames import coordinates_of_frame
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.values import (
    Value,
    as_integer,
    as_point,
    out_of_range,
)
from robolink_simulators.epson.spel.session import Session

_AXES: Final = 3


def _frames(session: Session, points: Sequence[Value]) -> tuple[Frame, Frame]:
    one, other = (frame_of(session.machine.pose_of(as_point(point))) for point in points)
    return one, other


def point_seen_from(session: Session, arguments: Sequence[Value]) -> Point:
    """Return DiffPoint: where the second point is as seen from the first."""
    one, other = _frames(session, arguments)
    return Point(coordinates_of_frame(one.inverse() @ other))


def turned_tool(session: Session, arguments: Sequence[Value]) -> Value:
    """Return DiffToolOrientation: the angle of one axis between two points, 0 to 180 degrees."""
    axis = as_integer(arguments[2])
    if not 1 <= axis <= _AXES:
        raise out_of_range(f"There is no axis {axis}")
    one, other = (frame.rotation for frame in _frames(session, arguments[:2]))
    cosine = sum(a[axis - 1] * b[axis - 1] for a, b in zip(one, other, strict=True))
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
