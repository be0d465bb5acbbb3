"""A straight movement until an input switches: ``Move ... Till`` or ``Find``.

Source: docs/reference/spel.md 7.1.
"""

from robolink.controllers.epson.link.window import CommandWindow
from robolink.controllers.epson.motion.movement import EpsonMotion
from robolink.controllers.epson.motion.positions import read_position
from robolink.controllers.motion_group import stopped_before_edge
from robolink.model import InputEdge, MotionOutcome, Pose
from robolink.protocols import spel


class EpsonMotionUntilInput:
    """Implements :class:`robolink.model.MotionUntilInput`.

    With ``run_on`` the position is the one that ``Find`` kept at the edge. Without, ``Till``
    keeps none: it is the measured position at rest, past the edge by the way of braking.
    """

    def __init__(
        self, motion: EpsonMotion, edge: InputEdge, window: CommandWindow, *, identity: str
    ) -> None:
        self._motion = motion
        self._edge = edge
        self._window = window
        self._identity = identity

    def wait(self, *, timeout_s: float) -> Pose | None:
        """Wait for the end; see :class:`robolink.model.MotionUntilInput`."""
        if self._motion.wait(timeout_s=timeout_s) is not MotionOutcome.ARRIVED:
            raise stopped_before_edge(self._identity, self._motion.statement)
        if self._edge.run_on:
            met, position = spel.print_position_found(), spel.print_found_position()
        else:
            met, position = spel.print_till_on(), spel.print_real_position()
        if not spel.parse_boolean(self._window.printed(met)):
            return None
        return read_position(self._window, position)


def statement_until(target: Pose, edge: InputEdge, *, six_axes: bool) -> spel.Statement:
    """Return the move that waits for an edge.

    Raises:
        LocalProtocolError: No such input, or a target that cannot be written.
    """
    build = spel.move_find if edge.run_on else spel.move_till
    return build(target, edge.number, on=not edge.falling, six_axes=six_axes)


def read_input(window: CommandWindow, bit: int) -> bool:
    """Read one input through Execute, as the statement that follows will see it."""
    return spel.parse_integer(window.printed(spel.print_input(bit))) != 0
