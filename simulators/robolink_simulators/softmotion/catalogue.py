"""Machines by the name of their kinematics, with parameters as their blocks name them."""

import inspect
import math
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from itertools import product
from typing import Any, Final, TypeVar, cast

from robolink.errors import ConfigError
from robolink.messages import joined, known_names, tr
from robolink.model import (
    AxisKind,
    ISMKinematicsWithOrientationImage,
    ISMOrientationKinematicsWithOriImage2,
    ISMPositionKinematics2,
    MCKinRefSM3,
    NotReachable,
    OrientationImage,
    OrientationSpace,
    is_custom,
    kinematics_class,
    kinematics_object,
)
from robolink_simulators.cell.frames import Frame, Matrix, Vector
from robolink_simulators.softmotion.group.axes import ASSUMED_LIMITS, AxisLimits
from robolink_simulators.softmotion.kinematics.kinematics import (
    ANY_CONFIGURATION,
    AxisValues,
    Configuration,
    KinematicsModel,
)
from robolink_simulators.softmotion.kinematics.wrists import Coupled, require_solvable
from robolink_simulators.softmotion.rows import (
    ORIENTATION_ROWS,
    POSITION_ROWS,
    STANDALONE_ROWS,
    KinematicsRow,
)
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

_COUPLING: Final = "+"
_MOST_AXES: Final = 6

NAMES: Final = (
    *STANDALONE_ROWS,
    *POSITION_ROWS,
    *(_COUPLING.join(parts) for parts in product(POSITION_ROWS, ORIENTATION_ROWS)),
)
"""Every kinematics that can be simulated; couplings come after the stand-alone ones."""


@dataclass(frozen=True, slots=True)
class MachineModel:
    """A kinematics and the limits of its drives.

    Attributes:
        kinematics: What connects axes and flange.
        limits: Of each drive, a0 first.
    """

    kinematics: KinematicsModel
    limits: tuple[AxisLimits, ...]


def machine_named(name: str, parameters: Mapping[str, float] | None = None) -> MachineModel:
    """Return a machine.

    Args:
        name: One of :data:`NAMES`, or ``module:Class`` in place of a part of it, for a
            kinematics of one's own (docs/custom-kinematics.md).
        parameters: ``dArmLength1``, ``dToolLength`` and the like in mm, ``dOffsetC`` in
            degrees, and ``a0_low``, ``a0_high``, ``a0_velocity_per_s``,
            ``a0_acceleration_per_s2`` of each axis in degrees or mm.

    Raises:
        ConfigError: No such kinematics or parameter, or a value that makes no machine.
    """
    left = dict(parameters or {})
    _require_finite(left)
    parts = _parts(name)
    kinematics = _made(name, parts, left)
    limits = tuple(
        _limits(axis, assumed, left) for axis, assumed in enumerate(_assumed(parts, kinematics))
    )
    if left:
        raise ConfigError(
            tr(
                "{kinematics} has no parameter {names}.",
                kinematics=name,
                names=", ".join(sorted(left)),
            ),
            remedy=known_names(parameter_names(name), min(left)),
        )
    _require_standing(name, kinematics, limits)
    model = MachineModel(kinematics, limits)
    if any(map(is_custom, name.split(_COUPLING))):
        require_true(name, kinematics, [(it.low, it.high) for it in limits])
    return model


def parameter_names(name: str) -> tuple[str, ...]:
    """Return the parameters that a kinematics takes.

    Raises:
        ConfigError: There is no such kinematics.
    """
    parts = _parts(name)
    own = [key for part in parts for key in part.parameters]
    axes = range(len(_made(name, parts, {}).kinds))
    return (*own, *(f"a{axis}_{limit.name}" for axis in axes for limit in fields(AxisLimits)))


def complete_kinematics(start: str) -> list[str]:
    """Return the names that begin so, in any case; couplings when a + is there or nothing else."""
    begun = start.casefold()
    found = [name for name in NAMES if name.casefold().startswith(begun)]
    whole = [name for name in found if _COUPLING not in name]
    return found if _COUPLING in start or not whole else whole


def _parts(name: str) -> list[KinematicsRow]:
    """Return the rows of a kinematics; what is coupled comes second."""
    first, *others = name.split(_COUPLING)
    if len(others) > 1:
        raise _no_machine(name)
    if first in ORIENTATION_ROWS and not others:
        raise ConfigError(
            tr("{name} turns the flange of another kinematics and moves none itself.", name=first),
            remedy=tr("Couple it, for example Kin_Gantry3+{name}.", name=first),
        )
    if first in STANDALONE_ROWS and others:
        raise ConfigError(
            tr("{name} is complete: nothing can be coupled to it.", name=first),
            remedy=tr("Couple to one of {names}.", names=", ".join(POSITION_ROWS)),
        )
    rows = [_row(first, name, {**POSITION_ROWS, **STANDALONE_ROWS}, carries=bool(others))]
    return rows + [_row(other, name, ORIENTATION_ROWS, orients=True) for other in others]


