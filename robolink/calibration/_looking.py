"""Measurements with an up-looking camera: a tip, a camera of unknown pose, a held board."""

import math
from collections.abc import Sequence

from robolink.calibration._board import solve_board
from robolink.calibration._board_round import solve_board_round
from robolink.calibration._camera import Sighting, solve_up_camera
from robolink.calibration._camera_affine import (
    CameraCalibration,
    PixelSighting,
    solve_camera_affine,
)
from robolink.calibration._camera_drive import CameraDrive, Place
from robolink.calibration._camera_round import CameraRound, as_round, solve_camera_round
from robolink.calibration._camera_station import (
    LEAST_SPAN_MM,
    CameraStation,
    LookPlan,
    PatternPlan,
)
from robolink.calibration._held_board import BoardDrawing
from robolink.calibration._looks import Looks
from robolink.calibration._planar_checks import MIN_ROTATION_DEG, angle_spread_deg
from robolink.calibration._steps import Procedure, SeenAt
from robolink.calibration._touch import NO_OFFSET
from robolink.calibration._turning import toward_zero
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset


def look_at_tip(
    station: CameraStation,
    plan: LookPlan,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    retake: bool = False,
) -> Procedure[CameraRound]:
    """Measure X and Y of a tip with a calibrated camera. Runs in Tool 0.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: At which angles it is looked at.
        here: Where the flange is; its U is where the angles count from.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.

    Raises:
        CalibrationError: ``tip_not_seen``, ``several_tips_seen``, ``camera_not_calibrated``, and
            those of :func:`solve_camera_round`.
    """
    tip, centred = stored or NO_OFFSET, False
    drive, angles_deg = CameraDrive(station, plan, here), plan.angles_deg(here.u_deg)
    if plan.centre_first:
        found = Place(angles_deg[0], tip)

        def expected(looks: Sequence[SeenAt]) -> ToolOffset:
            return solve_up_camera(station.sighting(looks[0]), stored=stored).offset

        tip = yield from drive.centred([found], here, expected)
        here, centred = drive.pose(found), True
    places = [Place(u_deg, tip) for u_deg in angles_deg]

    def solve(looks: Sequence[SeenAt]) -> CameraRound:
        sightings = [station.sighting(look) for look in looks]
        return solve_camera_round(sightings, stored=stored, sigma_mm=sigma_mm)

    looks = Looks(drive, solve, here, before_camera=centred)
    return (yield from looks.at(places, retake=retake))


def find_camera(
    station: CameraStation,
    plan: PatternPlan,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    retake: bool = False,
) -> Procedure[CameraCalibration]:
    """Measure X and Y of a tip, and the camera with it. Runs in Tool 0.

    The tip goes to four corners about the middle of the image, which tells what a pixel is,
    and turns in the middle, which tells the offset.

    Args:
        station: Where the camera is, to within its field of view; with its model of before,
            against which a changed camera is refused.
        plan: The pattern.
        here: Where the flange is; its U is that of the corners.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.

    Raises:
        CalibrationError: ``rank_deficient`` and ``insufficient_rotation`` before anything moves
            when the pattern cannot tell; ``tip_not_seen``, ``several_tips_seen``,
            ``camera_changed``, and the others of :func:`solve_camera_affine`.
    """
    _require_pattern(plan)
    tip = stored or NO_OFFSET
    drive = CameraDrive(station, plan.look, here)
    places = [
        Place(toward_zero(here.u_deg, turn), tip, aside_mm=(dx, dy)) for dx, dy, turn in plan.places
    ]

    def solve(looks: Sequence[SeenAt]) -> CameraCalibration:
        sightings = [PixelSighting(look, look.spot.x, look.spot.y) for look in looks]
        return solve_camera_affine(
            sightings, stored=stored, sigma_mm=sigma_mm, before=station.model
        )

    return (yield from Looks(drive, solve, here).at(places, retake=retake))


def look_at_board(
    station: CameraStation,
    plan: LookPlan,
    board: BoardDrawing,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    retake: bool = False,
) -> Procedure[CameraRound]:
    """Measure X, Y and U of a held board by its fiducials. Runs in Tool 0.

    Two fiducials at one angle are EPSON's CalcBoardTool; more fiducials or angles leave
    residuals. Over 30 degrees or more of U the camera's own error is told from the board's place.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: At which angles each fiducial is looked at.
        board: Where the fiducials are on the board.
        here: Where the flange is.
        stored: The tool of the board, as far as it is known; the fiducials are expected by it.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.

    Raises:
        CalibrationError: ``fiducial_not_seen``, ``several_fiducials_seen``, ``far_off``,
            ``camera_not_calibrated``, ``coincident_fiducials``, ``spacing_mismatch``, and the
            others of :func:`solve_board` and :func:`solve_board_round`.
    """
    board.require_apart()
    tool, centred = stored or NO_OFFSET, False
    drive, angles_deg = CameraDrive(station, plan, here), plan.angles_deg(here.u_deg)
    if plan.centre_first:
        found = board.places(tool, angles_deg[:1])[:2]
        pair = BoardDrawing(board.fiducials_mm[:2])

        def expected(looks: Sequence[SeenAt]) -> ToolOffset:
            sightings = [station.sighting(look) for look in looks]
            return _board_tool(sightings, (1, 2), pair, tool, None).offset

        tool = yield from drive.centred(found, here, expected)
        here, centred = drive.pose(found[-1]), True
    places = board.places(tool, angles_deg)

    def solve(looks: Sequence[SeenAt]) -> CameraRound:
        sightings = [station.sighting(look) for look in looks]
        marks = [place.mark for place in places]
        return _board_tool(sightings, marks, board, stored, sigma_mm)

    looks = Looks(drive, solve, here, before_camera=centred)
    return (yield from looks.at(places, retake=retake))


def _board_tool(
    sightings: Sequence[Sighting],
    marks: Sequence[int],
    board: BoardDrawing,
    stored: ToolOffset | None,
    sigma_mm: float | None,
) -> CameraRound:
    if len(sightings) == 2 and board.is_pair:
        (first, second), spacing_mm = sightings, math.dist(*board.fiducials_mm)
        return as_round(
            solve_board(first, second, stored=stored, spacing_mm=spacing_mm, sigma_mm=sigma_mm)
        )
    drawing = [board.fiducials_mm[mark - 1] for mark in marks]
    return solve_board_round(sightings, drawing, stored=stored, sigma_mm=sigma_mm)


def _require_pattern(plan: PatternPlan) -> None:
    """Refuse a pattern that cannot tell camera and offset apart, before anything moves."""
    if plan.span_mm < LEAST_SPAN_MM:
        raise CalibrationError(
            "rank_deficient",
            tr("A pattern of {span:g} mm does not tell what a pixel is.", span=plan.span_mm),
            remedy=tr("Let the tip go {least:g} mm or more to each side.", least=LEAST_SPAN_MM),
        )
    spread_deg = angle_spread_deg([0.0, *plan.look.turns_deg])
    if spread_deg < MIN_ROTATION_DEG:
        raise CalibrationError(
            "insufficient_rotation",
            tr("The pattern turns the tool by {spread:.1f} degrees only.", spread=spread_deg),
            remedy=tr("Turn it by {minimum:.0f} or more.", minimum=MIN_ROTATION_DEG),
        )
