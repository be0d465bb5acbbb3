"""Statements about tasks: Xqt, Quit, Halt, locks, signals, errors, Trap, timers.

Tasks: Xqt, Quit, Halt, Resume, TaskWait; locks, signals, and errors that a program raises.

Source: docs/reference/spel.md 4.4, 4.5.

Trap (docs/reference/spel.md 4.7).

Timers and random numbers while a program runs (docs/reference/spel.md 4.6, 11).
"""

import random
import re
from collections.abc import Callable
from typing import Final

from robolink.messages import tr
from robolink.timing import NS_PER_S
from robolink_simulators.epson.condition import RaisedError, RefusalKind, SpelRefusal, Task
from robolink_simulators.epson.spel.expressions.closures import Run
from robolink_simulators.epson.spel.expressions.values import as_integer, as_number, out_of_range
from robolink_simulators.epson.spel.line_tree import Call, TaskStatement, Trap
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.tasks.compiled_program import (
    CompiledFunction,
    JumpTarget,
    Operation,
)
from robolink_simulators.epson.spel.tasks.task import (
    EVENTS,
    HIGHEST_TRAP,
    TOLD_OF_ERROR,
    SetTrap,
    SpelTask,
    TaskKind,
)
from robolink_simulators.epson.spel.tasks.task_functions import number_of_function
from robolink_simulators.epson.spel.tasks.task_steps import require_advanced, require_unbound
from robolink_simulators.epson.spel.tasks.waits import WaitUntil
from robolink_simulators.epson.spel.tree import Expression, Name, names_in

_KINDS: Final = {
    "normal": TaskKind.NORMAL,
    "nopause": TaskKind.NO_PAUSE,
    "noemgabort": TaskKind.NO_ABORT,
}
_MAIN: Final = re.compile("main([1-9]|[1-5][0-9]|6[0-3])?")
_MAY_NOT_START: Final = frozenset({TaskKind.NO_ABORT, TaskKind.TRAP})


def _start(emitter: Emitter, node: TaskStatement) -> Operation:
    """Xqt [number,] function[(arguments)] [, kind]."""
    items = list(node.items)
    kind = TaskKind.NORMAL
    if isinstance(items[-1], Name) and items[-1].name in _KINDS:
        kind = _KINDS[items.pop().name]  # type: ignore[union-attr]
    named = items.pop() if items else None
    if not isinstance(named, Name) or named.name not in emitter.functions or len(items) > 1:
        raise emitter.fault(tr("Xqt needs a function"), expected=("Xqt 2, NAME",))
    number = emitter.run(items[0]) if items else None
    function, makers = emitter.given(named.name, named.arguments or ())

    def go(t: SpelTask) -> None:
        if t.kind in _MAY_NOT_START:
            raise SpelRefusal(RefusalKind.NOT_IN_THIS_TASK, "This task starts no other")
        wanted = None if number is None else as_integer(number(t))
        started = TaskKind.BACKGROUND if t.kind is TaskKind.BACKGROUND else kind
        t.runner.begin(function, [make(t) for make in makers], started, wanted, t.now_ns)

    return go


def _which(emitter: Emitter, item: Expression) -> Callable[[SpelTask], list[SpelTask]]:
    """Return what gives the tasks that a statement names: a number, a function, or All."""
    if isinstance(item, Name) and item.arguments is None and not emitter.scope.holds(item.name):
        if item.name == "all":
            return lambda t: [
                x for x in t.runner.tasks.values() if x.kind is not TaskKind.BACKGROUND
            ]
        if item.name in emitter.functions:
            name = item.name

            def by_name(t: SpelTask) -> list[SpelTask]:
                found = t.runner.tasks.get(number_of_function(t, name))
                return [] if found is None else [found]

            return by_name
    number = emitter.run(item)

    def by_number(t: SpelTask) -> list[SpelTask]:
        found = t.runner.tasks.get(as_integer(number(t)))
        return [] if found is None else [found]

    return by_number


