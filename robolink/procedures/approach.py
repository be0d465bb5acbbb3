"""The ways of a tip to a place and away from it, without dragging it along."""

from dataclasses import replace
from typing import Final

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset
from robolink.runner import Move, Procedure, Seek

NO_OFFSET: Final = ToolOffset()


def approach_path(target: Pose, *, here: Pose, purpose: str) -> Procedure[None]:
    """Go somewhere without dragging the tip along: up first, over, then down.

    Args:
        target: Where to.
        here: Where the frame is now.
        purpose: What for, for a person.
    """
    top_mm = max(here.z_mm, target.z_mm)
    above = replace(target, z_mm=top_mm)
    if here.z_mm < top_mm:
        yield Move(replace(here, z_mm=top_mm), Path.STRAIGHT, purpose)
    if above.coordinates() != replace(here, z_mm=top_mm).coordinates():
        yield Move(above, Path.JOINT, purpose)
    if target.z_mm < top_mm:
        yield Move(target, Path.STRAIGHT, purpose)


def offset_z(pose: Pose, by_mm: float) -> Pose:
    """Return ``pose`` with Z higher by ``by_mm``."""
    return replace(pose, z_mm=pose.z_mm + by_mm)


def seek_or_retract(step: Seek, *, here: Pose, safe_z_mm: float) -> Procedure[Pose]:
    """Seek; without an edge, lift the frame straight up and let the refusal stand.

    Args:
        step: What is sought.
        here: Where the frame is before.
        safe_z_mm: Height of the frame at which nothing is met.

    Raises:
        CalibrationError: ``no_edge`` or ``edge_passed``, with the tip drawn back.
    """
    try:
        found: Pose = yield step
    except CalibrationError as error:
        stands = step.target if error.code == "no_edge" else here
        yield Move(replace(stands, z_mm=safe_z_mm), Path.STRAIGHT, tr("Backing away."))
        raise
    return found
