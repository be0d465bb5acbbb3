"""XYLimDef, XYLimMode and the corners of XYLim (docs/reference/spel.md 5.2, 7.2)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink.model import Pose
from robolink_simulators.epson.arm.kinematics import tip_of
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.values import Value, as_integer, out_of_range
from robolink_simulators.epson.spel.session import Session


def corner_of_limits(session: Session, arguments: Sequence[Value]) -> Point:
    """Return XYLim(1), the lower limits, or XYLim(2), the upper ones.

    Raises:
        Refusal: There is no such corner.
    """
    which = as_integer(arguments[0])
    if which not in (1, 2):
        raise out_of_range(f"There is no XYLim({which})")
    return Point((*session.machine.kept.limits.corners[which - 1], 0.0, 0.0, 0.0))


def outside_limits_mm(session: Session, flange: Pose) -> float:
    """Return how far a place of the flange brings the robot outside the limits of XYLim.

    Whether they hold the tip of the selected tool or the flange, the documents leave open.
    """
    machine, place = session.machine, flange
    if session.options.xylim_counts == "tip":
        place = tip_of(machine.model, flange, machine.offset)
    return machine.kept.limits.outside_mm(place.coordinates()[:3])


LIMIT_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Sequence[Value]], Value]]]] = {
    "xylimdef": (range(1), lambda s, _: s.machine.kept.limits.defined),
    "xylimmode": (range(1), lambda s, _: int(s.machine.kept.limits.strict)),
}
"""Name to the numbers of arguments allowed and the function."""
