"""Runs one line of the command window in simulated time."""

import random
from collections.abc import Mapping
from dataclasses import dataclass

from robolink.timing import NS_PER_S
from robolink_simulators.epson.condition import Condition
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.variables import Variables
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.request_refusals import RequestRefused
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.printing import CRLF, joined, number_text
from robolink_simulators.epson.spel.expressions.values import Value, as_number, truth
from robolink_simulators.epson.spel.parse import parse
from robolink_simulators.epson.spel.session import Session, WindowMemory
from robolink_simulators.epson.spel.statements.jump import DESCENT
from robolink_simulators.epson.spel.statements.keywords import StatementOutcome, run_command
from robolink_simulators.epson.spel.statements.motion import plan
from robolink_simulators.epson.spel.statements.until import DescentWatch, Watch
from robolink_simulators.epson.spel.statements.waiting import (
    NEVER_NS,
    Waiting,
    is_condition,
    seconds_of,
    wait_limit,
)
from robolink_simulators.epson.spel.tree import (
    AssignCoordinate,
    AssignPoint,
    AssignVariable,
    Coordinates,
    If,
    KeywordStatement,
    MotionStatement,
    Print,
    Statement,
)


@dataclass(frozen=True, slots=True)
class SpelError:
    """The number that GetStatus shows and the controller's own text."""

    number: int
    text: str


