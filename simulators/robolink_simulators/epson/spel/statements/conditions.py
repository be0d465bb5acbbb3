"""``Wait`` for a condition; ``Till``, ``Find`` and ``Sense``, which end or mark a motion.

``Wait`` for a condition; the conditions that Till, Find and Sense keep.

Source: docs/reference/spel.md 4.6, 7.1.

``Till``, ``Find`` and ``Sense``: motions that a condition ends or marks.

Source: docs/reference/spel.md 7.1.

The instant at which an input that follows the robot meets the condition is known when the
motion starts, because the motion is; an input that is switched by hand is seen at once. Till
brakes with the motion's own deceleration (documented).
"""

from typing import Final

from robolink.timing import NS_PER_S
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.inputs import InputsAsked, first_between
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.print_format import number_text
from robolink_simulators.epson.spel.expressions.values import truth
from robolink_simulators.epson.spel.tree import (
    Binary,
    Expression,
    KeywordStatement,
    Literal,
    Name,
    PointExpression,
    Unary,
    Until,
    names_in,
)

LONGEST_WAIT_S: Final = 2_147_483
"""Longest Wait in seconds (docs/reference/spel.md 4.6)."""

NEVER_NS: Final = 2**62

_COMPARISONS: Final = frozenset({"=", "<>", "<", ">", "<=", ">="})
_JUDGING: Final = _COMPARISONS | {"and", "or", "xor", "mask"}
_EVENT_WORDS = """
    sw in inw oport out outw memsw memin meminw ctr getrobotinsidebox getrobotinsideplane
    mcalcomplete motor lof erroron safetyon estopon teachon pauseon athome latchstate windowsstatus
"""
_EVENTS: Final = frozenset(_EVENT_WORDS.split())

LOOK_NS: Final = 2_000_000
"""Interval in ns between checks of a condition that a moving robot may meet elsewhere (assumed)."""

_OF_THE_PLACE = """
    getrobotinsidebox getrobotinsideplane insidebox insideplane athome inpos here curpos realpos
    agl pls realpls tcpspeed stat robotinfo latchstate
"""
_OF_THE_ROBOT: Final = frozenset(_OF_THE_PLACE.split())
_OF_INPUTS: Final = frozenset({"sw", "in", "inw", "inbcd", "inreal"})


def follows_robot(names: frozenset[str], machine: Machine) -> bool:
    """Return whether the values of a condition may change because a robot moves.

    Args:
        names: Those in the condition.
        machine: Whose inputs may follow what the tip meets.
    """
    return bool(names & _OF_THE_ROBOT) or (machine.inputs.connected and bool(names & _OF_INPUTS))


def is_condition(expression: Expression) -> bool:
    """Return whether Wait waits for a condition, and does not read it as a number of seconds.

    A comparison, a logical operation and a bare event are conditions (documented,
    docs/reference/spel.md 4.6); everything else is a time.
    """
    match expression:
        case Binary(operator, left, right):
            return operator in _JUDGING or is_condition(left) or is_condition(right)
        case Unary(operator, operand):
            return operator == "not" or is_condition(operand)
        case Name(name):
            return name in _EVENTS
        case _:
            return False


class Waiting:
    """A Wait in progress.

    Args:
        evaluator: What evaluates the condition. What is compared with is worked out once, when
            the wait begins (documented).
        condition: What is waited for.
        start_ns: When it began.
        limit_s: The time that the statement names, ``None`` for TMOut's.
    """

    def __init__(
        self, evaluator: Evaluator, condition: Expression, start_ns: int, limit_s: float | None
    ) -> None:
        self._evaluator = evaluator
        self._condition = _with_right_sides(evaluator, condition)
        self._names = names_in(condition)
        self._own_limit = limit_s is not None
        session = evaluator.session
        self._seconds = (session.memory.wait_limit_s or None) if limit_s is None else limit_s
        self.restart(start_ns)

    def restart(self, now_ns: int) -> None:
        """Restart its time, as after a pause (docs/reference/spel.md 4.6)."""
        seconds = self._seconds
        self._end_ns = NEVER_NS if seconds is None else now_ns + round(seconds * NS_PER_S)

    def holds(self) -> bool:
        """Return whether the condition is true now.

        Raises:
            Refusal: It cannot be evaluated.
        """
        return truth(self._evaluator.value(self._condition))

    def next_poll_ns(self, seen_ns: int) -> int:
        """Return when it has to be checked again."""
        try:
            if self.holds():
                return seen_ns + 1  # switched just now
        except SpelRefusal:
            return seen_ns + 1  # the next check reports the reason
        machine = self._evaluator.session.machine
        coming_ns = machine.timed_bits.next_change()
        look_ns = min(self._end_ns, NEVER_NS if coming_ns is None else coming_ns)
        if machine.moving and follows_robot(self._names, machine):
            return min(look_ns, seen_ns + LOOK_NS)
        return look_ns

    def is_over(self, now_ns: int) -> bool:
        """Return whether it ends, and note for TW how.

        Raises:
            Refusal: TMOut's time ran out (documented: error 2280).
        """
        memory = self._evaluator.session.memory
        if self.holds():
            memory.timed_out = False
            return True
        if now_ns < self._end_ns:
            return False
        memory.timed_out = True
        if not self._own_limit:
            raise SpelRefusal(RefusalKind.WAIT_TIMED_OUT, "The time of TMOut ran out")
        return True


