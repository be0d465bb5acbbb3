"""A position kinematics with an orientation kinematics on its flange."""

from dataclasses import dataclass, field

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import AxisKind, NotReachable, OrientationDof, OrientationSpace, combined_space
from robolink_simulators.cell.frames import NO_TURN, ORIGIN, Frame, Matrix, product, transposed
from robolink_simulators.softmotion.kinematics.kinematics import (
    AxisValues,
    Configuration,
    KinematicsModel,
    OrientationModel,
)
from robolink_simulators.softmotion.kinematics.positions import Scara2Z
from robolink_simulators.softmotion.kinematics.wrists import CAxis, Wrist2
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind


@dataclass(frozen=True, slots=True)
class Coupled:
    """``Kin_Coupled`` of a position kinematics and an orientation kinematics.

    Source: docs/reference/softmotion.md 3.1 (documented). What is known of its flange follows
    from what is known of the two, by :func:`robolink.model.combined_space`.

    Attributes:
        position: What carries the other one.
        orientation: What turns the flange.
        place: Where the axes of the second stand in the row of axes; behind those of the first
            unless the kinematics maps them elsewhere.
        own_name: Name of a kinematics that is such a coupling itself.
    """

    position: KinematicsModel
    orientation: OrientationModel = field(default_factory=CAxis)
    place: int | None = None
    own_name: str = ""
    kinds: tuple[AxisKind, ...] = field(init=False, repr=False, compare=False)
    """The axes, a0 first."""
    _own: slice = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        carried, own = self.position.kinds, self.orientation.kinds
        at = len(carried) if self.place is None else self.place
        object.__setattr__(self, "kinds", (*carried[:at], *own, *carried[at:]))
        object.__setattr__(self, "_own", slice(at, at + len(own)))

    @property
    def name(self) -> str:
        """Name of the function block, or of both."""
        return self.own_name or f"{self.position.name}+{self.orientation.name}"

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is."""
        return self.position.flange(self._carrying(axes)) @ self.orientation.flange(axes[self._own])

    def configuration(self, axes: AxisValues) -> Configuration:
        """Return what both say."""
        of_position = self.position.configuration(self._carrying(axes))
        return of_position.completed(self.orientation.configuration(axes[self._own]))

    def axes_for(self, flange: Frame, configuration: Configuration, near: AxisValues) -> AxisValues:
        """Return the position part's axes, and those that make up for its turn."""
        base = self.position.orientation_image(flange.rotation) or OrientationSpace.unknown()
        place = Frame(self.orientation.carried_at(flange, base))
        carried = self.position.axes_for(place, configuration, self._carrying(near))
        seen = product(transposed(self.position.flange(carried).rotation), flange.rotation)
        own = self.orientation.axes_for(seen, configuration, near[self._own])
        at = self._own.start
        return (*carried[:at], *own, *carried[at:])

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:
        """Return what is known of the flange; ``None`` where nothing is of the position part."""
        base = self.position.orientation_image(wanted)
        if base is None:
            return None
        try:
            return combined_space(base, self.orientation.image(wanted, base), wanted)
        except NotReachable as unreachable:
            raise BlockRefused(ErrorKind.UNREACHABLE, str(unreachable)) from unreachable

    def _carrying(self, axes: AxisValues) -> AxisValues:
        return (*axes[: self._own.start], *axes[self._own.stop :])


def scara3_z(
    arm_length_1_mm: float = 300.0, arm_length_2_mm: float = 200.0, arm_length_3_mm: float = 0.0
) -> Coupled:
    """Return ``Kin_Scara3_Z``: three rotary axes, then the lift as a3.

    Documented: the flange stands at (L1 + L2 + L3, 0, 0) with all axes 0, and the block
    extends Kin_Coupled.
    """
    return Coupled(
        Scara2Z(arm_length_1_mm, arm_length_2_mm),
        CAxis((arm_length_3_mm, 0.0, 0.0)),
        place=2,
        own_name="Kin_Scara3_Z",
    )


def require_solvable(coupled: Coupled) -> None:
    """Refuse a coupling whose position part cannot be told where to go.

    The way from the flange back to the one that carries it must not depend on a part of the
    orientation that nobody knows: the same rule that decides about tools. The roll axis of a
    Kin_Wrist2 may be shifted only on a flange that never turns (documented).

    Raises:
        ConfigError: Names the parts.
    """
    position, orientation = coupled.position, coupled.orientation
    base = position.orientation_image(NO_TURN) or OrientationSpace.unknown()
    space = coupled.orientation_image(base.m_ori_zero) or OrientationSpace.unknown()
    turns = base.dof is not OrientationDof.ZERO
    rolls = isinstance(orientation, Wrist2) and any(orientation.roll_axis_mm) and turns
    if rolls or not space.accepts(orientation.carried_at(ORIGIN, base)):
        raise ConfigError(
            tr(
                "On {position}, whose flange turns with its arms, {orientation} cannot be shifted "
                "to the side.",
                position=position.name,
                orientation=orientation.name,
            ),
            remedy=tr("Set the shift of {orientation} to 0.", orientation=orientation.name),
        )
