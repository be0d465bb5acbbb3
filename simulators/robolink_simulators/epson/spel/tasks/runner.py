"""Runs the tasks of a program side by side in simulated time, statement by statement."""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from robolink.timing import NS_PER_S, Clock, SystemClock
from robolink_simulators.epson.condition import Condition, RefusalKind, SpelRefusal, Task
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.spel.expressions.values import Variable
from robolink_simulators.epson.spel.session import Session
from robolink_simulators.epson.spel.statements.conditions import NEVER_NS
from robolink_simulators.epson.spel.tasks.channels import NumberedChannels
from robolink_simulators.epson.spel.tasks.compiled_program import CompiledFunction, SpelProject
from robolink_simulators.epson.spel.tasks.ports import Ports
from robolink_simulators.epson.spel.tasks.shared_state import TaskSharing
from robolink_simulators.epson.spel.tasks.task import (
    SpelTask,
    TaskFailure,
    TaskKind,
    Traps,
)
from robolink_simulators.epson.spel.tasks.task_steps import TaskSteps
from robolink_simulators.epson.vision_system import VisionSystem

_NORMAL: Final = range(1, 33)
_BACKGROUND: Final = range(65, 81)
_TRAPS: Final = range(257, 268)

MOST_IN_BACKGROUND: Final = len(_BACKGROUND)


class TaskTable:
    """The tasks of a controller.

    Args:
        machine: Whose robots they choose.

    Attributes:
        tasks: Those that are not over, by their numbers.
        paused: Whether tasks that a pause holds are held.
    """

    def __init__(self, machine: Machine) -> None:
        self.tasks: dict[int, SpelTask] = {}
        self.paused = False
        self._machine = machine

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

    def first_due(self, seen_ns: int) -> tuple[SpelTask | None, int, int]:
        """Return the task that is due first, when, and when the next one after it is.

        Args:
            seen_ns: Until when everything has been done.
        """
        first, first_ns, second_ns = None, NEVER_NS, NEVER_NS
        for task in self.tasks.values():
            if task.halted or (self.paused and task.held_by_pause):
                continue
            waiting = task.waiting
            due_ns = task.now_ns
            if waiting is not None:
                with self.robot_of(task):
                    due_ns = waiting.next_poll_ns(seen_ns)
            if due_ns < first_ns:
                first, first_ns, second_ns = task, due_ns, first_ns
            elif due_ns < second_ns:
                second_ns = due_ns
        return first, first_ns, second_ns

    @contextmanager
    def robot_of(self, task: SpelTask) -> Iterator[None]:
        """Make a task's robot the current one; the command window keeps its own."""
        machine = self._machine
        kept, machine.robot_number = machine.robot_number, task.robot_number
        try:
            yield
        finally:
            task.robot_number, machine.robot_number = machine.robot_number, kept

    def pause(self, now_ns: int) -> None:
        """Hold the tasks that a pause holds."""
        self.paused = True
        for task in self._pausing():
            with self.robot_of(task):
                task.pause(now_ns)

    def resume(self, now_ns: int) -> None:
        """Continue them."""
        self.paused = False
        for task in self._pausing():
            task.now_ns = max(task.now_ns, now_ns)
            if task.waiting is not None:
                with self.robot_of(task):
                    task.waiting.resume(now_ns)

    def _pausing(self) -> list[SpelTask]:
        return [t for t in self.tasks.values() if t.kind is TaskKind.NORMAL and not t.halted]

    @property
    def only_background(self) -> bool:
        """Whether only background tasks are left, or nothing."""
        return all(task.kind is TaskKind.BACKGROUND for task in self.tasks.values())


BURST_NS: Final = 1_000_000
"""Time in ns for which a task runs before the others get their turn, if none of them is due."""

NO_JOINT: Final = 0
"""Joint number of an error that concerns no joint. No error here reports the joint it occurred at.
"""

