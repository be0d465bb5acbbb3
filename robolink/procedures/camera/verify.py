"""The proof with a camera: turn about the new tip, and look where it went."""

from collections.abc import Sequence
from typing import Final

from robolink.calibration import Drift, FlangePlane, VerifyResult
from robolink.model import TIP, Pose, ToolOffset
from robolink.procedures.approach import NO_OFFSET
from robolink.procedures.camera.drive import CameraDrive, Place
from robolink.procedures.camera.plan import LookPlan
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
    radius_px: float | None = None,
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
        radius_px: How wide its spot was in the measurement; ``None`` where nobody told.

    The drift is how far from where the controller puts it the tip is seen.

    Raises:
        CalibrationError: As :func:`~robolink.methods.measure_camera`.

    Example:
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import LookPlan, verify_by_looking
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> station, here = CameraStation(300, 80, -30), Pose(300, 80, 0, 0)
        >>> proof = verify_by_looking(
        ...     station, LookPlan(), here=here, angles_deg=(0, 120), tolerance_mm=0.2
        ... )
        >>> shown = PaperCell(here, ToolOffset(0.3)).run(proof)
        >>> shown.passed, round(shown.max_drift_mm, 3)
        (False, 0.3)
    """
    drive = CameraDrive(station, plan, here)
    drive.watch.expect_radius(TIP, radius_px)
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
    """Return how far from where the controller puts it a mark was seen.

    Args:
        station: Where the camera is, and what its pixels mean.
        look: What was seen, and where the frame was.
        place: Where the mark is, by the controller, in that frame.
        camera_error_mm: What the camera is off by, as the measurement found it; base X and Y.

    Example:
        >>> from robolink.model import Pose, Spot, SpotUnit, ToolOffset
        >>> from robolink.procedures import Place, seen_drift
        >>> from robolink.runner import SeenAt
        >>> from robolink.stations import CameraStation
        >>> look = SeenAt.of(Pose(300, 80, -30, 0), Spot(300.15, 80), SpotUnit.BASE_MM)
        >>> station, place = CameraStation(300, 80, -30), Place(0, ToolOffset())
        >>> round(seen_drift(station, look, place, camera_error_mm=(0.1, 0)).dx_mm, 3)
        0.05
    """
    sighting, (error_x, error_y) = station.sighting(look), camera_error_mm
    dx, dy = FlangePlane.of(look).in_base(place.at.x_mm, place.at.y_mm, place.at.z_mm)
    return Drift(
        look.u_deg,
        sighting.x_mm - error_x - look.x_mm - dx,
        sighting.y_mm - error_y - look.y_mm - dy,
    )