def _one(emitter: Emitter, node: TaskStatement) -> Expression:
    if len(node.items) != 1:
        raise emitter.fault(tr("{word} takes one task", word=node.word))
    return node.items[0]


def _quit(emitter: Emitter, node: TaskStatement) -> Operation:
    item = _one(emitter, node)
    if item == Name("all"):
        return lambda t: t.runner.quit_all()
    which = _which(emitter, item)

    def go(t: SpelTask) -> object:
        for task in which(t):
            t.runner.end(task)
        return t.turn() if t.ended else None

    return go


def _abort_motion(emitter: Emitter, node: TaskStatement) -> Operation:
    """AbortMotion robot or All: the task that moves a robot meets an error and stops it.

    Which error depends on whether the robot moves (documented, docs/reference/spel.md 10); that
    All passes over robots that no task drives is assumed.
    """
    item = _one(emitter, node)
    number = None if item == Name("all") else emitter.run(item)

    def go(t: SpelTask) -> object:
        robots = t.runner.session.machine.robots
        wanted = None if number is None else as_integer(number(t))
        if wanted is not None and not 1 <= wanted <= len(robots):
            raise SpelRefusal(RefusalKind.ROBOT_NUMBER, f"There is no robot {wanted}")
        movers = dict(t.runner.steps.movers)
        for at in range(1, len(robots) + 1) if wanted is None else (wanted,):
            mover = movers.get(at)
            if mover is None or mover.ended:
                if wanted is None:
                    continue
                missing = RefusalKind.NO_MOVER if mover is None else RefusalKind.MOVER_ENDED
                raise SpelRefusal(missing, f"No task moves robot {at}")
            arm = robots[at - 1].arm
            kind = RefusalKind.MOTION_ABORTED if arm.moving else RefusalKind.ABORTED_AT_REST
            arm.halt(t.now_ns)
            mover.now_ns = max(mover.now_ns, t.now_ns)
            t.runner.steps.fail(mover, SpelRefusal(kind, f"AbortMotion of robot {at}"))
        return t.turn() if t.ended else None

    return go


def _halt(emitter: Emitter, node: TaskStatement) -> Operation:
    which = _which(emitter, _one(emitter, node))

    def go(t: SpelTask) -> object:
        for task in which(t):
            task.halted = True
            if task.waiting is not None:
                with task.runner.table.robot_of(task):
                    task.waiting.suspend(t.now_ns)
        return t.turn() if t.halted else None

    return go


def _resume(emitter: Emitter, node: TaskStatement) -> Operation:
    which = _which(emitter, _one(emitter, node))

    def go(t: SpelTask) -> None:
        for task in which(t):
            if task.halted:
                task.halted = False
                task.now_ns = max(task.now_ns, t.now_ns)
                if task.waiting is not None:
                    with task.runner.table.robot_of(task):
                        task.waiting.resume(t.now_ns)

    return go


def _await_task(emitter: Emitter, node: TaskStatement) -> Operation:
    which = _which(emitter, _one(emitter, node))

    def go(t: SpelTask) -> WaitUntil:
        awaited = which(t)
        return WaitUntil(lambda: all(task.ended for task in awaited), lambda: None)

    return go


def _numbers(emitter: Emitter, node: TaskStatement, most: int) -> list[Run]:
    if not 1 <= len(node.items) <= most:
        raise emitter.fault(tr("{word} takes 1 to {most} values", word=node.word, most=most))
    return [emitter.run(item) for item in node.items]


def _until(t: SpelTask, runs: list[Run]) -> int | None:
    """Return when the time is up that a statement names, or TMOut's."""
    seconds = as_number(runs[1](t)) if len(runs) > 1 else t.session.memory.wait_limit_s or None
    return None if seconds is None else t.now_ns + round(float(seconds) * NS_PER_S)


