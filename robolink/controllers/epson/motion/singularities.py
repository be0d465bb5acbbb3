"""What a six-axis arm is held back from: places it cannot reach, and singular ones.

Close to where joint 5 is at 0 a straight movement of the tip asks joints 4 and 6 for speeds that
they do not have: the controller leaves the way there, or ends with an error
(docs/reference/epson-robots.md, "Singularities").
"""

from typing import Final

from robolink.controllers.epson.link.window import CommandWindow
from robolink.errors import LimitError
from robolink.messages import tr
from robolink.model import MotionProfile, Path, Pose
from robolink.protocols import spel

KEPT_CLEAR_DEG: Final = 10.0
"""Joint 5 stays so far from 0 in straight movements: the controller's own default of
SingularityAngle, and what EPSON's tool wizard asks for (docs/reference/epson-robots.md,
"Singularities")."""

_WRIST: Final = 5


def require_clear(window: CommandWindow, target: Pose, profile: MotionProfile) -> None:
    """Hold a movement of six axes back that would end out of reach, or straight at a singularity.

    Both are asked with functions that move nothing and raise no error in the controller.

    Raises:
        LimitError: Says which of the two, and what to do.
    """
    if not spel.parse_boolean(window.printed(spel.print_reachable(target, six_axes=True))):
        raise LimitError(
            tr("The robot cannot reach that place with its tool turned so; nothing was sent."),
            remedy=tr("Tilt or turn the tool less, or put the reference point nearer."),
        )
    if profile.path is not Path.STRAIGHT:
        return
    printed = window.printed(spel.print_joint_of(target, _WRIST, six_axes=True))
    bend_deg = spel.parse_number(printed)
    if abs(bend_deg) < KEPT_CLEAR_DEG:
        raise LimitError(
            tr(
                "Joint 5 would stand at {angle:.1f} degrees there, too near to its singular place "
                "at 0 for a straight movement; nothing was sent.",
                angle=bend_deg,
            ),
            remedy=tr(
                "Keep joint 5 more than {limit:g} degrees from 0: tilt the tool otherwise, or put "
                "the reference point elsewhere.",
                limit=KEPT_CLEAR_DEG,
            ),
        )
