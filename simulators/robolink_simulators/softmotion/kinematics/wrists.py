"""The orientation kinematics: axes that turn the flange on a position kinematics.

Parameters and axes as in docs/reference/softmotion.md 3.3; the evidence of each stands at its
class.
"""

import math
from dataclasses import dataclass, field
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import (
    AxisKind,
    CsTool,
    NotReachable,
    OrientationDof,
    OrientationImage,
    OrientationSpace,
    combined_space,
)
from robolink_simulators.cell.frames import (
    NO_TURN,
    ORIGIN,
    Y_AXIS,
    Z_AXIS,
    Frame,
    Matrix,
    Vector,
    about,
    product,
    subtract,
    transposed,
    turned,
    zyz,
    zyz_angles,
)
from robolink_simulators.softmotion.kinematics.kinematics import (
    ANY_CONFIGURATION,
    AxisValues,
    Configuration,
    KinematicsModel,
    OrientationModel,
    near_turn,
)
from robolink_simulators.softmotion.kinematics.positions import (
    Scara2Z,
    about_z,
    about_z_then_y,
    turn_and_lean_deg,
    yaw_deg,
)
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

_STRAIGHT: Final = 1e-9
_NO_SHIFT: Final[Vector] = (0.0, 0.0, 0.0)

# A simulated movement reads these in every cycle.
_DRIVEN_ABOUT_Z: Final = OrientationImage(
    CsTool.FLANGE, OrientationSpace(OrientationDof.ONE), b_active=True
)
_NOT_TURNED: Final = OrientationImage(
    CsTool.FLANGE, OrientationSpace.known(NO_TURN), b_active=False
)


@dataclass(frozen=True, slots=True)
class CAxis:
    """``Kin_CAxis`` and ``Kin_CAxis_Tool``: one axis about Z, the second with a fixed shift.

    Documented: the axis, that ``dOffsetC`` is taken off the axis value before the forward
    transformation, that every orientation is projected to the closest turn about Z, except where
    Z points the other way, and that the freedom is active. Inferred: ``dToolX``, ``dToolY`` and
    ``dToolZ`` turn with the axis.

    Attributes:
        tool_mm: ``dToolX``, ``dToolY``, ``dToolZ``.
        offset_deg: ``dOffsetC``.
        name: Name of the function block.
    """

    tool_mm: Vector = _NO_SHIFT
    offset_deg: float = 0.0
    name: str = "Kin_CAxis"

    kinds = (AxisKind.ROTARY,)

    def flange(self, axes: AxisValues) -> Frame:
        """Return where its flange is on the one that carries it."""
        return Frame(rotation=about_z(axes[0] - self.offset_deg)) @ Frame(self.tool_mm)

    def configuration(self, axes: AxisValues) -> Configuration:  # noqa: ARG002 - has none
        """Return that there is none."""
        return ANY_CONFIGURATION

    def axes_for(
        self,
        rotation: Matrix,
        configuration: Configuration,  # noqa: ARG002 - has none
        near: AxisValues,
    ) -> AxisValues:
        """Return the closest turn."""
        angle_deg = yaw_deg(rotation)
        if angle_deg is None:
            raise BlockRefused(
                ErrorKind.UNREACHABLE, "The Z axis of the flange cannot point the other way"
            )
        return (near_turn(angle_deg + self.offset_deg, near[0]),)

    def image(self, wanted: Matrix, base: OrientationSpace) -> OrientationImage:  # noqa: ARG002
        """Return that Z stays and the turn about it is driven."""
        return _DRIVEN_ABOUT_Z

    def carried_at(self, flange: Frame, base: OrientationSpace) -> Vector:  # noqa: ARG002
        """Return where the flange must be that carries it."""
        return flange.point(_opposite(self.tool_mm))


