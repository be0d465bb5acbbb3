"""Nozzles and held boards over an up-looking camera, on both kinds of controllers."""

import math
import sys
from dataclasses import replace

import pytest

from robolink.calibration import BoardDrawing, CameraCalibration
from robolink.errors import CalibrationError, VerifyError
from robolink.methods import BoardSource, CameraAffineSource, CameraSource
from robolink.model import ToolOffset
from robolink.procedures import LookPlan
from robolink.runner import Move
from tests.contract._camera_cell import (
    camera_model,
    camera_station,
    cell_of,
    furnish,
    run_source,
    stored_in,
)
from tests.contract._sensor_cell import TOOL, Followed, miss_mm

FINE_MM = 0.008


@pytest.fixture
def cell():
    with cell_of("epson") as cell:
        yield cell


@pytest.fixture(params=["epson", "softmotion"])
def any_cell(request):
    with cell_of(request.param) as cell:
        yield cell


def moved_station(cell, dx_mm, dy_mm):
    """Return the camera's station at a wrong place."""
    model = camera_model(cell)
    x_mm, y_mm = model.origin_mm
    model = replace(model, origin_mm=(x_mm + dx_mm, y_mm + dy_mm))
    return replace(camera_station(cell), model=model)


def seconds_of(cell, began_ns):
    return (cell.clock.now_ns() - began_ns) / 1e9


def inside(result, truth):
    """Return the largest error of a result in units of its half widths."""
    pairs = zip(result.measured, result.half_width95, strict=True)
    return max(abs(getattr(result.offset, n) - getattr(truth, n)) / half for n, half in pairs)


def test_a_nozzle_is_measured_written_and_proved(any_cell, capsys):
    began_ns = any_cell.clock.now_ns()
    report = run_source(any_cell, CameraSource(any_cell.url, camera_station(any_cell)))
    with capsys.disabled():
        took_s = seconds_of(any_cell, began_ns)
        sys.stdout.write(f"\nnozzle before a camera: {took_s:.1f} s of robot time\n")
    result = report.proposal.result
    assert inside(result, any_cell.truth) < 1.0
    stored = stored_in(any_cell)
    assert stored is not None
    assert miss_mm(stored, result.offset) < 0.001
    assert report.verification.passed
    assert report.verification.max_drift_mm < 2 * FINE_MM
    assert {round(drift.u_deg) for drift in report.verification.drifts}.isdisjoint(
        round(pose.u_deg) for pose in result.inputs
    )


def test_a_camera_that_was_moved_shifts_nothing_and_is_told(cell):
    moved = moved_station(cell, 0.4, -0.3)
    report = run_source(cell, CameraSource(cell.url, moved))
    result = report.proposal.result
    assert miss_mm(result.offset, cell.truth) < FINE_MM
    assert result.camera_error_mm == pytest.approx((0.4, -0.3), abs=FINE_MM)
    assert "camera_moved" in result.warnings
    assert report.verification.passed


def test_a_single_look_believes_a_moved_camera_and_the_proof_does_not(cell):
    moved = moved_station(cell, 0.4, 0.0)
    before = cell.stored
    with pytest.raises(VerifyError, match=r"Turn test failed: 0\.(79|80|81)"):
        run_source(cell, CameraSource(cell.url, moved, LookPlan(turns_deg=(0.0,))))
    assert cell.stored == before


def test_a_camera_of_unknown_pose_is_found_with_the_nozzle(cell, capsys):
    blank = replace(camera_station(cell, known=False), x_mm=camera_station(cell).x_mm + 1)
    began_ns = cell.clock.now_ns()
    report = run_source(cell, CameraAffineSource(cell.url, blank))
    with capsys.disabled():
        took_s = seconds_of(cell, began_ns)
        sys.stdout.write(f"\ncamera and nozzle found together: {took_s:.1f} s of robot time\n")
    result, true = report.proposal.result, camera_model(cell)
    assert isinstance(result, CameraCalibration)
    assert inside(result, cell.truth) < 1.5
    assert result.camera.mirrored is true.mirrored
    assert result.camera.scale_mm_per_px == pytest.approx(true.scale_mm_per_px, rel=0.01)
    assert result.camera.turn_deg == pytest.approx(true.turn_deg, abs=0.2)
    assert result.rms_px is not None
    assert result.rms_px < 0.5
    assert report.verification.passed


@pytest.mark.parametrize(
    ("kind", "count"),
    [pytest.param("epson", 2, marks=pytest.mark.soak), ("epson", 4), ("softmotion", 2)],
)
def test_a_held_board_is_measured_written_and_proved(kind, count, capsys):
    with cell_of(kind) as cell:
        furnish(cell, board_held=True)
        held = cell.simulator.world.board
        drawing = BoardDrawing(held.drawing_mm[:count])
        began_ns = cell.clock.now_ns()
        report = run_source(cell, BoardSource(cell.url, camera_station(cell), drawing))
        with capsys.disabled():
            took_s = seconds_of(cell, began_ns)
            sys.stdout.write(f"\nboard with {count} fiducials: {took_s:.1f} s of robot time\n")
        truth, result = held.frame(cell.truth), report.proposal.result
    assert miss_mm(result.offset, truth) < FINE_MM
    assert result.offset.u_deg == pytest.approx(truth.u_deg, abs=0.02)
    assert len(report.verification.drifts) == 2 * count
    assert report.verification.passed


