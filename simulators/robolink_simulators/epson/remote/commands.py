"""Which requests are served now, and what they do (docs/reference/epson.md 1.2).

Remote Ethernet's input, output and memory commands (docs/reference/epson.md 1.2).

Numbers count from 0. Bytes and words are read as hex digits and set as decimal numbers, as
clients do it (docs/reference/epson.md 1.2 note 5). GetIO reads inputs, SetIO sets outputs.

The extended queries of newer firmware (docs/reference/epson.md 1.8), and the alarms.

The order of fields is that of Epson's own client; the values are the simulator's.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import cached_property, lru_cache, partial
from typing import Final

from robolink.protocols.epson_text import (
    ErrorCode,
    Preference,
    RemoteCommand,
    Request,
    preferences_field,
    status_fields,
)
from robolink_simulators.epson.condition import (
    Condition,
    RequestRefused,
    SpelRefusal,
    Task,
    malformed,
    number,
)
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.bits import BitBank
from robolink_simulators.epson.memory.robot import DrivenRobot
from robolink_simulators.epson.memory.variables import Variables
from robolink_simulators.epson.options import ControllerCard, EpsonOptions, SpelNumbers

Fields = tuple[str, ...]
"""Fields of the answer to a command; empty for a plain ``0``."""

Served = Callable[..., Fields]
"""Carries out a command. Takes its parameters as text."""


def io_commands(machine: Machine) -> dict[str, Served]:
    """Return the commands by lower-case name. A bit that does not exist raises Refusal."""
    return {
        **_getters("getio", machine.inputs),
        **_setters("setio", machine.outputs),
        **_getters("getmemio", machine.memory),
        **_setters("setmemio", machine.memory),
    }


def _getters(name: str, bank: BitBank) -> dict[str, Served]:
    def bit(at: str) -> Fields:
        return (str(int(bank.get(number(at)))),)

    def byte(at: str) -> Fields:
        return (f"{bank.get_byte(number(at)):02X}",)

    def word(at: str) -> Fields:
        low = 2 * number(at)
        return (f"{bank.get_byte(low + 1) << 8 | bank.get_byte(low):04X}",)

    return {name: bit, f"{name}byte": byte, f"{name}word": word}


def _setters(name: str, bank: BitBank) -> dict[str, Served]:
    def bit(at: str, value: str) -> Fields:
        bank.set(number(at), number(value, 1) == 1)
        return ()

    def byte(at: str, value: str) -> Fields:
        bank.set_byte(number(at), number(value, 0xFF))
        return ()

    def word(at: str, value: str) -> Fields:
        low, wanted = 2 * number(at), number(value, 0xFFFF)
        bank.set_byte(low, wanted & 0xFF)
        bank.set_byte(low + 1, wanted >> 8)
        return ()

    return {name: bit, f"{name}byte": byte, f"{name}word": word}


_NOT_APPLICABLE: Final = "-1"
_AXES: Final = 6
_HIGHEST_LANGUAGE: Final = 6  # Spanish, which only ErrMsg$ documents (docs/reference/spel.md 4.4)
_WARNED_PARTS: Final = 6  # battery, belt, grease, motor, gear, ball screw
_FIRMWARE: Final = {5: "5. 4. 0. 0", 7: "7. 5. 4. 0", 8: "8. 1. 0. 0"}
"""Firmware versions by RC+ version. EPSON's own client removes the spaces after the dots."""

_OTHER_DEVICE: Final = "21"
"""Control device that leaves Remote Ethernet with monitoring only: the PC (docs/reference/spel.md
9); assumed.
"""

_WIDTH_OF_A_FUNCTION: Final = 64
_INSTALLED: Final = "2020/01/01 00:00:00"
_NEW: Final = (_INSTALLED, "0.0", "120.0")
"""Maintenance data of a part without wear: installation date, percent consumed, months left."""

_STAMP: Final = "2020/01/01 08:00:00"
"""Time of every error: simulated time has no date."""


def query_commands(
    machine: Machine, condition: Condition, card: ControllerCard, options: EpsonOptions
) -> dict[str, Served]:
    """Return the queries by lower-case name."""
    of_robot = partial(_of_robot, machine)
    health = _NEW if options.maintenance_data else (_NOT_APPLICABLE,)
    return {
        "getcontname": lambda: (card.name,),
        "getcontno": lambda: (machine.controller_serial,),
        "getcontver": lambda: (_FIRMWARE[options.rc_plus],),
        "getconttype": lambda: (card.kind,),
        "getcontdev": lambda: (_control_device(machine, condition),),
        "getsubnetmask": lambda: ("255.0.0.0",),
        "getdefaultgateway": lambda: ("0.0.0.0",),
        "getcontmacadd": lambda: ("00-00-00-00-00-00",),
        "getprjname": lambda: (card.project,),
        "getcpuload": lambda: ("0",),
        "getcontsettings": lambda: (card.settings or preferences_field(preferences_of(options)),),
        "getcameramodel": lambda: (card.camera,),
        "getforceserial": lambda: (card.force_sensor,),
        "getrobotinfo": lambda: of_robot(_kind)("0"),
        "getrobotname": of_robot(lambda _: (card.robot_name,)),
        "getrobotserial": of_robot(lambda robot: (robot.serial,)),
        "getmotor": of_robot(_drives),
        "gethofs": of_robot(_offsets, counted=False),
        "geterrmsg": _messages(card, options, condition),
        "geterrfunc": lambda code: _function_of(condition, number(code)),
        "gethealthcont": lambda: health,
        "gethealthrb": of_robot(lambda _: health, counted=False),
        "getpartwarning": of_robot(lambda _: ("0",) * _WARNED_PARTS, counted=False),
    }


