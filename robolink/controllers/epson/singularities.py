"""Refuses targets that an arm with singular places cannot reach, and the singular places.

Close to where joint 5 is at 0 a straight movement of the tip asks joints 4 and 6 for speeds that
they do not have, and close to the axis of joint 1 it asks them of joint 1: the controller leaves
the way there, or ends with an error (docs/reference/epson-robots.md, "Singularities"). An RS has
the second of them. The third one, the stretched elbow, is the end of the reach, which is asked for.

Positions as the controller prints them: measured, found at an edge, or taught by a person.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final

from robolink.controllers.epson.window import CommandWindow
from robolink.errors import LimitError
from robolink.messages import tr
from robolink.model import Path, Pose, angle_difference_deg
from robolink.protocols import spel


def read_position(window: CommandWindow, query: spel.Statement) -> Pose:
    """Read the position that ``query`` prints, of the selected tool."""
    (tool,), point = window.printed_before_point(spel.print_selected_tool(), point=query)
    return printed_pose(point, tool=spel.parse_integer(tool))


class EpsonPoints:
    """The point memory, P0 to P999. Only read: robolink never changes a taught point.

    Source: docs/reference/spel.md 5.1.

    A point holds coordinates, flags and a local, but not the tool that was in force when
    it was taught (docs/reference/epson.md 3.2); so the poses returned here carry ``tool=None``.
    """

    def __init__(self, window: CommandWindow) -> None:
        self._window = window

    def read(self, number: int) -> Pose | None:
        """Read one point, ``None`` when it is not taught.

        Raises:
            LocalProtocolError: There is no such point; 0 to 999 exist.
            NotReadyError: The state would not allow it. In Teach nothing can be read.
        """
        return self.read_all((number,))[number]

    def read_all(self, numbers: Iterable[int]) -> dict[int, Pose | None]:
        """Read several points, in the order given; same errors as :meth:`read`.

        The point is asked for only when it is taught: printing another one would put the
        controller in error (docs/reference/spel.md 5.1).
        """
        wanted = [(number, spel.print_point_defined(number)) for number in numbers]
        if wanted:
            self._window.require_ready(wanted[0][1])
        return {
            number: printed_pose(self._window.printed(spel.print_point(number)), tool=None)
            if self._taught(query)
            else None
            for number, query in wanted
        }

    def _taught(self, query: spel.Statement) -> bool:
        return spel.parse_boolean(self._window.printed(query))


def printed_pose(text: str, *, tool: int | None) -> Pose:
    """Return a printed position, of a tool where it is known."""
    point = spel.parse_point(text)
    x_mm, y_mm, z_mm, u_deg, *rest = point.coordinates
    v_deg, w_deg = rest or (0.0, 0.0)
    return Pose(
        x_mm,
        y_mm,
        z_mm,
        u_deg,
        v_deg,
        w_deg,
        hand=point.hand,
        local=point.local,
        tool=tool,
        posture=point.posture,
    )


KEPT_CLEAR_DEG: Final = 10.0
"""Smallest angle of joint 5 from 0 in straight movements, degrees: the controller's default for
SingularityAngle, and the value that EPSON's tool wizard requires (docs/reference/epson-robots.md,
"Singularities")."""

KEPT_CLEAR_MM: Final = 30.0
"""Smallest distance of the wrist from the axis of joint 1, in mm: the controller's default for
SingularityDist (docs/reference/epson-robots.md, "Singularities")."""

_SWING: Final = 1
_WRIST: Final = 5
_FREE_DEG: Final = 5.0
"""Turn of joint 1 that is allowed in any straight movement, degrees: this close to the axis, a jog
of 2.6 mm causes it."""

_FOLLOWING: Final = 1.5

_TURNED_DEG: Final = 0.01

_LOOKED_AT_EVERY_MM: Final = 25.0
"""Distance between the points of a straight move at which joint 5 is checked, in mm: on the
smallest arm joint 5 turns by at most 6 degrees between them, less than its margin."""

_AHEAD_DEG: Final = 1.0
"""Extra margin for a check in advance, degrees: where the tip stops beside its place is chosen
later."""


@dataclass(frozen=True, slots=True)
class SingularPlaces:
    """Asks a controller what a movement of its arm would meet.

    All questions are functions that move nothing and raise no error in the controller. Targets
    are meant for the selected tool.

    Attributes:
        window: The controller.
        six_axes: Whether the arm has a wrist of three joints; else it is an RS.
    """

    window: CommandWindow
    six_axes: bool

    def obstacle(self, target: Pose, path: Path, start: Pose | None = None) -> str:
        """Return why the arm cannot go to a target, or not straight; empty if it can.

        Args:
            target: Where to, with its flags.
            path: How.
            start: Where from; ``None`` where nobody knows yet, and then of a straight way only its
                end is looked at.
        """
        told = self._in_the_way(target, path, start, _AHEAD_DEG)
        if told or path is not Path.STRAIGHT or start is None or not self._reaches(start):
            return told
        return self._swing(start, target, self._joint_at(start, _SWING))

    def require_clear(self, target: Pose, path: Path) -> None:
        """Refuse a movement that would end out of reach, or meet a singular place.

        Raises:
            LimitError: Says which of the two, and what to do.
        """
        straight = path is Path.STRAIGHT
        here = read_position(self.window, spel.print_real_position()) if straight else None
        found = self._in_the_way(target, path, here, 0.0)
        remedy = tr(
            "Tilt or turn the tool another way, or put the reference point elsewhere: "
            "within reach, and where joint 5 stays more than {limit:g} degrees from 0.",
            limit=KEPT_CLEAR_DEG,
        )
        if here is not None and not found:
            now_deg = spel.parse_number(self.window.printed(spel.print_joint_angle(_SWING)))
            found = self._swing(here, target, now_deg)
            remedy = tr(
                "Put the reference point where the wrist stays more than {limit:g} mm from the "
                "axis of joint 1.",
                limit=KEPT_CLEAR_MM,
            )
        if found:
            raise LimitError(tr("{obstacle} Nothing was sent.", obstacle=found), remedy=remedy)

    def _in_the_way(self, target: Pose, path: Path, start: Pose | None, further_deg: float) -> str:
        straight = path is Path.STRAIGHT
        for place in _places(start if straight else None, target):
            if not self._reaches(place):
                return tr("The robot cannot reach that place with its tool turned that way.")
            if not straight or not self.six_axes:
                continue
            bend_deg = self._joint_at(place, _WRIST)
            if abs(bend_deg) < KEPT_CLEAR_DEG + further_deg:
                return tr(
                    "Joint 5 would be at {angle:.1f} degrees there, too near its "
                    "singularity at 0 for a straight movement.",
                    angle=bend_deg,
                )
        return ""

    def _swing(self, start: Pose, target: Pose, start_deg: float) -> str:
        """Return why a straight movement swings joint 1 as only one close to its axis does.

        Along a chord that stays 30 mm from the axis, joint 1 turns by at most 2 asin(d / 60 mm).
        How long the wrist's way is, is known where the tool does not turn. On an RS the way of the
        flange is that of the wrist, and joint 1 follows its distance from the axis, too, by no more
        than half as much again.
        """
        there_deg = self._joint_at(target, _SWING)
        swing_deg = abs(there_deg - start_deg)
        if swing_deg < _FREE_DEG or _turns(start, target):
            return ""
        way_mm = math.dist(start.coordinates()[:3], target.coordinates()[:3])
        usual_deg = 2 * math.degrees(math.asin(min(1.0, way_mm / (2 * KEPT_CLEAR_MM))))
        if swing_deg <= usual_deg * (1.0 if self.six_axes else _FOLLOWING):
            return ""
        return tr(
            "Joint 1 would turn by {angle:.0f} degrees in a straight movement of {way:.1f} "
            "mm: the wrist is too near its axis.",
            angle=swing_deg,
            way=way_mm,
        )

    def _reaches(self, place: Pose) -> bool:
        asked = spel.print_reachable(place, six_axes=self.six_axes)
        return spel.parse_boolean(self.window.printed(asked))

    def _joint_at(self, target: Pose, joint: int) -> float:
        asked = spel.print_joint_of(target, joint, six_axes=self.six_axes)
        return spel.parse_number(self.window.printed(asked))


def _turns(start: Pose, target: Pose) -> bool:
    angles = zip(start.coordinates()[3:], target.coordinates()[3:], strict=True)
    return any(abs(angle_difference_deg(a, b)) > _TURNED_DEG for a, b in angles)


def _places(start: Pose | None, target: Pose) -> Iterator[Pose]:
    """Yield the end of a straight movement, and the points between where the tool does not turn."""
    if start is not None and not _turns(start, target):
        begin, end = start.coordinates()[:3], target.coordinates()[:3]
        count = math.ceil(math.dist(begin, end) / _LOOKED_AT_EVERY_MM)
        for step in range(1, count):
            x, y, z = (a + (b - a) * step / count for a, b in zip(begin, end, strict=True))
            yield replace(target, x_mm=x, y_mm=y, z_mm=z)
    yield target