def _with_right_sides(evaluator: Evaluator, condition: Expression) -> Expression:
    """Return a condition whose right sides are values."""
    match condition:
        case Binary(sign, left, right) if sign in _COMPARISONS:
            value = evaluator.value(right)
            return condition if isinstance(value, Point) else Binary(sign, left, Literal(value))
        case Binary(sign, left, right):
            sides = _with_right_sides(evaluator, left), _with_right_sides(evaluator, right)
            return Binary(sign, *sides)
        case Unary(sign, operand):
            return Unary(sign, _with_right_sides(evaluator, operand))
        case _:
            return condition


def wait_limit(evaluator: Evaluator, command: KeywordStatement) -> float | None:
    """Return the time that ``Wait condition, time`` names, ``None`` for none.

    Raises:
        Refusal: It is no time, or more than one stands there.
    """
    _, *rest = command.arguments
    if len(rest) > 1:
        raise SpelRefusal(RefusalKind.SYNTAX, "Wait takes a condition and a time")
    return seconds_of(evaluator, rest[0]) if rest else None


def seconds_of(evaluator: Evaluator, expression: Expression) -> float:
    """Return a time to wait.

    Raises:
        Refusal: It is negative or too long.
    """
    seconds = float(evaluator.number(expression))
    if not 0 <= seconds <= LONGEST_WAIT_S:
        raise SpelRefusal(RefusalKind.WAIT_TIME, f"Wait of {seconds} s")
    return seconds


def shown_condition(expression: Expression) -> str:
    """Return a condition as a bare Till shows it (its format is not documented)."""
    match expression:
        case Literal(str(text)):
            return f'"{text}"'
        case Literal(value) if not isinstance(value, str):
            return number_text(value)
        case Name(name, None):
            return name.capitalize()
        case Name(name, arguments):
            return f"{name.capitalize()}({', '.join(map(shown_condition, arguments or ()))})"
        case Unary(operator, operand):
            return f"{operator.capitalize()} {shown_condition(operand)}"
        case Binary(operator, left, right):
            sides = (shown_condition(left), operator.capitalize(), shown_condition(right))
            return " ".join(sides)
        case PointExpression():
            return "point"
        case _:
            return "?"


_SAMPLE_NS: Final = 1_000_000
"""A condition that holds for less than this, in ns, is missed (assumed: controllers sample inputs).
"""

_INPUTS: Final = frozenset({"sw", "in", "inw", "on", "off"})
"""Functions of inputs, and the values with which they are compared."""


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
        """Return whether the condition is true at an instant of the motion in progress.

        Raises:
            Refusal: It cannot be evaluated.
        """
        with self._evaluator.session.machine.inputs.as_at(instant_ns):
            return truth(self._evaluator.value(self._condition))

    def foresee(self, start_ns: int, end_ns: int) -> None:
        """Find out when the motion that has just started meets the condition."""
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
            alike = (scan.lasts_until(after_ns) - after_ns) // _SAMPLE_NS
            before_ns = after_ns + alike * _SAMPLE_NS

    def edge_after(self, seen_ns: int) -> int | None:
        """Return when the condition is met, as far as that is known at ``seen_ns``."""
        if self.holds(seen_ns):
            return seen_ns + 1  # switched by hand just now
        return self._edge_ns

    def meet(self, instant_ns: int) -> int | None:
        """Stop, or note the place; return when the robot has stopped, if it does."""
        machine = self._evaluator.session.machine
        if self.stops:
            machine.till_met = True
            machine.robot.guard.coming = None
            return machine.arm.brake(instant_ns)
        machine.found = machine.robot.here()
        return None

    @property
    def asks_for_inputs_alone(self) -> bool:
        """Whether nothing but inputs, numbers and operators stands in the condition."""
        return _inputs_alone(self._condition)

    def value_and_inputs(self, instant_ns: int) -> tuple[bool, InputsAsked]:
        """Return whether the condition is true, and the inputs on which that depends.

        Raises:
            Refusal: It cannot be evaluated.
        """
        with self._evaluator.session.machine.inputs.noting() as asked:
            return self.holds(instant_ns), asked

    def still(self, asked: InputsAsked, instant_ns: int) -> bool:
        """Return whether those inputs show at an instant what they showed."""
        return self._evaluator.session.machine.inputs.show(asked, instant_ns)

    def lasts_until(self, asked: InputsAsked, instant_ns: int) -> int:
        """Return until when those inputs surely show what they show at an instant."""
        return self._evaluator.session.machine.inputs.last_until(asked, instant_ns)


class _Scan:
    """Checks a condition repeatedly while nothing but the robot moves.

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
        """Return whether the condition is true at an instant of the motion in progress."""
        if not self._inputs_alone:
            return self._watch.holds(instant_ns)
        if self._asked is None or not self._watch.still(self._asked, instant_ns):
            self._held, self._asked = self._watch.value_and_inputs(instant_ns)
        return self._held

    def lasts_until(self, instant_ns: int) -> int:
        """Return until when the condition surely is what it is at the instant asked for last."""
        if self._asked is None:
            return instant_ns
        return self._watch.lasts_until(self._asked, instant_ns)


class DescentWatch:
    """The Sense of a Jump: checked once, just before the descent (documented).

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
        """Return when the check is due."""
        return max(self._at_ns, seen_ns)

    def meet(self, instant_ns: int) -> int | None:
        """Check; stop above the target, or continue."""
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