def _row(
    part: str,
    name: str,
    known: Mapping[str, KinematicsRow],
    *,
    carries: bool = False,
    orients: bool = False,
) -> KinematicsRow:
    if is_custom(part):
        return load_row(part, carries=carries, orients=orients)
    if part not in known:
        raise _no_machine(name)
    return known[part]


def _no_machine(name: str) -> ConfigError:
    return ConfigError(
        tr("The simulator has no kinematics {name!r}.", name=name),
        remedy=joined(
            " ",
            (
                known_names(NAMES, name),
                tr(
                    "Or give module:Class for your own. See docs/reference/simulated-softmotion.md."
                ),
            ),
        ),
    )


def _require_finite(parameters: Mapping[str, float]) -> None:
    for name, value in parameters.items():
        if not math.isfinite(value):
            raise ConfigError(
                tr("The parameter {name} cannot be {value!r}.", name=name, value=value),
                remedy=tr("Give a finite decimal number."),
            )


def _made(name: str, parts: Sequence[KinematicsRow], left: dict[str, float]) -> KinematicsModel:
    position, *orientations = (_made_part(part, left) for part in parts)
    if not orientations:
        return cast(KinematicsModel, position)
    coupled = Coupled(position, orientations[0])
    if len(coupled.kinds) > _MOST_AXES:
        raise ConfigError(
            tr("{name} would have {count} axes.", name=name, count=len(coupled.kinds)),
            remedy=tr("An axis group has at most {most}.", most=_MOST_AXES),
        )
    require_solvable(coupled)
    return coupled


def _made_part(row: KinematicsRow, left: dict[str, float]) -> Any:  # noqa: ANN401 - either kind
    values = {key: left.pop(key, default) for key, default in row.parameters.items()}
    short = [key for key in row.positive if values[key] <= 0]
    if short:
        raise ConfigError(
            tr("{name} cannot be {length_mm} mm.", name=short[0], length_mm=values[short[0]]),
            remedy=tr("Give lengths of arms and rods in mm, above zero."),
        )
    return row.make(*values.values())


def _assumed(parts: Sequence[KinematicsRow], kinematics: KinematicsModel) -> list[AxisLimits]:
    """Return the limits of the drives, those of a coupled part after the others."""
    special = dict(parts[0].limits)
    if len(parts) > 1:
        behind = len(cast(Coupled, kinematics).position.kinds)
        special |= {behind + axis: limits for axis, limits in parts[1].limits.items()}
    return [special.get(n, ASSUMED_LIMITS[kind]) for n, kind in enumerate(kinematics.kinds)]


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


def _require_standing(name: str, kinematics: KinematicsModel, limits: Sequence[AxisLimits]) -> None:
    """Refuse limits that let the axes reach an impossible state, as rods can."""
    try:
        for corner in product(*((it.low, it.high) for it in limits)):
            kinematics.flange(corner)
    except BlockRefused as refused:
        raise ConfigError(
            tr(
                "{name} cannot be at the limits of its axes: {cause}.",
                name=name,
                cause=refused.text,
            ),
            remedy=tr("Narrow the limits of the axes, or correct the lengths."),
        ) from refused


Answered = TypeVar("Answered")

_TRIES: Final = 40
_MISSED_MM: Final = 1e-4


def load_row(part: str, *, carries: bool = False, orients: bool = False) -> KinematicsRow:
    """Return a row for a class; the numbers that its constructor takes are its parameters.

    Args:
        part: ``module:Class``.
        carries: Whether an orientation kinematics is coupled to it.
        orients: Whether it is to be coupled to a position kinematics.

    Raises:
        ConfigError: There is no such class, or it lacks an interface.
    """
    found = kinematics_class(part)
    numbers = {
        name: float(it.default)
        for name, it in inspect.signature(found).parameters.items()
        if isinstance(it.default, int | float)
    }

    def make(*values: float) -> CustomPosition | CustomOrientation:
        own = kinematics_object(part, dict(zip(numbers, values, strict=True)))
        _require_interfaces(part, own, orients=orients)
        return CustomOrientation(part, own) if orients else CustomPosition(part, own, carries)

    settings = zip(getattr(found, "kinds", ()), getattr(found, "axis_settings", ()), strict=False)
    limits = {
        axis: replace(ASSUMED_LIMITS[kind], low=low, high=high)
        for axis, (kind, (low, high)) in enumerate(settings)
    }
    return KinematicsRow(make, numbers, limits=limits)


