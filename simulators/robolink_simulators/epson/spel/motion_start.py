"""How a motion begins and stops, and how Recover leads back to one.

How long the servo needs to come within Fine, or FineDist, of a target.

Source: docs/reference/spel.md 7.1, 7.2. The servo is assumed to follow its command with one time
constant, ``servo_lag_ms``: during an even deceleration ``a`` it stays ``a * lag ** 2`` behind where
it will rest, and that fades with ``exp(-t / lag)`` (a lag of first order, R. C. Dorf and R. H.
Bishop, Modern Control Systems).

Recover: motors on after the safeguard, and back to where the robots were.

Source: docs/reference/spel.md 4.5.
"""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

from robolink.timing import NS_PER_S
from robolink_simulators.epson.arm.robots import Joints
from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.robot import DrivenRobot
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.legs import go_leg
from robolink_simulators.epson.spel.session import Session
from robolink_simulators.epson.spel.statements.conditions import DescentWatch, Watch
from robolink_simulators.epson.spel.statements.keywords import StatementOutcome
from robolink_simulators.epson.spel.statements.motion import DESCENT, blends, fall_ns, plan
from robolink_simulators.epson.spel.tree import Expression, KeywordStatement, MotionStatement, Name

NS_PER_MS: Final = NS_PER_S // 1000

GIVEN_UP_NS: Final = 2 * NS_PER_S
"""Approximate time in ns after which a motion that has not reached Fine ends in error 4024
(documented).
"""

_LEAST_PULSES: Final = 0.5
"""Deviation in pulses at which Fine 0 is reached: no encoder resolves less (assumed)."""


def settling_ns(session: Session, legs: Sequence[Leg]) -> int:
    """Return how long after its end a motion counts as done; note the error if it never does."""
    lag_ms, unrest = session.options.servo_lag_ms, session.options.servo_unrest_pulses
    if not lag_ms and not unrest:
        return 0
    machine, leg = session.machine, legs[-1]
    end = leg.joints_at(leg.duration_ns)
    ever = _off_mm(machine, end, [unrest] * machine.model.axes)
    fine_mm = machine.robot.drives.get("finedist")[0]
    fine = machine.settings.fine_pulses
    met = ever <= fine_mm if fine_mm else all(unrest <= pulses for pulses in fine)
    if not met:
        machine.robot.guard.coming = machine.robot.guard.coming or RefusalKind.FINE_NOT_REACHED
        return GIVEN_UP_NS
    behind = _behind_pulses(machine, leg, lag_ms)
    if fine_mm:
        ratio = _off_mm(machine, end, behind) / fine_mm
    else:
        pairs = zip(behind, fine, strict=True)
        ratio = max(off / max(pulses, _LEAST_PULSES) for off, pulses in pairs)
    return round(lag_ms * NS_PER_MS * math.log(max(ratio, 1.0)))


def _behind_pulses(machine: Machine, leg: Leg, lag_ms: float) -> list[float]:
    """Return how far each joint is behind when its command has come to rest."""
    last_ns = leg.duration_ns
    a, b, c = (leg.joints_at(max(0, last_ns - step)) for step in (2 * NS_PER_MS, NS_PER_MS, 0))
    scales = zip(a, b, c, machine.model.pulses_per_unit, strict=True)
    return [abs(p - 2 * q + r) * lag_ms**2 * scale for p, q, r, scale in scales]


def _off_mm(machine: Machine, end: Joints, pulses: Sequence[float]) -> float:
    """Return how far the tip is from a target when each joint is off by some pulses."""
    scales = zip(end, pulses, machine.model.pulses_per_unit, strict=True)
    there = Joints(*(joint + off / scale for joint, off, scale in scales))
    tips = [machine.robot.tip_near(joints).coordinates()[:3] for joints in (end, there)]
    return math.dist(*tips)


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
            # A motion that the drives cut short does not slow down before it stops.
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


_WITH_MOVE: Final = 0
_WITHOUT_MOVE: Final = 1


def recover(evaluator: Evaluator, command: KeywordStatement) -> int:
    """Carry Recover out; return how long the way back takes, in ns.

    Motors come on, and each robot goes back point to point in low power (documented); robots go
    side by side (assumed).

    Raises:
        Refusal: The safeguard is open (the number of that error is assumed), or it names no robot.
    """
    session = evaluator.session
    machine, condition = session.machine, session.condition
    numbers, moves = _asked(evaluator, command.arguments)
    if condition.guard_open or condition.flags().emergency_stop:
        kind = RefusalKind.GUARD_OPEN if condition.guard_open else RefusalKind.EMERGENCY_STOP
        raise SpelRefusal(kind, "The robots cannot be recovered now")
    now_ns, chosen, longest_ns = machine.arm.now_ns, machine.robot_number, 0
    try:
        for machine.robot_number in numbers:
            robot = machine.robot
            robot.switch_motors(True)
            if moves and robot.recovers_to is not None:
                leg = go_leg(machine, robot.arm.joints, robot.recovers_to)
                longest_ns = max(longest_ns, robot.arm.start([leg], now_ns) - now_ns)
                robot.way_back = robot.arm.moves_started
            robot.recovers_to = None
    finally:
        machine.robot_number = chosen
    return longest_ns


def _asked(evaluator: Evaluator, arguments: tuple[Expression, ...]) -> tuple[list[int], bool]:
    machine = evaluator.session.machine
    if len(arguments) > 2:
        raise SpelRefusal(RefusalKind.SYNTAX, "Recover takes a robot and a way")
    way = evaluator.integer(arguments[1]) if len(arguments) > 1 else _WITH_MOVE
    if way not in (_WITH_MOVE, _WITHOUT_MOVE):
        raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"There is no way {way}")
    if not arguments or arguments[0] == Name("all"):
        robots: list[DrivenRobot] = list(machine.robots)
        return list(range(1, len(robots) + 1)), way == _WITH_MOVE
    number = evaluator.integer(arguments[0])
    machine.numbered(number)
    return [number], way == _WITH_MOVE
