"""Runs one line of the command window in simulated time."""

import random
from dataclasses import dataclass

from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.refusals import Refusal, RefusalKind
from robolink_simulators.epson.spel._evaluate import Evaluator
from robolink_simulators.epson.spel._motion import plan
from robolink_simulators.epson.spel._parse import parse
from robolink_simulators.epson.spel._printing import CRLF, joined
from robolink_simulators.epson.spel._session import Session
from robolink_simulators.epson.spel._statements import Outcome, run_command
from robolink_simulators.epson.spel._tree import (
    AssignPoint,
    AssignVariable,
    Command,
    Motion,
    Print,
    Statement,
)
from robolink_simulators.epson.spel._until import Watch


@dataclass(frozen=True, slots=True)
class SpelError:
    """The number that GetStatus shows and the controller's own text."""

    number: int
    text: str


class Execution:
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
        self._watch: Watch | None = None
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
            watch, self._watch = self._watch, None
            if watch is not None and watch.edge_after(self._seen_ns) == change_ns:
                self._meet(watch, change_ns)
            elif self._pending:
                self._run(self._pending.pop())
            else:
                self._done = True
            self._seen_ns = change_ns
        arm.advance(now_ns)
        self._seen_ns = max(self._seen_ns, now_ns)

    def next_change(self) -> int | None:
        """Return when something happens next, ``None`` when all statements have ended."""
        return None if self._done else self._change_ns

    @property
    def _change_ns(self) -> int:
        """When the condition of the motion under way is met, or the statement ends."""
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

    def refuse(self, refusal: Refusal) -> None:
        """End the line with the number that the options give for a refusal."""
        numbers = self._evaluator.session.options.numbers
        self._fail(SpelError(getattr(numbers, refusal.kind), refusal.text))

    def _run(self, statement: Statement) -> None:
        try:
            outcome = self._outcome(statement)
        except Refusal as refusal:
            self.refuse(refusal)
        except RecursionError:
            self.refuse(Refusal(RefusalKind.SYNTAX, "Expression too deeply nested"))
        else:
            self.output += outcome.output
            self._busy_until_ns += outcome.duration_ns

    def _begin(self, motion: Motion) -> Outcome:
        machine, start_ns = self._evaluator.session.machine, self._busy_until_ns
        legs, until = plan(self._evaluator, motion), motion.options.until
        machine.till_met = False
        watch = None if until is None else Watch(self._evaluator, until)
        if watch is not None and not watch.stops:
            machine.found = None
        if watch is not None and self._stays(watch, start_ns):
            watch.meet(start_ns)
            return Outcome()
        end_ns = machine.arm.start(legs, start_ns)
        if watch is not None:
            watch.foresee(start_ns, end_ns)
        self._watch = watch
        return Outcome(duration_ns=end_ns - start_ns)

    def _stays(self, watch: Watch, start_ns: int) -> bool:
        stays = self._evaluator.session.options.till_already_met == "stays"
        return watch.holds(start_ns) and watch.stops and stays

    def _meet(self, watch: Watch, instant_ns: int) -> None:
        rest_ns = watch.meet(instant_ns)
        if rest_ns is not None:
            self._busy_until_ns = rest_ns

    def _outcome(self, statement: Statement) -> Outcome:
        evaluator = self._evaluator
        machine = evaluator.session.machine
        match statement:
            case Print(items, newline):
                values = [evaluator.value(item) for item in items]
                end = CRLF if newline else ""
                return Outcome(joined(values, evaluator.session.options) + end)
            case Command():
                return run_command(evaluator, statement)
            case Motion():
                return self._begin(statement)
            case AssignPoint(number, value):
                point = evaluator.point_of(value)
                machine.points.store(evaluator.integer(number), point)
                return Outcome()
            case AssignVariable(name):
                # Whether the command window takes variables is left open (spel.md 13).
                raise Refusal(RefusalKind.NOT_ALLOWED_HERE, f"{name} needs a program")


class Interpreter:
    """Carries out command-window lines, as Execute does.

    Args:
        machine: What the statements act on.
        options: The controller's habits and error numbers.
        rng: Source of RealPos's noise.
    """

    def __init__(self, machine: Machine, options: EpsonOptions, rng: random.Random) -> None:
        self._evaluator = Evaluator(Session(machine, options, rng))

    def start(self, statement: str, now_ns: int) -> Execution:
        """Begin a line at ``now_ns``; what takes no time is done when this returns.

        A line that cannot be parsed, or that holds a statement for programs only, gives an
        execution that has failed already: nothing of it was carried out.
        """
        try:
            statements = parse(statement)
        except Refusal as refusal:
            execution = Execution(self._evaluator, (), now_ns)
            execution.refuse(refusal)
            return execution
        execution = Execution(self._evaluator, statements, now_ns)
        execution.advance(now_ns)
        return execution
