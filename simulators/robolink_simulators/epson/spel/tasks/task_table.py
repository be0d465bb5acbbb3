"""The tasks that there are: their numbers, whose turn is next, which of them a pause holds."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.statements.waiting import NEVER_NS
from robolink_simulators.epson.spel.tasks.task import SpelTask, TaskKind

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
                    due_ns = waiting.due_ns(seen_ns)
            if due_ns < first_ns:
                first, first_ns, second_ns = task, due_ns, first_ns
            elif due_ns < second_ns:
                second_ns = due_ns
        return first, first_ns, second_ns

    @contextmanager
    def robot_of(self, task: SpelTask) -> Iterator[None]:
        """Put the robot in force that a task has chosen; the command window keeps its own."""
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

    def go_on(self, now_ns: int) -> None:
        """Let them go on."""
        self.paused = False
        for task in self._pausing():
            task.now_ns = max(task.now_ns, now_ns)
            if task.waiting is not None:
                with self.robot_of(task):
                    task.waiting.go_on(now_ns)

    def _pausing(self) -> list[SpelTask]:
        return [t for t in self.tasks.values() if t.kind is TaskKind.NORMAL and not t.halted]

    @property
    def only_background(self) -> bool:
        """Whether nothing but background tasks is left, or nothing at all."""
        return all(task.kind is TaskKind.BACKGROUND for task in self.tasks.values())
