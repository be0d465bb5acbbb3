"""Checks whether a tool fits the kinematics of a PLC, before it is written.

The PLC refuses such a tool by itself, in one word for all of it
(``SMC_AXIS_GROUP_TOOL_OFFSET_INCOMPATIBLE_WITH_KINEMATICS``); here it is said which part of the
shift is impossible and why. A slot that is not in force would even be written without a word.

What is open of the flange's orientation on each kinematics that a mailbox can name.

The code words of the vendor's blocks have their images here; a block of the machine builder's own
(``CUSTOM``) has one where he names its class in Python (docs/custom-kinematics.md). Which tools
follow from an image is decided nowhere but in :mod:`robolink.model._kinematics`.
Source: docs/reference/softmotion.md 3.1, 3.2.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeVar

from robolink.controllers.softmotion.facts import block_name
from robolink.errors import RejectedError
from robolink.messages import tr
from robolink.model import (
    CsTool,
    ISMKinematicsWithOrientationImage,
    ISMOrientationKinematicsWithOriImage2,
    ISMPositionKinematics2,
    NotReachable,
    OrientationDof,
    OrientationImage,
    OrientationSpace,
    RotationMatrix,
    ToolOffset,
    combined_space,
    is_custom,
    kinematics_object,
)
from robolink.protocols.mailbox import ErrorClass, Kinematics, Response

Image = TypeVar("Image")

_UPRIGHT: Final[RotationMatrix] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_HANGING: Final[RotationMatrix] = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
_DIRECTED: Final = OrientationSpace(OrientationDof.ONE)
_OPEN: Final[Mapping[int, OrientationSpace]] = {
    Kinematics.SCARA2_Z: _DIRECTED,
    Kinematics.POLAR: _DIRECTED,
    Kinematics.POLAR_Z: _DIRECTED,
    Kinematics.POS_RRR: OrientationSpace.unknown(),
}
"""Orientation spaces of position kinematics whose flange turns with the machine; on all others the
orientation is known."""

_WHOLE: Final = frozenset(Kinematics) - {Kinematics.NONE, Kinematics.CUSTOM, *_OPEN}


def _driven(_: RotationMatrix, __: OrientationSpace) -> OrientationImage:
    return OrientationImage(CsTool.FLANGE, _DIRECTED, b_active=True)


def _fixed(_: RotationMatrix, __: OrientationSpace) -> OrientationImage:
    return OrientationImage(CsTool.FLANGE, OrientationSpace.known(_UPRIGHT), b_active=False)


def _left_over(wanted: RotationMatrix, base: OrientationSpace) -> OrientationImage:
    """Return the image of Kin_Wrist2: its axes follow where the base is known but for a turn."""
    if base.dof is OrientationDof.THREE:
        along = (wanted[0][2], wanted[1][2], wanted[2][2])
        space = OrientationSpace.directed((0.0, 0.0, 1.0), along, wanted)
        return OrientationImage(CsTool.MCS, space, b_active=False)
    return OrientationImage(CsTool.MCS, OrientationSpace.known(wanted), b_active=False)


def _free(wanted: RotationMatrix, _: OrientationSpace) -> OrientationImage:
    return OrientationImage(CsTool.MCS, OrientationSpace.known(wanted), b_active=True)


_TURNING: Final[Mapping[int, Callable[[RotationMatrix, OrientationSpace], OrientationImage]]] = {
    Kinematics.C_AXIS: _driven,
    Kinematics.C_AXIS_TOOL: _driven,
    Kinematics.TOOL: _fixed,
    Kinematics.WRIST2: _left_over,
    Kinematics.WRIST3: _free,
}


class OrientationImages:
    """The images of one PLC's kinematics.

    Args:
        custom: ``module:Class`` of the machine builder's own kinematics, parts of a coupling
            joined with ``+``, or objects of such classes; the position kinematics first.
    """

    def __init__(self, custom: str | tuple[object, ...] = ()) -> None:
        self._custom = custom

    def space(self, position: int, orientation: int) -> OrientationSpace | None:
        """Return what is open of the flange's orientation.

        Args:
            position: Code of the kinematics.
            orientation: Code of the one that is coupled to it, 0 for none.

        Returns:
            ``None`` where nobody has said it: then the PLC decides.

        Raises:
            ConfigError: A class that was named is not there.
            NoOrientationImageError: The machine builder's own kinematics has no interface for it.
        """
        base = self._of_position(position, coupled=bool(orientation))
        if base is None or not orientation:
            return base
        turning = self._of_orientation(orientation)
        if turning is None:
            return None
        return _asked(lambda wanted: combined_space(base, turning(wanted, base), wanted))

    def _of_position(self, code: int, *, coupled: bool) -> OrientationSpace | None:
        if code != Kinematics.CUSTOM:
            return _OPEN.get(code) or (OrientationSpace.known(_UPRIGHT) if code in _WHOLE else None)
        own = self._own(0)
        if own is None:
            return None
        if isinstance(own, ISMKinematicsWithOrientationImage) and not coupled:
            return _asked(own.get_flange_orientation_image)
        if isinstance(own, ISMPositionKinematics2):
            return own.get_orientation_image()
        raise NoOrientationImageError

    def _of_orientation(
        self, code: int
    ) -> Callable[[RotationMatrix, OrientationSpace], OrientationImage] | None:
        if code != Kinematics.CUSTOM:
            return _TURNING.get(code)
        own = self._own(-1)
        if isinstance(own, ISMOrientationKinematicsWithOriImage2):
            return own.get_orientation_image_2
        return None

    def _own(self, place: int) -> Any:  # noqa: ANN401 - whatever the machine builder has written
        if isinstance(self._custom, str):
            parts = self._custom.split("+")
            self._custom = tuple(kinematics_object(it) if is_custom(it) else None for it in parts)
        return self._custom[place] if self._custom else None


class NoOrientationImageError(Exception):
    """A kinematics lacks the interface by which robolink judges tools: no tool fits it."""


def _asked(question: Callable[[RotationMatrix], Image]) -> Image | None:
    """Ask for an upright flange, or one that hangs where the machine can have no other."""
    for wanted in (_UPRIGHT, _HANGING):
        try:
            return question(wanted)
        except NotReachable:
            continue
    return None


_SHOWN_MM: Final = 0.0005
_AXES: Final = {(1.0, 0.0, 0.0): "X", (0.0, 1.0, 0.0): "Y", (0.0, 0.0, 1.0): "Z"}


def require_fit(images: OrientationImages, now: Response, offset: ToolOffset) -> None:
    """Refuse a tool that the present kinematics cannot carry; an unknown one is the PLC's.

    Args:
        images: What is known of the kinematics.
        now: A snapshot that was taken just now.
        offset: The tool.

    Raises:
        RejectedError: Names the kinematics, each impossible component, and why.
    """
    space = _space(images, now)
    shift = (offset.x_mm, offset.y_mm, offset.z_mm)
    if space is None or space.accepts(shift):
        return
    raise _incompatible(
        tr(
            "{kinematics} cannot use this tool: {parts} of its shift is impossible. {why}",
            kinematics=_name(now),
            parts=_parts(space, shift),
            why=_why(space),
        ),
    )


def require_measurable(images: OrientationImages, now: Response, components: Sequence[str]) -> None:
    """Refuse to measure components of a shift that the present kinematics cannot carry.

    A measured one is never exactly zero, so it would be refused when it is written, with the
    work of a measurement behind it.

    Args:
        images: What is known of the kinematics.
        now: A snapshot that was taken just now.
        components: ``x_mm``, ``y_mm``, ``z_mm`` and other parts of a tool.

    Raises:
        RejectedError: Names the kinematics, each impossible component, and why.
    """
    space = _space(images, now)
    if space is None:
        return
    directions = {"x_mm": (1.0, 0.0, 0.0), "y_mm": (0.0, 1.0, 0.0), "z_mm": (0.0, 0.0, 1.0)}
    measured = [name for name in directions if name in components]
    impossible = [name for name in measured if not space.accepts(directions[name])]
    if impossible:
        raise _incompatible(
            tr(
                "{kinematics} cannot store the measured values: {parts}. {why}",
                kinematics=_name(now),
                parts=", ".join(name[0].upper() for name in impossible),
                why=_why(space),
            ),
        )


def _space(images: OrientationImages, now: Response) -> OrientationSpace | None:
    try:
        return images.space(now.position_kinematics, now.orientation_kinematics)
    except NoOrientationImageError:
        raise RejectedError(
            tr("{kinematics} cannot carry tool offsets at all.", kinematics=_name(now)),
            code=ErrorClass.NO_ORIENTATION_IMAGE,
            remedy=tr(
                "Nothing was sent. The PLC's own kinematics must implement "
                "ISMKinematicsWithOrientationImage."
            ),
        ) from None


def _incompatible(what: str) -> RejectedError:
    return RejectedError(
        what,
        code=ErrorClass.TOOL_INCOMPATIBLE,
        remedy=tr("Nothing was sent. Couple an orientation kinematics, or mount the tip in line."),
    )


def _name(now: Response) -> str:
    codes = (now.position_kinematics, now.orientation_kinematics)
    if Kinematics.CUSTOM in codes:
        return tr("The machine builder's own kinematics")
    return "+".join(name for name in map(block_name, codes) if name)


def _parts(space: OrientationSpace, shift: tuple[float, float, float]) -> str:
    parts = zip("XYZ", space.impossible(shift), strict=True)
    found = [f"{axis} {part:.3f} mm" for axis, part in parts if abs(part) >= _SHOWN_MM]
    # A part too small to be shown is still a deviation.
    return ", ".join(found) or tr("a part below {least} mm", least=_SHOWN_MM)


def _why(space: OrientationSpace) -> str:
    if space.dof is OrientationDof.THREE:
        return tr("How its flange will be turned is not known.")
    x, y, z = space.v_u
    line = _AXES.get((abs(x), abs(y), abs(z))) or f"({x:.3f}, {y:.3f}, {z:.3f})"
    return tr(
        "Its flange turns about its {line}: only shifts along it stay fixed.",
        line=line,
    )
