"""Lets the tasks of a program go on side by side in simulated time, statement by statement."""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from robolink_simulators.epson.condition import Condition, Task
from robolink_simulators.epson.refusals import RaisedError, RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.data_types import Variable
from robolink_simulators.epson.spel.session import Session
from robolink_simulators.epson.spel.statement_execution import StatementExecution
from robolink_simulators.epson.spel.statements.waiting import NEVER_NS
from robolink_simulators.epson.spel.tasks.channels.numbered import NumberedChannels
from robolink_simulators.epson.spel.tasks.channels.ports import Ports
from robolink_simulators.epson.spel.tasks.compiled import CompiledFunction, SpelProject
from robolink_simulators.epson.spel.tasks.permissions import forbidden_in
from robolink_simulators.epson.spel.tasks.shared import TaskSharing
from robolink_simulators.epson.spel.tasks.task import (
    SpelTask,
    TaskFailure,
    TaskKind,
)
from robolink_simulators.epson.spel.tasks.traps import Traps
from robolink_simulators.epson.spel.tasks.waits import StatementWaiting, TaskWaiting
from robolink_simulators.epson.spel.tree import KeywordStatement, MotionStatement, Statement
from robolink_simulators.epson.vision.system import VisionSystem

BURST_NS: Final = 1_000_000
"""How long a task goes on before the others are looked at, in ns, if none of them is due."""

_CONSOLE_LINES: Final = 2000
_NORMAL: Final = range(1, 33)
_BACKGROUND: Final = range(65, 81)
_TRAPS: Final = range(257, 268)

TraceHook = Callable[[SpelTask, str, int, str], None]
"""Called with a task, file, line and text before each statement."""


