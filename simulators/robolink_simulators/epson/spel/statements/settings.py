"""Statements that set or show a setting, or list what is set and measured.

Statements that set or show a motion setting (docs/reference/spel.md 7.2, 7.3).

Without values a statement shows what is set. Only Speed's and Accel's listings are described,
and their columns were lost: rows here are assumed, values and the first line are documented.
Everything else shows its number alone, as a bare Tool does (assumed).

LimZMargin, QP, OLAccel, PTPBoost and their kin (docs/reference/spel.md 6.3, 7.2, 7.3).

ATCLR, ATRQ, PTCLR, PTRQ, OLRate, AvgSpeed, PeakSpeed: what is measured of the drives.

Source: docs/reference/spel.md 7.3, 7.4. Lists have two values a row and six on every robot, as
their samples; how wide their columns are is assumed.

Arch, the statement (docs/reference/spel.md 7.1, 7.3).

SysConfig: what the controller and its robots are set to, as lines that could be entered again.

Source: docs/reference/spel.md 7.3. What belongs to no statement stands behind an apostrophe.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Final

from robolink_simulators.epson.arm.arch import Arch
from robolink_simulators.epson.arm.joint_settings import (
    DRIVE_SETTINGS,
    OF_SIX_AXES,
    DriveSetting,
)
from robolink_simulators.epson.arm.motion_parameters import HIGHEST_SPEED_S
from robolink_simulators.epson.arm.torques import DriveObserver, DriveQuantity
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.robot import DrivenRobot
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.joint_functions import another_robot
from robolink_simulators.epson.spel.expressions.machine_functions import hours_of
from robolink_simulators.epson.spel.expressions.motion_functions import (
    DRIVE_VALUES,
    DriveValue,
    joint_number,
)
from robolink_simulators.epson.spel.expressions.print_format import CRLF, number_text
from robolink_simulators.epson.spel.expressions.setting_functions import NS_PER_HOUR
from robolink_simulators.epson.spel.expressions.values import Number, out_of_range
from robolink_simulators.epson.spel.tree import KeywordStatement

Numbers = Sequence[Number]
Setting = Callable[[Machine, Numbers], str]

HIGHEST_ACCEL_S: Final = 25_000.0
"""Highest AccelS in mm/s2 of most SCARA robots (docs/reference/spel.md 7.2)."""

HIGHEST_SPEED_R: Final = 1000.0
"""Highest SpeedR in degrees/s (docs/reference/spel.md 7.2)."""

HIGHEST_ACCEL_R: Final = 5000.0
"""Highest AccelR in degrees/s2 (docs/reference/spel.md 7.2)."""


def expect(values: Numbers, *counts: int) -> None:
    """Refuse another number of values."""
    if len(values) not in counts:
        raise SpelRefusal(RefusalKind.SYNTAX, f"{len(values)} values, not one of {counts}")


def setting(
    show: Callable[[Machine], str], *counts: int
) -> Callable[[Callable[[Machine, Numbers], None]], Setting]:
    """Make the statement of what sets a setting: without values it shows it.

    Args:
        show: What it shows.
        counts: How many values set it; none if what sets it counts them itself.
    """

    def statement(put: Callable[[Machine, Numbers], None]) -> Setting:
        def choose(machine: Machine, values: Numbers) -> str:
            if counts:
                expect(values, 0, *counts)
            if not values:
                return show(machine)
            put(machine, values)
            return ""

        return choose

    return statement


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


@setting(lambda machine: _rows(machine, machine.parameters.speed), 1, 3)
def _speed(machine: Machine, values: Numbers) -> None:
    travel, depart, approach = map(int, _filled(_checked(values, 1, 100), 3))
    machine.parameters.speed = (travel, depart, approach)


@setting(lambda machine: _rows(machine, machine.parameters.speed_s), 1, 3)
def _speed_s(machine: Machine, values: Numbers) -> None:
    travel, depart, approach = _filled(_checked(values, 0.1, HIGHEST_SPEED_S), 3)
    machine.parameters.speed_s = (travel, depart, approach)


def accel(machine: Machine, values: Numbers, highest: int) -> str:
    """Set or show Accel; the highest value is AccelMax's."""
    expect(values, 0, 2, 6)
    if not values:
        return _rows(machine, machine.parameters.accel)
    a, b, c, d, e, f = map(int, _filled(_checked(values, 1, highest), 6))
    machine.parameters.accel = (a, b, c, d, e, f)
    return ""


