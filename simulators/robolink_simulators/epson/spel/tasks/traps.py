"""Trap: what interrupts a task when something happens (docs/reference/spel.md 4.7)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from robolink_simulators.epson.refusals import SpelRefusal
from robolink_simulators.epson.spel.expressions.closures import Run
from robolink_simulators.epson.spel.expressions.data_types import Variable
from robolink_simulators.epson.spel.expressions.values import truth
from robolink_simulators.epson.spel.statements.waiting import LOOK_NS, follows_robot
from robolink_simulators.epson.spel.tasks.compiled import CompiledFunction, JumpTarget
from robolink_simulators.epson.spel.tasks.task import CallFrame, SpelTask, TaskKind

EVENTS: Final = frozenset({"emergency", "error", "pause", "sgopen", "sgclose", "abort", "finish"})
HIGHEST_TRAP: Final = 4
TOLD_OF_ERROR: Final = ("number", "robot", "joint")
"""What a function of Trap Error may take: three Integer by value (p. 855)."""


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
        """Set a trap, or take it away."""
        if trap is None:
            self._conditions.pop(number, None)
        else:
            self._conditions[number] = trap

    def on_event(self, event: str, function: CompiledFunction | None) -> None:
        """Say what an event starts; nothing any more without a function."""
        if function is None:
            self._events.pop(event, None)
        else:
            self._events[event] = function

    def forget(self, task: SpelTask) -> None:
        """Take away the traps of a task that is over, but those that start another (documented)."""
        self._conditions = {
            n: trap
            for n, trap in self._conditions.items()
            if trap.task is not task or (trap.starts and self._runner.tasks)
        }

    def clear(self) -> None:
        """Take all away."""
        self._conditions.clear()
        self._events.clear()

    def happen(self, event: str, now_ns: int, about: Sequence[int] = ()) -> None:
        """Start what an event starts.

        Args:
            event: What happens.
            now_ns: When.
            about: What the function is told of it, if it asks for that.
        """
        function = self._events.get(event)
        if function is not None:
            self._start(function, now_ns, about)

    def look(self, now_ns: int) -> None:
        """Fire the traps whose condition holds; each fires once (documented)."""
        for number, trap in list(self._conditions.items()):
            if trap.task.ended and not trap.starts:
                continue
            try:
                holds = truth(trap.condition(trap.task))
            except SpelRefusal:
                continue
            if holds and self._conditions.pop(number, None) is not None:
                self._fire(trap, now_ns)

    def next_look(self, seen_ns: int) -> int | None:
        """Return when to look again because a robot moves, ``None`` where nothing asks for that."""
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
