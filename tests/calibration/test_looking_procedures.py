"""The moves at an up-looking camera, with an ideal cell: every move and its result."""

import math
from dataclasses import replace

import pytest

from robolink.calibration import BoardDrawing, CameraModel, rotation_of
from robolink.errors import CalibrationError
from robolink.methods import (
    CameraAffineParameters,
    measure_board,
    measure_camera,
    measure_camera_affine,
    verify_board,
)
from robolink.model import Pose, Spot, SpotUnit, ToolOffset
from robolink.procedures import LookPlan, verify_by_looking
from robolink.runner import Confirm, Consider, Look, Move, Notify, SeenAt
from robolink.stations import CameraStation
from tests.calibration._simulated import refused

MODEL = CameraModel(((0.02, 0.001), (0.001, -0.02)), (287.0, 90.0))
STATION = CameraStation(300.0, 80.0, -30.0, MODEL)
TIP = ToolOffset(12.4, -3.8, -20.0)
STORED = ToolOffset(12.0, -3.5, -20.0, 7.0)
HERE = Pose(280.0, 90.0, 20.0, 120.0, tool=0)
BOARD = BoardDrawing(((20.0, 12.5), (-20.0, 12.5), (-20.0, -12.5), (20.0, -12.5)))
HELD = ToolOffset(12.3, -3.2, -20.0, 8.2)
OFF_MM = (0.25, -0.15)
"""The shift of the simulated camera since its calibration."""


class IdealCell:
    """Carries out the steps of a procedure; the camera sees the true marks, in pixels.

    Attributes:
        frame: The place of the frame.
        steps: The steps so far.
        told, offers: Messages and offers to the person; the first offer is accepted.
        wrong: The error of each wrong look, in pixels.
    """

    def __init__(self, marks, *, here=HERE, off_mm=OFF_MM, blind=None, unit=SpotUnit.PIXEL):
        self.marks, self.frame, self.off_mm = marks, here, off_mm
        self.blind, self.unit, self.steps = blind, unit, []
        self.told, self.offers, self.wrong, self.focus = [], [], {}, True
        self.score = None

    def run(self, procedure):
        try:
            step = next(procedure)
            while True:
                if isinstance(step, Notify):
                    self.told.append(step.text)
                    step = procedure.send(None)
                    continue
                if isinstance(step, Consider):
                    step = procedure.send(("",) * len(step.moves))
                    continue
                if isinstance(step, Confirm):
                    self.offers.append(step.question)
                    step = procedure.send(len(self.offers) == 1)
                    continue
                self.steps.append(step)
                try:
                    answer = self._take(step)
                except CalibrationError as error:
                    step = procedure.throw(error)
                    continue
                step = procedure.send(answer)
        except StopIteration as finished:
            return finished.value

    @property
    def looks(self):
        return [step for step in self.steps if isinstance(step, Look)]

    @property
    def placed(self):
        """The looks at places; the other looks are beside them."""
        return [look for look in self.looks if not look.purpose.startswith("Checking whether")]

    def _take(self, step):
        if isinstance(step, Move):
            self.frame = step.target
            return self.frame
        if len(self.looks) == self.blind:
            raise CalibrationError("tip_not_seen", "nothing there", remedy="look")
        spot = replace(self._spot(self.marks[step.mark]), score=self.score)
        spot = replace(spot, x=spot.x + self.wrong.get(len(self.looks), 0.0))
        return SeenAt.of(self.frame, spot, self.unit)

    def _spot(self, mark):
        dx, dy, dz = rotation_of(self.frame) @ mark.components()[:3]
        high_mm = self.frame.z_mm + dz - STATION.z_mm
        assert not self.focus or abs(high_mm) < 0.1, "out of focus"
        x, y = self.frame.x_mm + dx + self.off_mm[0], self.frame.y_mm + dy + self.off_mm[1]
        if self.unit is SpotUnit.BASE_MM:
            return Spot(x, y)
        (a, b), (c, d) = MODEL.mm_per_px
        x, y = x - MODEL.origin_mm[0], y - MODEL.origin_mm[1]
        area = MODEL.determinant
        return Spot((d * x - b * y) / area, (a * y - c * x) / area)


def fiducials(held, board=BOARD):
    return dict(enumerate(board.seen_from(held), start=1))


def tip_cell(**options):
    return IdealCell({0: TIP}, **options)


