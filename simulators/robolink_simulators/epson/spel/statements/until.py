"""``Till``, ``Find`` and ``Sense``: motions that a condition ends or marks.

Source: docs/reference/spel.md 7.1.

The instant at which an input that follows the robot meets the condition is known when the
motion starts, because the motion is; an input that is switched by hand is seen at once. Till
brakes with the motion's own deceleration (documented).
"""

from typing import Final

from robolink_simulators.epson.memory.input_bits import InputsAsked, first_between
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.values import truth
from robolink_simulators.epson.spel.statements.waiting import follows_robot
from robolink_simulators.epson.spel.tree import (
    Binary,
    Expression,
    Literal,
    Name,
    Unary,
    Until,
    names_in,
)

_SAMPLE_NS: Final = 1_000_000
"""A condition that holds for less is not seen (assumed: controllers sample their inputs)."""

_INPUTS: Final = frozenset({"sw", "in", "inw", "on", "off"})
"""Functions of inputs, and the values to which they are compared."""


class Watch:
    """The condition of one motion.

    Args:
        evaluator: What evaluates it.
        until: What the motion says.
    """

    def __init__(self, evaluator: Evaluator, until: Until) -> None:
        self.stops = until.word == "till"
        self._evaluator = evaluator
        stored: Expression = getattr(evaluator.session.memory, until.word)
        self._condition = until.condition or stored
        self._edge_ns: int | None = None

    def holds(self, instant_ns: int) -> bool:
        """Tell whether the condition holds at an instant of the motion under way.

        Raises:
            Refusal: It cannot be evaluated.
        """
        with self._evaluator.session.machine.inputs.as_at(instant_ns):
            return truth(self._evaluator.value(self._condition))

    def foresee(self, start_ns: int, end_ns: int) -> None:
        """Find out when the motion that has just been started meets the condition."""
        machine = self._evaluator.session.machine
        if not follows_robot(names_in(self._condition), machine):
            return
        scan = _Scan(self)
        before_ns = start_ns
        while before_ns < end_ns:
            after_ns = min(before_ns + _SAMPLE_NS, end_ns)
            if scan.holds(after_ns):
                self._edge_ns = first_between(before_ns, after_ns, scan.holds)
                return
            before_ns = after_ns

    def edge_after(self, seen_ns: int) -> int | None:
        """Return when the condition is met, as far as that is known at ``seen_ns``."""
        if self.holds(seen_ns):
            return seen_ns + 1  # switched by hand just now
        return self._edge_ns

    def meet(self, instant_ns: int) -> int | None:
        """Stop, or note the place; return when the robot rests if it stops."""
        machine = self._evaluator.session.machine
        if self.stops:
            machine.till_met = True
            machine.robot.guard.coming = None
            return machine.arm.brake(instant_ns)
        machine.found = machine.here()
        return None

    @property
    def asks_for_inputs_alone(self) -> bool:
        """Whether nothing but inputs, numbers and operators stands in the condition."""
        return _inputs_alone(self._condition)

    def value_and_inputs(self, instant_ns: int) -> tuple[bool, InputsAsked]:
        """Return whether the condition holds, and the inputs on which that hangs.

        Raises:
            Refusal: It cannot be evaluated.
        """
        with self._evaluator.session.machine.inputs.noting() as asked:
            return self.holds(instant_ns), asked

    def still(self, asked: InputsAsked, instant_ns: int) -> bool:
        """Tell whether those inputs show at an instant what they showed."""
        return self._evaluator.session.machine.inputs.show(asked, instant_ns)


class _Scan:
    """Looks at a condition again and again while nothing but the robot moves.

    An expression of inputs alone is worked out anew only when an input that it asked for has
    changed: of the thousands of instants of a slow search all but a few are alike. What else it
    may ask for, where the robot is for one, is another at each instant.
    """

    def __init__(self, watch: Watch) -> None:
        self._watch = watch
        self._inputs_alone = watch.asks_for_inputs_alone
        self._held = False
        self._asked: InputsAsked | None = None

    def holds(self, instant_ns: int) -> bool:
        """Tell whether the condition holds at an instant of the motion under way."""
        if not self._inputs_alone:
            return self._watch.holds(instant_ns)
        if self._asked is None or not self._watch.still(self._asked, instant_ns):
            self._held, self._asked = self._watch.value_and_inputs(instant_ns)
        return self._held


class DescentWatch:
    """The Sense of a Jump: looked at once, just before the descent (documented).

    Args:
        evaluator: What evaluates the condition.
        until: What the motion says.
        at_ns: When the descent begins.
    """

    stops = False

    def __init__(self, evaluator: Evaluator, until: Until, at_ns: int) -> None:
        self._evaluator = evaluator
        self._condition: Expression = until.condition or evaluator.session.memory.sense
        self._at_ns = at_ns

    def edge_after(self, seen_ns: int) -> int | None:
        """Return when the look is due."""
        return max(self._at_ns, seen_ns)

    def meet(self, instant_ns: int) -> int | None:
        """Look; stop above the target, or go on."""
        session = self._evaluator.session
        session.machine.sensed = truth(self._evaluator.value(self._condition))
        if not session.machine.sensed:
            return None
        session.machine.arm.halt(instant_ns)
        return instant_ns


def _inputs_alone(expression: Expression) -> bool:
    match expression:
        case Literal():
            return True
        case Unary(_, operand):
            return _inputs_alone(operand)
        case Binary(_, left, right):
            return _inputs_alone(left) and _inputs_alone(right)
        case Name(name, arguments):
            return name in _INPUTS and all(map(_inputs_alone, arguments or ()))
    return False
