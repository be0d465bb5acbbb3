"""Whether a tool fits the kinematics of a PLC, said before it is written.

The PLC refuses such a tool by itself, in one word for all of it
(``SMC_AXIS_GROUP_TOOL_OFFSET_INCOMPATIBLE_WITH_KINEMATICS``); here it is said which part of the
shift is impossible and why. A slot that is not in force would even be written without a word.
"""

from collections.abc import Sequence
from typing import Final

from robolink.controllers.softmotion.facts import block_name
from robolink.controllers.softmotion.tools.orientation_images import (
    NoOrientationImageError,
    OrientationImages,
)
from robolink.errors import RejectedError
from robolink.messages import tr
from robolink.model import OrientationDof, OrientationSpace, ToolOffset
from robolink.protocols.mailbox import ErrorClass, Kinematics, Response

_SHOWN_MM: Final = 0.0005
_AXES: Final = {(1.0, 0.0, 0.0): "X", (0.0, 1.0, 0.0): "Y", (0.0, 0.0, 1.0): "Z"}


def require_fit(
    images: OrientationImages, now: Response, offset: ToolOffset, *, controller: str, request: str
) -> None:
    """Refuse a tool that the kinematics in force cannot carry; one nobody knows is the PLC's.

    Args:
        images: What is known of the kinematics.
        now: A snapshot that was taken just now.
        offset: The tool.
        controller: Its name in the error.
        request: What is held back.

    Raises:
        RejectedError: Names the kinematics, each impossible component, and why.
    """
    space = _space(images, now, controller=controller, request=request)
    shift = (offset.x_mm, offset.y_mm, offset.z_mm)
    if space is None or space.accepts(shift):
        return
    raise _incompatible(
        tr(
            "{kinematics} cannot carry this tool: {parts} of its shift is impossible. {why}",
            kinematics=_name(now),
            parts=_parts(space, shift),
            why=_why(space),
        ),
        controller=controller,
        request=request,
    )


def require_measurable(
    images: OrientationImages, now: Response, components: Sequence[str], *, controller: str
) -> None:
    """Refuse to measure components of a shift that the kinematics in force cannot carry.

    A measured one is never exactly zero, so it would be refused when it is written, with the
    work of a measurement behind it.

    Args:
        images: What is known of the kinematics.
        now: A snapshot that was taken just now.
        components: ``x_mm``, ``y_mm``, ``z_mm`` and other parts of a tool.
        controller: Its name in the error.

    Raises:
        RejectedError: Names the kinematics, each impossible component, and why.
    """
    space = _space(images, now, controller=controller, request="")
    if space is None:
        return
    directions = {"x_mm": (1.0, 0.0, 0.0), "y_mm": (0.0, 1.0, 0.0), "z_mm": (0.0, 0.0, 1.0)}
    measured = [name for name in directions if name in components]
    impossible = [name for name in measured if not space.accepts(directions[name])]
    if impossible:
        raise _incompatible(
            tr(
                "{kinematics} cannot be given what would be measured: {parts}. {why}",
                kinematics=_name(now),
                parts=", ".join(name[0].upper() for name in impossible),
                why=_why(space),
            ),
            controller=controller,
            request="",
        )


def _space(
    images: OrientationImages, now: Response, *, controller: str, request: str
) -> OrientationSpace | None:
    try:
        return images.space(now.position_kinematics, now.orientation_kinematics)
    except NoOrientationImageError:
        raise RejectedError(
            tr("{kinematics} cannot carry tool offsets at all.", kinematics=_name(now)),
            code=ErrorClass.NO_ORIENTATION_IMAGE,
            remedy=tr(
                "The PLC's own kinematics must implement ISMKinematicsWithOrientationImage. "
                "Nothing was sent."
            ),
            controller=controller,
            request=request,
        ) from None


def _incompatible(what: str, *, controller: str, request: str) -> RejectedError:
    return RejectedError(
        what,
        code=ErrorClass.TOOL_INCOMPATIBLE,
        remedy=tr(
            "Couple an orientation kinematics in the PLC, or mount the tip on that line. Nothing "
            "was sent."
        ),
        controller=controller,
        request=request,
    )


def _name(now: Response) -> str:
    codes = (now.position_kinematics, now.orientation_kinematics)
    if Kinematics.CUSTOM in codes:
        return tr("The machine builder's own kinematics")
    return "+".join(name for name in map(block_name, codes) if name)


def _parts(space: OrientationSpace, shift: tuple[float, float, float]) -> str:
    parts = zip("XYZ", space.impossible(shift), strict=True)
    found = [f"{axis} {part:.3f} mm" for axis, part in parts if abs(part) >= _SHOWN_MM]
    # A shift that stands off by less than what is shown still does.
    return ", ".join(found) or tr("a part below {least} mm", least=_SHOWN_MM)


def _why(space: OrientationSpace) -> str:
    if space.dof is OrientationDof.THREE:
        return tr(
            "How its flange is turned is not known beforehand, so it cannot be said "
            "where a shift would lead."
        )
    x, y, z = space.v_u
    line = _AXES.get((abs(x), abs(y), abs(z))) or f"({x:.3f}, {y:.3f}, {z:.3f})"
    return tr(
        "Its flange turns about its {line} as the machine moves, so only a shift along {line} "
        "stays where it is.",
        line=line,
    )
