"""What was set of the drives: LimZMargin, QP, PTPBoost(1) ... (docs/reference/spel.md 7.2)."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.definitions.drive_settings import DRIVE_SETTINGS
from robolink_simulators.epson.spel.expressions.values import Value, as_integer, out_of_range
from robolink_simulators.epson.spel.session import Session


def _told(word: str) -> Callable[[Session, Sequence[Value]], Value]:
    def tell(session: Session, arguments: Sequence[Value]) -> Value:
        machine = session.machine
        robot, at = machine.robot, as_integer(arguments[0]) if arguments else 1
        if word == "performmode" and arguments:
            robot, at = machine.numbered(at), 1
        values = robot.drives.get(word)
        if not 1 <= at <= len(values):
            raise out_of_range(f"{word} has no value {at}")
        value = values[at - 1]
        return int(value) if value == int(value) else value

    return tell


def _end_of_range(session: Session, arguments: Sequence[Value]) -> Value:
    """Return JRange(joint, 1 or 2): the lower or the upper end in pulses."""
    joint, end = (as_integer(argument) for argument in arguments)
    if not 1 <= joint <= session.machine.model.axes or end not in {1, 2}:
        raise out_of_range(f"There is no end {end} of a joint {joint}")
    return session.machine.robot.kept.ranges.pulses()[2 * joint - 3 + end]


DRIVE_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Sequence[Value]], Value]]]] = {
    **{word: (range(2), _told(word)) for word in DRIVE_SETTINGS},
    "jrange": (range(2, 3), _end_of_range),
    "finestatus": (range(1), lambda s, _: int(s.machine.robot.drives.get("finedist")[0] > 0)),
}
"""Name to the numbers of arguments allowed and the function."""