def _late(t: SpelTask, runs: list[Run]) -> None:
    """Note for TW that its own time ran out; TMOut's is an error (documented: 2281)."""
    if len(runs) < 2:
        raise SpelRefusal(RefusalKind.SHARED_WAIT_TIMED_OUT, "The time of TMOut ran out")
    _timed(t, True)


def _timed(t: SpelTask, out: bool) -> None:
    t.session.memory.timed_out = out


def _lock(emitter: Emitter, node: TaskStatement) -> Operation:
    runs = _numbers(emitter, node, 2)

    def go(t: SpelTask) -> WaitUntil:
        sharing, number = t.runner.sharing, as_integer(runs[0](t))
        sharing.may_lock(number, t)

        def take() -> None:
            sharing.lock(number, t)
            _timed(t, False)

        return WaitUntil(
            lambda: sharing.may_lock(number, t),
            take,
            end_ns=_until(t, runs),
            out_of_time=lambda: _late(t, runs),
        )

    return go


def _unlock(emitter: Emitter, node: TaskStatement) -> Operation:
    (number,) = _numbers(emitter, node, 1)
    return lambda t: t.runner.sharing.unlock(as_integer(number(t)), t)


def _signal(emitter: Emitter, node: TaskStatement) -> Operation:
    (number,) = _numbers(emitter, node, 1)
    return lambda t: t.runner.sharing.signal(as_integer(number(t)))


def _await_signal(emitter: Emitter, node: TaskStatement) -> Operation:
    runs = _numbers(emitter, node, 2)

    def go(t: SpelTask) -> WaitUntil:
        sharing, number = t.runner.sharing, as_integer(runs[0](t))
        sharing.await_signal(number, t)

        def out() -> None:
            sharing.cease(number, t)
            _late(t, runs)

        return WaitUntil(
            lambda: sharing.signalled(number, t),
            lambda: _timed(t, False),
            end_ns=_until(t, runs),
            out_of_time=out,
        )

    return go


def _raise(emitter: Emitter, node: TaskStatement) -> Operation:
    """Error [task,] number."""
    runs = _numbers(emitter, node, 2)

    def go(t: SpelTask) -> None:
        error = RaisedError(as_integer(runs[-1](t)))
        if len(runs) == 1:
            raise error
        other = t.runner.tasks.get(as_integer(runs[0](t)))
        if other is t:
            raise error
        if other is not None:
            t.runner.steps.fail(other, error)

    return go


def _pause(emitter: Emitter, node: TaskStatement) -> Operation:  # noqa: ARG001
    def go(t: SpelTask) -> object:
        t.runner.turn_to(Task.PAUSED)
        return t.turn()

    return go


def _continue(emitter: Emitter, node: TaskStatement) -> Operation:  # noqa: ARG001
    def go(t: SpelTask) -> None:
        require_advanced(t)
        t.runner.turn_to(Task.RUNNING)

    return go


def _restart(emitter: Emitter, node: TaskStatement) -> Operation:
    if node.items:
        raise emitter.fault(tr("{word} takes no arguments", word=node.word))

    def go(t: SpelTask) -> object:
        require_unbound(t)
        t.runner.start_again(t.now_ns)
        return t.turn()

    return go


def _start_main(emitter: Emitter, node: TaskStatement) -> Operation:
    """StartMain main to main63: from a background task, while no program runs."""
    item = _one(emitter, node)
    name = item.name if isinstance(item, Name) and _MAIN.fullmatch(item.name) else ""
    function = emitter.functions.get(name)
    if function is None or function.parameters:
        raise emitter.fault(tr("{word} needs main to main63", word=node.word))

    def go(t: SpelTask) -> None:
        require_advanced(t)
        if t.kind is not TaskKind.BACKGROUND or not t.runner.table.only_background:
            raise SpelRefusal(RefusalKind.NOT_IN_THIS_TASK, "Background only, one program at once")
        t.runner.begin_main(function, t.now_ns)

    return go