def miss(offset, true):
    return math.hypot(offset.x_mm - true.x_mm, offset.y_mm - true.y_mm)


@pytest.mark.parametrize("unit", list(SpotUnit))
def test_a_tip_and_what_the_camera_is_off_by_are_told_apart(unit):
    result = tip_cell(unit=unit).run(measure_camera(STATION, LookPlan(), here=HERE, stored=STORED))
    assert miss(result.offset, TIP) < 1e-9
    assert (result.offset.z_mm, result.offset.u_deg) == (STORED.z_mm, STORED.u_deg)
    assert result.camera_error_mm == pytest.approx(OFF_MM)
    assert "camera_moved" in result.warnings
    assert result.dof == 4
    assert isinstance(result.inputs[0], SeenAt)


HANGING = [(0.0, 180.0), (180.0, 0.0), (5.0, -4.0), (3.0, 176.0)]
"""V and W of a flange that is not upright."""


@pytest.mark.parametrize(("v_deg", "w_deg"), HANGING)
def test_a_flange_that_hangs_otherwise_is_led_and_solved_as_it_hangs(v_deg, w_deg):
    here = replace(HERE, v_deg=v_deg, w_deg=w_deg)
    found = tip_cell(here=here).run(measure_camera(STATION, LookPlan(), here=here, stored=STORED))
    assert miss(found.offset, TIP) < 1e-9
    assert found.camera_error_mm == pytest.approx(OFF_MM)
    plan = CameraAffineParameters()
    unknown = CameraStation(STATION.x_mm, STATION.y_mm, STATION.z_mm)
    pixels = measure_camera_affine(unknown, plan, here=here, stored=STORED)
    assert miss(tip_cell(here=here).run(pixels).offset, TIP) < 1e-6
    drive = measure_board(STATION, LookPlan(turns_deg=(0.0, 120.0)), BOARD, here=here, stored=HELD)
    held = IdealCell(fiducials(HELD), here=here).run(drive).offset
    assert (miss(held, HELD), held.u_deg) == pytest.approx((0, HELD.u_deg), abs=1e-6)


@pytest.mark.parametrize(("v_deg", "w_deg"), HANGING)
def test_the_proof_of_a_frame_that_hangs_otherwise_shows_an_error_and_nothing_else(v_deg, w_deg):
    here, aside = replace(HERE, v_deg=v_deg, w_deg=w_deg, tool=1), ToolOffset(2.0, -1.0, 0.5)
    for at, drift_mm in ((aside, 0.0), (replace(aside, x_mm=2.3), 0.3)):
        cell = IdealCell({0: aside}, here=here, off_mm=(0.0, 0.0))
        cell.focus = False
        result = cell.run(
            verify_by_looking(
                STATION, LookPlan(), here=here, angles_deg=(0, 90), tolerance_mm=0.1, aside=at
            )
        )
        assert result.max_drift_mm == pytest.approx(drift_mm, abs=2e-3)


@pytest.mark.parametrize("stored", [STORED, None])
def test_a_flange_that_leans_too_much_is_refused_before_anything_moves(stored):
    here = replace(HERE, v_deg=12.0 if stored else 1.0)
    for procedure in (
        measure_camera(STATION, LookPlan(), here=here, stored=stored),
        measure_camera_affine(STATION, CameraAffineParameters(), here=here, stored=stored),
        measure_board(STATION, LookPlan(), BOARD, here=here, stored=stored),
    ):
        cell = tip_cell(here=here)
        with refused("tilted_pose"):
            cell.run(procedure)
        assert cell.steps == []


def test_a_single_look_believes_the_camera_and_says_so():
    plan = LookPlan(turns_deg=(0.0,))
    result = tip_cell().run(measure_camera(STATION, plan, here=HERE, stored=STORED))
    assert miss(result.offset, TIP) == pytest.approx(math.hypot(*OFF_MM))
    assert result.camera_error_mm is None
    assert result.half_width95 == ()