class StatementExecution:
    """One line under way. Made by :meth:`Interpreter.start`.

    Attributes:
        output: What was printed so far; each Print ends with CRLF unless it said otherwise.
        error: Why it failed, ``None`` while it has not.
    """

    def __init__(
        self, evaluator: Evaluator, statements: tuple[Statement, ...], now_ns: int
    ) -> None:
        self.output = ""
        self.error: SpelError | None = None
        self._evaluator = evaluator
        self._pending = list(reversed(statements))
        self._busy_until_ns = now_ns
        self._seen_ns = now_ns
        self._watch: Watch | DescentWatch | None = None
        self._waiting: Waiting | None = None
        self._done = False

    @property
    def done(self) -> bool:
        """Whether it has ended, well or not."""
        return self._done

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``; each statement starts when the last one ends."""
        arm = self._evaluator.session.machine.arm
        while not self._done and now_ns >= (change_ns := self._change_ns):
            arm.advance(change_ns)
            self._evaluator.session.machine.timed_bits.advance(change_ns)
            self._attempt(change_ns)
            self._seen_ns = change_ns
        arm.advance(now_ns)
        self._seen_ns = max(self._seen_ns, now_ns)

    def _take_up(self, change_ns: int) -> None:
        """Do what is due: an end of waiting, an edge, or the next statement."""
        if self._waiting is not None:
            if self._waiting.is_over(change_ns):
                self._waiting, self._busy_until_ns = None, change_ns
            return
        watch, self._watch = self._watch, None
        if watch is not None and watch.edge_after(self._seen_ns) == change_ns:
            rest_ns = watch.meet(change_ns)
            self._busy_until_ns = self._busy_until_ns if rest_ns is None else rest_ns
        elif self._pending:
            self._run(self._pending.pop())
        else:
            self._done = True

    def next_change(self) -> int | None:
        """Return when something happens next, ``None`` when all statements have ended."""
        if self._done or self._change_ns >= NEVER_NS:
            return None
        return self._change_ns

    @property
    def _change_ns(self) -> int:
        """When the condition that is waited for, or that a motion watches, is met, or the
        statement ends.
        """  # noqa: D205 - one sentence over two lines
        if self._waiting is not None:
            return self._waiting.next_look(self._seen_ns)
        edge_ns = None if self._watch is None else self._watch.edge_after(self._seen_ns)
        return self._busy_until_ns if edge_ns is None else min(edge_ns, self._busy_until_ns)

    def abort(self, now_ns: int) -> None:
        """Stop the line and the motion where it is; how a real one ends is unverified."""
        number = self._evaluator.session.options.numbers.aborted
        self.fail(SpelError(number, "Aborted"), now_ns)

    def fail(self, error: SpelError, now_ns: int) -> None:
        """End the line with ``error`` and stop the motion where it is; no effect once done."""
        if self._done:
            return
        self.advance(now_ns)
        if not self._done:
            self._evaluator.session.machine.arm.halt(now_ns)
            self._fail(error)

    def _fail(self, error: SpelError) -> None:
        self.error = error
        self._done = True

    def refuse(self, refusal: SpelRefusal) -> None:
        """End the line with the number that the options give for a refusal."""
        session = self._evaluator.session
        session.memory.last_error = getattr(session.options.numbers, refusal.kind)
        self._fail(SpelError(session.memory.last_error, refusal.text))

    def _attempt(self, change_ns: int) -> None:
        try:
            self._take_up(change_ns)
        except SpelRefusal as refusal:
            self.refuse(refusal)
        except RecursionError:
            self.refuse(SpelRefusal(RefusalKind.SYNTAX, "Expression too deeply nested"))

    def _run(self, statement: Statement) -> None:
        outcome = self._outcome(statement)
        start_ns, machine = self._busy_until_ns, self._evaluator.session.machine
        self.output += outcome.output
        if outcome.timed is not None:
            bank, number, on, after_ns = outcome.timed
            machine.timed_bits.plan(start_ns + after_ns, bank, number, on)
        if outcome.legs:
            self._busy_until_ns = machine.arm.start(outcome.legs, start_ns)
        self._busy_until_ns += outcome.duration_ns

    def _begin(self, motion: MotionStatement) -> StatementOutcome:
        machine, start_ns = self._evaluator.session.machine, self._busy_until_ns
        legs, until = plan(self._evaluator, motion), motion.options.until
        machine.till_met = machine.sensed = False
        if until is None:
            return StatementOutcome(legs=legs)
        if until.word == "sense":
            descent_ns = start_ns + sum(leg.duration_ns for leg in legs[:DESCENT])
            self._watch = DescentWatch(self._evaluator, until, descent_ns)
            return StatementOutcome(legs=legs)
        watch = Watch(self._evaluator, until)
        if not watch.stops:
            machine.found = None
        if self._stays(watch, start_ns):
            watch.meet(start_ns)
            return StatementOutcome()
        end_ns = machine.arm.start(legs, start_ns)
        watch.foresee(start_ns, end_ns)
        self._watch = watch
        return StatementOutcome(duration_ns=end_ns - start_ns)

    def _stays(self, watch: Watch, start_ns: int) -> bool:
        stays = self._evaluator.session.options.till_already_met == "stays"
        return watch.holds(start_ns) and watch.stops and stays

    def _wait(self, command: KeywordStatement) -> StatementOutcome:
        """Wait for a condition, or for some seconds."""
        evaluator, arguments = self._evaluator, command.arguments
        if not arguments:
            raise SpelRefusal(RefusalKind.SYNTAX, "Wait needs a time or a condition")
        limit_s = wait_limit(evaluator, command)
        if not is_condition(arguments[0]):
            if limit_s is not None:
                raise SpelRefusal(RefusalKind.SYNTAX, "Wait takes one time")
            seconds = seconds_of(evaluator, arguments[0])
            return StatementOutcome(duration_ns=round(seconds * NS_PER_S))
        waiting = Waiting(evaluator, arguments[0], self._busy_until_ns, limit_s)
        if not waiting.is_over(self._busy_until_ns):
            self._waiting = waiting
        return StatementOutcome()

    def _branch(self, statement: If) -> StatementOutcome:
        if self._evaluator.session.options.single_line_if == "refused":
            raise SpelRefusal(RefusalKind.NOT_ALLOWED_HERE, "If is allowed in programs only")
        holds = truth(self._evaluator.value(statement.condition))
        self._pending += reversed(statement.then if holds else statement.otherwise)
        return StatementOutcome()

    def _assign(self, name: str, value: Value) -> StatementOutcome:
        session = self._evaluator.session
        if session.options.variable_assignment == "refused":
            # Whether the command window takes variables is left open (docs/reference/spel.md 13).
            raise SpelRefusal(RefusalKind.NOT_ALLOWED_HERE, f"{name} needs a program")
        if not session.variables.holds(name):
            raise SpelRefusal(RefusalKind.NAME_UNDEFINED, f"Nothing is called {name}")
        text = value if isinstance(value, str) else number_text(as_number(value))
        try:
            session.variables.set(name, text)
        except RequestRefused as refused:
            raise SpelRefusal(RefusalKind.TYPE_MISMATCH, f"{name} cannot hold {text}") from refused
        return StatementOutcome()

    def _outcome(self, statement: Statement) -> StatementOutcome:
        evaluator = self._evaluator
        machine = evaluator.session.machine
        match statement:
            case Print(items, newline):
                values = [evaluator.shown(item) for item in items]
                end = CRLF if newline else ""
                session = evaluator.session
                text = joined(values, session.options, session.machine.model)
                return StatementOutcome(text + end)
            case KeywordStatement("wait"):
                return self._wait(statement)
            case If():
                return self._branch(statement)
            case KeywordStatement():
                return run_command(evaluator, statement)
            case MotionStatement():
                return self._begin(statement)
            case AssignPoint(number, value):
                point = evaluator.point_of(value)
                machine.points.store(evaluator.integer(number), point)
                return StatementOutcome()
            case AssignCoordinate(axis, place, value):
                number_of_point = evaluator.stored_number(place)
                changed = machine.points.get(number_of_point).with_axis(
                    axis, float(evaluator.number(value))
                )
                machine.points.store(number_of_point, changed)
                return StatementOutcome()
            case AssignVariable(name, Coordinates()):
                raise SpelRefusal(RefusalKind.TYPE_MISMATCH, f"{name} cannot hold coordinates")
            case AssignVariable(name, expression) if not isinstance(expression, Coordinates):
                return self._assign(name, evaluator.value(expression))
        raise AssertionError(statement)


class Interpreter:
    """Carries out command-window lines, as Execute does.

    Args:
        machine: What the statements act on.
        options: The controller's habits and error numbers.
        rng: Source of RealPos's noise.
        condition: What the functions of the controller's state tell; one of its own if none.
        variables: The project's variables; none if none are given.
        messages: Texts of error numbers, for ErrMsg$.
    """

    def __init__(
        self,
        machine: Machine,
        options: EpsonOptions,
        rng: random.Random,
        *,
        condition: Condition | None = None,
        variables: Variables | None = None,
        messages: Mapping[int, str] | None = None,
    ) -> None:
        session = Session(
            machine,
            options,
            rng,
            condition or Condition(monitoring_only=False),
            variables or Variables(str(options.true_value)),
            {} if messages is None else messages,
        )
        self._evaluator = Evaluator(session)

    def forget(self) -> None:
        """Forget what statements have set: stored conditions, TMOut, TW, Err."""
        self._evaluator.session.memory = WindowMemory()

    def start(self, statement: str, now_ns: int) -> StatementExecution:
        """Begin a line at ``now_ns``; what takes no time is done when this returns.

        A line that cannot be parsed, or that holds a statement for programs only, gives an
        execution that has failed already: nothing of it was carried out.
        """
        try:
            statements = parse(statement)
        except SpelRefusal as refusal:
            execution = StatementExecution(self._evaluator, (), now_ns)
            execution.refuse(refusal)
            return execution
        execution = StatementExecution(self._evaluator, statements, now_ns)
        execution.advance(now_ns)
        return execution
