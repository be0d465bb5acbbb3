"""Functions that know the task: its number, its errors, timers, locks, ports.

Source: docs/reference/spel.md 4.4, 4.5, 4.6, 17.
"""

from collections.abc import Callable, Sequence
from typing import Final, cast

from robolink.timing import NS_PER_S
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.closures import (
    Run,
    Scope,
    Surroundings,
    check_count,
    closure,
)
from robolink_simulators.epson.spel.expressions.values import Value, as_integer, out_of_range
from robolink_simulators.epson.spel.tasks.runner import ProgramRunner
from robolink_simulators.epson.spel.tasks.task import SpelTask, TaskKind, TaskState
from robolink_simulators.epson.spel.tree import Expression, Name

TaskFunction = Callable[[SpelTask, Sequence[Value]], Value]

_TYPES: Final = {
    TaskKind.NORMAL: 0,
    TaskKind.NO_PAUSE: 1,
    TaskKind.NO_ABORT: 2,
    TaskKind.TRAP: 3,
    TaskKind.BACKGROUND: 4,
}


def _runner(t: SpelTask) -> ProgramRunner:
    runner: ProgramRunner = t.runner
    return runner


def numbered_task(t: SpelTask, number: int) -> SpelTask | None:
    """Return a task by its number; 0 is the task that asks."""
    found = t if number == 0 else _runner(t).tasks.get(number)
    return None if found is None or found.ended else found


def _of_failure(part: str, none: Value) -> TaskFunction:
    def tell(t: SpelTask, arguments: Sequence[Value]) -> Value:
        asked = numbered_task(t, as_integer(arguments[0]) if arguments else 0)
        if asked is None:
            raise SpelRefusal(RefusalKind.TASK_GONE, "The task has already ended")
        return none if asked.failure is None else cast(Value, getattr(asked.failure, part))

    return tell


def _failed_task(t: SpelTask, _: Sequence[Value]) -> Value:
    return 0 if t.failure is None else t.failure.task


def _task_info(t: SpelTask, arguments: Sequence[Value]) -> Value:
    number, index = (as_integer(argument) for argument in arguments)
    asked = numbered_task(t, number)
    if not 0 <= index <= 7:
        raise out_of_range(f"TaskInfo({number}, {index})")
    if asked is None:
        return -1 if index == 3 else 0
    told: dict[int, Value] = {
        0: asked.task_number,
        1: int(asked.kind is not TaskKind.BACKGROUND),
        2: _TYPES[asked.kind],
        3: int(asked.state),
        4: asked.session.memory.timed_out,
        6: t.session.machine.robot_number,
        7: t.session.machine.robot_number,
    }
    return told.get(index, 0)


def _task_text(t: SpelTask, arguments: Sequence[Value]) -> Value:
    number, index = (as_integer(argument) for argument in arguments)
    asked = numbered_task(t, number)
    if asked is None:
        return ""
    frame = asked.frame
    place = frame.function.places[max(0, asked.pc - 1)]
    texts = {0: asked.name, 1: "", 2: frame.function.spelled, 3: str(place.line)}
    return texts.get(index, "")


def _state(t: SpelTask, arguments: Sequence[Value]) -> Value:
    asked = numbered_task(t, as_integer(arguments[0]))
    return int(TaskState.NONE if asked is None else asked.state)


def _done(t: SpelTask, arguments: Sequence[Value]) -> Value:
    return numbered_task(t, as_integer(arguments[0])) is None


def _random(t: SpelTask, arguments: Sequence[Value]) -> Value:
    highest = float(cast(float, arguments[0])) if arguments else 1.0
    return _runner(t).sharing.rng.uniform(0.0, highest)


def _elapsed(t: SpelTask, _: Sequence[Value]) -> Value:
    return round((t.present_ns - _runner(t).sharing.elapsed_since_ns) / NS_PER_S, 3)


def _lines_left(t: SpelTask, arguments: Sequence[Value]) -> Value:
    number = as_integer(arguments[0])
    return _runner(t).channels.of(number).lines(number, t)


TASK_FUNCTIONS: Final[dict[str, tuple[range, TaskFunction]]] = {
    "mytask": (range(1), lambda t, _: t.task_number),
    "taskstate": (range(1, 2), _state),
    "taskdone": (range(1, 2), _done),
    "taskinfo": (range(2, 3), _task_info),
    "taskinfo$": (range(2, 3), _task_text),
    "taskreserve": (range(1), lambda t, _: _runner(t).table.free_number(TaskKind.NORMAL)),
    "synclockreserve": (range(1), lambda t, _: _runner(t).sharing.reserve_lock()),
    "err": (range(2), _of_failure("number", 0)),
    "erl": (range(2), _of_failure("line", 0)),
    "erf$": (range(2), _of_failure("function", "")),
    "era": (range(2), lambda *_: 0),
    "errb": (range(2), _of_failure("robot", 0)),
    "ert": (range(1), _failed_task),
    "tmr": (range(1, 2), lambda t, a: _runner(t).sharing.timer_s(as_integer(a[0]), t.present_ns)),
    "elapsedtime": (range(1), _elapsed),
    "rnd": (range(1, 2), _random),
    "chknet": (range(1, 2), lambda t, a: _runner(t).ports.waiting_bytes(as_integer(a[0]), t)),
    "chkcom": (range(1, 2), lambda t, a: _runner(t).ports.waiting_bytes(as_integer(a[0]), t)),
    "opencom": (range(1, 2), lambda t, a: _runner(t).ports.owner_number(as_integer(a[0]))),
    "lof": (range(1, 2), _lines_left),
    "eof": (range(1, 2), lambda t, a: _runner(t).channels.files.at_end(as_integer(a[0]), t)),
    "freefile": (range(1), lambda t, _: _runner(t).channels.files.free_number()),
    "opennet": (range(1, 2), lambda t, a: _runner(t).ports.owner_number(as_integer(a[0]))),
}
"""Functions by name, each with its allowed numbers of arguments."""

_OF_TASKS: Final = frozenset({"taskstate", "taskdone", "taskinfo", "taskinfo$"})


def task_function(name: str, arguments: Sequence[Expression] | None, scope: Scope) -> Run | None:
    """Return a function about tasks, ``None`` if a name is none.

    Raises:
        Refusal: It does not take so many arguments.
    """
    if name not in TASK_FUNCTIONS:
        return None
    counts, function = TASK_FUNCTIONS[name]
    given = arguments or ()
    check_count(name, given, counts)
    inner = [
        _task_number(argument, scope)
        if name in _OF_TASKS and not index
        else closure(argument, scope)
        for index, argument in enumerate(given)
    ]
    return lambda t: function(cast(SpelTask, t), [run(t) for run in inner])


def _task_number(argument: Expression, scope: Scope) -> Run:
    """Return the number of a task that is told by its number or its function; -1 for none."""
    if isinstance(argument, Name) and argument.arguments is None:
        own = scope.named(argument.name, None)
        if own is not None:
            return own
        wanted = argument.name

        def by_name(t: Surroundings) -> Value:
            return number_of_function(cast(SpelTask, t), wanted)

        return by_name
    return closure(argument, scope)


def number_of_function(t: SpelTask, name: str) -> int:
    """Return the number of the task that was started with a function, -1 for none.

    Raises:
        Refusal: There is no such function.
    """
    if name not in _runner(t).project.functions:
        raise SpelRefusal(RefusalKind.NO_SUCH_FUNCTION, f"There is no function {name}")
    for task in _runner(t).tasks.values():
        if task.frames[0].function.name == name and not task.ended:
            return task.task_number
    return -1