def require_true(
    name: str, kinematics: KinematicsModel, limits: Sequence[tuple[float, float]]
) -> None:
    """Test a kinematics' own claims at axis values drawn within their limits.

    Raises:
        ConfigError: A flange orientation lies outside of the space that the image gives for it,
            or the axes found for a flange bring it elsewhere.
    """
    draw = random.Random(name)
    for _ in range(_TRIES):
        axes = tuple(draw.uniform(low, high) for low, high in limits)
        flange = kinematics.flange(axes)
        space = kinematics.orientation_image(flange.rotation)
        if space is not None and not space.holds(flange.rotation):
            raise ConfigError(
                tr(
                    "The orientation image of {name} does not hold the flange at {axes}.",
                    name=name,
                    axes=_rounded(axes),
                ),
                remedy=tr("Correct it: a tool that it accepts would not be where it is believed."),
            )
        back = kinematics.flange(kinematics.axes_for(flange, kinematics.configuration(axes), axes))
        missed = max(abs(a - b) for a, b in zip(back.shift_mm, flange.shift_mm, strict=True))
        if not missed <= _MISSED_MM:
            raise ConfigError(
                tr(
                    "{name} finds axes for its flange at {axes} that bring it elsewhere.",
                    name=name,
                    axes=_rounded(axes),
                ),
                remedy=tr("Correct cartesian_to_axes, or narrow the limits of the axes."),
            )


@dataclass(frozen=True, slots=True)
class _OwnKinematics:
    """A user's own class as the simulated group uses it.

    Attributes:
        name: ``module:Class``.
        own: The object.
    """

    name: str
    own: Any

    @property
    def kinds(self) -> tuple[AxisKind, ...]:
        """The axes, a0 first."""
        return tuple(self.own.kinds)

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is; of an orientation kinematics on the one that carries it."""
        return _asked(lambda: Frame(*self.own.axes_to_cartesian(axes)))

    def configuration(self, axes: AxisValues) -> Configuration:  # noqa: ARG002 - has none
        """Return that there is none: the solution nearest to the present axes is used."""
        return ANY_CONFIGURATION


@dataclass(frozen=True, slots=True)
class CustomPosition(_OwnKinematics):
    """A user's own kinematics that moves the machine.

    Attributes:
        carries: Whether an orientation kinematics is coupled to it: then ISMPositionKinematics2
            tells how its flange stands, as on the PLC.
    """

    carries: bool

    def axes_for(
        self,
        flange: Frame,
        configuration: Configuration,  # noqa: ARG002 - has none
        near: AxisValues,
    ) -> AxisValues:
        """Return the axis values that move the flange there."""
        wanted = (flange.shift_mm, flange.rotation)
        return _asked(lambda: tuple[float, ...](self.own.cartesian_to_axes(wanted, near)))

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:
        """Return what is known of the flange; ``None`` if the class has no interface for it."""
        if isinstance(self.own, ISMKinematicsWithOrientationImage) and not self.carries:
            return _asked(partial(self.own.get_flange_orientation_image, wanted))
        if isinstance(self.own, ISMPositionKinematics2):
            return self.own.get_orientation_image()
        return None


@dataclass(frozen=True, slots=True)
class CustomOrientation(_OwnKinematics):
    """A user's own kinematics that turns a flange on another one."""

    def axes_for(
        self,
        rotation: Matrix,
        configuration: Configuration,  # noqa: ARG002 - has none
        near: AxisValues,
    ) -> AxisValues:
        """Return the axes that give an orientation."""
        wanted = ((0.0, 0.0, 0.0), rotation)
        return _asked(lambda: tuple[float, ...](self.own.cartesian_to_axes(wanted, near)))

    def image(self, wanted: Matrix, base: OrientationSpace) -> OrientationImage:
        """Return which orientations it gives."""
        image: OrientationImage = self.own.get_orientation_image_2(wanted, base)
        return image

    def carried_at(self, flange: Frame, base: OrientationSpace) -> Vector:
        """Return where the flange must be that carries it."""
        own, wanted = self.own, (flange.shift_mm, flange.rotation)
        place: Vector = _asked(lambda: own.get_position_from_orientation(wanted, base))
        return place


def _asked(question: Callable[[], Answered]) -> Answered:
    try:
        return question()
    except NotReachable as unreachable:
        raise BlockRefused(ErrorKind.UNREACHABLE, str(unreachable)) from unreachable


def _require_interfaces(part: str, own: object, *, orients: bool) -> None:
    lacking = [] if isinstance(own, MCKinRefSM3) else ["MC_KIN_REF_SM3"]
    if orients and not isinstance(own, ISMOrientationKinematicsWithOriImage2):
        lacking.append("ISMOrientationKinematicsWithOriImage2")
    if lacking:
        raise ConfigError(
            tr("{name} lacks methods of {lacking}.", name=part, lacking=", ".join(lacking)),
            remedy=tr("See docs/custom-kinematics.md for what each interface holds."),
        )


def _rounded(axes: AxisValues) -> str:
    return ", ".join(f"{value:.1f}" for value in axes)