class ProgramRunner:
    """Runs the programs of a controller.

    Args:
        session: What statements reach; each task remembers its own last error.
        condition: Says whether tasks may run; told when they end.
        project: The functions.
        ports: The TCP/IP ports of the controller.

    Attributes:
        ports: The TCP/IP and serial ports.
        channels: Ports, files and the window of a person, by their numbers.
        tasks: Those that are not over, by their numbers.
        movers: The task that moved each robot last, by the robot's number.
        console: What Print has shown, the last lines of it.
        on_print: Called with what is printed.
        on_statement: Called before each statement, if anybody follows the run.
        failure: The error that ended the last task that failed.
        sharing: Locks, signals and timers.
        traps: What interrupts tasks.
        vision: Its cameras and sequences, ``None`` for a controller without Vision Guide.
    """

    def __init__(
        self, session: Session, condition: Condition, project: SpelProject, ports: Ports
    ) -> None:
        self.session = session
        self.project = project
        self.ports = ports
        keeps_ports = session.options.ports_of_ended_task == "open"
        self.channels = NumberedChannels(ports, session.files, self.show, keeps_ports=keeps_ports)
        self.tasks: dict[int, SpelTask] = {}
        self.console: deque[str] = deque(maxlen=_CONSOLE_LINES)
        self.on_print: Callable[[str], None] | None = None
        self.on_statement: TraceHook | None = None
        self.failure: TaskFailure | None = None
        self.sharing = TaskSharing()
        self.traps = Traps(self)
        self.vision: VisionSystem | None = None
        self._condition = condition
        self._step_ns = session.options.statement_us * 1000
        self._seen_ns, self._paused = 0, False
        self.movers: dict[int, SpelTask] = {}

    @property
    def now_ns(self) -> int:
        """Until when everything has been done."""
        return self._seen_ns

    def starter(self, now_ns: Callable[[], int]) -> Callable[[int], object]:
        """Return what begins main0 to main63 by its number, at the present time."""
        return lambda number: self.start(f"main{number or ''}", now_ns())

    def start(self, name: str, now_ns: int) -> SpelTask:
        """Start a function as Start does, as task 1.

        Raises:
            Refusal: There is no such function, or it takes arguments.
        """
        function = self.project.functions.get(name.lower())
        if function is None or function.parameters:
            raise SpelRefusal(RefusalKind.NO_SUCH_FUNCTION, f"There is no function {name}")
        if self.session.options.globals_at_start == "cleared":
            self.project.clear_globals()
        self.advance(now_ns)
        self.failure = None
        self._condition.task = Task.RUNNING
        return self.begin(function, [], TaskKind.NORMAL, None, now_ns)

    def begin(
        self,
        function: CompiledFunction,
        given: list[Variable],
        kind: TaskKind,
        number: int | None,
        now_ns: int,
    ) -> SpelTask:
        """Start a task.

        Raises:
            Refusal: Its number is not free, or does not exist.
        """
        task = SpelTask(self.free_number(kind, number), kind, self, self.session, now_ns)
        task.enter(function, given, 0)
        self.tasks[task.task_number] = task
        return task

    def free_number(self, kind: TaskKind, wanted: int | None = None) -> int:
        """Return the number of a new task.

        Raises:
            Refusal: There is none, or the one that is wanted is taken.
        """
        numbers = {TaskKind.BACKGROUND: _BACKGROUND, TaskKind.TRAP: _TRAPS}.get(kind, _NORMAL)
        if wanted is None:
            wanted = next((n for n in numbers if n not in self.tasks), None)
        if wanted is None:
            raise SpelRefusal(RefusalKind.TASKS_FULL, "Too many tasks")
        if wanted not in numbers:
            raise SpelRefusal(RefusalKind.TASK_NUMBER, f"There is no task {wanted}")
        if wanted in self.tasks:
            raise SpelRefusal(RefusalKind.TASK_BUSY, f"Task {wanted} is not free")
        return wanted

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""
        self._heed()
        while self.tasks:
            task, due_ns, others_ns = self._next()
            look_ns = self.traps.next_look(self._seen_ns)
            if look_ns is not None and look_ns < due_ns and look_ns <= now_ns:
                self.session.machine.advance(look_ns)
                self._seen_ns = look_ns
                self.traps.look(look_ns)
                continue
            if task is None or due_ns > now_ns:
                break
            with self.robot_of(task):
                if task.waiting is None:
                    limit_ns = min(now_ns, others_ns, task.now_ns + BURST_NS)
                    self._burst(task, max(limit_ns, task.now_ns))
                else:
                    self._look(task, task.waiting, due_ns)
            self._seen_ns = max(self._seen_ns, due_ns, min(task.now_ns, now_ns))
            self._tidy()
            self.traps.look(self._seen_ns)
        self._seen_ns = max(self._seen_ns, now_ns)
        self.traps.look(self._seen_ns)

    def next_change(self) -> int | None:
        """Return when a task next does something by itself."""
        if not self.tasks:
            return None
        task, due_ns, _ = self._next()
        look_ns = self.traps.next_look(self._seen_ns)
        if look_ns is not None and look_ns < due_ns:
            return look_ns
        if task is None or due_ns >= NEVER_NS:
            return None
        return due_ns if task.waiting is not None else due_ns + BURST_NS

    def _next(self) -> tuple[SpelTask | None, int, int]:
        """Return the task that is due first, when, and when the next one after it is."""
        first, first_ns, second_ns = None, NEVER_NS, NEVER_NS
        for task in self.tasks.values():
            if task.halted or (self._paused and task.held_by_pause):
                continue
            waiting = task.waiting
            due_ns = task.now_ns
            if waiting is not None:
                with self.robot_of(task):
                    due_ns = waiting.due_ns(self._seen_ns)
            if due_ns < first_ns:
                first, first_ns, second_ns = task, due_ns, first_ns
            elif due_ns < second_ns:
                second_ns = due_ns
        return first, first_ns, second_ns

    @contextmanager
    def robot_of(self, task: SpelTask) -> Iterator[None]:
        """Put the robot in force that a task has chosen; the command window keeps its own."""
        machine = self.session.machine
        kept, machine.robot_number = machine.robot_number, task.robot_number
        try:
            yield
        finally:
            task.robot_number, machine.robot_number = machine.robot_number, kept

    def _burst(self, task: SpelTask, until_ns: int) -> None:
        """Carry operations out until an instant, or until one takes time."""
        operations, step_ns = task.operations, self._step_ns
        try:
            while task.now_ns <= until_ns:
                pc = task.pc
                task.pc = pc + 1
                if self.on_statement is not None:
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
        if function.starts[pc] == pc and self.on_statement is not None:
            place = function.places[pc]
            text = self.project.sources.get(place, "")
            self.on_statement(task, place.file, place.line, text)

    def _take_up(self, task: SpelTask, outcome: object) -> bool:
        """Deal with what an operation gave; tell whether the task goes on at once."""
        if isinstance(outcome, Statement):
            waiting: TaskWaiting = StatementWaiting(self.carried_out(task, outcome))
        elif hasattr(outcome, "look"):
            waiting = outcome  # type: ignore[assignment]
        else:
            return not task.ended
        self._look(task, waiting, task.now_ns)
        if isinstance(outcome, KeywordStatement) and outcome.name == "wait":
            return False  # Wait 0 gives the others a turn (documented)
        return task.waiting is None and not task.ended and not task.halted

    def carried_out(self, task: SpelTask, statement: Statement) -> StatementExecution:
        """Begin a statement of the machine for a task.

        Raises:
            Refusal: This kind of task may not, or another task moves the robot.
        """
        machine = self.session.machine
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

    def _look(self, task: SpelTask, waiting: TaskWaiting, now_ns: int) -> None:
        """Look at what a task waits for, and let it go on if that is over."""
        task.waiting = waiting
        try:
            over = waiting.look(max(now_ns, task.now_ns))
            if not over:
                return
            task.waiting = None
            task.loop_passes = 0
            task.now_ns = max(task.now_ns, now_ns)
            if isinstance(waiting, StatementWaiting):
                self._finish(task, waiting.execution)
        except SpelRefusal as refusal:
            task.waiting = None
            task.now_ns = max(task.now_ns, now_ns)
            self.fail(task, refusal)

    def _finish(self, task: SpelTask, execution: StatementExecution) -> None:
        if execution.output:
            self.show(execution.output)
        task.now_ns = max(task.now_ns, execution.ended_ns)
        if execution.error is not None:
            self._fail(task, execution.error.number, execution.error.text)

    def show(self, text: str) -> None:
        """Show what Print says."""
        self.console.append(text)
        if self.on_print is not None:
            self.on_print(text)

    def fail(self, task: SpelTask, refusal: SpelRefusal) -> None:
        """Let a task meet an error: where it deals with it, or at its end."""
        if isinstance(refusal, RaisedError):
            self._fail(task, refusal.number, refusal.text)
        else:
            self._fail(task, getattr(self.session.options.numbers, refusal.kind), refusal.text)

    def _fail(self, task: SpelTask, number: int, text: str) -> None:
        task.waiting = None
        if task.fail(number, text) or task.failure is None:
            return
        task.ended = True
        self.failure = task.failure
        self.session.machine.halt(task.now_ns)
        self._condition.raise_error(number)
        self._condition.failure = (number % 10_000, str(task.failure))
        self.traps.happen("error", task.now_ns)
        self._stop(background=True)

    def end(self, task: SpelTask) -> None:
        """End a task, and stop what it moves (Quit)."""
        for number, mover in self.movers.items():
            if mover is task:
                self.session.machine.robots[number - 1].arm.halt(self._seen_ns)
        task.ended = True

    def turn_to(self, state: Task) -> None:
        """Pause or go on, as a task asks for."""
        if self._condition.task is not Task.NONE:
            self._condition.task = state
            self._heed()

    def quit_all(self) -> None:
        """End all but background tasks, and put the motion parameters back."""
        for task in self.tasks.values():
            if task.kind is not TaskKind.BACKGROUND:
                self.end(task)
        self.session.machine.reset_motion_parameters()

    def _heed(self) -> None:
        """Do what the controller's state asks for since it was looked at last."""
        state, now_ns = self._condition.task, self._seen_ns
        if not self.tasks:
            self._paused = False
            return
        if state is Task.NONE and any(
            t.kind is not TaskKind.BACKGROUND for t in self.tasks.values()
        ):
            event = "emergency" if self._condition.flags().emergency_stop else "abort"
            self._stop(background=event == "emergency" or self._condition.error)
            self.traps.happen(event, now_ns)
            self._tidy()
        elif state is Task.PAUSED and not self._paused:
            self._pause(now_ns)
        elif state is Task.RUNNING and self._paused:
            self._paused = False
            for task in self._pausing():
                task.now_ns = max(task.now_ns, now_ns)
                if task.waiting is not None:
                    with self.robot_of(task):
                        task.waiting.go_on(now_ns)

    def _pause(self, now_ns: int) -> None:
        self._paused = True
        for task in self._pausing():
            with self.robot_of(task):
                task.pause(now_ns)
        self.traps.happen("sgopen" if self._condition.guard_open else "pause", now_ns)

    def _pausing(self) -> list[SpelTask]:
        return [t for t in self.tasks.values() if t.kind is TaskKind.NORMAL and not t.halted]

    def _stop(self, *, background: bool) -> None:
        """End the normal tasks; with ``background``, those go on that stops do not touch."""
        self.session.machine.halt(self._seen_ns)
        kept = {TaskKind.BACKGROUND}
        if background:
            kept |= {TaskKind.NO_ABORT, TaskKind.TRAP}
        for task in self.tasks.values():
            if task.kind not in kept:
                task.ended = True

    def _tidy(self) -> None:
        """Forget tasks that are over, and what they held."""
        over = [task for task in self.tasks.values() if task.ended]
        for task in over:
            del self.tasks[task.task_number]
            self.sharing.release(task)
            self.traps.forget(task)
            self.channels.close_of(task)
        normal = any(task.kind is not TaskKind.BACKGROUND for task in self.tasks.values())
        if over and not normal and self._condition.task is Task.RUNNING:
            self._condition.task = Task.NONE
            self.traps.happen("finish", self._seen_ns)

    def forget(self) -> None:
        """Switch off: no task is there any more, every port is closed."""
        self.tasks.clear()
        self.sharing = TaskSharing()
        self.traps.clear()
        self.channels.close_all()
        self._paused = False