def test_the_tool_is_lifted_before_it_turns_and_every_place_is_met_from_one_side():
    cell, plan = tip_cell(), LookPlan()
    cell.run(measure_camera(STATION, plan, here=HERE, stored=STORED))
    in_focus_mm = STATION.z_mm - STORED.z_mm
    before = HERE
    for index, step in enumerate(cell.steps):
        if isinstance(step, Look) and step not in cell.placed:
            assert isinstance(cell.steps[index - 1], Move)
        elif isinstance(step, Look):
            beside, came = cell.steps[index - 3].target, cell.steps[index - 1].target
            assert came.z_mm == beside.z_mm == in_focus_mm
            assert came.x_mm - beside.x_mm == pytest.approx(plan.beside_mm)
            assert came.y_mm - beside.y_mm == pytest.approx(plan.beside_mm)
        elif step.target.u_deg != before.u_deg:
            assert min(step.target.z_mm, before.z_mm) >= in_focus_mm + plan.lift_mm
            before = step.target
        else:
            before = step.target
    assert before.z_mm == in_focus_mm + plan.lift_mm
    assert {round(step.expected_mm[0], 6) for step in cell.placed} == {STATION.x_mm}
    # The picture beside costs no movement: there, two at the next place, four at each of three
    # further angles, and off.
    assert sum(isinstance(step, Move) for step in cell.steps) == 3 + 2 + 3 * 4 + 1


def test_the_score_of_a_finder_is_shown_and_decides_nothing():
    cell = tip_cell()
    cell.score = 0.125
    result = cell.run(measure_camera(STATION, LookPlan(), here=HERE, stored=STORED))
    assert cell.told[0] == "seen X +0.310 Y +0.346 mm from where it is expected; score 0.125"
    assert miss(result.offset, TIP) < 1e-9


def test_after_the_first_look_the_tip_is_brought_to_the_middle():
    cell = tip_cell(off_mm=(0.0, 0.0))
    result = cell.run(measure_camera(STATION, LookPlan(), here=HERE, stored=STORED))
    for seen in result.inputs:
        assert STATION.base_mm(seen) == pytest.approx((STATION.x_mm, STATION.y_mm))


def test_a_find_far_from_where_it_is_expected_is_not_followed():
    cell = tip_cell()
    cell.wrong = dict.fromkeys((1, 2), 300.0)
    with refused("far_off"):
        cell.run(measure_camera(STATION, LookPlan(), here=HERE, stored=STORED))
    assert len(cell.looks) == 2
    assert cell.frame.z_mm == STATION.z_mm - STORED.z_mm + LookPlan().lift_mm


def test_a_first_look_that_means_nothing_ends_lifted_too():
    cell = tip_cell(off_mm=(2000.0, 0.0))
    plan = LookPlan(search_mm=5000.0)
    with refused("implausible_offset"):
        cell.run(measure_camera(STATION, plan, here=HERE, stored=STORED))
    assert cell.frame.z_mm == STATION.z_mm - STORED.z_mm + plan.lift_mm


def test_the_look_that_fits_worst_is_offered_and_taken_again():
    cell = tip_cell()
    cell.wrong = dict.fromkeys((5, 6), 20.0)
    result = cell.run(measure_camera(STATION, LookPlan(), here=HERE, stored=STORED, retake=True))
    assert cell.offers[0].startswith("Look 2 at U 60.0 is 0.2")
    assert len(cell.offers) == 2
    assert len(cell.looks) == 2 * (1 + 4 + 1)
    assert cell.told[-1].startswith("4 looks agree within 0.000 mm; the last is 0.000 mm off")
    assert miss(result.offset, TIP) < 1e-9
    assert cell.told[0] == "seen X +0.310 Y +0.346 mm from where it is expected"
    assert cell.frame.z_mm == STATION.z_mm - STORED.z_mm + LookPlan().lift_mm


def test_a_camera_of_unknown_pose_is_found_with_the_tip():
    blank = replace(STATION, x_mm=300.8, y_mm=79.5, model=None)
    cell = tip_cell(off_mm=(0.0, 0.0))
    result = cell.run(
        measure_camera_affine(blank, CameraAffineParameters(), here=HERE, stored=STORED)
    )
    assert miss(result.offset, TIP) < 1e-9
    for found, true in zip(result.camera.mm_per_px, MODEL.mm_per_px, strict=True):
        assert found == pytest.approx(true)
    assert result.camera.origin_mm == pytest.approx(MODEL.origin_mm)
    assert result.condition_number < 3
    assert result.dof == 8


def test_a_camera_that_is_not_as_it_was_is_refused():
    before = replace(MODEL, mm_per_px=((0.0215, 0.001), (0.001, -0.02)))
    station = replace(STATION, model=before)
    procedure = measure_camera_affine(station, CameraAffineParameters(), here=HERE, stored=STORED)
    with refused("camera_changed"):
        tip_cell().run(procedure)


