"""Tilting a lifted tool in the air, and finding out whether the robot took the orientation up."""

from typing import Final

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.pivot.tilts import OverPin, Tilt, apart_deg, tilt_path
from robolink.model import Path, Pose
from robolink.runner import Move, Procedure
from robolink.ways import Way, way

MOST_DEVIATION_DEG: Final = 1.0
"""A robot that stands further from the orientation it was sent to cannot take it up."""


def tilt_in_air(over: OverPin, stands: Tilt, goal: Tilt, lift_mm: float) -> Procedure[None]:
    """Tilt a lifted tool with its tip where it is.

    Args:
        over: The place above which the tip is.
        stands: How the tool stands.
        goal: How it is to stand.
        lift_mm: How far above the place the tip is.

    Raises:
        CalibrationError: ``not_tilted``: the robot stands otherwise than it was told.
    """
    for tilt in tilt_path(stands, goal):
        target = over.pose(tilt, lift_mm)
        reached: Pose = yield Move(target, Path.JOINT, tr("Tilting and turning in the air."))
        amiss_deg = apart_deg(target, reached)
        if amiss_deg > MOST_DEVIATION_DEG:
            raise CalibrationError(
                "not_tilted",
                tr(
                    "The tool is {amiss:.1f} degrees from the orientation it was sent to.",
                    amiss=amiss_deg,
                ),
                remedy=tr(
                    "This robot cannot reach it, and stands still with the tip "
                    "lifted. Tilt less with {tilt}, or teach the poses and give "
                    "{points}.",
                    tilt=way(Way.TILT),
                    points=way(Way.TAUGHT_POINTS),
                ),
            )
