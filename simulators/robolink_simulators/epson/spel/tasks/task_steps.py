"""Carries out the operations of tasks, as far as they may.

What a task may not do that goes on through an emergency stop, or in the background.

Source: docs/reference/spel.md 4.5.
"""

from typing import Any, Final

from robolink_simulators.epson.condition import RaisedError, RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.execution import StatementExecution
from robolink_simulators.epson.spel.session import Session
from robolink_simulators.epson.spel.tasks.task import SpelTask, TaskKind
from robolink_simulators.epson.spel.tasks.waits import (
    StatementWait,
    TaskWait,
    WaitSequence,
    WaitUntil,
)
from robolink_simulators.epson.spel.tree import KeywordStatement, MotionStatement, Name, Statement

_WORDS = """
    accel accels accelr arm armset base box boxclr plane planeclr cp ecp ecpset ecpclr fine home
    homeset inertia limz local motor power pulse range sfree slock speed speeds speedr tlset
    tlclr tool weight till find sense jtran arch armclr xylim xylimclr xylimmode limzmargin
    finedist performmode ptpboost qpdecelr qpdecels tclim tcspeed limittorque qp olaccel softcp
    speedrlimitation tc jrange ptran hordr finedist calib mcal mcordr homeclr
    syncrobots latchenable setlatch curve localclr reset waitpos
"""
FORBIDDEN: Final = frozenset(_WORDS.split())
_ALONE: Final = frozenset({"home", "slock", "xylimclr", "mcal", "homeclr", "reset", "waitpos"})
"""Statements that act even without an argument. Without one, the others show their setting."""

BOUND: Final = frozenset({TaskKind.NO_ABORT, TaskKind.BACKGROUND})
"""Kinds of tasks in which some statements are not allowed (p. 912 to 917)."""


def forbidden_in(kind: TaskKind, statement: Statement) -> bool:
    """Return whether a task of a kind may not carry a statement out."""
    if kind not in BOUND:
        return False
    match statement:
        case MotionStatement():
            return True
        case KeywordStatement(name, arguments):
            if name == "reset" and arguments == (Name("error"),):
                return False
            return name in FORBIDDEN and bool(arguments or name in _ALONE)
    return False


def require_unbound(task: SpelTask) -> None:
    """Refuse statements that emergency-proof and background tasks may not use.

    Raises:
        Refusal: It is one of those.
    """
    if task.kind in BOUND:
        raise SpelRefusal(RefusalKind.NOT_IN_THIS_TASK, "Not allowed in this kind of task")


def require_advanced(task: SpelTask) -> None:
    """Refuse Cont, Reset Error and StartMain if the preference forbids them to programs.

    Source: docs/reference/spel.md 4.5.

    Raises:
        Refusal: It does not (which number that has is not told).
    """
    if not task.session.options.advanced_task_commands:
        raise SpelRefusal(RefusalKind.PREFERENCE_OFF, "Advanced task commands are not permitted")


class TaskSteps:
    """Continues one task at a time.

    Args:
        runner: Whose tasks they are: a ``ProgramRunner``, which makes this. It is shown what
            Print says, and told which errors no task dealt with.
        session: What statements reach.

    Attributes:
        movers: The task that moved each robot last, by the robot's number.
    """

    def __init__(self, runner: Any, session: Session) -> None:  # noqa: ANN401 - see above
        self._runner = runner
        self._session = session
        self._step_ns = session.options.statement_us * 1000
        self.movers: dict[int, SpelTask] = {}

    def burst(self, task: SpelTask, until_ns: int) -> None:
        """Carry operations out until an instant, or until one takes time."""
        operations, step_ns, runner = task.operations, self._step_ns, self._runner
        try:
            while task.now_ns <= until_ns:
                pc = task.pc
                task.pc = pc + 1
                if runner.on_statement is not None:
                    self._trace(task, pc)
                outcome = operations[pc](task)
                task.now_ns += step_ns
                if outcome is None:
                    continue
                if not self._take_up(task, outcome):
                    return
                operations = task.operations
        except SpelRefusal as refusal:
            self.fail(task, refusal)
        except RecursionError:
            self.fail(task, SpelRefusal(RefusalKind.SYNTAX, "Expression too deeply nested"))

    def _trace(self, task: SpelTask, pc: int) -> None:
        function = task.frame.function
        if function.starts[pc] == pc:
            place = function.places[pc]
            text = self._runner.project.sources.get(place, "")
            self._runner.on_statement(task, place.file, place.line, text)

    def _take_up(self, task: SpelTask, outcome: object) -> bool:
        """Handle the result of an operation; return whether the task continues at once."""
        if isinstance(outcome, Statement):
            waiting: TaskWait = StatementWait(self.carried_out(task, outcome))
        elif isinstance(outcome, (WaitUntil, WaitSequence, StatementWait)):
            waiting = outcome
        else:
            return not task.ended
        self.poll(task, waiting, task.now_ns)
        if isinstance(outcome, KeywordStatement) and outcome.name == "wait":
            return False  # Wait 0 gives the others a turn (documented)
        return task.waiting is None and not task.ended and not task.halted

    def carried_out(self, task: SpelTask, statement: Statement) -> StatementExecution:
        """Begin a statement of the machine for a task.

        Raises:
            Refusal: This kind of task may not, or another task moves the robot.
        """
        machine = self._session.machine
        machine.advance(task.now_ns)
        machine.timed_bits.advance(task.now_ns)
        if forbidden_in(task.kind, statement):
            raise SpelRefusal(RefusalKind.NOT_IN_THIS_TASK, "Not allowed in this kind of task")
        if isinstance(statement, MotionStatement):
            number = machine.robot_number
            if machine.arm.moving and self.movers.get(number) is not task:
                raise SpelRefusal(RefusalKind.ROBOT_IN_USE, "Another task moves the robot")
            self.movers[number] = task
        return StatementExecution(task, (statement,), task.now_ns)

    def poll(self, task: SpelTask, waiting: TaskWait, now_ns: int) -> None:
        """Check what a task waits for, and continue the task if that is over."""
        task.waiting = waiting
        try:
            over = waiting.poll(max(now_ns, task.now_ns))
            if not over:
                return
            task.waiting = None
            task.loop_passes = 0
            task.now_ns = max(task.now_ns, now_ns)
            if isinstance(waiting, StatementWait):
                self._finish(task, waiting.execution)
        except SpelRefusal as refusal:
            task.waiting = None
            task.now_ns = max(task.now_ns, now_ns)
            self.fail(task, refusal)

    def _finish(self, task: SpelTask, execution: StatementExecution) -> None:
        if execution.output:
            self._runner.show(execution.output)
        task.now_ns = max(task.now_ns, execution.ended_ns)
        if execution.error is not None:
            robot = task.robot_number if execution.moves else 0
            self._fail(task, execution.error.number, execution.error.text, robot)

    def fail(self, task: SpelTask, refusal: SpelRefusal) -> None:
        """Give a task an error: at its handler, or at its end."""
        if isinstance(refusal, RaisedError):
            self._fail(task, refusal.number, refusal.text)
        else:
            self._fail(
                task, getattr(self._session.options.numbers, refusal.kind.option), refusal.text
            )

    def _fail(self, task: SpelTask, number: int, text: str, robot: int = 0) -> None:
        task.waiting = None
        if not task.fail(number, text, robot) and task.failure is not None:
            self._runner.give_up(task, task.failure)
