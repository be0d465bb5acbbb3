"""A held board, seen by its fiducials."""

import math
from collections.abc import Sequence

from robolink.calibration import (
    BoardDrawing,
    CameraRound,
    Sighting,
    VerifyResult,
    as_round,
    height_of,
    solvable_planes,
    solve_board,
    solve_board_round,
)
from robolink.model import Pose, ToolOffset
from robolink.procedures import (
    NO_ERROR,
    NO_OFFSET,
    CameraDrive,
    CameraSamples,
    LookPlan,
    Place,
    nearest_first,
    seen_drift,
)
from robolink.runner import Procedure, SeenAt
from robolink.stations import CameraStation


def measure_board(
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
        CalibrationError: ``tilted_pose`` before anything moves; ``fiducial_not_seen``,
            ``several_fiducials_seen``, ``far_off``, ``camera_not_calibrated``,
            ``coincident_fiducials``, ``spacing_mismatch``, and the others of :func:`solve_board`
            and :func:`solve_board_round`.
        LimitError: The arm cannot bring the board before the camera so; nothing was moved.

    Example:
        >>> from robolink.calibration import BoardDrawing
        >>> from robolink.methods import measure_board
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import LookPlan
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> board, held = BoardDrawing.of_two(40), ToolOffset(2, -1, -20, 8)
        >>> camera, here, plan = CameraStation(300, 80, -30), Pose(300, 100, 20, 0), LookPlan()
        >>> cell = PaperCell(here, held, marks=dict(enumerate(board.seen_from(held), start=1)))
        >>> stored = ToolOffset(0, 0, -20)
        >>> found = cell.run(measure_board(camera, plan, board, here=here, stored=stored))
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3), round(found.offset.u_deg, 3)
        (2.0, -1.0, 8.0)
    """
    board.require_apart()
    solvable_planes([here], height_of(stored))
    tool, centred = stored or NO_OFFSET, False
    drive = CameraDrive(station, plan, here)
    angles_deg = yield from drive.angles_in_reach(
        here, lambda angles: _places(board, stored or NO_OFFSET, angles)
    )
    if plan.centre_first:
        found = _places(board, tool, angles_deg[:1])[:2]
        pair = BoardDrawing(board.fiducials_mm[:2])

        def expected(looks: Sequence[SeenAt]) -> ToolOffset:
            sightings = [station.sighting(look) for look in looks]
            return _board_tool(station, sightings, (1, 2), pair, tool).offset

        tool = yield from drive.centred(found, here, expected)
        here, centred = drive.pose(found[-1]), True
    places = _places(board, tool, angles_deg)

    def solve(looks: Sequence[SeenAt]) -> CameraRound:
        sightings = [station.sighting(look) for look in looks]
        marks = [place.mark for place in places]
        return _board_tool(station, sightings, marks, board, stored, sigma_mm)

    looks = CameraSamples(drive, solve, here, before_camera=centred)
    return (yield from looks.at(places, retake=retake))


def _board_tool(
    station: CameraStation,
    sightings: Sequence[Sighting],
    marks: Sequence[int],
    board: BoardDrawing,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
) -> CameraRound:
    if len(sightings) == 2 and board.is_pair:
        (first, second), spacing_mm = sightings, math.dist(*board.fiducials_mm)
        return as_round(
            solve_board(
                first,
                second,
                stored=stored,
                spacing_mm=spacing_mm,
                sigma_mm=sigma_mm,
                camera=station.model,
            )
        )
    drawing = [board.fiducials_mm[mark - 1] for mark in marks]
    return solve_board_round(
        sightings, drawing, stored=stored, sigma_mm=sigma_mm, camera=station.model
    )


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
        CalibrationError: As :func:`measure_board`.

    Example:
        >>> from robolink.calibration import BoardDrawing
        >>> from robolink.methods import verify_board
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import LookPlan
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> board, here = BoardDrawing(((20, 0), (-20, 0))), Pose(300, 80, 0, 0)
        >>> proof = verify_board(
        ...     CameraStation(300, 80, -30), LookPlan(), board, here=here, angles_deg=(0, 90),
        ...     tolerance_mm=0.1,
        ... )
        >>> fiducials = dict(enumerate(board.seen_from(ToolOffset(0.03)), start=1))
        >>> shown = PaperCell(here, ToolOffset(), marks=fiducials).run(proof)
        >>> shown.passed, round(shown.max_drift_mm, 3)
        (True, 0.03)
    """
    drive = CameraDrive(station, plan, here)
    places = _places(board, aside, nearest_first(angles_deg, here))
    seen = yield from drive.looks(places, here)
    yield from drive.lifted(places[-1])
    drifts = [
        seen_drift(station, look, place, camera_error_mm)
        for look, place in zip(seen, places, strict=True)
    ]
    return VerifyResult(tuple(drifts), tolerance_mm)


def _places(board: BoardDrawing, tool: ToolOffset, angles_deg: Sequence[float]) -> list[Place]:
    """Return every fiducial at every angle, as something to be looked at."""
    return [
        Place(u_deg, at, mark)
        for u_deg in angles_deg
        for mark, at in enumerate(board.seen_from(tool), start=1)
    ]
