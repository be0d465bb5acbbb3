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

    Example:
        >>> from robolink.model import Pose
        >>> from robolink.procedures import approach_path
        >>> here, target = Pose(300, 100, -40, 0), Pose(310, 95, 5, 0)
        >>> course = approach_path(target, here=here, purpose="To the pin.")
        >>> [(step.path.value, step.target.x_mm, step.target.z_mm) for step in course]
        [('straight', 300, 5), ('joint', 310, 5)]
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

    Example:
        >>> from robolink.errors import CalibrationError
        >>> from robolink.model import InputEdge, Pose, ToolOffset
        >>> from robolink.procedures import seek_or_retract
        >>> from robolink.runner import Seek
        >>> from robolink.testing import PaperCell
        >>> here = Pose(300, 100, 0, 0)
        >>> cell = PaperCell(here, ToolOffset())  # without a switch
        >>> step = Seek(Pose(300, 100, -5, 0), InputEdge(5), 2, "Looking for the plate.")
        >>> try:
        ...     cell.run(seek_or_retract(step, here=here, safe_z_mm=10))
        ... except CalibrationError as error:
        ...     print(error.code, cell.here.z_mm)
        no_edge 10
    """
    try:
        found: Pose = yield step
    except CalibrationError as error:
        stands = step.target if error.code == "no_edge" else here
        yield Move(replace(stands, z_mm=safe_z_mm), Path.STRAIGHT, tr("Backing away."))
        raise
    return found
