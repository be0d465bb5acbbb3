"""Kinematics of a machine builder's own: a class, named ``module:Class``.

What it must have are the interfaces of :mod:`robolink.model.motion.custom_kinematics`; an example
is docs/custom-kinematics.md. A class whose orientation image says more than its axes keep would
let every check pass and the tip be elsewhere, so what it says is tried when it is loaded.
"""

import inspect
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final, TypeVar

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import (
    AxisKind,
    ISMKinematicsWithOrientationImage,
    ISMOrientationKinematicsWithOriImage2,
    ISMPositionKinematics2,
    MCKinRefSM3,
    NotReachable,
    OrientationImage,
    OrientationSpace,
    kinematics_class,
    kinematics_object,
)
from robolink_simulators.cell.frames import Frame, Matrix, Vector
from robolink_simulators.softmotion.kinematics.kinematics import (
    ANY_CONFIGURATION,
    AxisValues,
    Configuration,
    KinematicsModel,
)
from robolink_simulators.softmotion.motion.axes import ASSUMED_LIMITS
from robolink_simulators.softmotion.rows import KinematicsRow
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

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
    """Try what a kinematics says of itself at axis values drawn within their limits.

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
    """A class of one's own as the simulated group works with it.

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
        """Return that there is none: the solution nearest to the present axes is taken."""
        return ANY_CONFIGURATION


@dataclass(frozen=True, slots=True)
class CustomPosition(_OwnKinematics):
    """A kinematics of one's own that moves the machine.

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
        """Return the axes that bring the flange there."""
        wanted = (flange.shift_mm, flange.rotation)
        return _asked(lambda: tuple[float, ...](self.own.cartesian_to_axes(wanted, near)))

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:
        """Return what is known of the flange; ``None`` where the class has no interface for it."""
        if isinstance(self.own, ISMKinematicsWithOrientationImage) and not self.carries:
            return _asked(partial(self.own.get_flange_orientation_image, wanted))
        if isinstance(self.own, ISMPositionKinematics2):
            return self.own.get_orientation_image()
        return None


@dataclass(frozen=True, slots=True)
class CustomOrientation(_OwnKinematics):
    """A kinematics of one's own that turns a flange on another one."""

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
