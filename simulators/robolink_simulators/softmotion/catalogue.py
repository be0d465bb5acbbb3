"""Machines by the name of their kinematics, with parameters as their blocks name them."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.softmotion.kinematics.coupled import CAxis, Coupled, scara3_z
from robolink_simulators.softmotion.kinematics.five_axes import FiveAxes
from robolink_simulators.softmotion.kinematics.kinematics import AxisKind, KinematicsModel
from robolink_simulators.softmotion.kinematics.positions import Gantry3, PolarZ, Scara2Z
from robolink_simulators.softmotion.motion.axes import ASSUMED_LIMITS, AxisLimits

_COUPLED: Final = "+Kin_CAxis"
_C_AXIS: Final = 3
"""Place of a C axis that is coupled to a position kinematics, in the row of axes."""

_C_LIMITS: Final = AxisLimits(-360.0, 360.0, 720.0, 3600.0)
# The world puts each axis at 60 % of its range: a tool that can lean stands upright there.
_LEAN_LIMITS: Final = AxisLimits(-90.0, 60.0, 360.0, 1800.0)
_RADIUS_LIMITS: Final = replace(ASSUMED_LIMITS[AxisKind.LINEAR], low=0.0, high=600.0)


@dataclass(frozen=True, slots=True)
class MachineModel:
    """A kinematics and the limits of its drives.

    Attributes:
        kinematics: What connects axes and flange.
        limits: Of each drive, a0 first.
    """

    kinematics: KinematicsModel
    limits: tuple[AxisLimits, ...]


@dataclass(frozen=True, slots=True)
class _Entry:
    """How a kinematics is made.

    Attributes:
        make: Makes it.
        parameters: Their names, and the values that they have by default.
        arms: How many of them, from the first, are lengths of arms, which are above zero.
        limits: Of axes that are not like others of their kind.
    """

    make: Callable[..., KinematicsModel]
    parameters: Mapping[str, float]
    arms: int = 0
    limits: Mapping[int, AxisLimits] = field(default_factory=dict)


_ARMS: Final = {"dArmLength1": 300.0, "dArmLength2": 200.0}

_ENTRIES: Final = {
    "Kin_Scara2_Z": _Entry(Scara2Z, _ARMS, arms=2),
    "Kin_Scara3_Z": _Entry(scara3_z, {**_ARMS, "dArmLength3": 0.0}, arms=2, limits={2: _C_LIMITS}),
    "Kin_Polar_Z": _Entry(PolarZ, {}, limits={1: _RADIUS_LIMITS}),
    "Kin_Gantry3": _Entry(Gantry3, {}),
    "Kin_5Axes": _Entry(FiveAxes, {"dToolLength": 100.0}, limits={3: _C_LIMITS, 4: _LEAN_LIMITS}),
}

NAMES: Final = (
    "Kin_Scara2_Z",
    "Kin_Scara2_Z+Kin_CAxis",
    "Kin_Scara3_Z",
    "Kin_Polar_Z",
    "Kin_Polar_Z+Kin_CAxis",
    "Kin_Gantry3",
    "Kin_Gantry3+Kin_CAxis",
    "Kin_5Axes",
)
"""Every kinematics that can be simulated. Kin_Scara3_Z and Kin_5Axes are couplings already."""


def machine_named(name: str, parameters: Mapping[str, float] | None = None) -> MachineModel:
    """Return a machine.

    Args:
        name: One of :data:`NAMES`.
        parameters: ``dArmLength1``, ``dToolLength`` and the like in mm, ``dOffsetC`` in
            degrees, and ``a0_low``, ``a0_high``, ``a0_velocity_per_s``,
            ``a0_acceleration_per_s2`` of each axis in degrees or mm.

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
        _limits(axis, assumed, left) for axis, assumed in enumerate(_assumed(name, kinematics))
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
    return (*own, *(f"a{axis}_{limit.name}" for axis in axes for limit in fields(AxisLimits)))


def _require_finite(parameters: Mapping[str, float]) -> None:
    for name, value in parameters.items():
        if not math.isfinite(value):
            raise ConfigError(
                tr("The parameter {name} cannot be {value}.", name=name, value=value),
                remedy=tr("Give a finite decimal number."),
            )


def _made(name: str, left: dict[str, float]) -> KinematicsModel:
    entry = _ENTRIES[name.removesuffix(_COUPLED)]
    lengths_mm = [left.pop(key, default) for key, default in entry.parameters.items()]
    arms_mm = lengths_mm[: entry.arms]
    if any(length_mm <= 0 for length_mm in arms_mm):
        raise ConfigError(
            tr("An arm cannot be {length_mm} mm long.", length_mm=min(arms_mm)),
            remedy=tr("Give the lengths of the arms in mm, above zero."),
        )
    position = entry.make(*lengths_mm)
    if not name.endswith(_COUPLED):
        return position
    c_axis = CAxis(offset_deg=left.pop("dOffsetC", 0.0))
    return Coupled(position, c_axis, c_index=_C_AXIS)


def _assumed(name: str, kinematics: KinematicsModel) -> Iterator[AxisLimits]:
    entry = _ENTRIES[name.removesuffix(_COUPLED)]
    special = {**entry.limits, **({_C_AXIS: _C_LIMITS} if name.endswith(_COUPLED) else {})}
    for axis, kind in enumerate(kinematics.kinds):
        yield special.get(axis, ASSUMED_LIMITS[kind])


def _limits(axis: int, assumed: AxisLimits, left: dict[str, float]) -> AxisLimits:
    given = {
        limit.name: left.pop(f"a{axis}_{limit.name}")
        for limit in fields(AxisLimits)
        if f"a{axis}_{limit.name}" in left
    }
    limits = replace(assumed, **given)
    usable = limits.low < limits.high and min(limits.velocity_per_s, limits.acceleration_per_s2) > 0
    if not usable:
        raise ConfigError(
            tr("The limits of axis {axis} make no sense.", axis=axis),
            remedy=tr("Give low below high, and velocity and acceleration above zero."),
        )
    return limits
