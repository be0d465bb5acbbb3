"""Statements that set or show a motion setting (docs/reference/spel.md 7.2, 7.3).

Without values a statement shows what is set. Only Speed's and Accel's listings are described,
and their columns were lost: rows here are assumed, values and the first line are documented.
Everything else shows its number alone, as a bare Tool does (assumed).
"""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.arm.motion_parameters import HIGHEST_SPEED_S
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.printing import CRLF, number_text
from robolink_simulators.epson.spel.expressions.values import Number, out_of_range

Numbers = Sequence[Number]
Setting = Callable[[Machine, Numbers], str]

HIGHEST_ACCEL_S: Final = 25_000.0
"""AccelS in mm/s2 of most SCARA robots (docs/reference/spel.md 7.2)."""

HIGHEST_SPEED_R: Final = 1000.0
"""SpeedR in degrees/s (docs/reference/spel.md 7.2)."""

HIGHEST_ACCEL_R: Final = 5000.0
"""AccelR in degrees/s2 (docs/reference/spel.md 7.2)."""


def _expect(values: Numbers, *counts: int) -> None:
    if len(values) not in counts:
        raise SpelRefusal(RefusalKind.SYNTAX, f"{len(values)} values, not one of {counts}")


def _checked(values: Numbers, low: float, high: float) -> list[float]:
    if any(not low <= value <= high for value in values):
        raise out_of_range(f"Allowed are {low:g} to {high:g}")
    return [float(value) for value in values]


def _filled(values: Sequence[float], count: int) -> list[float]:
    """Repeat the leading values for those left out, keeping their period."""
    period = 1 if count == 3 else 2
    start = list(values) if len(values) >= period else [values[0]] * period
    return [*start, *(start[i % period] for i in range(len(start), count))]


def _rows(machine: Machine, values: Numbers) -> str:
    """Show values, two a row, under the documented mark of low power."""
    lines = [] if machine.power_high else ["Low Power Mode"]
    texts = [f"{number_text(value):>10}" for value in values]
    if len(texts) == 3:
        lines.append(texts.pop(0))
    lines += ["".join(texts[i : i + 2]) for i in range(0, len(texts), 2)]
    return "".join(line + CRLF for line in lines)


def _speed(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, 1, 3)
    if not values:
        return _rows(machine, machine.parameters.speed)
    travel, depart, approach = map(int, _filled(_checked(values, 1, 100), 3))
    machine.parameters.speed = (travel, depart, approach)
    return ""


def _speed_s(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, 1, 3)
    if not values:
        return _rows(machine, machine.parameters.speed_s)
    travel, depart, approach = _filled(_checked(values, 0.1, HIGHEST_SPEED_S), 3)
    machine.parameters.speed_s = (travel, depart, approach)
    return ""


def accel(machine: Machine, values: Numbers, highest: int) -> str:
    """Set or show Accel; the highest value is AccelMax's."""
    _expect(values, 0, 2, 6)
    if not values:
        return _rows(machine, machine.parameters.accel)
    a, b, c, d, e, f = map(int, _filled(_checked(values, 1, highest), 6))
    machine.parameters.accel = (a, b, c, d, e, f)
    return ""


def _accel_s(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, 1, 2, 6)
    if not values:
        return _rows(machine, machine.parameters.accel_s)
    a, b, c, d, e, f = _filled(_checked(values, 0.1, HIGHEST_ACCEL_S), 6)
    machine.parameters.accel_s = (a, b, c, d, e, f)
    return ""


def _shown(value: Number) -> str:
    return number_text(value) + CRLF


def _speed_r(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, 1)
    if not values:
        return _shown(machine.parameters.speed_r)
    (machine.parameters.speed_r,) = _checked(values, 0.1, HIGHEST_SPEED_R)
    return ""


def _accel_r(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, 1, 2)
    if not values:
        return _shown(machine.parameters.accel_r)
    # One value rules both ends of a turn here; the slower of two is taken.
    machine.parameters.accel_r = min(_checked(values, 0.1, HIGHEST_ACCEL_R))
    return ""


def _limz(machine: Machine, values: Numbers) -> str:
    if machine.model.six_axes:
        raise SpelRefusal(RefusalKind.OTHER_ROBOT, "A six-axis robot has no LimZ")
    _expect(values, 0, 1)
    if not values:
        return _shown(machine.parameters.limz_mm)
    low, high = machine.model.ranges[2]
    (machine.parameters.limz_mm,) = _checked(values, low, high)
    return ""


def _motor(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, 1)
    if not values:
        return _shown(int(machine.motors_on))
    machine.switch_motors(bool(values[0]))
    return ""


def _power(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, 1)
    if not values:
        return _shown(int(machine.power_high))
    machine.power_high = bool(values[0])
    return ""


def _robot(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, 1)
    if not values:
        return _shown(machine.robot_number)
    machine.choose(int(values[0]))
    return ""


SETTINGS: Final[dict[str, Setting]] = {
    "speed": _speed,
    "speeds": _speed_s,
    "speedr": _speed_r,
    "accels": _accel_s,
    "accelr": _accel_r,
    "limz": _limz,
    "motor": _motor,
    "power": _power,
    "robot": _robot,
}
"""Keyword to what sets or shows it; what is shown comes back as text."""
