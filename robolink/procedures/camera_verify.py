"""The proof with a camera: turn about the new tip, and look where it went."""

from collections.abc import Sequence
from typing import Final

from robolink.calibration import Drift, FlangePlane, VerifyResult
from robolink.model import Pose, ToolOffset
from robolink.procedures.approach import NO_OFFSET
from robolink.procedures.camera_plan import LookPlan
from robolink.procedures.camera_samples import CameraDrive, Place
from robolink.runner import Procedure, SeenAt
from robolink.stations import CameraStation

NO_ERROR: Final = (0.0, 0.0)


def verify_by_looking(
    station: CameraStation,
    plan: LookPlan,
    *,
    here: Pose,
    angles_deg: Sequence[float],
    tolerance_mm: float,
    camera_error_mm: tuple[float, float] = NO_ERROR,
    aside: ToolOffset = NO_OFFSET,
) -> Procedure[VerifyResult]:
    """Turn about the new tip and look at it again. Runs in the new tool; ends lifted.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: Pictures and heights.
        here: Where the frame of the new tool is.
        angles_deg: Its angles U at which the tip is looked at.
        tolerance_mm: Largest drift that passes.
        camera_error_mm: What the camera is off by, as the measurement found it.
        aside: Where the tip is expected, seen from the frame in force; not 0 where a difference
            to a reference was written.

    The drift is how far from where the controller puts it the tip is seen.

    Raises:
        CalibrationError: As :func:`~robolink.methods.measure_camera`.
    """
    drive = CameraDrive(station, plan, here)
    places = [Place(u_deg, aside) for u_deg in nearest_first(angles_deg, here)]
    seen = yield from drive.looks(places, here)
    yield from drive.lifted(places[-1])
    drifts = [
        seen_drift(station, look, place, camera_error_mm)
        for look, place in zip(seen, places, strict=True)
    ]
    return VerifyResult(tuple(drifts), tolerance_mm)


def nearest_first(angles_deg: Sequence[float], here: Pose) -> list[float]:
    """Return angles in the order in which the tool winds up least."""
    return sorted(angles_deg, key=lambda u_deg: abs(u_deg - here.u_deg))


def seen_drift(
    station: CameraStation, look: SeenAt, place: Place, camera_error_mm: tuple[float, float]
) -> Drift:
    """Return how far from where the controller puts it a mark was seen."""
    sighting, (error_x, error_y) = station.sighting(look), camera_error_mm
    dx, dy = FlangePlane.of(look).in_base(place.at.x_mm, place.at.y_mm, place.at.z_mm)
    return Drift(
        look.u_deg,
        sighting.x_mm - error_x - look.x_mm - dx,
        sighting.y_mm - error_y - look.y_mm - dy,
    )