@dataclass(frozen=True, slots=True)
class FixedTool:
    """``Kin_Tool``: no axis, a shift that turns with the flange that carries it (documented).

    Attributes:
        tool_mm: ``dToolX``, ``dToolY``, ``dToolZ``.
    """

    tool_mm: Vector = _NO_SHIFT

    name = "Kin_Tool"
    kinds: tuple[AxisKind, ...] = ()

    def flange(self, axes: AxisValues) -> Frame:  # noqa: ARG002 - has none
        """Return where its flange is on the one that carries it."""
        return Frame(self.tool_mm)

    def configuration(self, axes: AxisValues) -> Configuration:  # noqa: ARG002 - has none
        """Return that there is none."""
        return ANY_CONFIGURATION

    def axes_for(
        self,
        rotation: Matrix,  # noqa: ARG002 - has no axis
        configuration: Configuration,  # noqa: ARG002
        near: AxisValues,  # noqa: ARG002
    ) -> AxisValues:
        """Return no axes."""
        return ()

    def image(self, wanted: Matrix, base: OrientationSpace) -> OrientationImage:  # noqa: ARG002
        """Return that nothing is turned."""
        return _NOT_TURNED

    def carried_at(self, flange: Frame, base: OrientationSpace) -> Vector:  # noqa: ARG002
        """Return where the flange must be that carries it."""
        return flange.point(_opposite(self.tool_mm))


@dataclass(frozen=True, slots=True)
class Wrist2:
    """``Kin_Wrist2``: a turn about Z, then about the new Y.

    Documented: the axes, the parameters, that the roll axis may be shifted only on a flange that
    never turns, and that the freedom is passive: the direction of Z is what was programmed, the
    turn about it is left over. Inferred: where it is known how the carrying flange stands, but
    for a turn about its Z, the axes follow and with them the whole orientation.

    Attributes:
        tool_length_mm: ``dToolLength``: from the roll axis to the flange, along the flange's Z.
        roll_axis_mm: ``dRollAxisOffsetX``, ``Y``, ``Z``: where the roll axis is, turned with a0.
        leans: Sign of a1.
        name: Name of the function block.
    """

    tool_length_mm: float = 0.0
    roll_axis_mm: Vector = _NO_SHIFT
    leans: int = 1
    name: str = "Kin_Wrist2"

    kinds = (AxisKind.ROTARY, AxisKind.ROTARY)

    def flange(self, axes: AxisValues) -> Frame:
        """Return where its flange is on the one that carries it."""
        turn = about_z(axes[0])
        rotation = about_z_then_y(axes[0], self.leans * axes[1])
        tool = turned(rotation, (0.0, 0.0, self.tool_length_mm))
        return Frame(subtract(tool, turned(turn, _opposite(self.roll_axis_mm))), rotation)

    def configuration(self, axes: AxisValues) -> Configuration:  # noqa: ARG002 - has none
        """Return that there is none: the closest orientation decides which way it leans."""
        return ANY_CONFIGURATION

    def axes_for(
        self,
        rotation: Matrix,
        configuration: Configuration,  # noqa: ARG002 - has none
        near: AxisValues,
    ) -> AxisValues:
        """Return the axes that give the direction of Z, by the smaller way from ``near``."""
        x, y, z = turned(rotation, Z_AXIS)
        level = math.hypot(x, y)
        lean_deg = math.degrees(math.atan2(level, z))
        if level < _STRAIGHT:
            upright = rotation if z > 0 else product(rotation, about(Y_AXIS, 180.0))
            turn_deg = yaw_deg(upright) or 0.0
            return (near_turn(turn_deg, near[0]), near_turn(self.leans * lean_deg, near[1]))
        turn_deg = math.degrees(math.atan2(y, x))
        ways = [(turn_deg, lean_deg), (turn_deg + 180.0, -lean_deg)]
        found = [(near_turn(a, near[0]), near_turn(self.leans * lean, near[1])) for a, lean in ways]
        # The path that keeps the whole orientation, if it is given; otherwise the shorter one.
        return min(found, key=lambda it: (self._misses(it, rotation), math.dist(it, near)))

    def image(self, wanted: Matrix, base: OrientationSpace) -> OrientationImage:
        """Return the closest orientation, or its direction alone where the base is not known."""
        turns_about_z = base.dof is OrientationDof.ONE and base.v_u == Z_AXIS
        if base.dof is OrientationDof.ZERO or turns_about_z:
            seen = product(transposed(base.m_ori_zero), wanted)
            known = product(base.m_ori_zero, about_z_then_y(*turn_and_lean_deg(seen)))
            return OrientationImage(CsTool.MCS, OrientationSpace.known(known), b_active=False)
        space = OrientationSpace.directed(Z_AXIS, turned(wanted, Z_AXIS), wanted)
        return OrientationImage(CsTool.MCS, space, b_active=False)

    def carried_at(self, flange: Frame, base: OrientationSpace) -> Vector:
        """Return where the flange must be that carries it."""
        roll_axis = flange.point((0.0, 0.0, -self.tool_length_mm))
        if not any(self.roll_axis_mm):
            return roll_axis
        seen = product(transposed(base.m_ori_zero), flange.rotation)
        turn_deg, _ = turn_and_lean_deg(seen)
        shift = turned(product(base.m_ori_zero, about_z(turn_deg)), self.roll_axis_mm)
        return subtract(roll_axis, shift)

    def _misses(self, axes: AxisValues, rotation: Matrix) -> bool:
        found = about_z_then_y(axes[0], self.leans * axes[1])
        return math.dist(found[0] + found[1], rotation[0] + rotation[1]) > 1e-6