@setting(lambda machine: _rows(machine, machine.parameters.accel_s), 1, 2, 6)
def _accel_s(machine: Machine, values: Numbers) -> None:
    a, b, c, d, e, f = _filled(_checked(values, 0.1, HIGHEST_ACCEL_S), 6)
    machine.parameters.accel_s = (a, b, c, d, e, f)


def _shown(value: Number) -> str:
    return number_text(value) + CRLF


@setting(lambda machine: _shown(machine.parameters.speed_r), 1)
def _speed_r(machine: Machine, values: Numbers) -> None:
    (machine.parameters.speed_r,) = _checked(values, 0.1, HIGHEST_SPEED_R)


@setting(lambda machine: _shown(machine.parameters.accel_r), 1, 2)
def _accel_r(machine: Machine, values: Numbers) -> None:
    # One value applies to both ends of a turn here: the lower of the two.
    machine.parameters.accel_r = min(_checked(values, 0.1, HIGHEST_ACCEL_R))


def _limz(machine: Machine, values: Numbers) -> str:
    if machine.model.six_axes:
        raise SpelRefusal(RefusalKind.OTHER_ROBOT, "A six-axis robot has no LimZ")
    expect(values, 0, 1)
    if not values:
        return _shown(machine.parameters.limz_mm)
    low, high = machine.model.ranges[2]
    (machine.parameters.limz_mm,) = _checked(values, low, high)
    return ""


@setting(lambda machine: _shown(int(machine.motors_on)), 1)
def _motor(machine: Machine, values: Numbers) -> None:
    machine.switch_motors(bool(values[0]))


@setting(lambda machine: _shown(int(machine.power_high)), 1)
def _power(machine: Machine, values: Numbers) -> None:
    machine.power_high = bool(values[0])


@setting(lambda machine: _shown(machine.robot_number), 1)
def _robot(machine: Machine, values: Numbers) -> None:
    machine.choose(int(values[0]))


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
"""Functions that set or show a setting, by keyword. Each returns the shown text."""


def _listed(setting: DriveSetting, values: Sequence[float]) -> str:
    if setting.switched and len(values) > 1:
        return ",".join("ON" if value else "OFF" for value in values) + CRLF
    if setting.switched and setting.listing != "{}":
        return setting.listing.format("ON" if values[0] else "OFF") + CRLF
    return ", ".join(map(_number, values)) + CRLF


def _number(value: float) -> str:
    return number_text(int(value) if value == int(value) else value)


def _setting(word: str) -> Callable[[Machine, Sequence[Number]], str]:
    """Return what sets or lists a setting.

    That several values are listed with commas is assumed.
    """
    setting = DRIVE_SETTINGS[word]

    def choose(machine: Machine, values: Sequence[Number]) -> str:
        drives = machine.robot.drives
        if word in OF_SIX_AXES and not machine.model.six_axes:
            raise another_robot(machine.model)
        if not values:
            return _listed(setting, drives.get(word))
        if word == "performmode" and len(values) == 2:
            drives, values = machine.numbered(int(values[1])).drives, values[:1]
        if len(values) not in drives.takes(word):
            raise SpelRefusal(RefusalKind.SYNTAX, f"{word} does not take {len(values)} values")
        if any(not setting.low <= value <= setting.high for value in values):
            raise out_of_range(f"Allowed are {setting.low:g} to {setting.high:g}")
        drives.set(word, tuple(map(float, values)))
        return ""

    return choose


DRIVE_STATEMENTS: Final[dict[str, Callable[[Machine, Sequence[Number]], str]]] = {
    word: _setting(word) for word in DRIVE_SETTINGS
}
"""Functions that set or show a setting, by keyword."""


_LISTED: Final = 6
_DECIMALS: Final = 3
_DECIMALS_OF_OVERLOAD: Final = 5
_BETWEEN: Final = 6


