"""What a kinematics of one's own offers, by the interfaces of the vendor's library.

A class that has these methods can be simulated (``module:Class`` in place of the name of a
kinematics), and a tool is checked against it before it is written. Names are those of
SM3_Transformation in Python's spelling: ``GetFlangeOrientationImage`` is
``get_flange_orientation_image``, ``vRot`` is ``v_rot``. Source: docs/reference/softmotion.md 3.1;
a worked example: docs/custom-kinematics.md.

A class for the PLC is written in Structured Text; this one stands for it on the PC.
"""

import importlib
from collections.abc import Mapping
from enum import StrEnum
from typing import Any, Protocol, runtime_checkable

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model.motion.orientation_coupling import OrientationImage
from robolink.model.motion.orientation_space import Direction3, OrientationSpace, RotationMatrix

AxisPositions = tuple[float, ...]
"""``AXISPOS_REF``: one value an axis, a0 first; degrees of a rotary axis, mm of a linear one."""

FlangeFrame = tuple[Direction3, RotationMatrix]
"""Where a flange stands: its place in mm, and how it is turned."""


class AxisKind(StrEnum):
    """How an axis moves."""

    ROTARY = "rotary"
    LINEAR = "linear"


def is_custom(part: str) -> bool:
    """Tell whether a name of a kinematics, or of a part of one, stands for a class."""
    return ":" in part


def kinematics_class(part: str) -> type[Any]:
    """Return the class that ``module:Class`` names; its module is imported.

    Raises:
        ConfigError: There is no such class.
    """
    module, _, name = part.partition(":")
    try:
        found = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise ConfigError(
            tr("There is no class {name!r}: {cause}.", name=part, cause=error),
            remedy=tr("Give module:Class; Python must find the module (PYTHONPATH)."),
        ) from error
    if not isinstance(found, type):
        raise ConfigError(
            tr("{name!r} is not a class.", name=part), remedy=tr("Give module:Class.")
        )
    return found


def kinematics_object(part: str, numbers: Mapping[str, float] | None = None) -> object:
    """Return an object of the class that ``module:Class`` names.

    Args:
        part: The name.
        numbers: What its constructor is given.

    Raises:
        ConfigError: There is no such class, or its constructor refuses.
    """
    found = kinematics_class(part)
    try:
        made: object = found(**(numbers or {}))
    except (TypeError, ValueError) as error:
        raise ConfigError(
            tr("{name} cannot be made: {cause}.", name=part, cause=error),
            remedy=tr("Its constructor takes numbers by name, each with a default."),
        ) from error
    return made


@runtime_checkable
class MCKinRefSM3(Protocol):
    """``MC_KIN_REF_SM3``: axes to flange and back.

    A class may also say ``axis_settings`` (``ISMKinematicAxisSettings``): the lowest and the
    highest value of each axis, a0 first. They are the limits of simulated drives.
    """

    @property
    def kinds(self) -> tuple[AxisKind, ...]:
        """The axes, a0 first."""

    def axes_to_cartesian(self, axes: AxisPositions) -> FlangeFrame:
        """Return where the flange is: in the machine's coordinate system, or, of an orientation
        kinematics, on the flange that carries it.

        Raises:
            NotReachable: The axes cannot stand so.
        """  # noqa: D205 - one sentence over two lines

    def cartesian_to_axes(self, flange: FlangeFrame, near: AxisPositions) -> AxisPositions:
        """Return the axes that bring the flange there.

        Args:
            flange: Its orientation is a member of the space that the image gave for it. A
                position kinematics turns as it must; an orientation kinematics is asked for its
                orientation only.
            near: Of several solutions the one that is nearest to these is wanted.

        Raises:
            NotReachable: The flange cannot come there.
        """


@runtime_checkable
class ISMKinematicsWithOrientationImage(Protocol):
    """``ISMKinematicsWithOrientationImage``: without it no tool can be set at all."""

    def get_flange_orientation_image(self, r_flange: RotationMatrix) -> OrientationSpace:
        """Return which orientations of the flange can result for a programmed one (``oriInfo``).

        Args:
            r_flange: ``mR_Flange``: the programmed orientation.

        Raises:
            NotReachable: None is nearest to this one.
        """


@runtime_checkable
class ISMPositionKinematics2(Protocol):
    """``ISMPositionKinematics2``: a kinematics of up to three axes that may carry another one."""

    def get_orientation_image(self) -> OrientationSpace:
        """Return the orientations in which its flange can stand."""


@runtime_checkable
class ISMOrientationKinematicsWithOriImage2(Protocol):
    """``ISMOrientationKinematicsWithOriImage2``: axes that turn a flange on another one."""

    def get_orientation_image_2(
        self, r_flange: RotationMatrix, base: OrientationSpace
    ) -> OrientationImage:
        """Return the orientations that it gives for a programmed one, and whether on purpose.

        Args:
            r_flange: ``mR_Flange``: the programmed orientation of its flange.
            base: ``oriInfoBase``: how the flange stands that carries it.

        Raises:
            NotReachable: None is nearest to this one.
        """

    def get_position_from_orientation(
        self, flange: FlangeFrame, base: OrientationSpace
    ) -> Direction3:
        """Return where the flange that carries it must be, in mm, for its own to stand there."""
