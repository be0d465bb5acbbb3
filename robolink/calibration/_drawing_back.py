"""What every procedure with a sensor does when the sensor stays silent: it lifts, then refuses."""

from dataclasses import replace

from robolink.calibration._steps import Move, Procedure, Seek
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Path, Pose


def sought(step: Seek, *, here: Pose, safe_z_mm: float) -> Procedure[Pose]:
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
        yield Move(replace(stands, z_mm=safe_z_mm), Path.STRAIGHT, tr("draw the tip back"))
        raise
    return found
