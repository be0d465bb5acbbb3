"""The extended queries of newer firmware (docs/reference/epson.md 1.8), and the alarms.

The order of fields is that of Epson's own client; the values are the simulator's.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import lru_cache, partial
from typing import Final

from robolink.protocols.epson_text import ErrorCode, Preference, preferences_field
from robolink_simulators.epson.card import ControllerCard
from robolink_simulators.epson.condition import Condition
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.driven_robot import DrivenRobot
from robolink_simulators.epson.options import EpsonOptions, SpelNumbers
from robolink_simulators.epson.refusals import malformed, number
from robolink_simulators.epson.remote.io_commands import Fields, Served

_NOT_APPLICABLE: Final = "-1"
_AXES: Final = 6
_HIGHEST_LANGUAGE: Final = 6  # Spanish, which only ErrMsg$ documents (docs/reference/spel.md 4.4)
_WARNED_PARTS: Final = 6  # battery, belt, grease, motor, gear, ball screw
_FIRMWARE: Final = {5: "5. 4. 0. 0", 7: "7. 5. 4. 0", 8: "8. 1. 0. 0"}
"""With the blanks after the dots that Epson's own client takes out."""

_OTHER_DEVICE: Final = "21"
"""The control device where Remote Ethernet may only monitor: the PC (docs/reference/spel.md 9),
assumed."""

_WIDTH_OF_A_FUNCTION: Final = 64
_INSTALLED: Final = "2020/01/01 00:00:00"
_NEW: Final = (_INSTALLED, "0.0", "120.0")
"""Maintenance data of a part without wear: installed, consumed in percent, months left."""

_STAMP: Final = "2020/01/01 08:00:00"
"""When an error happened: simulated time has no date."""


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
    """Return the number of a robot that there is, or 0 for all.

    Raises:
        Refused: There is no such robot.
    """
    return number(text, len(machine.robots))


class Alarms:
    """Numbers of the alarms that stand (docs/reference/epson.md 1.2)."""

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
        """Carry out ResetAlm; an alarm that does not stand is malformed (assumed)."""
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
            own = failure[1]  # of the program that failed, with its line
        texts = _error_texts(options.numbers)
        return (own or texts.get(number(code), f"Error {number(code)}"),)

    return serve
