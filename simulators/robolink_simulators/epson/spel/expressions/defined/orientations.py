"""How far a tool turns between two places: ROTOK; and Align (docs/reference/spel.md 5.3, 7.1)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink.model import Pose
from robolink_simulators.cell.frames import axis_and_angle, product, transposed
from robolink_simulators.epson.arm.kinematics import frame_of
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.values import Value, as_point
from robolink_simulators.epson.spel.session import Session

LEAST_TURN_DEG: Final = 0.001
"""Assumed: a tool that turns by less does not turn."""


def turn_deg(machine: Machine, start: Pose, end: Pose) -> float:
    """Return by how much a tool turns from one pose to another."""
    if not machine.model.six_axes:
        return abs(end.u_deg - start.u_deg)
    before, after = frame_of(start).rotation, frame_of(end).rotation
    return axis_and_angle(product(after, transposed(before)))[1]


def _may_turn(session: Session, arguments: Sequence[Value]) -> Value:
    """ROTOK([reference, ]target): whether ROT may stand: the tool turns on the way (documented)."""
    machine = session.machine
    *before, after = (machine.pose_of(as_point(argument)) for argument in arguments)
    start = before[0] if before else machine.tip()
    return turn_deg(machine, start, after) > LEAST_TURN_DEG


def aligned(session: Session, arguments: Sequence[Value]) -> Point:
    """Return Align and AlignECP of a SCARA: the point itself (documented).

    Which axes of the tool six axes bring to which of the local, the reference does not say.

    Raises:
        Refusal: Six axes.
    """
    if session.machine.model.six_axes:
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "Align on six axes")
    return as_point(arguments[0])


_Function = Callable[[Session, Sequence[Value]], Value]

ORIENTATION_FUNCTIONS: Final[dict[str, tuple[range, _Function]]] = {
    "rotok": (range(1, 3), _may_turn),
}
"""Name to the numbers of arguments allowed and the function."""