@dataclass(frozen=True, slots=True)
class Wrist3:
    """``Kin_Wrist3``: a turn about Z, then about the new -Y, then about the new Z.

    Documented: axes, parameters, that offsets are taken off the axis values before the forward
    transformation, and that a1 is positive with the hand down. The second axis is the negative
    Y axis by the vendor's table of axes and by its Denavit-Hartenberg rows; its prose says Y.

    Attributes:
        tool_mm: ``dToolOffsetX``, ``Y``, ``Z``: from wrist centre to flange, seen from the flange.
        offsets_deg: ``dOffsetA``, ``dOffsetB``, ``dOffsetC``.
    """

    tool_mm: Vector = _NO_SHIFT
    offsets_deg: Vector = _NO_SHIFT

    name = "Kin_Wrist3"
    kinds = (AxisKind.ROTARY,) * 3

    def flange(self, axes: AxisValues) -> Frame:
        """Return where its flange is on the one that carries it."""
        a, b, c = (value - offset for value, offset in zip(axes, self.offsets_deg, strict=True))
        return Frame(rotation=zyz(a, -b, c)) @ Frame(self.tool_mm)

    def configuration(self, axes: AxisValues) -> Configuration:
        """Return which way the hand points; a stretched one counts as up."""
        return Configuration(hand_down=axes[1] - self.offsets_deg[1] > 0)

    def axes_for(
        self, rotation: Matrix, configuration: Configuration, near: AxisValues
    ) -> AxisValues:
        """Return the axes; where two of them turn about one line, a0 stays as it was."""
        a, lean, c = zyz_angles(rotation)
        down = configuration.hand_down
        if down is None:
            down = bool(self.configuration(near).hand_down)
        if math.sin(math.radians(lean)) < _STRAIGHT:
            kept = near[0] - self.offsets_deg[0]
            c = a - kept if lean < 90.0 else kept - a
            a = kept
        elif down:
            a, c = a + 180.0, c + 180.0
        found = (a, lean if down else -lean, c)
        wanted = [value + offset for value, offset in zip(found, self.offsets_deg, strict=True)]
        return (near_turn(wanted[0], near[0]), wanted[1], near_turn(wanted[2], near[2]))

    def image(self, wanted: Matrix, base: OrientationSpace) -> OrientationImage:  # noqa: ARG002
        """Return that every orientation is taken up as it was programmed."""
        return OrientationImage(CsTool.MCS, OrientationSpace.known(wanted), b_active=True)

    def carried_at(self, flange: Frame, base: OrientationSpace) -> Vector:  # noqa: ARG002
        """Return the centre of the wrist."""
        return flange.point(_opposite(self.tool_mm))


def _opposite(vector: Vector) -> Vector:
    return (-vector[0], -vector[1], -vector[2])


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
    """Kinds of the axes, a0 first."""
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
