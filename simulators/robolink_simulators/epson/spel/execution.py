"""Carries statements out, one by one, in simulated time.

What statements do that take no time: print, assign, set.

What takes time (motion, Wait, what stands inside ``!...!``) is :class:`StatementExecution`'s.

The command window carries a line out so, a task of a program each statement that has to do with
the machine: what a statement means does not depend on who says it.
"""

from dataclasses import dataclass, replace
from typing import Final

from robolink.timing import NS_PER_S
from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.condition import RefusalKind, RequestRefused, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.print_format import (
    CRLF,
    LONGEST_PRINT_TO,
    joined,
    number_text,
)
from robolink_simulators.epson.spel.expressions.values import Value, as_number, truth
from robolink_simulators.epson.spel.motion_start import begin_motion, recover, settling_ns
from robolink_simulators.epson.spel.statements.conditions import (
    NEVER_NS,
    DescentWatch,
    Waiting,
    Watch,
    is_condition,
    seconds_of,
    wait_limit,
)
from robolink_simulators.epson.spel.statements.curves import store_curve
from robolink_simulators.epson.spel.statements.keywords import StatementOutcome, run_command
from robolink_simulators.epson.spel.statements.motion import plan, require_drives, rest_of_way
from robolink_simulators.epson.spel.tree import (
    AssignCoordinate,
    AssignPoint,
    AssignVariable,
    Coordinates,
    Distance,
    If,
    KeywordStatement,
    MotionStatement,
    Print,
    PrintTo,
    Statement,
)


def effect(evaluator: Evaluator, statement: Statement) -> str:
    """Carry out a statement that takes no time and is no keyword's; return what it prints.

    Raises:
        Refusal: It cannot be carried out.
    """
    match statement:
        case Print(items, newline):
            session = evaluator.session
            values = [evaluator.shown(item) for item in items]
            text = joined(values, session.options, session.machine.model)
            return text + (CRLF if newline else "")
        case MotionStatement("curve"):
            store_curve(evaluator, statement)
        case PrintTo():
            _print_to(evaluator, statement)
        case AssignPoint() | AssignCoordinate():
            _store(evaluator, statement)
        case AssignVariable(name, value) if (
            number := evaluator.session.machine.points.labelled(name)
        ) is not None:
            evaluator.session.machine.points.store(number, evaluator.point_of(value))
        case AssignVariable(name, Coordinates()):
            raise SpelRefusal(RefusalKind.TYPE_MISMATCH, f"{name} cannot hold coordinates")
        case AssignVariable(name, expression) if not isinstance(expression, Coordinates):
            _assign(evaluator, name, evaluator.value(expression))
        case _:
            raise AssertionError(statement)
    return ""


def _store(evaluator: Evaluator, statement: AssignPoint | AssignCoordinate) -> None:
    points = evaluator.session.machine.points
    if isinstance(statement, AssignPoint):
        point = evaluator.point_of(statement.value)
        points.store(evaluator.point_number(statement.number), point)
        return
    number = evaluator.stored_number(statement.point)
    value = float(evaluator.number(statement.value))
    points.store(number, points.get(number).assigned(statement.axis, value))


def _assign(evaluator: Evaluator, name: str, value: Value) -> None:
    session = evaluator.session
    if session.options.variable_assignment == "refused":
        # Not documented: does the command window accept variables (docs/reference/spel.md 13)?
        raise SpelRefusal(RefusalKind.NOT_ALLOWED_HERE, f"{name} needs a program")
    if not session.variables.holds(name):
        raise SpelRefusal(RefusalKind.NAME_UNDEFINED, f"Nothing is called {name}")
    text = value if isinstance(value, str) else number_text(as_number(value))
    try:
        session.variables.set(name, text)
    except RequestRefused as refused:
        raise SpelRefusal(RefusalKind.TYPE_MISMATCH, f"{name} cannot hold {text}") from refused


def _print_to(evaluator: Evaluator, statement: PrintTo) -> None:
    """Print to a port: only those that a program has opened exist."""
    session = evaluator.session
    channel = evaluator.integer(statement.channel)
    values = [evaluator.shown(item) for item in statement.items]
    text = joined(values, session.options, session.machine.model, longest=LONGEST_PRINT_TO)
    evaluator.write_to(channel, text, ends=statement.newline)