_CONSOLE_LINES: Final = 2000
TraceHook = Callable[[SpelTask, str, int, str], None]
"""Called before each statement with the task, the file, the line number and the text."""


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
        table: The tasks, and whose turn it is.
        tasks: Those that are not over, by their numbers.
        steps: What tasks do, one operation after the other.
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
        self.table = TaskTable(session.machine)
        self.tasks = self.table.tasks
        self.steps = TaskSteps(self, session)
        self.console: deque[str] = deque(maxlen=_CONSOLE_LINES)
        self.on_print: Callable[[str], None] | None = None
        self.on_statement: TraceHook | None = None
        self.failure: TaskFailure | None = None
        self.sharing = TaskSharing()
        self.traps = Traps(self)
        self.vision: VisionSystem | None = None
        self._condition = condition
        self._main: CompiledFunction | None = None
        self._stopped_by: str | None = None
        self._seen_ns = 0

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
        self.advance(now_ns)
        return self.begin_main(function, now_ns)

    def begin_main(self, function: CompiledFunction, now_ns: int) -> SpelTask:
        """Begin the tasks of a program with its first; Restart uses it again.

        Raises:
            Refusal: No task is free.
        """
        if self.session.options.globals_at_start == "cleared":
            self.project.clear_globals()
        self.traps.clear()
        self._main, self.failure = function, None
        self._condition.task = Task.RUNNING
        return self.begin(function, [], TaskKind.NORMAL, None, now_ns)

    def begin_background(self, now_ns: int) -> None:
        """Begin the project's background tasks, as a controller does after it is switched on."""
        for function in self.project.background:
            self.begin(function, [], TaskKind.BACKGROUND, None, now_ns)

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
        task = SpelTask(self.table.free_number(kind, number), kind, self, self.session, now_ns)
        task.enter(function, given, 0)
        self.tasks[task.task_number] = task
        return task

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""
        self._heed()
        while self.tasks:
            task, due_ns, others_ns = self.table.first_due(self._seen_ns)
            poll_ns = self.traps.next_poll_ns(self._seen_ns)
            if poll_ns is not None and poll_ns < due_ns and poll_ns <= now_ns:
                self.session.machine.advance(poll_ns)
                self._seen_ns = poll_ns
                self.traps.poll(poll_ns)
                continue
            if task is None or due_ns > now_ns:
                break
            with self.table.robot_of(task):
                if task.waiting is None:
                    limit_ns = min(now_ns, others_ns, task.now_ns + BURST_NS)
                    self.steps.burst(task, max(limit_ns, task.now_ns))
                else:
                    self.steps.poll(task, task.waiting, due_ns)
            self._seen_ns = max(self._seen_ns, due_ns, min(task.now_ns, now_ns))
            self._tidy()
            self.traps.poll(self._seen_ns)
        self._seen_ns = max(self._seen_ns, now_ns)
        self.traps.poll(self._seen_ns)

    def next_change(self) -> int | None:
        """Return when a task next does something by itself."""
        if not self.tasks:
            return None
        task, due_ns, _ = self.table.first_due(self._seen_ns)
        poll_ns = self.traps.next_poll_ns(self._seen_ns)
        if poll_ns is not None and poll_ns < due_ns:
            return poll_ns
        if task is None or due_ns >= NEVER_NS:
            return None
        return due_ns if task.waiting is not None else due_ns + BURST_NS

    def show(self, text: str) -> None:
        """Show what Print prints."""
        self.console.append(text)
        if self.on_print is not None:
            self.on_print(text)

    def give_up(self, task: SpelTask, failure: TaskFailure) -> None:
        """End a task by an unhandled error, and what such an error ends."""
        task.ended = True
        self.failure = failure
        self.session.machine.halt(task.now_ns)
        stood = self._condition.task is Task.NONE
        self._condition.raise_error(failure.number)
        self._condition.failure = (failure.number % 10_000, str(failure))
        self._stopped_by = "abort"
        if not stood:  # a task of Trap Abort that fails starts none (documented)
            self.traps.happen("error", task.now_ns, (failure.number, failure.robot, NO_JOINT))
        self._stop(background=True)

    def end(self, task: SpelTask) -> None:
        """End a task, and stop what it moves (Quit)."""
        for number, mover in self.steps.movers.items():
            if mover is task:
                self.session.machine.robots[number - 1].arm.halt(self._seen_ns)
        task.ended = True

    def turn_to(self, state: Task) -> None:
        """Pause or continue, at a task's request."""
        if self._condition.task is not Task.NONE:
            self._condition.task = state
            self._heed()

    def quit_all(self) -> None:
        """End all except background tasks, and reset the motion parameters."""
        for task in self.tasks.values():
            if task.kind is not TaskKind.BACKGROUND:
                self.end(task)
        self.session.machine.reset_motion_parameters()

    def end_others(self, task: SpelTask) -> None:
        """End all except background tasks and the requesting one (Reset Error)."""
        for other in self.tasks.values():
            if other is not task and other.kind is not TaskKind.BACKGROUND:
                self.end(other)

    def start_again(self, now_ns: int) -> None:
        """End all except background tasks, without Trap Abort, and begin what ran last (Restart).

        Raises:
            Refusal: The emergency stop or an error stands, or nothing has run yet.
        """
        if self._condition.flags().emergency_stop or self._condition.error:
            raise SpelRefusal(RefusalKind.EMERGENCY_STOP, "Reset it first")
        if self._main is None:
            raise SpelRefusal(RefusalKind.NO_SUCH_FUNCTION, "No program has run")
        self.quit_all()
        self._condition.task, self.table.paused = Task.NONE, False
        self._tidy()
        self.begin_main(self._main, now_ns)

    def _heed(self) -> None:
        """React to changes of the controller's state since the last check."""
        state, now_ns = self._condition.task, self._seen_ns
        if state is not Task.NONE or not self.tasks:
            self._stopped_by = None
        if not self.tasks:
            self.table.paused = False
            return
        if state is Task.NONE and not self.table.only_background:
            event = "emergency" if self._condition.flags().emergency_stop else "abort"
            before, self._stopped_by = self._stopped_by, event
            if event != before and (before is None or event == "emergency"):
                self._stop(background=event == "emergency" or self._condition.error)
                self.traps.happen(event, now_ns)
                self._tidy()
        elif state is Task.PAUSED and not self.table.paused:
            self.table.pause(now_ns)
            self.traps.happen("sgopen" if self._condition.guard_open else "pause", now_ns)
        elif state is Task.RUNNING and self.table.paused:
            self.table.resume(now_ns)

    def _stop(self, *, background: bool) -> None:
        """End the normal tasks; with ``background``, those continue that stops do not affect."""
        self.session.machine.halt(self._seen_ns)
        kept = {TaskKind.BACKGROUND}
        if background:
            kept |= {TaskKind.NO_ABORT, TaskKind.TRAP}
        for task in self.tasks.values():
            if task.kind not in kept:
                task.ended = True

    def _tidy(self) -> None:
        """Forget finished tasks, and what they held."""
        over = [task for task in self.tasks.values() if task.ended]
        for task in over:
            del self.tasks[task.task_number]
            self.sharing.release(task)
            self.traps.forget(task)
            self.channels.close_of(task)
        if over and self.table.only_background and self._condition.task is Task.RUNNING:
            self._condition.task = Task.NONE
            self.traps.happen("finish", self._seen_ns)

    def forget(self) -> None:
        """Switch off: no task is left, every port is closed."""
        self.tasks.clear()
        self.sharing = TaskSharing()
        self.traps.clear()
        self._main = None
        self.channels.close_all()
        self.table.paused = False


