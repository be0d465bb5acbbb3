"""The extended queries of newer firmware (epson.md 1.8), and the alarms.

The order of fields is that of Epson's own client; the values are the simulator's.
"""

from collections.abc import Callable
from dataclasses import asdict
from typing import Final

from robolink.protocols.epson_text import ErrorCode
from robolink_simulators.epson.io_desk import Fields, Served
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.refused import malformed, number

_SCARA: Final = "3"
_NOT_APPLICABLE: Final = "-1"
_PREFERENCE_BITS: Final = 20
_AXES: Final = 6
_LANGUAGES: Final = 6
_FIRMWARE: Final = {5: "5.4.0.0", 7: "7.5.4.0", 8: "8.1.0.0"}


def query_commands(machine: Machine, options: EpsonOptions) -> dict[str, Served]:
    """Return the queries by lower-case name."""
    return {
        **_constants(options),
        "getrobotinfo": lambda: ("1", _SCARA, machine.model.name),
        "getrobotname": _of_robot(lambda: ("1", "Robot1")),
        "getcontno": lambda: (machine.controller_serial,),
        "getrobotserial": _of_robot(lambda: ("1", machine.serial)),
        "getmotor": _of_robot(
            lambda: ("1", str(int(machine.motors_on)), str(int(machine.power_high)))
        ),
        "gethofs": _of_robot(lambda: ("0.000",) * _AXES),
        "geterrmsg": _messages(options),
        "geterrfunc": lambda code: (str(0 * number(code)),),
        "gethealthcont": lambda: (_NOT_APPLICABLE,),
        "gethealthrb": _of_robot(lambda: (_NOT_APPLICABLE,)),
        "getpartwarning": _of_robot(lambda: (_NOT_APPLICABLE,)),
    }


def check_robot(text: str) -> None:
    """Accept robot 1, the only one, and 0 for all.

    Raises:
        Refused: There is no such robot.
    """
    number(text, 1)


class Alarms:
    """Numbers of the alarms that stand (epson.md 1.2)."""

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


def _constants(options: EpsonOptions) -> dict[str, Served]:
    values = {
        "getcontname": "SIMULATED",
        "getcontver": _FIRMWARE[options.rc_plus],
        "getconttype": "SIMULATOR",
        "getcontdev": "26",
        "getsubnetmask": "255.0.0.0",
        "getdefaultgateway": "0.0.0.0",
        "getcontmacadd": "00-00-00-00-00-00",
        "getprjname": "robolink",
        "getcpuload": "0",
        "getcontsettings": "0" * _PREFERENCE_BITS,
    }
    return {name: _constant(value) for name, value in values.items()}


def _constant(value: str) -> Served:
    return lambda: (value,)


def _of_robot(answer: Callable[[], Fields]) -> Served:
    def serve(robot: str, *_more: str) -> Fields:
        check_robot(robot)
        return answer()

    return serve


def _messages(options: EpsonOptions) -> Served:
    numbers = asdict(options.numbers)
    texts = {value: name.replace("_", " ").capitalize() for name, value in numbers.items()}
    texts[int(ErrorCode.TIMED_OUT)] = "Remote time-out"

    def serve(code: str, language: str) -> Fields:
        number(language, _LANGUAGES - 1)
        return (texts.get(number(code), f"Error {number(code)}"),)

    return serve