def preferences_of(options: EpsonOptions) -> frozenset[Preference]:
    """Return the preferences that are on; those without an option are off."""
    on = {
        Preference.RESET_OUTPUTS_OFF: options.reset_outputs_off,
        Preference.OUTPUTS_OFF_AT_ESTOP: options.outputs_off_at_estop,
        Preference.DRY_RUN: options.dry_run,
        Preference.VIRTUAL_IO: options.virtual_io,
        Preference.MAINTENANCE_DATA: options.maintenance_data,
        Preference.GLOBALS_CLEARED_AT_START: options.globals_at_start == "cleared",
        Preference.BACKGROUND_TASKS: bool(options.background_tasks),
        Preference.ADVANCED_TASK_COMMANDS: options.advanced_task_commands,
    }
    return frozenset(preference for preference, is_on in on.items() if is_on)


def check_robot(text: str, machine: Machine) -> int:
    """Return the number of an existing robot, or 0 for all.

    Raises:
        Refused: There is no such robot.
    """
    return number(text, len(machine.robots))


class Alarms:
    """Numbers of the active alarms (docs/reference/epson.md 1.2)."""

    def __init__(self) -> None:
        self._numbers: list[int] = []

    def raise_alarm(self, alarm: int) -> None:
        """Add an alarm."""
        if alarm not in self._numbers:
            self._numbers.append(alarm)

    def get(self) -> Fields:
        """Answer GetAlm: how many, then each."""
        return (str(len(self._numbers)), *map(str, self._numbers))

    def reset(self, text: str) -> Fields:
        """Carry out ResetAlm; an alarm that is not active is malformed (assumed)."""
        alarm = number(text)
        if alarm not in self._numbers:
            raise malformed()
        self._numbers.remove(alarm)
        return ()


def _control_device(machine: Machine, condition: Condition) -> str:
    return _OTHER_DEVICE if condition.monitoring_only else str(machine.control_device)


def _function_of(condition: Condition, code: int) -> Fields:
    """Answer GetErrFunc: where a program failed, ``0`` when none failed with this error.

    Start runs one endless task here, so the line is its only one.
    """
    if not code or condition.program_error != code:
        return ("0",)
    return ("main".ljust(_WIDTH_OF_A_FUNCTION), "1", "1", "1", _STAMP)


def _of_robot(
    machine: Machine, answer: Callable[[DrivenRobot], Fields], *, counted: bool = True
) -> Served:
    """Return a query of one robot, or of all with 0; the answer may begin with their number.

    Source: docs/reference/epson.md 1.8.
    """

    def serve(robot: str, *_more: str) -> Fields:
        asked = check_robot(robot, machine)
        told = machine.robots if asked == 0 else (machine.robots[asked - 1],)
        if not counted:
            return answer(told[0])
        return (str(len(told)), *(field for one in told for field in answer(one)))

    return serve


def _kind(robot: DrivenRobot) -> Fields:
    return (str(robot.model.robot_type), robot.model.name)


def _offsets(robot: DrivenRobot) -> Fields:
    offsets = [f"{offset:.3f}" for offset in robot.kept.origins.offsets]
    return tuple(offsets + ["0.000"] * (_AXES - len(offsets)))


def _drives(robot: DrivenRobot) -> Fields:
    return (str(int(robot.motors_on)), str(int(robot.power_high)))


@lru_cache(maxsize=16)
def _error_texts(numbers: SpelNumbers) -> Mapping[int, str]:
    """Return what the errors are called; controllers with the same numbers share it."""
    named = asdict(numbers).items()
    texts = {value: name.replace("_", " ").capitalize() for name, value in named}
    return {**texts, int(ErrorCode.TIMED_OUT): "Remote time-out"}


def _messages(card: ControllerCard, options: EpsonOptions, condition: Condition) -> Served:
    def serve(code: str, language: str) -> Fields:
        number(language, _HIGHEST_LANGUAGE)
        own = card.messages.get(number(code))
        failure = condition.failure
        if failure is not None and failure[0] == number(code):
            own = failure[1]  # the failed program's own text, with its line
        texts = _error_texts(options.numbers)
        return (own or texts.get(number(code), f"Error {number(code)}"),)

    return serve


_HIGHEST_FUNCTION = {5: 7, 7: 63, 8: 63}


