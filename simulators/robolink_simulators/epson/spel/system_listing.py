"""SysConfig: what the controller and its robots are set to, as lines that could be entered again.

Source: docs/reference/spel.md 7.3. What belongs to no statement stands behind an apostrophe.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Final

from robolink_simulators.epson.memory.driven_robot import DrivenRobot
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.defined.origins import NS_PER_HOUR
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.machine_functions import hours_of
from robolink_simulators.epson.spel.expressions.printing import CRLF
from robolink_simulators.epson.spel.tree import KeywordStatement

_LIMITS_LISTED: Final = 6


def _listing(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Return the listing; motors, boards and options, which are not simulated, are left out."""
    if command.arguments:
        raise SpelRefusal(RefusalKind.SYNTAX, "SysConfig takes nothing")
    session = evaluator.session
    head = [
        f"' HOUR: {hours_of(session):.3f}",
        "' Controller:",
        f"'   Serial #: {session.machine.controller_serial}",
    ]
    robots = enumerate(session.machine.robots, start=1)
    rows = (row for number, robot in robots for row in _robot(number, robot))
    return "".join(line + CRLF for line in (*head, *rows))


def _robot(number: int, robot: DrivenRobot) -> Iterator[str]:
    yield f"' ROBOT {number}:"
    yield f"'   Name: Robot{number}"
    yield f"'   Model: {robot.model.name}"
    yield f"'   Serial #: {robot.serial}"
    yield f"'   Motor On Time: {robot.motors_on_ns / NS_PER_HOUR:.3f}"
    kept, settings = robot.kept, robot.settings
    for arch, ends in enumerate(kept.arches.all()):
        yield _row("ARCH", (arch, ends.depart_mm, ends.approach_mm))
    for arm, values in kept.arms.all().items():
        yield _row("ARMSET", (arm, *values))
    yield _row("HOFS", kept.origins.offsets)
    yield _row("HORDR", settings.home_order)
    yield _row("RANGE", kept.ranges.pulses())
    yield _row("BASE", kept.base.coordinates)
    yield _row("WEIGHT", (settings.weight_kg, settings.weight_at_mm))
    yield _row("INERTIA", (settings.inertia_kg_m2, settings.eccentricity_mm))
    limits = (*kept.limits.values, 0.0, 0.0)[:_LIMITS_LISTED]
    yield _row("XYLIM", limits)


def _row(word: str, values: Iterable[float]) -> str:
    return f"{word} " + ", ".join(f"{value:.10g}" for value in values)


SYSTEM_COMMANDS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "sysconfig": _listing
}
"""Keyword to what carries it out."""