@pytest.mark.parametrize(
    ("trouble", "within_mm"),
    [
        ({"backlash_deg": 0.01}, 0.010),
        ({"camera_tilt_deg": 3.0, "camera_tilt_toward_deg": 40.0}, 0.010),
        ({"camera_um_per_px_y": 15.0, "camera_shear_deg": 2.0}, FINE_MM),
        ({"camera_mirrored": False}, FINE_MM),
        pytest.param({"camera_miss_share": 0.15}, FINE_MM, marks=pytest.mark.soak),
        pytest.param({"camera_outlier_share": 0.05}, FINE_MM, marks=pytest.mark.soak),
        pytest.param({"camera_noise_px": 1.0}, 0.04, marks=pytest.mark.soak),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else None,
)
def test_what_a_cell_is_like_does_little_harm(cell, trouble, within_mm):
    furnish(cell, **trouble)
    report = run_source(cell, CameraSource(cell.url, camera_station(cell)))
    assert miss_mm(report.proposal.result.offset, cell.truth) < within_mm
    assert report.verification.passed


def test_play_in_the_joints_does_no_harm_because_places_are_met_from_one_side(cell):
    furnish(cell, backlash_deg=0.02)
    source = CameraSource(cell.url, camera_station(cell))
    assert miss_mm(run_source(cell, source, write=False).proposal.tip, cell.truth) < 0.02


def refused(cell, code, source):
    """Check that the change is refused: nothing written, the tip lifted, the tool restored."""
    before = cell.stored
    with pytest.raises(CalibrationError) as refusal:
        run_source(cell, source)
    assert refusal.value.code == code
    assert refusal.value.remedy
    assert cell.stored == before
    assert cell.simulator.machine.flash_writes == 0
    assert cell.simulator.machine.tools.selected == TOOL
    return refusal.value


def test_a_tip_that_is_not_seen_is_refused_lifted(cell):
    furnish(cell, camera_miss_share=1.0)
    error = refused(cell, "tip_not_seen", CameraSource(cell.url, camera_station(cell)))
    assert "0 of 3 pictures" in str(error)
    assert cell.tip_z_mm > cell.simulator.world.camera.middle_mm[2] + 8.0


def test_two_tips_in_the_image_are_refused(cell):
    tip = cell.truth
    cell.simulator.world.tips[2] = ToolOffset(tip.x_mm + 3.0, tip.y_mm, tip.z_mm)
    error = refused(cell, "several_tips_seen", CameraSource(cell.url, camera_station(cell)))
    assert "2 tips" in str(error)


def test_a_board_that_is_not_there_is_refused(cell):
    drawing = BoardDrawing.of_two(40.0)
    refused(cell, "fiducial_not_seen", BoardSource(cell.url, camera_station(cell), drawing))


def test_a_board_whose_marks_are_too_near_to_each_other_is_refused(cell):
    furnish(cell, board_held=True)
    world = cell.simulator.world
    world.board = replace(world.board, drawing_mm=((4.0, 0.0), (-4.0, 0.0)))
    drawing = BoardDrawing.of_two(8.0)
    refused(cell, "several_fiducials_seen", BoardSource(cell.url, camera_station(cell), drawing))


@pytest.mark.parametrize(
    ("drawing", "code"),
    [
        (BoardDrawing.of_two(41.0), "spacing_mismatch"),
        (BoardDrawing.of_two(3.0), "coincident_fiducials"),
    ],
)
def test_a_drawing_that_is_not_the_boards_is_refused(cell, drawing, code):
    furnish(cell, board_held=True)
    world = cell.simulator.world
    world.board = replace(world.board, drawing_mm=((20.0, 0.0), (-20.0, 0.0)))
    refused(cell, code, BoardSource(cell.url, camera_station(cell), drawing))
    assert cell.tip_z_mm > world.camera.middle_mm[2]


def test_a_board_far_from_where_it_is_expected_is_refused_lifted(cell):
    furnish(cell, board_held=True)
    world = cell.simulator.world
    pair = ((20.0, 0.0), (-20.0, 0.0))
    world.board = replace(world.board, shift_mm=(4.5, 4.5), drawing_mm=pair)
    drawing = BoardDrawing.of_two(40.0)
    refused(cell, "far_off", BoardSource(cell.url, camera_station(cell), drawing))
    assert cell.tip_z_mm > world.camera.middle_mm[2] + 8.0


def test_a_camera_that_changed_is_refused(cell):
    station = camera_station(cell)
    furnish(cell, camera_um_per_px_x=21.0)
    refused(cell, "camera_changed", CameraAffineSource(cell.url, station))


def test_a_camera_that_means_nothing_is_refused_before_anything_moves(cell):
    blank = camera_station(cell, known=False)
    refused(cell, "camera_not_calibrated", CameraSource(cell.url, blank))
    assert cell.simulator.machine.arm.moves_started == 0


def test_a_sensor_that_nobody_brings_is_refused_before_anything_moves(cell):
    error = refused(cell, "sensor_not_found", CameraSource("basler", camera_station(cell)))
    assert "epson+sim" in error.remedy
    assert cell.simulator.machine.arm.moves_started == 0


def test_every_step_is_foreseen_before_anything_moves(cell):
    followed = Followed()
    source = CameraSource(cell.url, camera_station(cell))
    with cell.connected() as controller:
        foreseen = cell.foresee(controller, source)
        assert cell.simulator.machine.arm.moves_started == 0
        cell.change(source, followed)(controller, write=False)
    assert [step.text for step in foreseen] == [done.step.purpose for done in followed.steps]
    assert not any(step.refusal for step in foreseen)
    correction_mm = math.hypot(
        cell.truth.x_mm - cell.stored.x_mm, cell.truth.y_mm - cell.stored.y_mm
    )
    for step, done in zip(foreseen, followed.steps, strict=True):
        if step.target is not None and isinstance(done.step, Move):
            apart_mm = math.dist(step.target.coordinates()[:3], done.step.target.coordinates()[:3])
            assert apart_mm < correction_mm + 0.05