@pytest.mark.parametrize(
    ("plan", "code"),
    [
        (CameraAffineParameters(span_mm=0.0), "rank_deficient"),
        (CameraAffineParameters(turns_deg=(0.0, 20.0)), "insufficient_rotation"),
    ],
)
def test_a_pattern_that_cannot_tell_is_refused_before_anything_moves(plan, code):
    cell = tip_cell()
    with refused(code):
        cell.run(measure_camera_affine(STATION, plan, here=HERE, stored=STORED))
    assert cell.steps == []


def test_pixels_that_mean_nothing_are_refused():
    station = replace(STATION, model=None)
    with refused("camera_not_calibrated"):
        tip_cell().run(measure_camera(station, LookPlan(), here=HERE, stored=STORED))


@pytest.mark.parametrize("blind", [2, 6])
def test_what_is_not_seen_is_refused_with_the_tool_lifted(blind):
    cell = tip_cell(blind=blind)
    with refused("tip_not_seen"):
        cell.run(measure_camera(STATION, LookPlan(), here=HERE, stored=STORED))
    assert cell.frame.z_mm == STATION.z_mm - STORED.z_mm + LookPlan().lift_mm
    assert len(cell.looks) == blind


def test_a_board_and_what_the_camera_is_off_by_are_told_apart():
    plan = LookPlan(turns_deg=(0.0, 120.0))
    cell = IdealCell(fiducials(HELD))
    result = cell.run(measure_board(STATION, plan, BOARD, here=HERE, stored=STORED))
    assert miss(result.offset, HELD) < 1e-9
    assert result.offset.u_deg == pytest.approx(HELD.u_deg)
    assert result.camera_error_mm == pytest.approx(OFF_MM)
    assert result.dof == 2 * 8 - 5
    assert len(cell.looks) == 2 * (2 + 8)


def test_two_fiducials_at_one_angle_are_epsons_board():
    pair, plan = BoardDrawing.of_two(40.0), LookPlan(turns_deg=(0.0,))
    cell = IdealCell(fiducials(HELD, pair), off_mm=(0.0, 0.0))
    result = cell.run(measure_board(STATION, plan, pair, here=HERE, stored=STORED))
    assert result.method == "board"
    assert miss(result.offset, HELD) < 1e-9
    assert result.offset.u_deg == pytest.approx(HELD.u_deg)


@pytest.mark.parametrize(
    ("drawn", "code"),
    [
        (((10.0, 0.0), (10.0, 1.0)), "coincident_fiducials"),
        (((20.6, 0.0), (-20.6, 0.0)), "spacing_mismatch"),
    ],
)
def test_a_drawing_that_is_not_the_boards_is_refused(drawn, code):
    pair = BoardDrawing.of_two(40.0)
    cell = IdealCell(fiducials(HELD, pair))
    with refused(code):
        cell.run(measure_board(STATION, LookPlan(), BoardDrawing(drawn), here=HERE, stored=STORED))


def test_the_proof_shows_an_error_and_not_the_cameras():
    beside = {0: ToolOffset(-0.1, 0.0, 0.0)}
    here = Pose(290.0, 85.0, 0.0, 120.0, tool=1)
    for marks, drift in (({0: ToolOffset()}, 0.0), (beside, 0.1)):
        proof = IdealCell(marks, here=here).run(
            verify_by_looking(
                STATION,
                LookPlan(),
                here=here,
                angles_deg=(30.0, -90.0),
                tolerance_mm=0.05,
                camera_error_mm=OFF_MM,
            )
        )
        assert proof.max_drift_mm == pytest.approx(drift, abs=1e-9)
        assert proof.passed is (drift == 0.0)


def test_the_proof_of_a_board_looks_at_all_its_fiducials():
    here = Pose(290.0, 85.0, 0.0, 120.0, tool=1)
    turned = ToolOffset(0.0, 0.0, 0.0, 0.5)
    proof = IdealCell(fiducials(turned), here=here).run(
        verify_board(
            STATION,
            LookPlan(),
            BOARD,
            here=here,
            angles_deg=(30.0, -90.0),
            tolerance_mm=0.05,
            camera_error_mm=OFF_MM,
        )
    )
    lever_mm = math.hypot(20.0, 12.5)
    assert len(proof.drifts) == 8
    assert proof.max_drift_mm == pytest.approx(lever_mm * math.radians(0.5), rel=1e-3)