_LONGEST_NAP_NS: Final = 20_000_000

Advance = Callable[[int], None]
"""Advances a controller's simulated time to an instant."""


def run_to_end(
    runner: ProgramRunner,
    advance: Advance,
    next_change: Callable[[], int | None],
    *,
    most_s: float,
    clock: Clock | None = None,
) -> bool:
    """Let time pass until every task has ended; return whether that came in time.

    Nobody waits for simulated time: it goes on to what happens next. Only while a port is open
    does it pass as fast as outside, because another program may have to answer.

    Args:
        runner: What runs; it was started.
        advance: Lets the controller's time pass.
        next_change: Tells when something happens next.
        most_s: Simulated seconds after which it is left as it is.
        clock: The time outside.
    """
    outside = clock or SystemClock()
    end_ns = runner.now_ns + round(most_s * NS_PER_S)
    behind_ns = outside.now_ns() - runner.now_ns
    while runner.tasks:
        change_ns = next_change()
        if change_ns is None or change_ns > end_ns:
            return False
        if runner.ports.in_use:
            present_ns = outside.now_ns() - behind_ns
            if change_ns > present_ns:
                nap_ns = min(change_ns - present_ns, _LONGEST_NAP_NS)
                outside.sleep(nap_ns / NS_PER_S)
                change_ns = min(change_ns, present_ns + nap_ns)
        else:
            behind_ns = outside.now_ns() - change_ns
        advance(change_ns)
    return True
