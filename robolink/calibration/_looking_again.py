"""The proof with a camera: turn about the new tip, and look where it went."""

from collections.abc import Sequence
from typing import Final

from robolink.calibration._camera_drive import CameraDrive, Place
from robolink.calibration._camera_station import CameraStation, LookPlan
from robolink.calibration._held_board import BoardDrawing
from robolink.calibration._result import Drift, VerifyResult
from robolink.calibration._steps import Procedure, SeenAt
from robolink.calibration._touch import NO_OFFSET
from robolink.model import Pose, ToolOffset, rotate_xy

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
        CalibrationError: As :func:`look_at_tip`.
    """
    drive = CameraDrive(station, plan, here)
    places = [Place(u_deg, aside) for u_deg in _nearest_first(angles_deg, here)]
    seen = yield from drive.looks(places, here)
    yield from drive.lifted(places[-1])
    drifts = [
        _drift(station, look, place, camera_error_mm)
        for look, place in zip(seen, places, strict=True)
    ]
    return VerifyResult(tuple(drifts), tolerance_mm)


def verify_board(
    station: CameraStation,
    plan: LookPlan,
    board: BoardDrawing,
    *,
    here: Pose,
    angles_deg: Sequence[float],
    tolerance_mm: float,
    camera_error_mm: tuple[float, float] = NO_ERROR,
    aside: ToolOffset = NO_OFFSET,
) -> Procedure[VerifyResult]:
    """Turn about the board's new origin and look at its fiducials again. Runs in the new tool.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: Pictures and heights.
        board: Where the fiducials are on the board.
        here: Where the frame of the new tool is.
        angles_deg: Its angles U at which each fiducial is looked at.
        tolerance_mm: Largest drift that passes.
        camera_error_mm: What the camera is off by, as the measurement found it.
        aside: Where the board is expected, seen from the frame in force.

    Raises:
        CalibrationError: As :func:`look_at_board`.
    """
    drive = CameraDrive(station, plan, here)
    places = board.places(aside, _nearest_first(angles_deg, here))
    seen = yield from drive.looks(places, here)
    yield from drive.lifted(places[-1])
    drifts = [
        _drift(station, look, place, camera_error_mm)
        for look, place in zip(seen, places, strict=True)
    ]
    return VerifyResult(tuple(drifts), tolerance_mm)


def _nearest_first(angles_deg: Sequence[float], here: Pose) -> list[float]:
    """Return angles in the order in which the tool winds up least."""
    return sorted(angles_deg, key=lambda u_deg: abs(u_deg - here.u_deg))


def _drift(
    station: CameraStation, look: SeenAt, place: Place, camera_error_mm: tuple[float, float]
) -> Drift:
    """Return how far from where the controller puts it a mark was seen."""
    sighting, (error_x, error_y) = station.sighting(look), camera_error_mm
    dx, dy = rotate_xy(place.at.x_mm, place.at.y_mm, look.u_deg)
    return Drift(
        look.u_deg,
        sighting.x_mm - error_x - look.x_mm - dx,
        sighting.y_mm - error_y - look.y_mm - dy,
    )
