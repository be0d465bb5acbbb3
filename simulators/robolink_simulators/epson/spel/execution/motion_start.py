"""How a motion begins: planned, started or foreseen, and what stands inside its ``!...!``."""

from collections.abc import Sequence
from typing import Final, NamedTuple

from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.spel.execution.settling import settling_ns
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.statements.blending import blends, fall_ns
from robolink_simulators.epson.spel.statements.jump import DESCENT
from robolink_simulators.epson.spel.statements.keywords import StatementOutcome
from robolink_simulators.epson.spel.statements.motion import plan
from robolink_simulators.epson.spel.statements.until import DescentWatch, Watch
from robolink_simulators.epson.spel.tree import MotionStatement

WAYS_OF_JUMP: Final = 3


class MotionStart(NamedTuple):
    """A motion that has begun.

    Attributes:
        outcome: How long it takes, and the legs that have still to be started.
        aim: The last leg of one that has been started.
        watch: The condition that may end it.
        travelled_ns: For what stands inside ``!...!``: how long after the beginning the way
            begins that D divides, and how long that takes.
    """

    outcome: StatementOutcome
    aim: Leg | None = None
    watch: Watch | DescentWatch | None = None
    travelled_ns: tuple[int, int] = (0, 0)


def begin_motion(evaluator: Evaluator, motion: MotionStatement, start_ns: int) -> MotionStart:
    """Begin a motion at an instant.

    Raises:
        Refusal: It cannot be carried out; nothing moves.
    """
    machine = evaluator.session.machine
    legs, until = plan(evaluator, motion), motion.options.until
    machine.till_met = machine.sensed = False
    way_ns = _travelled_ns(motion, legs)
    if motion.verb.startswith("jump"):
        machine.robot.jump = start_ns, tuple(leg.duration_ns for leg in legs)
    if evaluator.blends and blends(machine, motion):
        lasts_ns = machine.arm.start(legs, start_ns) - start_ns
        if lasts_ns >= sum(leg.duration_ns for leg in legs):
            # What the drives cut short does not slow down before it rests.
            lasts_ns -= fall_ns(legs[-1])
        return MotionStart(StatementOutcome(duration_ns=lasts_ns), legs[-1], travelled_ns=way_ns)
    if until is None:
        return MotionStart(StatementOutcome(legs=legs), travelled_ns=way_ns)
    if until.word == "sense":
        descent_ns = start_ns + sum(leg.duration_ns for leg in legs[:DESCENT])
        look = DescentWatch(evaluator, until, descent_ns)
        return MotionStart(StatementOutcome(legs=legs), watch=look, travelled_ns=way_ns)
    watch = Watch(evaluator, until)
    if not watch.stops:
        machine.found = None
    if _stays(evaluator, watch, start_ns):
        watch.meet(start_ns)
        return MotionStart(StatementOutcome(), travelled_ns=way_ns)
    end_ns = machine.arm.start(legs, start_ns)
    watch.foresee(start_ns, end_ns)
    end_ns += settling_ns(evaluator.session, legs)
    outcome = StatementOutcome(duration_ns=end_ns - start_ns)
    return MotionStart(outcome, legs[-1], watch, way_ns)


def _travelled_ns(motion: MotionStatement, legs: Sequence[Leg]) -> tuple[int, int]:
    if motion.verb == "jump" and len(legs) == WAYS_OF_JUMP:
        return legs[0].duration_ns, legs[1].duration_ns
    return 0, sum(leg.duration_ns for leg in legs)


def _stays(evaluator: Evaluator, watch: Watch, start_ns: int) -> bool:
    stays = evaluator.session.options.till_already_met == "stays"
    return watch.holds(start_ns) and watch.stops and stays
