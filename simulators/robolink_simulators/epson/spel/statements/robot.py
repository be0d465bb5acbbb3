"""Keyword statements about load, free joints and the home position.

Source: docs/reference/spel.md 6.2, 7.2, 7.3.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

from robolink_simulators.epson.arm.robot_settings import SingularSurroundings
from robolink_simulators.epson.arm.robots import Mechanism
from robolink_simulators.epson.definitions.drive_settings import RestoredAt
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.joint_functions import JOINT_COUNTS, another_robot
from robolink_simulators.epson.spel.expressions.printing import CRLF, number_text
from robolink_simulators.epson.spel.expressions.values import Number, out_of_range
from robolink_simulators.epson.spel.statements.defined.added_arms import ARM_SETTINGS
from robolink_simulators.epson.spel.statements.defined.arches import ARCH_SETTINGS
from robolink_simulators.epson.spel.statements.defined.drive_settings import DRIVE_STATEMENTS
from robolink_simulators.epson.spel.statements.defined.joint_ranges import RANGE_STATEMENTS
from robolink_simulators.epson.spel.statements.defined.origins import ORIGIN_STATEMENTS
from robolink_simulators.epson.spel.statements.defined.xy_limits import LIMIT_SETTINGS
from robolink_simulators.epson.spel.statements.torques import TORQUE_STATEMENTS

Numbers = Sequence[Number]
Setting = Callable[[Machine, Numbers], str]

_HIGHEST_FINE: Final = 65535
_HEAVIEST_KG: Final = 20.0
"""Assumed; per model in the reference, where too much is an error."""


def _expect(values: Numbers, *counts: int) -> None:
    if len(values) not in counts:
        raise SpelRefusal(RefusalKind.SYNTAX, f"{len(values)} values, not one of {counts}")


def _within(value: Number, low: float, high: float) -> float:
    if not low <= value <= high:
        raise out_of_range(f"Allowed are {low:g} to {high:g}")
    return float(value)


def _weight(machine: Machine, values: Numbers) -> str:
    settings = machine.settings
    _expect(values, 0, 1, 2)
    if not values:
        return f"{settings.weight_kg:.3f}, {settings.weight_at_mm:.3f}" + CRLF
    settings.weight_kg = _within(values[0], 0, _HEAVIEST_KG)
    if len(values) > 1:
        settings.weight_at_mm = _within(values[1], 0, 10_000)
    return ""


def _inertia(machine: Machine, values: Numbers) -> str:
    settings = machine.settings
    _expect(values, 0, 1, 2)
    if not values:
        return f"{settings.inertia_kg_m2:.3f}, {settings.eccentricity_mm:.3f}" + CRLF
    settings.inertia_kg_m2 = _within(values[0], 0, 10)
    if len(values) > 1:
        settings.eccentricity_mm = _within(values[1], 0, 10_000)
    return ""


def _fine(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, machine.model.axes)
    if not values:
        return ", ".join(map(str, machine.settings.fine_pulses)) + CRLF
    machine.settings.fine_pulses = tuple(int(_within(value, 0, _HIGHEST_FINE)) for value in values)
    # The one of Fine and FineDist counts that was said last (assumed).
    machine.robot.drives.set("finedist", (0.0,))
    return ""


def _speed_factor(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, 1)
    if not values:
        return number_text(machine.settings.speed_factor) + CRLF
    machine.settings.speed_factor = int(_within(values[0], 1, 100))
    return ""


def _continuous_path(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, 1)
    if not values:
        return number_text(int(machine.settings.continuous_path)) + CRLF
    machine.settings.continuous_path = bool(values[0])
    return ""


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
    _expect(values, 0, machine.model.axes)
    home = machine.settings.home_pulses
    if values:
        machine.settings.home_pulses = tuple(map(int, values))
        return ""
    if home is None:
        raise SpelRefusal(RefusalKind.HOME_UNDEFINED, "No home position is set")
    return "".join(f"{a} {b}{CRLF}" for a, b in zip(home[::2], home[1::2], strict=True))


def _control_point(machine: Machine, values: Numbers) -> str:
    _expect(values, 0, 1)
    if not values:
        return number_text(machine.control_points.selected) + CRLF
    machine.control_points.select(int(values[0]))
    return ""


def _avoid_singularity(machine: Machine, values: Numbers) -> str:
    """Set or show AvoidSingularity; 5 is for another kind of robot (documented: 4002)."""
    if machine.model.mechanism is Mechanism.SCARA:
        raise another_robot(machine.model)
    _expect(values, 0, 1)
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
        _expect(values, 0, 1)
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
    **RANGE_STATEMENTS,
    **TORQUE_STATEMENTS,
    **ORIGIN_STATEMENTS,
    "weight": _weight,
    "inertia": _inertia,
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
"""Keyword to what sets or shows it; what is shown comes back as text."""
