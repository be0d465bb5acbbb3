"""Machines by the name of their kinematics, with parameters as their blocks name them."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.softmotion.axes import ASSUMED_LIMITS, AxisLimits
from robolink_simulators.softmotion.coupled import CAxis, Coupled, scara3_z
from robolink_simulators.softmotion.kinematics import Kinematics
from robolink_simulators.softmotion.positions import Gantry3, PolarZ, Scara2Z

_COUPLED: Final = "+Kin_CAxis"
_C_LIMITS: Final = AxisLimits(-360.0, 360.0, 720.0, 3600.0)


@dataclass(frozen=True, slots=True)
class MachineModel:
    """A kinematics and the limits of its drives.

    Attributes:
        kinematics: What connects axes and flange.
        limits: Of each drive, a0 first.
    """

    kinematics: Kinematics
    limits: tuple[AxisLimits, ...]


@dataclass(frozen=True, slots=True)
class _Entry:
    """How a kinematics is made, and its parameters with the values they have by default."""

    make: Callable[..., Kinematics]
    parameters: Mapping[str, float]


_ARMS: Final = {"dArmLength1": 300.0, "dArmLength2": 200.0}

_ENTRIES: Final = {
    "Kin_Scara2_Z": _Entry(Scara2Z, _ARMS),
    "Kin_Scara3_Z": _Entry(scara3_z, {**_ARMS, "dArmLength3": 0.0}),
    "Kin_Polar_Z": _Entry(PolarZ, {}),
    "Kin_Gantry3": _Entry(Gantry3, {}),
}

NAMES: Final = (
    "Kin_Scara2_Z",
    "Kin_Scara2_Z+Kin_CAxis",
    "Kin_Scara3_Z",
    "Kin_Polar_Z",
    "Kin_Polar_Z+Kin_CAxis",
    "Kin_Gantry3",
    "Kin_Gantry3+Kin_CAxis",
)
"""Every kinematics that can be simulated. Kin_Scara3_Z is a coupling already."""


def machine_named(name: str, parameters: Mapping[str, float] | None = None) -> MachineModel:
    """Return a machine.

    Args:
        name: One of :data:`NAMES`.
        parameters: ``dArmLength1`` and the like in mm, ``dOffsetC`` in degrees, and
            ``a0_low``, ``a0_high``, ``a0_velocity_per_s``, ``a0_acceleration_per_s2`` of each
            axis in degrees or mm.

    Raises:
        ConfigError: No such kinematics or parameter, or a value that makes no machine.
    """
    if name not in NAMES:
        raise ConfigError(
            tr("The simulator has no kinematics {name!r}.", name=name),
            remedy=tr("Known are: {names}.", names=", ".join(NAMES)),
        )
    left = dict(parameters or {})
    _require_finite(left)
    kinematics = _made(name, left)
    limits = tuple(
        _limits(axis, _assumed(kinematics, axis), left) for axis in range(len(kinematics.kinds))
    )
    if left:
        raise ConfigError(
            tr(
                "{kinematics} has no parameter {names}.",
                kinematics=name,
                names=", ".join(sorted(left)),
            ),
            remedy=tr("Known are: {names}.", names=", ".join(parameter_names(name))),
        )
    return MachineModel(kinematics, limits)


def parameter_names(name: str) -> tuple[str, ...]:
    """Return the parameters that a kinematics of :data:`NAMES` takes."""
    own = [*_ENTRIES[name.removesuffix(_COUPLED)].parameters]
    if name.endswith(_COUPLED):
        own.append("dOffsetC")
    axes = range(len(_made(name, {}).kinds))
    return (*own, *(f"a{axis}_{field.name}" for axis in axes for field in fields(AxisLimits)))


def _require_finite(parameters: Mapping[str, float]) -> None:
    for name, value in parameters.items():
        if not math.isfinite(value):
            raise ConfigError(
                tr("The parameter {name} cannot be {value}.", name=name, value=value),
                remedy=tr("Give a finite decimal number."),
            )


def _made(name: str, left: dict[str, float]) -> Kinematics:
    entry = _ENTRIES[name.removesuffix(_COUPLED)]
    lengths_mm = [left.pop(key, default) for key, default in entry.parameters.items()]
    if any(length_mm <= 0 for length_mm in lengths_mm[:2]):
        raise ConfigError(
            tr("An arm cannot be {length_mm} mm long.", length_mm=min(lengths_mm)),
            remedy=tr("Give the lengths of the arms in mm, above zero."),
        )
    position = entry.make(*lengths_mm)
    if not name.endswith(_COUPLED):
        return position
    return Coupled(position, CAxis(offset_deg=left.pop("dOffsetC", 0.0)))


def _assumed(kinematics: Kinematics, axis: int) -> AxisLimits:
    if isinstance(kinematics, Coupled) and axis == kinematics.c_index:
        return _C_LIMITS
    limits = ASSUMED_LIMITS[kinematics.kinds[axis]]
    if kinematics.name.startswith(PolarZ.name) and axis == 1:
        return replace(limits, low=0.0, high=600.0)
    return limits


def _limits(axis: int, assumed: AxisLimits, left: dict[str, float]) -> AxisLimits:
    given = {
        field.name: left.pop(f"a{axis}_{field.name}")
        for field in fields(AxisLimits)
        if f"a{axis}_{field.name}" in left
    }
    limits = replace(assumed, **given)
    usable = limits.low < limits.high and min(limits.velocity_per_s, limits.acceleration_per_s2) > 0
    if not usable:
        raise ConfigError(
            tr("The limits of axis {axis} make no sense.", axis=axis),
            remedy=tr("Give low below high, and velocity and acceleration above zero."),
        )
    return limits
