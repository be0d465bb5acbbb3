"""Functions that report the state of the controller, its errors and its waits.

Source: docs/reference/spel.md 4.4, 9.

That the command window may call those which programs may call from special tasks only is left
open; they are answered (the default of docs/reference/spel.md 4.4).
"""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.condition import Mode, Task
from robolink_simulators.epson.memory.robot import DrivenRobot
from robolink_simulators.epson.spel.expressions.values import (
    Value,
    as_integer,
    as_text,
    out_of_range,
)
from robolink_simulators.epson.spel.session import Session

Arguments = Sequence[Value]
StateFunction = Callable[[Session, Arguments], Value]

_VERSION: Final = {5: 5_040_000, 7: 7_050_400, 8: 8_010_000}
"""CtrlInfo(9) by RC+ version: major, minor, revision and build, two digits each except the first.
"""

_HIGHEST_LANGUAGE: Final = 6


def _error_text(session: Session, arguments: Arguments) -> Value:
    number = as_integer(arguments[0])
    if len(arguments) > 1 and not 0 <= as_integer(arguments[1]) <= _HIGHEST_LANGUAGE:
        raise out_of_range("No such language")
    for error in session.user_errors.values():
        if error.number == number and error.text:
            return error.text
    return session.messages.get(number, f"Error {number}")


def _system_error(session: Session, arguments: Arguments) -> Value:
    """Return the controller's error, or its warning for 1."""
    condition = session.condition
    wanted_error = not arguments or as_integer(arguments[0]) == 0
    return condition.code if condition.error is wanted_error else 0


def _controller(session: Session, arguments: Arguments) -> Value:
    """Return CtrlInfo(i); what is not simulated is 0."""
    condition, options = session.condition, session.options
    flags = condition.flags()
    ready = (
        flags.ready
        | flags.running << 1
        | flags.paused << 2
        | flags.emergency_stop << 8
        | flags.safeguard << 9
        | flags.error << 10
        | flags.serious_error << 11
        | flags.warning << 12
        | any(robot.recovers_to is not None for robot in session.machine.robots) << 13
        | any(robot.recovering for robot in session.machine.robots) << 14
    )
    told = {
        1: ready,
        4: int(options.dry_run),
        5: session.machine.control_device,
        6: len(session.machine.robots),
        7: 1,
        9: _VERSION[options.rc_plus],
    }
    index = as_integer(arguments[0])
    if not 0 <= index <= 16:
        raise out_of_range(f"CtrlInfo({index})")
    return told.get(index, 0)


def _engaged_bits(axes: int) -> int:
    """Return the bits of Stat(1) for motors that are on: J4 to J1 from bit 8, J6, J5 after them."""
    return 0b1111 << 8 if axes == 4 else 0b111111 << 8


def _stat(session: Session, arguments: Arguments) -> Value:
    """Return Stat(0) and Stat(1); further tasks are not simulated."""
    condition, machine = session.condition, session.machine
    running, paused = condition.task is Task.RUNNING, condition.task is Task.PAUSED
    words = {
        0: running
        | running << 16
        | paused << 17
        | condition.error << 18
        | (condition.mode is Mode.TEACH) << 19
        | condition.flags().emergency_stop << 20
        | (not machine.power_high) << 21
        | (not condition.guard_open) << 22
        | 1 << 23
        | (condition.mode is Mode.TEST) << 26,
        1: machine.sensed
        | machine.till_met << 1
        | machine.motors_on << 4
        | machine.robot.at_home << 5
        | (not machine.power_high) << 6
        | (_engaged_bits(machine.model.axes) if machine.motors_on else 0),
        2: 0,
    }
    index = as_integer(arguments[0])
    if index not in words:
        raise out_of_range(f"Stat({index})")
    return int(words[index])


def _brakes(robot: DrivenRobot) -> tuple[bool, ...]:
    """Return which joints a brake holds; of a SCARA, whose brakes are not simulated, none."""
    return robot.brakes_closed if robot.model.six_axes else ()


def _robot(session: Session, arguments: Arguments) -> Value:
    """Return RobotInfo(i)."""
    machine = session.machine
    words = {
        0: machine.motors_on << 3 | machine.power_high << 4 | 1 << 8 | machine.till_met << 14,
        1: (machine.robot.recovers_to is not None) << 1 | machine.robot.recovering << 2,
        2: int(machine.robot.at_home),
        3: (1 << machine.model.axes) - 1 if machine.motors_on else 0,
        4: 0,
        5: sum(closed << bit for bit, closed in enumerate(_brakes(machine.robot))),
    }
    index = as_integer(arguments[0])
    if index not in words:
        raise out_of_range(f"RobotInfo({index})")
    return int(words[index])


def _robot_text(session: Session, arguments: Arguments) -> Value:
    """Return RobotInfo$(i): name, model, default point file, serial number."""
    texts = {0: "Robot1", 1: session.machine.model.name, 2: "robot1.pts", 4: session.machine.serial}
    index = as_integer(arguments[0])
    if index not in texts:
        raise out_of_range(f"RobotInfo$({index})")
    return texts[index]


STATE_FUNCTIONS: Final[dict[str, tuple[range, StateFunction]]] = {
    "safetyon": (range(1), lambda s, _: s.condition.guard_open),
    "estopon": (range(1), lambda s, _: s.condition.flags().emergency_stop),
    "erroron": (range(1), lambda s, _: s.condition.error),
    "teachon": (range(1), lambda s, _: s.condition.mode is Mode.TEACH),
    "pauseon": (range(1), lambda s, _: s.condition.task is Task.PAUSED),
    "syserr": (range(2), _system_error),
    "err": (range(2), lambda s, _: s.memory.last_error),
    "errmsg$": (range(1, 3), _error_text),
    "ctrlinfo": (range(1, 2), _controller),
    "stat": (range(1, 2), _stat),
    "robotinfo": (range(1, 2), _robot),
    "robotinfo$": (range(1, 2), _robot_text),
    "robotname$": (range(1), lambda s, _: _robot_text(s, (0,))),
    "fileexists": (range(1, 2), lambda s, a: s.files.exists(as_text(a[0]), folder=False)),
    "folderexists": (range(1, 2), lambda s, a: s.files.exists(as_text(a[0]), folder=True)),
    "curdir$": (range(1), lambda s, _: s.files.present),
    "curdrive$": (range(1), lambda s, _: s.files.drive.upper()),
    "windowsstatus": (range(1), lambda s, _: s.options.windows_status),
    "projectname$": (range(1), lambda s, _: s.project_name),
    "tw": (range(1), lambda s, _: s.memory.timed_out),
}
"""Functions by name, each with its allowed numbers of arguments."""