class CommandDesk:
    """Serves every command but Login, Logout, Execute and Abort.

    Attributes:
        starter: Starts the function of that number, where a program is loaded; raises Refusal.
    """

    def __init__(
        self,
        machine: Machine,
        condition: Condition,
        variables: Variables,
        alarms: Alarms,
        card: ControllerCard,
        *,
        options: EpsonOptions,
    ) -> None:
        self._machine = machine
        self._condition = condition
        self._options = options
        self.starter: Callable[[int], object] | None = None
        self._held = (variables, alarms, card)

    @cached_property
    def _served(self) -> dict[str, Served]:
        """The commands by lower-case name, made at first use: most controllers need none."""
        machine, (variables, alarms, card) = self._machine, self._held
        return {
            **io_commands(machine),
            **query_commands(machine, self._condition, card, self._options),
            "getvariable": variables.get,
            "setvariable": variables.set,
            "getalm": alarms.get,
            "resetalm": alarms.reset,
            "getcurrobot": lambda: (str(machine.robot_number),),
            "setcurrobot": self._set_current_robot,
            "setmotorson": lambda *robot: self._switch_motors(robot, on=True),
            "setmotorsoff": lambda *robot: self._switch_motors(robot, on=False),
            "start": self._start,
            "stop": self._stop,
            "pause": lambda: self._turn(Task.PAUSED),
            "continue": lambda: self._turn(Task.RUNNING),
            "reset": self._reset,
        }

    def admit(self, command: RemoteCommand, *, logged_in: bool, executing: bool) -> None:
        """Check everything that could prevent a command.

        The order of the checks is assumed: unknown, not logged in, monitoring only, an
        Execute running, a flag missing.

        Raises:
            Refused: 11, 20, 21, or what the option says for monitoring.
        """
        options = self._options
        unknown = command.since > options.rc_plus
        if unknown or (command.extended and not options.extended_queries):
            raise RequestRefused(ErrorCode.UNKNOWN_COMMAND)
        if command.name == "Login":
            return
        if not logged_in:
            raise RequestRefused(ErrorCode.UNKNOWN_COMMAND)
        if self._condition.monitoring_only and not command.in_monitoring:
            raise RequestRefused(options.monitoring_refusal)
        if executing and not command.allowed_during_execute(options.rc_plus):
            raise RequestRefused(ErrorCode.EXECUTE_RUNNING)
        if command.needs or command.forbids:
            on = self._condition.names_on()
            if not (command.needs <= on and command.forbids.isdisjoint(on)):
                raise RequestRefused(ErrorCode.NOT_READY)

    def serve(self, request: Request) -> Fields:
        """Carry a request out.

        Raises:
            Refused: A parameter does not fit.
        """
        try:
            return self._served[request.name.lower()](*request.parameters)
        except SpelRefusal as refusal:
            raise malformed() from refusal

    def check_home(self, robot: tuple[str, ...]) -> None:
        """Check the values of a Home.

        Raises:
            Refused: There is no such robot, or no number where one is needed.
        """
        self._check_robot(robot)

    def status(self, *, executing: bool) -> Fields:
        """Answer GetStatus; an option decides whether an Execute shows."""
        shown = executing and self._options.flags_during_execute == "running"
        flags = self._condition.flags(executing=shown)
        return status_fields(flags, self._condition.code, self._options.status_flags)

    def _set_current_robot(self, robot: str) -> Fields:
        chosen = check_robot(robot, self._machine)
        if chosen == 0 and self._options.robot_zero == "error_12":
            raise malformed()
        if chosen:
            self._machine.choose(chosen)
        return ()

    def _check_robot(self, robot: tuple[str, ...]) -> int:
        """Return the number of a robot, 0 for all; none where that means one of them."""
        if robot:
            return check_robot(robot[0], self._machine)
        if self._options.missing_robot_number == "error_12":
            raise malformed()
        in_force = self._options.missing_robot_number == "current"
        return self._machine.robot_number if in_force else 0

    def _switch_motors(self, robot: tuple[str, ...], *, on: bool) -> Fields:
        chosen = self._check_robot(robot)
        if chosen:
            self._machine.robots[chosen - 1].switch_motors(on)
        else:
            self._machine.switch_all_motors(on)
        return ()

    def _start(self, function: str) -> Fields:
        chosen = number(function, _HIGHEST_FUNCTION[self._options.rc_plus])
        if self.starter is not None:
            self.starter(chosen)
            return ()
        return self._turn(Task.RUNNING)

    def _stop(self) -> Fields:
        if self._condition.task is not Task.NONE:
            self._machine.reset_motion_parameters()
        return self._turn(Task.NONE)

    def _turn(self, task: Task) -> Fields:
        self._condition.task = task
        return ()

    def _reset(self) -> Fields:
        if self._condition.serious:
            raise RequestRefused(ErrorCode.NOT_READY)
        self._condition.reset()
        self._machine.reset_motion_parameters()
        if self._options.reset_outputs_off:
            self._machine.clear_outputs()
        return ()
