"""Lets the tasks of a program go on side by side in simulated time, statement by statement."""

from collections import deque
from collections.abc import Callable
from typing import Final

from robolink_simulators.epson.condition import Condition, Task
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.data_types import Variable
from robolink_simulators.epson.spel.session import Session
from robolink_simulators.epson.spel.statements.waiting import NEVER_NS
from robolink_simulators.epson.spel.tasks.channels.numbered import NumberedChannels
from robolink_simulators.epson.spel.tasks.channels.ports import Ports
from robolink_simulators.epson.spel.tasks.compiled import CompiledFunction, SpelProject
from robolink_simulators.epson.spel.tasks.shared import TaskSharing
from robolink_simulators.epson.spel.tasks.task import (
    SpelTask,
    TaskFailure,
    TaskKind,
)
from robolink_simulators.epson.spel.tasks.task_steps import TaskSteps
from robolink_simulators.epson.spel.tasks.task_table import TaskTable
from robolink_simulators.epson.spel.tasks.traps import Traps
from robolink_simulators.epson.vision.system import VisionSystem

BURST_NS: Final = 1_000_000
"""How long a task goes on before the others are looked at, in ns, if none of them is due."""

NO_JOINT: Final = 0
"""The joint of an error that lies at none; which joint met it, no error tells here."""

_CONSOLE_LINES: Final = 2000
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
        """Begin the tasks of a program by its first; Restart takes it again.

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
        """Begin the background tasks of the project, as a controller does that was switched on."""
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
            look_ns = self.traps.next_look(self._seen_ns)
            if look_ns is not None and look_ns < due_ns and look_ns <= now_ns:
                self.session.machine.advance(look_ns)
                self._seen_ns = look_ns
                self.traps.look(look_ns)
                continue
            if task is None or due_ns > now_ns:
                break
            with self.table.robot_of(task):
                if task.waiting is None:
                    limit_ns = min(now_ns, others_ns, task.now_ns + BURST_NS)
                    self.steps.burst(task, max(limit_ns, task.now_ns))
                else:
                    self.steps.look(task, task.waiting, due_ns)
            self._seen_ns = max(self._seen_ns, due_ns, min(task.now_ns, now_ns))
            self._tidy()
            self.traps.look(self._seen_ns)
        self._seen_ns = max(self._seen_ns, now_ns)
        self.traps.look(self._seen_ns)

    def next_change(self) -> int | None:
        """Return when a task next does something by itself."""
        if not self.tasks:
            return None
        task, due_ns, _ = self.table.first_due(self._seen_ns)
        look_ns = self.traps.next_look(self._seen_ns)
        if look_ns is not None and look_ns < due_ns:
            return look_ns
        if task is None or due_ns >= NEVER_NS:
            return None
        return due_ns if task.waiting is not None else due_ns + BURST_NS

    def show(self, text: str) -> None:
        """Show what Print says."""
        self.console.append(text)
        if self.on_print is not None:
            self.on_print(text)

    def give_up(self, task: SpelTask, failure: TaskFailure) -> None:
        """End a task by an error that it did not deal with, and what such an error ends."""
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

    def end_others(self, task: SpelTask) -> None:
        """End all but background tasks and the one that asks for it (Reset Error)."""
        for other in self.tasks.values():
            if other is not task and other.kind is not TaskKind.BACKGROUND:
                self.end(other)

    def start_again(self, now_ns: int) -> None:
        """End all but background tasks, without Trap Abort, and begin what ran last (Restart).

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
        """Do what the controller's state asks for since it was looked at last."""
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
            self.table.go_on(now_ns)

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
        if over and self.table.only_background and self._condition.task is Task.RUNNING:
            self._condition.task = Task.NONE
            self.traps.happen("finish", self._seen_ns)

    def forget(self) -> None:
        """Switch off: no task is there any more, every port is closed."""
        self.tasks.clear()
        self.sharing = TaskSharing()
        self.traps.clear()
        self._main = None
        self.channels.close_all()
        self.table.paused = False
