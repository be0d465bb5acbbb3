"""Pass: by several points, outputs switched on the way (docs/reference/spel.md 7.1)."""

from collections.abc import Sequence
from itertools import accumulate, pairwise

from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.statements.legs import go_leg
from robolink_simulators.epson.spel.tree import MotionStatement, PointRange, SwitchOnTheWay


def passing(evaluator: Evaluator, motion: MotionStatement, points: Sequence[Point]) -> list[Leg]:
    """Plan a Pass; each point is stood at for an instant here (assumed simplification).

    An output switches when the arm is at the point that stands before it.

    Raises:
        Refusal: A point is out of reach.
    """
    machine = evaluator.session.machine
    joints = [machine.arm.joints, *(machine.joints_for(point) for point in points)]
    legs: list[Leg] = [go_leg(machine, a, b) for a, b in pairwise(joints)]
    ends_ns = [0, *accumulate(leg.duration_ns for leg in legs)]
    passed = 0
    for target in motion.targets:
        if isinstance(target, SwitchOnTheWay):
            bank = machine.memory if target.word.startswith("mem") else machine.outputs
            number, at_ns = evaluator.integer(target.number), machine.arm.now_ns + ends_ns[passed]
            bank.get(number)
            machine.timed_bits.plan(at_ns, bank, number, target.word.endswith("on"))
        elif isinstance(target, PointRange):
            first, last = evaluator.integer(target.first), evaluator.integer(target.last)
            passed += max(0, last - first + 1)
        else:
            passed += 1
    return legs