def _clearing(quantity: DriveQuantity) -> Setting:
    def clear(machine: Machine, values: Numbers) -> str:
        joints = [joint_number(machine, int(value)) for value in values]
        machine.robot.observer.clear(quantity, joints or range(1, machine.model.axes + 1))
        return ""

    return clear


def _listing(tell: DriveValue, decimals: int = _DECIMALS) -> Setting:
    def show(machine: Machine, values: Numbers) -> str:
        observer, axes = machine.robot.observer, machine.model.axes
        if len(values) > 1:
            raise SpelRefusal(RefusalKind.SYNTAX, "One joint, or none for all of them")
        if values:
            return f"{tell(observer, joint_number(machine, int(values[0]))):.{decimals}f}" + CRLF
        told = [tell(observer, joint) for joint in range(1, axes + 1)]
        told += [0.0] * (_LISTED - axes)
        texts = [f"{value:{decimals + _BETWEEN}.{decimals}f}" for value in told]
        rows = ["".join(texts[at : at + 2]) for at in range(0, _LISTED, 2)]
        return "".join(row + CRLF for row in rows)

    return show


TORQUE_STATEMENTS: Final[dict[str, Setting]] = {
    **{quantity.value: _clearing(quantity) for quantity in DriveQuantity},
    **{word: _listing(DRIVE_VALUES[word]) for word in ("atrq", "ptrq", "avgspeed", "peakspeed")},
    "olrate": _listing(DriveObserver.overload, _DECIMALS_OF_OVERLOAD),
}
"""Functions that clear or show a value, by keyword."""


def _arch(machine: Machine, values: Sequence[Number]) -> str:
    arches = machine.kept.arches
    match values:
        case []:
            listed = enumerate(arches.all())
            return "".join(f"arch{n} ={a:9.3f}{b:9.3f}{CRLF}" for n, (a, b) in listed)
        case [number, depart, approach]:
            arches.set(int(number), Arch(float(depart), float(approach)))
            return ""
    raise SpelRefusal(RefusalKind.SYNTAX, f"Arch does not take {len(values)} values")


ARCH_SETTINGS: Final[dict[str, Callable[[Machine, Sequence[Number]], str]]] = {"arch": _arch}
"""Functions that set or show a setting, by keyword."""


_LIMITS_LISTED: Final = 6


def _system_listing(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Return the listing; motors, boards and options, which are not simulated, are left out."""
    if command.arguments:
        raise SpelRefusal(RefusalKind.SYNTAX, "SysConfig takes nothing")
    session = evaluator.session
    head = [
        f"' HOUR: {hours_of(session):.3f}",
        "' Controller:",
        f"'   Serial #: {session.machine.controller_serial}",
    ]
    robots = enumerate(session.machine.robots, start=1)
    rows = (row for number, robot in robots for row in _robot_listing(number, robot))
    return "".join(line + CRLF for line in (*head, *rows))


def _robot_listing(number: int, robot: DrivenRobot) -> Iterator[str]:
    yield f"' ROBOT {number}:"
    yield f"'   Name: Robot{number}"
    yield f"'   Model: {robot.model.name}"
    yield f"'   Serial #: {robot.serial}"
    yield f"'   Motor On Time: {robot.motors_on_ns / NS_PER_HOUR:.3f}"
    kept, settings = robot.kept, robot.settings
    for arch, ends in enumerate(kept.arches.all()):
        yield _row("ARCH", (arch, ends.depart_mm, ends.approach_mm))
    for arm, values in kept.arms.all().items():
        yield _row("ARMSET", (arm, *values))
    yield _row("HOFS", kept.origins.offsets)
    yield _row("HORDR", settings.home_order)
    yield _row("RANGE", kept.ranges.pulses())
    yield _row("BASE", kept.base.coordinates)
    yield _row("WEIGHT", (settings.weight_kg, settings.weight_at_mm))
    yield _row("INERTIA", (settings.inertia_kg_m2, settings.eccentricity_mm))
    limits = (*kept.limits.values, 0.0, 0.0)[:_LIMITS_LISTED]
    yield _row("XYLIM", limits)


def _row(word: str, values: Iterable[float]) -> str:
    return f"{word} " + ", ".join(f"{value:.10g}" for value in values)


SYSTEM_COMMANDS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "sysconfig": _system_listing
}
"""Statement handlers by keyword."""
