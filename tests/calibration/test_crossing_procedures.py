"""The drives through beams and onto a plate, fed with an ideal tip: what moves, and where."""

from dataclasses import replace

import pytest

from robolink.calibration import (
    Beam,
    BeamStation,
    CrossingPlan,
    Move,
    ProbePlan,
    Seek,
    TouchStation,
    cross_beams,
    touch_off,
    toward_zero,
    verify_by_crossing,
)
from robolink.errors import CalibrationError
from robolink.model import Path, Pose, ToolOffset, rotate_xy
from tests.calibration._simulated import refused

STATION = BeamStation((Beam(300.0, 80.0, 3.0), Beam(300.0, 80.0, 88.0)), -30.0, (3, 4))
PLATE = TouchStation(310.0, 70.0, -40.0, 5)
TIP = ToolOffset(12.2, -3.6, -20.3)
STORED = ToolOffset(12.0, -3.5, -20.0, 7.0)
HERE = Pose(280.0, 90.0, 0.0, 120.0, tool=0)
WIDTH_MM = 0.3


class IdealCell:
    """Takes the steps of a procedure; the tip breaks a beam within its width.

    Attributes:
        frame: Where the frame is.
        steps: The steps taken.
    """

    def __init__(self, tip, *, here=HERE, silent=()):
        self.tip, self.frame, self.silent = tip, here, silent
        self.steps = []

    def run(self, procedure):
        try:
            step = next(procedure)
            while True:
                self.steps.append(step)
                try:
                    self.frame = self._take(step)
                except CalibrationError as error:
                    step = procedure.throw(error)
                    continue
                step = procedure.send(self.frame)
        except StopIteration as finished:
            return finished.value

    def _take(self, step):
        if isinstance(step, Move):
            return step.target
        assert isinstance(step, Seek)
        assert step.target.u_deg == self.frame.u_deg
        if step.edge.number in self.silent:
            self.frame = step.target
            raise CalibrationError("no_edge", "nothing", remedy="look")
        if step.edge.number == PLATE.input:
            return replace(step.target, z_mm=PLATE.z_mm - self.tip.z_mm)
        beam = STATION.beams[STATION.inputs.index(step.edge.number)]
        begin, end = self._across(beam, self.frame), self._across(beam, step.target)
        way = 1.0 if end > begin else -1.0
        edge = way * WIDTH_MM if step.edge.falling else -way * WIDTH_MM
        share = (edge - begin) / (end - begin)
        assert 0 <= share <= 1
        pairs = zip(self.frame.coordinates(), step.target.coordinates(), strict=True)
        return replace(step.target, **_between(pairs, share))

    def _across(self, beam, frame):
        nx, ny = beam.normal
        dx, dy = rotate_xy(self.tip.x_mm, self.tip.y_mm, frame.u_deg)
        return nx * (frame.x_mm + dx) + ny * (frame.y_mm + dy) - beam.distance_mm


def _between(pairs, share):
    x_mm, y_mm, z_mm, *_ = (a + (b - a) * share for a, b in pairs)
    return {"x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm}


@pytest.mark.parametrize("turn_deg", [0.0, 180.0])
def test_an_ideal_tip_is_found_exactly_and_the_rest_is_kept(turn_deg):
    cell = IdealCell(TIP)
    procedure = cross_beams(STATION, CrossingPlan(), here=HERE, stored=STORED, turn_deg=turn_deg)
    found = cell.run(procedure).offset
    assert (found.x_mm, found.y_mm) == pytest.approx((TIP.x_mm, TIP.y_mm), abs=1e-9)
    assert (found.z_mm, found.u_deg) == (STORED.z_mm, STORED.u_deg)


def test_nothing_turns_and_no_joint_moves_while_the_tip_is_among_the_beams():
    cell = IdealCell(TIP)
    cell.run(cross_beams(STATION, CrossingPlan(), here=HERE, stored=STORED, turn_deg=180.0))
    safe_mm = STATION.z_mm + CrossingPlan().lift_mm - STORED.z_mm
    before = HERE
    for step in cell.steps:
        turns = step.target.u_deg != before.u_deg
        if turns or getattr(step, "path", Path.STRAIGHT) is Path.JOINT:
            assert min(step.target.z_mm, before.z_mm) >= safe_mm - 1e-9
        before = step.target
    assert cell.frame.z_mm == pytest.approx(safe_mm)


def test_a_silent_beam_lifts_the_tip_straight_up_before_the_refusal():
    cell = IdealCell(TIP, silent=(4,))
    with refused("no_edge"):
        cell.run(cross_beams(STATION, CrossingPlan(), here=HERE, stored=STORED))
    seek, lift = cell.steps[-2:]
    assert isinstance(seek, Seek)
    assert isinstance(lift, Move)
    assert lift.path is Path.STRAIGHT
    assert lift.target == replace(seek.target, z_mm=lift.target.z_mm)
    assert lift.target.z_mm > seek.target.z_mm + 10


def test_the_drift_is_where_the_tip_of_the_frame_in_force_really_is():
    off = ToolOffset(0.2, -0.1, 0.0)
    cell = IdealCell(off, here=replace(HERE, tool=1))
    result = cell.run(
        verify_by_crossing(
            STATION, CrossingPlan(), here=cell.frame, angles_deg=(-60.0,), tolerance_mm=0.2
        )
    )
    expected = rotate_xy(-off.x_mm, -off.y_mm, -60.0)
    (drift,) = result.drifts
    assert (drift.dx_mm, drift.dy_mm) == pytest.approx(expected, abs=1e-9)
    assert not result.passed


def test_a_tip_that_is_expected_aside_does_not_drift():
    off = ToolOffset(0.2, -0.1, 0.0)
    cell = IdealCell(off, here=replace(HERE, tool=1))
    result = cell.run(
        verify_by_crossing(
            STATION,
            CrossingPlan(),
            here=cell.frame,
            angles_deg=(-60.0,),
            tolerance_mm=0.2,
            aside=off,
        )
    )
    assert result.max_drift_mm == pytest.approx(0.0, abs=1e-9)


def test_each_touch_begins_above_the_last_one_and_the_tip_ends_lifted():
    cell = IdealCell(TIP)
    plan = ProbePlan(back_off_mm=0.8)
    found = cell.run(touch_off(PLATE, plan, here=HERE, stored=STORED)).offset
    assert found.z_mm == pytest.approx(TIP.z_mm)
    assert found.x_mm == STORED.x_mm
    touch_mm = PLATE.z_mm - TIP.z_mm
    after = [b for a, b in zip(cell.steps, cell.steps[1:], strict=False) if isinstance(a, Seek)]
    assert [step.target.z_mm for step in after] == pytest.approx([touch_mm + 0.8] * 4)
    assert cell.frame.z_mm == pytest.approx(PLATE.z_mm + plan.lift_mm - STORED.z_mm)


@pytest.mark.parametrize(("u_deg", "turned_deg"), [(90.0, -90.0), (0.0, 180.0), (-170.0, 10.0)])
def test_u_turns_toward_zero(u_deg, turned_deg):
    assert toward_zero(u_deg, 180.0) == turned_deg
