"""Statements about load, joints, their zeros and ranges, and the home position.

Where the zeros of joints lie, the home position, brakes: Hofs, CalPls, Calib, MCal, Brake.

Source: docs/reference/spel.md 7.2, 7.3.

Range and JRange in pulses, and the order in which Home moves the joints (Hordr).

Source: docs/reference/spel.md 6.3, 7.2, 7.3.

Keyword statements about load, free joints and the home position.

Source: docs/reference/spel.md 6.2, 7.2, 7.3.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

from robolink_simulators.epson.arm.joint_settings import RestoredAt
from robolink_simulators.epson.arm.robot_settings import SingularSurroundings
from robolink_simulators.epson.arm.robots import Mechanism
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.spel.expressions.joint_functions import (
    JOINT_COUNTS,
    another_robot,
    pulses_of,
)
from robolink_simulators.epson.spel.expressions.print_format import CRLF, number_text
from robolink_simulators.epson.spel.expressions.values import Number, out_of_range
from robolink_simulators.epson.spel.statements.areas import LIMIT_SETTINGS
from robolink_simulators.epson.spel.statements.coordinate_systems import ARM_SETTINGS
from robolink_simulators.epson.spel.statements.settings import (
    ARCH_SETTINGS,
    DRIVE_STATEMENTS,
    TORQUE_STATEMENTS,
    Numbers,
    Setting,
    expect,
    setting,
)


def _one_a_joint(machine: Machine, word: str, values: Numbers) -> list[int]:
    axes = machine.model.axes
    if len(values) in JOINT_COUNTS - {axes}:
        raise another_robot(machine.model)
    if len(values) != axes:
        raise SpelRefusal(RefusalKind.SYNTAX, f"{word} takes {axes} values")
    return [int(value) for value in values]


def _listed(values: Sequence[int]) -> str:
    return ", ".join(map(str, values)) + CRLF


@setting(lambda machine: _listed(machine.kept.origins.offsets))
def _offsets(machine: Machine, values: Numbers) -> None:
    """Set or list Hofs."""
    _require_rest(machine)
    machine.robot.offset_origins(_one_a_joint(machine, "Hofs", values))


@setting(lambda machine: _listed(machine.kept.origins.reference or (0,) * machine.model.axes))
def _reference(machine: Machine, values: Numbers) -> None:
    """Set or list CalPls; what it lists before it was set is not documented: 0 (assumed)."""
    machine.kept.origins.reference = tuple(_one_a_joint(machine, "CalPls", values))


def _calibrate(machine: Machine, values: Numbers) -> str:
    """Let joints stand at CalPls, where they are: their offsets follow (documented).

    Without CalPls it is refused (assumed), and so is no joint (documented; no number of either).
    """
    origins, axes = machine.kept.origins, machine.model.axes
    if not values:
        raise SpelRefusal(RefusalKind.SYNTAX, "Calib needs a joint")
    joints = {int(value) for value in values}
    if not joints <= set(range(1, axes + 1)):
        raise out_of_range(f"There are joints 1 to {axes}")
    if origins.reference is None:
        raise SpelRefusal(RefusalKind.CALIBRATION_PULSES, "CalPls has not been set")
    _require_rest(machine)
    stands = pulses_of(machine, machine.arm.joints)
    rows = enumerate(zip(origins.offsets, origins.reference, stands, strict=True), start=1)
    machine.robot.offset_origins(
        [offset + (right - now if joint in joints else 0) for joint, (offset, right, now) in rows]
    )
    return ""


def _require_rest(machine: Machine) -> None:
    if machine.arm.moving:
        raise SpelRefusal(RefusalKind.ROBOT_IN_USE, "The robot is moving")


def _find_origins(_: Machine, values: Numbers) -> str:
    """MCal: absolute encoders, which all robots here have, do not need it (documented)."""
    if values:
        raise SpelRefusal(RefusalKind.SYNTAX, "MCal takes nothing")
    return ""


@setting(lambda machine: _listed(machine.kept.origins.order))
def _order(machine: Machine, values: Numbers) -> None:
    """Set or list MCordr."""
    machine.kept.origins.order = _steps(machine, "MCordr", values)


def _steps(machine: Machine, word: str, values: Numbers) -> tuple[int, ...]:
    """Return which joints move in each step, a bit for each joint."""
    order, highest = _one_a_joint(machine, word, values), (1 << machine.model.axes) - 1
    if any(not 0 <= step <= highest for step in order):
        raise out_of_range(f"Allowed are 0 to {highest}")
    return tuple(order)


def _forget_home(machine: Machine, values: Numbers) -> str:
    if values:
        raise SpelRefusal(RefusalKind.SYNTAX, "HomeClr takes nothing")
    machine.settings.home_pulses = None
    return ""


def _brake(machine: Machine, values: Numbers) -> str:
    """Close or open the brake of one joint of six axes; the arm does not sink here (assumed).

    What it does while the motors are on, and hold the joint themselves, is not documented: refused.
    """
    if not machine.model.six_axes:
        raise SpelRefusal(RefusalKind.OTHER_ROBOT, "Brake is for six axes")
    if len(values) != 2:
        raise SpelRefusal(RefusalKind.SYNTAX, "Brake takes On or Off and a joint")
    closed, joint = bool(values[0]), int(values[1])
    if not 1 <= joint <= machine.model.axes:
        raise out_of_range(f"There is no joint {joint}")
    if machine.motors_on:
        raise SpelRefusal(RefusalKind.MOTORS_ON, "Motors are on")
    machine.robot.drives.put_back(RestoredAt.DRIVES)
    machine.robot.reset_motion_parameters()
    brakes = machine.robot.opened_brakes
    (brakes.discard if closed else brakes.add)(joint)
    return ""


ORIGIN_STATEMENTS: Final[dict[str, Callable[[Machine, Numbers], str]]] = {
    "hofs": _offsets,
    "calpls": _reference,
    "calib": _calibrate,
    "mcal": _find_origins,
    "mcordr": _order,
    "homeclr": _forget_home,
    "brake": _brake,
}
"""Statement handlers by keyword. Each returns the shown text."""


_JRANGE_VALUES: Final = 3


@setting(lambda machine: _listed(machine.kept.ranges.pulses()))
def _range(machine: Machine, values: Numbers) -> None:
    """Hold every joint to low and high, or list those in force."""
    robot, axes = machine.robot, machine.model.axes
    if len(values) in {2 * count for count in JOINT_COUNTS - {axes}}:
        raise another_robot(machine.model)
    if len(values) != 2 * axes:
        raise SpelRefusal(RefusalKind.SYNTAX, "Range takes two values for each joint")
    before = robot.kept.ranges.to_state()
    try:
        for joint in range(1, axes + 1):
            low, high = values[2 * joint - 2 : 2 * joint]
            robot.kept.ranges.set_pulses(joint, int(low), int(high))
    except SpelRefusal:
        robot.kept.ranges.restore(before)
        raise
    robot.hold_to_ranges()


def _of_one_joint(machine: Machine, values: Sequence[Number]) -> str:
    if len(values) != _JRANGE_VALUES:
        raise SpelRefusal(RefusalKind.SYNTAX, "JRange takes a joint and two ends")
    joint, low, high = map(int, values)
    if not 1 <= joint <= machine.model.axes:
        raise out_of_range(f"There is no joint {joint}")
    machine.robot.kept.ranges.set_pulses(joint, low, high)
    machine.robot.hold_to_ranges()
    return ""


@setting(lambda machine: _listed(machine.settings.home_order))
def _home_order(machine: Machine, values: Numbers) -> None:
    """Set which joints Home moves in each step, a bit for each joint, or list that."""
    machine.settings.home_order = _steps(machine, "Hordr", values)


_HIGHEST_FINE: Final = 65535
_HEAVIEST_KG: Final = 20.0
"""Largest load in kg (assumed). The reference gives it per model; a larger one is an error."""


def _within(value: Number, low: float, high: float) -> float:
    if not low <= value <= high:
        raise out_of_range(f"Allowed are {low:g} to {high:g}")
    return float(value)


def _load(load: str, most: float, distance: str) -> Setting:
    """Return Weight or Inertia: a load, and how far out it is."""

    def show(machine: Machine) -> str:
        shown = (getattr(machine.settings, name) for name in (load, distance))
        return ", ".join(f"{value:.3f}" for value in shown) + CRLF

    @setting(show, 1, 2)
    def put(machine: Machine, values: Numbers) -> None:
        setattr(machine.settings, load, _within(values[0], 0, most))
        if len(values) > 1:
            setattr(machine.settings, distance, _within(values[1], 0, 10_000))

    return put


def _fine(machine: Machine, values: Numbers) -> str:
    expect(values, 0, machine.model.axes)
    if not values:
        return ", ".join(map(str, machine.settings.fine_pulses)) + CRLF
    machine.settings.fine_pulses = tuple(int(_within(value, 0, _HIGHEST_FINE)) for value in values)
    # Of Fine and FineDist, the one set last applies (assumed).
    machine.robot.drives.set("finedist", (0.0,))
    return ""


@setting(lambda machine: number_text(machine.settings.speed_factor) + CRLF, 1)
def _speed_factor(machine: Machine, values: Numbers) -> None:
    machine.settings.speed_factor = int(_within(values[0], 1, 100))


@setting(lambda machine: number_text(int(machine.settings.continuous_path)) + CRLF, 1)
def _continuous_path(machine: Machine, values: Numbers) -> None:
    machine.settings.continuous_path = bool(values[0])


def _joints(machine: Machine, values: Numbers) -> set[int]:
    if machine.model.six_axes:
        raise SpelRefusal(RefusalKind.OTHER_ROBOT, "Joints of a six-axis robot cannot be freed")
    return {int(_within(value, 1, machine.model.axes)) for value in values}


def _free(machine: Machine, values: Numbers) -> str:
    if not values:
        raise SpelRefusal(RefusalKind.SYNTAX, "SFree needs a joint")
    machine.settings.free_joints |= _joints(machine, values)
    machine.robot.drives.put_back(RestoredAt.DRIVES)
    machine.reset_motion_parameters()
    return ""


def _lock(machine: Machine, values: Numbers) -> str:
    joints = _joints(machine, values) or set(range(1, machine.model.axes + 1))
    if not machine.motors_on:
        raise SpelRefusal(RefusalKind.MOTORS_OFF, "Motors are off")
    machine.settings.free_joints -= joints
    machine.robot.drives.put_back(RestoredAt.DRIVES)
    machine.reset_motion_parameters()
    return ""


def _home_set(machine: Machine, values: Numbers) -> str:
    if len(values) in JOINT_COUNTS - {machine.model.axes}:
        raise another_robot(machine.model)
    expect(values, 0, machine.model.axes)
    home = machine.settings.home_pulses
    if values:
        machine.settings.home_pulses = tuple(map(int, values))
        return ""
    if home is None:
        raise SpelRefusal(RefusalKind.HOME_UNDEFINED, "No home position is set")
    return "".join(f"{a} {b}{CRLF}" for a, b in zip(home[::2], home[1::2], strict=True))


@setting(lambda machine: number_text(machine.control_points.selected) + CRLF, 1)
def _control_point(machine: Machine, values: Numbers) -> None:
    machine.control_points.select(int(values[0]))


def _avoid_singularity(machine: Machine, values: Numbers) -> str:
    """Set or show AvoidSingularity; 5 is for another kind of robot (documented: 4002)."""
    if machine.model.mechanism is Mechanism.SCARA:
        raise another_robot(machine.model)
    expect(values, 0, 1)
    if not values:
        return number_text(machine.settings.avoid_singularity) + CRLF
    machine.settings.avoid_singularity = int(_within(values[0], 0, 4))
    machine.settings.surroundings = SingularSurroundings()
    return ""


def _surroundings(name: str, most: float) -> Setting:
    """Return SingularityAngle, -Speed or -Dist; how large they may be is assumed."""

    def choose(machine: Machine, values: Numbers) -> str:
        if machine.model.mechanism is Mechanism.SCARA:
            raise another_robot(machine.model)
        expect(values, 0, 1)
        settings = machine.settings
        if not values:
            return number_text(getattr(settings.surroundings, name)) + CRLF
        changed = {name: _within(values[0], 0, most)}
        settings.surroundings = replace(settings.surroundings, **changed)
        return ""

    return choose


ROBOT_SETTINGS: Final[dict[str, Setting]] = {
    **ARCH_SETTINGS,
    **ARM_SETTINGS,
    **LIMIT_SETTINGS,
    **DRIVE_STATEMENTS,
    **TORQUE_STATEMENTS,
    **ORIGIN_STATEMENTS,
    "range": _range,
    "jrange": _of_one_joint,
    "hordr": _home_order,
    "weight": _load("weight_kg", _HEAVIEST_KG, "weight_at_mm"),
    "inertia": _load("inertia_kg_m2", 10, "eccentricity_mm"),
    "fine": _fine,
    "speedfactor": _speed_factor,
    "cp": _continuous_path,
    "ecp": _control_point,
    "sfree": _free,
    "slock": _lock,
    "homeset": _home_set,
    "avoidsingularity": _avoid_singularity,
    "singularityangle": _surroundings("angle_deg", 180),
    "singularityspeed": _surroundings("speed_percent", 100),
    "singularitydist": _surroundings("distance_mm", 1000),
}
"""Functions that set or show a setting, by keyword. Each returns the shown text."""