TASK_STATEMENTS: Final[dict[str, Callable[[Emitter, TaskStatement], Operation]]] = {
    "xqt": _start,
    "quit": _quit,
    "abortmotion": _abort_motion,
    "halt": _halt,
    "resume": _resume,
    "taskwait": _await_task,
    "synclock": _lock,
    "syncunlock": _unlock,
    "signal": _signal,
    "waitsig": _await_signal,
    "error": _raise,
    "pause": _pause,
    "cont": _continue,
    "restart": _restart,
    "startmain": _start_main,
}
"""Compilers of statements by keyword."""


def compile_trap(emitter: Emitter, node: Trap, label: JumpTarget | None) -> Operation:
    """Return what sets a trap, or takes it away.

    Raises:
        ProgramFault: It makes no sense.
    """
    function = _function(emitter, node)
    if isinstance(node.event, Name) and node.event.name in EVENTS:
        event = node.event.name

        def follow(t: SpelTask) -> None:
            require_unbound(t)
            t.runner.traps.on_event(event, function)

        return follow
    number, condition, names = emitter.run(node.event), None, names_in(node.condition)
    if node.condition is not None:
        condition = emitter.run(node.condition)
    if (condition is None) is not (node.action is None):
        raise emitter.fault(tr("a trap needs a condition and what it does"))

    def go(t: SpelTask) -> None:
        require_unbound(t)
        wanted = as_integer(number(t))
        if not 1 <= wanted <= HIGHEST_TRAP:
            raise out_of_range(f"Trap {wanted}")
        trap = None
        if condition is not None:
            starts = node.action == "xqt"
            trap = SetTrap(t, t.frame, condition, label, function, starts, names)
        t.runner.traps.set(wanted, trap)

    return go


def _function(emitter: Emitter, node: Trap) -> CompiledFunction | None:
    if node.action in (None, "goto") or node.target is None:
        return None
    function = emitter.functions.get(node.target)
    if function is not None and node.event == Name("error") and _told_of_error(function):
        return function
    if function is None or function.parameters:
        text = tr("there is no function {name} without arguments", name=node.target)
        raise emitter.fault(text)
    return function


def _told_of_error(function: CompiledFunction) -> bool:
    """Return whether a function takes the values of Trap Error."""
    count = len(TOLD_OF_ERROR)
    kinds = [slot.kind.name for slot in function.variables[1 : 1 + function.parameters]]
    alone = not any(function.by_reference) and not any(function.arrays)
    return kinds == ["integer"] * count and alone


def _values(emitter: Emitter, node: Call, least: int, most: int) -> list[Run]:
    if not least <= len(node.arguments) <= most:
        raise emitter.fault(tr("{word} takes other values", word=node.name))
    return [emitter.run(argument) for argument in node.arguments]


def _reset_timer(emitter: Emitter, node: Call) -> Operation:
    (number,) = _values(emitter, node, 1, 1)
    return lambda t: t.runner.sharing.reset_timer(as_integer(number(t)), t.present_ns)


def _reset_elapsed(emitter: Emitter, node: Call) -> Operation:
    _values(emitter, node, 0, 0)

    def go(t: SpelTask) -> None:
        t.runner.sharing.elapsed_since_ns = t.present_ns

    return go


def _randomize(emitter: Emitter, node: Call) -> Operation:
    seeds = _values(emitter, node, 0, 1)

    def go(t: SpelTask) -> None:
        seed = as_number(seeds[0](t)) if seeds else t.present_ns
        t.runner.sharing.rng = random.Random(seed)

    return go


TIMERS: Final[dict[str, Callable[[Emitter, Call], Operation]]] = {
    "tmreset": _reset_timer,
    "resetelapsedtime": _reset_elapsed,
    "randomize": _randomize,
}
"""Compilers of the statements written as calls, by name."""
