"""Where the zeros of joints lie, the home position, brakes: Hofs, CalPls, Calib, MCal, Brake.

Source: docs/reference/spel.md 7.2, 7.3.
"""

from collections.abc import Callable, Sequence
from typing import Final

from robolink_simulators.epson.definitions.drive_settings import RestoredAt
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.joint_functions import (
    JOINT_COUNTS,
    another_robot,
    pulses_of,
)
from robolink_simulators.epson.spel.expressions.printing import CRLF
from robolink_simulators.epson.spel.expressions.values import Number, out_of_range

Numbers = Sequence[Number]


def _one_a_joint(machine: Machine, word: str, values: Numbers) -> list[int]:
    axes = machine.model.axes
    if len(values) in JOINT_COUNTS - {axes}:
        raise another_robot(machine.model)
    if len(values) != axes:
        raise SpelRefusal(RefusalKind.SYNTAX, f"{word} takes {axes} values")
    return [int(value) for value in values]


def _listed(values: Sequence[int]) -> str:
    return ", ".join(map(str, values)) + CRLF


def _offsets(machine: Machine, values: Numbers) -> str:
    """Set or list Hofs."""
    if not values:
        return _listed(machine.kept.origins.offsets)
    _require_rest(machine)
    machine.robot.offset_origins(_one_a_joint(machine, "Hofs", values))
    return ""


def _reference(machine: Machine, values: Numbers) -> str:
    """Set or list CalPls; what it lists before it was set is not documented: 0 (assumed)."""
    origins = machine.kept.origins
    if not values:
        return _listed(origins.reference or (0,) * machine.model.axes)
    origins.refer_to(_one_a_joint(machine, "CalPls", values))
    return ""


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


def _order(machine: Machine, values: Numbers) -> str:
    """Set or list MCordr."""
    if not values:
        return _listed(machine.kept.origins.order)
    order = _one_a_joint(machine, "MCordr", values)
    highest = (1 << machine.model.axes) - 1
    if any(not 0 <= step <= highest for step in order):
        raise out_of_range(f"Allowed are 0 to {highest}")
    machine.kept.origins.move_in(order)
    return ""


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
"""Keyword to what carries it out; what is shown comes back as text."""
