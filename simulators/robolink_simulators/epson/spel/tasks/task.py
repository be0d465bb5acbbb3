"""One task: its place in which function, its memory, and what interrupts it.

Trap: what interrupts a task when something happens (docs/reference/spel.md 4.7).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum, StrEnum
from typing import Any, Final

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.closures import Run
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.values import Variable, truth
from robolink_simulators.epson.spel.session import Session, WindowMemory
from robolink_simulators.epson.spel.statements.conditions import LOOK_NS, follows_robot
from robolink_simulators.epson.spel.tasks.compiled_program import (
    CompiledFunction,
    JumpTarget,
    Operation,
)
from robolink_simulators.epson.spel.tasks.waits import (
    StatementWait,
    TaskWait,
    WaitSequence,
    WaitUntil,
)

DEEPEST_CALL: Final = 200
"""Deepest nesting of calls of functions, or of subroutines in a function (no limit is documented;
assumed).
"""


class TaskKind(StrEnum):
    """How a task continues when the controller stops (docs/reference/spel.md 4.5)."""

    NORMAL = "normal"
    NO_PAUSE = "nopause"
    NO_ABORT = "noemgabort"
    TRAP = "trap"
    BACKGROUND = "background"


class TaskState(IntEnum):
    """The values of TaskState."""

    NONE = 0
    RUNNING = 1
    WAITING = 2
    HALTED = 3
    PAUSED = 4
    FAILED = 5


@dataclass(slots=True)
class CallFrame:
    """A function in progress.

    Attributes:
        function: Which.
        pc: Where it goes on when what it called has returned.
        variables: Its own.
        results: What functions gave that it called, and ends of its loops.
        slot: Where the caller keeps the result.
        handler: Where errors are dealt with.
        failed_pc: The operation whose error is being dealt with.
        returns: Where Return goes.
    """

    function: CompiledFunction
    variables: list[Variable]
    slot: int
    pc: int = 0
    results: list[Any] = field(default_factory=list)
    handler: JumpTarget | None = None
    failed_pc: int | None = None
    returns: list[int] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class TaskFailure:
    """An error of a task.

    Attributes:
        number: What Err tells.
        text: The controller's sentence.
        task: Number of the task.
        function: Its function.
        file: Its file.
        line: Line in the file.
        robot: Number of the robot whose motion met it, 0 for none.
    """

    number: int
    text: str
    task: int
    function: str
    file: str
    line: int
    robot: int = 0

    def __str__(self) -> str:
        where = f"{self.file}:{self.line} in {self.function} of task {self.task}"
        return f"{self.text} at {where}".replace(",", ";").replace('"', "'")


class SpelTask(Evaluator):
    """A task; the runner continues it.

    Attributes:
        task_number: 1 to 32, 65 to 80 in the background, 257 to 267 for traps.
        robot_number: The robot that it has chosen with Robot n; at first that of whoever
            started it (assumed).
        kind: How it takes stops.
        runner: What lets it go on: a ``ProgramRunner``, which makes tasks and is not known here.
        operations: Those of the function that runs.
        pc: Which of them is next.
        frame: The function that runs.
        now_ns: Until when it has come.
        waiting: What it waits for, or the statement that takes time.
        halted: Whether Halt has stopped it.
        ended: Whether it is over.
        failure: Its last error.
        loop_passes: Passes of loops since it gave others a turn.
    """

    def __init__(
        self,
        number: int,
        kind: TaskKind,
        runner: Any,  # noqa: ANN401 - see above
        session: Session,
        now_ns: int,
    ) -> None:
        super().__init__(replace(session, memory=WindowMemory()))
        self.blends = True
        self.task_number = number
        self.robot_number: int = session.machine.robot_number
        self.kind = kind
        self.runner = runner
        self.operations: list[Operation] = []
        self.pc = 0
        self.now_ns = now_ns
        self.started_ns = now_ns
        self.frames: list[CallFrame] = []
        self.waiting: TaskWait | None = None
        self.halted = False
        self.ended = False
        self.failure: TaskFailure | None = None
        self.loop_passes = 0

    @property
    def frame(self) -> CallFrame:
        """The function that runs."""
        return self.frames[-1]

    @property
    def held_by_pause(self) -> bool:
        """Whether nothing of it continues in a pause; QP Off lets a motion in progress end."""
        ends = isinstance(self.waiting, StatementWait) and self.waiting.finishing
        return self.kind is TaskKind.NORMAL and not ends

    def pause(self, now_ns: int) -> None:
        """Hold what it waits for: a motion stops at once, with QP Off it ends first.

        Source: docs/reference/spel.md 7.2.
        """
        if self.waiting is None:
            return
        waiting = self.waiting
        if isinstance(waiting, WaitSequence):
            waiting = waiting.present
        if (
            isinstance(waiting, StatementWait)
            and waiting.execution.travels
            and not self.session.machine.robot.drives.is_on("qp")
        ):
            waiting.finishing = True
        else:
            waiting.suspend(now_ns)

    def carries(self, statement: object) -> bool:
        """Return whether it still waits for a statement that it has begun."""
        waiting = self.waiting
        if isinstance(waiting, WaitSequence):
            waiting = waiting.present
        waits = isinstance(waiting, StatementWait) and waiting.execution is statement
        return waits and not self.ended

    @property
    def present_ns(self) -> int:
        """The instant of what is being carried out, also inside ``!...!``."""
        return max(self.now_ns, self.session.machine.arm.now_ns)

    @property
    def state(self) -> TaskState:
        """Its TaskState."""
        if self.ended:
            return TaskState.NONE
        if self.halted:
            return TaskState.HALTED
        return TaskState.RUNNING if self.waiting is None else TaskState.WAITING

    @property
    def name(self) -> str:
        """The function that it was started with."""
        return self.frames[0].function.spelled if self.frames else ""

    def enter(self, function: CompiledFunction, given: list[Variable], slot: int) -> None:
        """Continue in a function.

        Raises:
            Refusal: Functions call each other too deeply.
        """
        if len(self.frames) >= DEEPEST_CALL:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "Functions call too deeply")
        first, rest = function.variables[:1], function.variables[1 + len(given) :]
        variables = [Variable(slot_.kind, slot_.bounds) for slot_ in (*first, *rest)]
        variables[1:1] = given
        if self.frames:
            self.frames[-1].pc = self.pc
        frame = CallFrame(function, variables, slot, results=[None] * function.result_slots)
        self.frames.append(frame)
        self._take_up(frame)

    def leave(self) -> None:
        """Return from the function; the task ends with its first one."""
        frame = self.frames.pop()
        if not self.frames:
            self.frames.append(frame)
            self.ended = True
            return
        caller = self.frames[-1]
        caller.results[frame.slot] = frame.variables[0].values[0]
        self._take_up(caller)

    def turn(self) -> TaskWait:
        """Return a wait that ends at once, after the other tasks have had their turn."""
        return WaitUntil(lambda: True, lambda: None)

    def write_to(self, channel: int, text: str, *, ends: bool) -> None:
        """Print to a port or a file.

        Raises:
            Refusal: It is not open, or not this task's.
        """
        self.runner.channels.of(channel).write(channel, text, self, ends=ends)

    def unwind(self, depth: int, pc: int) -> None:
        """Continue at an operation of a function in progress, leaving those that it called."""
        del self.frames[depth + 1 :]
        self.frames[depth].pc = pc
        self._take_up(self.frames[depth])

    def _take_up(self, frame: CallFrame) -> None:
        self.operations = frame.function.operations
        self.pc = frame.pc
        self.variables = frame.variables
        self.results = frame.results
        self.scope = frame.function.scope

    def count_pass(self) -> None:
        """Note a pass of a loop.

        Raises:
            Refusal: Too many without a turn for others (documented: 2556).
        """
        self.loop_passes += 1
        if self.loop_passes > self.session.options.loop_passes:
            self.loop_passes = 0
            raise SpelRefusal(RefusalKind.EXCESSIVE_LOOP, "Excessive loop detected")

    def fail(self, number: int, text: str, robot: int = 0) -> bool:
        """Handle an error: go to its handler; return whether there is one.

        Args:
            number: What Err tells.
            text: The controller's sentence.
            robot: The robot whose motion met it, 0 for none.
        """
        frame = self.frame
        place = frame.function.places[self.pc - 1]
        self.frame.pc = self.pc
        self.failure = TaskFailure(
            number, text, self.task_number, frame.function.spelled, place.file, place.line, robot
        )
        self.session.memory.last_error = number
        for depth in range(len(self.frames) - 1, -1, -1):
            candidate = self.frames[depth]
            if candidate.handler is not None and candidate.failed_pc is None:
                candidate.failed_pc = candidate.pc - 1
                self.unwind(depth, candidate.handler.pc)
                return True
        return False


EVENTS: Final = frozenset({"emergency", "error", "pause", "sgopen", "sgclose", "abort", "finish"})
HIGHEST_TRAP: Final = 4
TOLD_OF_ERROR: Final = ("number", "robot", "joint")
"""Parameters that a function of Trap Error may have: three Integer by value (p. 855)."""


@dataclass(frozen=True, slots=True)
class SetTrap:
    """A trap that is set.

    Attributes:
        task: Whose it is.
        frame: The function that set it.
        condition: When it fires.
        label: Where that task goes on, for GoTo.
        function: What it calls or starts, for Call and Xqt.
        starts: Whether the function is started as a task.
        names: What its condition asks for.
    """

    task: SpelTask
    frame: CallFrame
    condition: Run
    label: JumpTarget | None
    function: CompiledFunction | None
    starts: bool
    names: frozenset[str] = frozenset()


class Traps:
    """The traps of a controller.

    Args:
        runner: What starts tasks: a ``ProgramRunner``, which makes the traps.
    """

    def __init__(self, runner: Any) -> None:  # noqa: ANN401
        self._runner = runner
        self._conditions: dict[int, SetTrap] = {}
        self._events: dict[str, CompiledFunction] = {}

    def set(self, number: int, trap: SetTrap | None) -> None:
        """Set a trap, or remove it."""
        if trap is None:
            self._conditions.pop(number, None)
        else:
            self._conditions[number] = trap

    def on_event(self, event: str, function: CompiledFunction | None) -> None:
        """Set the function that an event starts; without one, nothing."""
        if function is None:
            self._events.pop(event, None)
        else:
            self._events[event] = function

    def forget(self, task: SpelTask) -> None:
        """Remove the traps of a finished task, except those that start another (documented)."""
        self._conditions = {
            n: trap
            for n, trap in self._conditions.items()
            if trap.task is not task or (trap.starts and self._runner.tasks)
        }

    def clear(self) -> None:
        """Remove all."""
        self._conditions.clear()
        self._events.clear()

    def happen(self, event: str, now_ns: int, about: Sequence[int] = ()) -> None:
        """Start the function of an event.

        Args:
            event: What happens.
            now_ns: When.
            about: What the function is told of it, if it asks for that.
        """
        function = self._events.get(event)
        if function is not None:
            self._start(function, now_ns, about)

    def poll(self, now_ns: int) -> None:
        """Fire the traps whose condition is true; each fires once (documented)."""
        for number, trap in list(self._conditions.items()):
            if trap.task.ended and not trap.starts:
                continue
            try:
                holds = truth(trap.condition(trap.task))
            except SpelRefusal:
                continue
            if holds and self._conditions.pop(number, None) is not None:
                self._fire(trap, now_ns)

    def next_poll_ns(self, seen_ns: int) -> int | None:
        """Return when to check again because a robot moves, ``None`` if nothing needs that."""
        machine = self._runner.session.machine
        following = any(follows_robot(trap.names, machine) for trap in self._conditions.values())
        return seen_ns + LOOK_NS if following and machine.moving else None

    def _fire(self, trap: SetTrap, now_ns: int) -> None:
        task = trap.task
        if trap.function is not None and trap.starts:
            self._start(trap.function, now_ns)
            return
        if task.waiting is not None:
            with self._runner.table.robot_of(task):
                task.waiting.suspend(now_ns)
            task.waiting = None
        task.now_ns = max(task.now_ns, now_ns)
        if trap.label is not None and trap.frame in task.frames:
            task.unwind(task.frames.index(trap.frame), trap.label.pc)
        elif trap.function is not None:
            task.enter(trap.function, [], task.frame.function.result_slots - 1)

    def _start(self, function: CompiledFunction, now_ns: int, about: Sequence[int] = ()) -> None:
        asked = function.parameters
        given = [Variable(slot.kind) for slot in function.variables[1 : 1 + asked]]
        for variable, value in zip(given, about, strict=bool(given)):
            variable.values[0] = value
        try:
            self._runner.begin(function, given, TaskKind.TRAP, None, now_ns)
        except SpelRefusal:
            return
