"""What a six-axis arm is held back from: places it cannot reach, and singular ones.

Close to where joint 5 is at 0 a straight movement of the tip asks joints 4 and 6 for speeds that
they do not have, and close to the axis of joint 1 it asks them of joint 1: the controller leaves
the way there, or ends with an error (docs/reference/epson-robots.md, "Singularities"). The third
one, the stretched elbow, is the end of the reach, which is asked for.
"""

import math
from typing import Final

from robolink.controllers.epson.link.window import CommandWindow
from robolink.controllers.epson.motion.positions import read_position
from robolink.errors import LimitError
from robolink.messages import tr
from robolink.model import Path, Pose, angle_difference_deg
from robolink.protocols import spel

KEPT_CLEAR_DEG: Final = 10.0
"""Joint 5 stays so far from 0 in straight movements: the controller's own default of
SingularityAngle, and what EPSON's tool wizard asks for (docs/reference/epson-robots.md,
"Singularities")."""

KEPT_CLEAR_MM: Final = 30.0
"""The wrist stays so far from the axis of joint 1: the controller's own default of
SingularityDist (docs/reference/epson-robots.md, "Singularities")."""

_SWING: Final = 1
_WRIST: Final = 5
_FREE_DEG: Final = 5.0
"""Joint 1 may turn by this in any straight movement: a jog of 2.6 mm so near the axis would."""

_TURNED_DEG: Final = 0.01


def obstacle_of(window: CommandWindow, target: Pose, path: Path) -> str:
    """Return why six axes cannot go to a target, or not straight; empty where they can.

    Asked with functions that move nothing and raise no error in the controller.
    """
    if not spel.parse_boolean(window.printed(spel.print_reachable(target, six_axes=True))):
        return tr("The robot cannot reach that place with its tool turned so.")
    if path is not Path.STRAIGHT:
        return ""
    bend_deg = _joint_at(window, target, _WRIST)
    if abs(bend_deg) < KEPT_CLEAR_DEG:
        return tr(
            "Joint 5 would stand at {angle:.1f} degrees there, too near to its singular place "
            "at 0 for a straight movement.",
            angle=bend_deg,
        )
    return ""


def require_clear(window: CommandWindow, target: Pose, path: Path) -> None:
    """Hold a movement of six axes back that would end out of reach, or meet a singular place.

    Raises:
        LimitError: Says which of the two, and what to do.
    """
    found = obstacle_of(window, target, path)
    if found:
        raise LimitError(
            tr("{obstacle} Nothing was sent.", obstacle=found),
            remedy=tr(
                "Tilt or turn the tool otherwise, or put the reference point elsewhere: in reach, "
                "and so that joint 5 stays more than {limit:g} degrees from 0.",
                limit=KEPT_CLEAR_DEG,
            ),
        )
    if path is Path.STRAIGHT:
        _require_clear_of_base(window, target)


def _require_clear_of_base(window: CommandWindow, target: Pose) -> None:
    """Hold a straight movement back that swings joint 1 as only one close to its axis does.

    Along a chord that stays 30 mm from the axis, joint 1 turns by at most 2 asin(d / 60 mm). How
    long the wrist's way is, is known where the tool does not turn.

    Raises:
        LimitError: The wrist would come nearer.
    """
    there_deg = _joint_at(window, target, _SWING)
    now_deg = spel.parse_number(window.printed(spel.print_joint_angle(_SWING)))
    swing_deg = abs(there_deg - now_deg)
    if swing_deg < _FREE_DEG:
        return
    here = read_position(window, spel.print_real_position())
    turned = zip(here.coordinates()[3:], target.coordinates()[3:], strict=True)
    if any(abs(angle_difference_deg(a, b)) > _TURNED_DEG for a, b in turned):
        return
    way_mm = math.dist(here.coordinates()[:3], target.coordinates()[:3])
    if swing_deg > 2 * math.degrees(math.asin(min(1.0, way_mm / (2 * KEPT_CLEAR_MM)))):
        raise LimitError(
            tr(
                "Joint 1 would turn by {angle:.0f} degrees in a straight movement of {way:.1f} mm: "
                "the wrist is too near to its axis. Nothing was sent.",
                angle=swing_deg,
                way=way_mm,
            ),
            remedy=tr(
                "Put the reference point where the wrist stays more than {limit:g} mm from the "
                "axis of joint 1.",
                limit=KEPT_CLEAR_MM,
            ),
        )


def _joint_at(window: CommandWindow, target: Pose, joint: int) -> float:
    return spel.parse_number(window.printed(spel.print_joint_of(target, joint, six_axes=True)))