HIGHEST_PERCENT: Final = 100


@dataclass(frozen=True, slots=True)
class SpelError:
    """The number that GetStatus shows and the controller's own text."""

    number: int
    text: str


class StatementExecution:
    """Statements in progress: a line of the command window, or a statement of a task.

    Args:
        evaluator: What works expressions out.
        statements: What is carried out.
        now_ns: When it begins.
        travel_ns: For what stands inside ``!...!``: how long the way takes that D divides.

    Attributes:
        output: What was printed so far; each Print ends with CRLF unless it said otherwise.
        error: Why it failed, ``None`` while it has not.

    Example:
        >>> import random
        >>> from robolink_simulators.epson import EpsonOptions, EpsonSimulator
        >>> from robolink_simulators.epson.spel import Interpreter, StatementExecution
        >>> from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
        >>> from robolink_simulators.epson.spel.parser import parse
        >>> machine = EpsonSimulator().machine
        >>> session = Interpreter(machine, EpsonOptions(), random.Random(1)).session
        >>> line = StatementExecution(Evaluator(session), parse("Wait 2; On 5"), now_ns=0)
        >>> line.advance(1_999_999_999)
        >>> line.done, machine.outputs.get(5)
        (False, False)
        >>> line.advance(2_000_000_000)
        >>> line.done, machine.outputs.get(5)
        (True, True)
    """

    def __init__(
        self,
        evaluator: Evaluator,
        statements: tuple[Statement, ...],
        now_ns: int,
        *,
        travel_ns: int = 0,
    ) -> None:
        self.output = ""
        self.error: SpelError | None = None
        self._statements = statements
        self._evaluator = evaluator
        self._pending = list(reversed(statements))
        self._began_ns = now_ns
        self._travel_ns = travel_ns
        self._busy_until_ns = now_ns
        self._seen_ns = now_ns
        self._duration_ns = 0
        self._watch: Watch | DescentWatch | None = None
        self._waiting: Waiting | None = None
        self._meanwhile: StatementExecution | None = None
        self._aim: Leg | None = None
        self._reserved: MotionStatement | None = None
        self._held = self._released = False
        self._done = False

    @property
    def done(self) -> bool:
        """Whether it has ended, well or not."""
        return self._done

    @property
    def moves(self) -> bool:
        """Whether it moves the robot."""
        return any(isinstance(one, MotionStatement) for one in self._statements)

    @property
    def ended_ns(self) -> int:
        """When the last statement ends, or ended."""
        return self._busy_until_ns

    @property
    def waits(self) -> bool:
        """Whether it waits for a condition."""
        return self._waiting is not None

    def saw(self, now_ns: int) -> None:
        """Note that nothing it waits for came before an instant."""
        self._seen_ns = max(self._seen_ns, now_ns)

    @property
    def travels(self) -> bool:
        """Whether its motion is in progress."""
        return self._aim is not None and self._evaluator.session.machine.arm.moving

    @property
    def stands(self) -> bool:
        """Whether its motion is reserved and waits for SyncRobots."""
        return self._reserved is not None and not self._done and self._evaluator.carries(self)

    def start_reserved(self, now_ns: int) -> None:
        """Begin the reserved motion; a held one begins when it continues (assumed)."""
        if self._held:
            self._released = True
        elif self._reserved is not None:
            motion, self._reserved = self._reserved, None
            options = replace(motion.options, words=motion.options.words - {"sync"})
            self._pending.append(replace(motion, options=options))
            self._busy_until_ns = now_ns
            self._take_up(now_ns)

    def suspend(self, now_ns: int) -> None:
        """Stop the motion where it is; nothing is done until :meth:`resume`."""
        if self._reserved is not None:
            self._held = True
        elif self.travels:
            self._evaluator.session.machine.arm.halt(now_ns)
        elif now_ns >= self._busy_until_ns:  # otherwise the safeguard has just stopped it
            self._aim = None

    def resume(self, now_ns: int) -> None:
        """Continue after :meth:`suspend`; a timed wait starts again (docs/reference/spel.md 4.6).

        What is left of a motion is travelled point to point, of a straight one in a straight
        line (assumed).
        """
        machine = self._evaluator.session.machine
        self._seen_ns = now_ns
        try:
            self._restart(machine, now_ns)
        except SpelRefusal as refusal:
            self.refuse(refusal)

    def _restart(self, machine: Machine, now_ns: int) -> None:
        if self._reserved is not None:
            self._held = False
            if self._released:
                self.start_reserved(now_ns)
        elif self._aim is not None:
            require_drives(machine)
            self._busy_until_ns = machine.arm.start([rest_of_way(machine, self._aim)], now_ns)
        elif self._waiting is not None:
            self._waiting.restart(now_ns)
        else:
            self._busy_until_ns = now_ns + self._duration_ns

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``; each statement starts when the last one ends."""
        machine = self._evaluator.session.machine
        arm = machine.robot.arm
        while not self._done and now_ns >= (change_ns := self._change_ns):
            arm.advance(change_ns)
            machine.timed_bits.advance(change_ns)
            self._take_up(change_ns)
            self._seen_ns = change_ns
        arm.advance(now_ns)
        self._seen_ns = max(self._seen_ns, now_ns)

    def _take_up(self, change_ns: int) -> None:
        """Do what is due: an end of waiting, an edge, or the next statement."""
        try:
            if self._waiting is not None:
                if self._waiting.is_over(change_ns):
                    self._waiting, self._busy_until_ns = None, change_ns
            elif (
                self._meanwhile is not None
                and self._meanwhile.next_poll_ns(self._seen_ns) <= change_ns
            ):
                self._advance_meanwhile(change_ns)
            elif not self._met_an_edge(change_ns):
                self._evaluator.session.machine.robot.guard.require_no_error()
                self._done = not self._pending
                if self._pending:
                    self._aim = None
                    self._run(self._pending.pop())
        except SpelRefusal as refusal:
            self.refuse(refusal)
        except RecursionError:
            self.refuse(SpelRefusal(RefusalKind.SYNTAX, "Expression too deeply nested"))

    def _met_an_edge(self, change_ns: int) -> bool:
        """Return whether an edge is met, or the next statement waits for what is inside ``!...!``.

        Source: docs/reference/spel.md 7.1.
        """
        watch, self._watch = self._watch, None
        if watch is not None and watch.edge_after(self._seen_ns) == change_ns:
            rest_ns = watch.meet(change_ns)
            self._busy_until_ns = self._busy_until_ns if rest_ns is None else rest_ns
            return True
        if self._meanwhile is not None:
            self._busy_until_ns = self._meanwhile.next_poll_ns(self._seen_ns)
            return True
        return False

    def next_poll_ns(self, seen_ns: int) -> int:
        """Return when it has to be checked again."""
        self.saw(seen_ns)
        return seen_ns + 1 if self._done else self._change_ns

    def _advance_meanwhile(self, now_ns: int) -> None:
        """Carry out what is due inside ``!...!``."""
        meanwhile = self._meanwhile
        if meanwhile is None:
            return
        meanwhile.step(now_ns)
        if not meanwhile.done:
            return
        self._meanwhile = None
        self.output += meanwhile.output
        if meanwhile.error is not None:
            self._evaluator.session.machine.arm.halt(now_ns)
            self._fail(meanwhile.error)

    def step(self, now_ns: int) -> None:
        """Carry out what is due, without moving the arm through time."""
        while not self._done and now_ns >= (change_ns := self._change_ns):
            self._take_up(change_ns)
            self._seen_ns = change_ns

    def next_change(self) -> int | None:
        """Return when something happens next, ``None`` when all statements have ended."""
        if self._done or self._change_ns >= NEVER_NS:
            return None
        return self._change_ns

    @property
    def _change_ns(self) -> int:
        """When something is due: an end of waiting, an edge, the end of the statement."""
        if self._reserved is not None:
            return NEVER_NS
        if self._waiting is not None:
            return self._waiting.next_poll_ns(self._seen_ns)
        change_ns = self._busy_until_ns
        if self._watch is not None:
            edge_ns = self._watch.edge_after(self._seen_ns)
            change_ns = change_ns if edge_ns is None else min(edge_ns, change_ns)
        if self._meanwhile is not None:
            change_ns = min(change_ns, self._meanwhile.next_poll_ns(self._seen_ns))
        return change_ns

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
        session.memory.last_error = getattr(session.options.numbers, refusal.kind.option)
        self._fail(SpelError(session.memory.last_error, refusal.text))

    def _run(self, statement: Statement) -> None:
        """Begin a statement; what takes no time is done when this returns."""
        match statement:
            case Print():  # most are
                outcome = StatementOutcome(effect(self._evaluator, statement))
            case KeywordStatement("wait"):
                outcome = self._wait(statement)
            case KeywordStatement("recover"):
                outcome = StatementOutcome(duration_ns=recover(self._evaluator, statement))
            case KeywordStatement():
                outcome = run_command(self._evaluator, statement)
            case If():
                outcome = self._branch(statement)
            case MotionStatement(verb) if verb != "curve":
                reserves = "sync" in statement.options.words
                outcome = self._reserve(statement) if reserves else self._begin(statement)
            case Distance(percent):
                outcome = self._wait_for_distance(percent)
            case _:
                outcome = StatementOutcome(effect(self._evaluator, statement))
        self._note(outcome)

    def _note(self, outcome: StatementOutcome) -> None:
        """Note what a statement has begun, and how long it takes."""
        start_ns, machine = self._busy_until_ns, self._evaluator.session.machine
        self.output += outcome.output
        if outcome.timed is not None:
            bank, number, on, after_ns = outcome.timed
            machine.timed_bits.plan(start_ns + after_ns, bank, number, on)
        if outcome.legs:
            self._aim = outcome.legs[-1]
            self._busy_until_ns = machine.arm.start(outcome.legs, start_ns)
            self._busy_until_ns += settling_ns(self._evaluator.session, outcome.legs)
        self._duration_ns = outcome.duration_ns
        self._busy_until_ns += outcome.duration_ns

    def _reserve(self, motion: MotionStatement) -> StatementOutcome:
        """Store a motion with SYNC for SyncRobots; refuse an impossible one now (assumed)."""
        robot = self._evaluator.session.machine.robot
        plan(self._evaluator, motion)
        self._reserved, robot.reservation = motion, self
        return StatementOutcome()

    def _begin(self, motion: MotionStatement) -> StatementOutcome:
        machine, start_ns = self._evaluator.session.machine, self._busy_until_ns
        if self._evaluator.blends and machine.arm.moving:
            # The previous motion should blend into this one; here it ends first (assumed).
            self._pending.append(motion)
            return StatementOutcome(duration_ns=(machine.arm.next_change() or start_ns) - start_ns)
        start = begin_motion(self._evaluator, motion, start_ns)
        if motion.options.meanwhile:
            before_ns, travel_ns = start.travelled_ns
            self._meanwhile = StatementExecution(
                self._evaluator,
                motion.options.meanwhile,
                start_ns + before_ns,
                travel_ns=travel_ns,
            )
        self._aim, self._watch = start.aim, start.watch
        return start.outcome

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

    def _wait_for_distance(self, percent: float) -> StatementOutcome:
        """Wait until a part of the way is behind: ``D50`` inside ``!...!``."""
        if not 0 <= percent <= HIGHEST_PERCENT:
            raise SpelRefusal(RefusalKind.DISTANCE, f"D{percent:g}")
        at_ns = self._began_ns + round(self._travel_ns * percent / HIGHEST_PERCENT)
        return StatementOutcome(duration_ns=max(0, at_ns - self._busy_until_ns))

    def _branch(self, statement: If) -> StatementOutcome:
        if self._evaluator.session.options.single_line_if == "refused":
            raise SpelRefusal(RefusalKind.NOT_ALLOWED_HERE, "If is allowed in programs only")
        holds = truth(self._evaluator.value(statement.condition))
        self._pending += reversed(statement.then if holds else statement.otherwise)
        return StatementOutcome()
