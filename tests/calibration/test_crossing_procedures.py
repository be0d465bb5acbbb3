"""The moves through beams and onto a plate, with an ideal tip: every move and its target."""

import random
import re
from dataclasses import replace

import pytest

from robolink.calibration import Beam, Touch, rotation_of, toward_zero
from robolink.errors import CalibrationError
from robolink.methods import (
    BeamsParameters,
    ZTouchParameters,
    measure_beams,
    measure_z_touch,
    verify_by_crossing,
)
from robolink.methods.z_touch.procedure import TriggerLag, verify_by_touching
from robolink.model import Path, Pose, ToolOffset, rotate_xy
from robolink.runner import Confirm, Move, Notify, Seek
from robolink.stations import BeamStation, TouchStation
from tests.calibration._simulated import refused

STATION = BeamStation((Beam(300.0, 80.0, 3.0), Beam(300.0, 80.0, 88.0)), -30.0, (3, 4))
PLATE = TouchStation(310.0, 70.0, -40.0, 5)
TIP = ToolOffset(12.2, -3.6, -20.3)
STORED = ToolOffset(12.0, -3.5, -20.0, 7.0)
HERE = Pose(280.0, 90.0, 0.0, 120.0, tool=0)
WIDTH_MM = 0.3


SLIP_MM = 0.4
"""Two crossings that check each other share it: half of it is well beyond the tolerance, 0.15."""


class IdealCell:
    """Carries out the steps of a procedure; the tip breaks a beam within its width.

    Attributes:
        frame: The place of the frame.
        steps: The steps so far that move or seek.
        ways: Where the frame was before and after each of them.
        crossings: How many times it has entered a beam.
        told: Messages to the person.
        offers: Offers to the person, of which so many are accepted.
    """

    def __init__(self, tip, *, here=HERE, silent=(), slips=(), noise_mm=0.0, accepts=0):
        self.tip, self.frame, self.silent = tip, here, silent
        self.steps, self.ways, self.told, self.offers = [], [], [], []
        self.crossings = 0
        self._slips, self._accepts = set(slips), accepts
        self._random, self._noise_mm, self._slip_mm = random.Random(1), noise_mm, 0.0

    @property
    def seeks(self):
        return [step for step in self.steps if isinstance(step, Seek)]

    def run(self, procedure):
        try:
            step = next(procedure)
            while True:
                if isinstance(step, Notify):
                    self.told.append(step.text)
                    step = procedure.send(None)
                    continue
                if isinstance(step, Confirm):
                    self.offers.append((step.question, len(self.steps)))
                    step = procedure.send(len(self.offers) <= self._accepts)
                    continue
                self.steps.append(step)
                before = self.frame
                try:
                    self.frame = self._take(step)
                except CalibrationError as error:
                    step = procedure.throw(error)
                    continue
                finally:
                    self.ways.append((before, self.frame))
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
            self._slip_mm = SLIP_MM if len(self.seeks) in self._slips else 0.0
            off_mm = self._slip_mm + self._random.gauss(0, self._noise_mm)
            _, _, below_mm = rotation_of(self.frame) @ self.tip.components()[:3]
            return replace(step.target, z_mm=PLATE.z_mm - below_mm + off_mm)
        crossing = self.crossings + (0 if step.edge.falling else 1)
        self._slip_mm = SLIP_MM if crossing in self._slips else 0.0
        beam = STATION.beams[STATION.inputs.index(step.edge.number)]
        begin, end = self._across(beam, self.frame), self._across(beam, step.target)
        way = 1.0 if end > begin else -1.0
        edge = way * WIDTH_MM if step.edge.falling else -way * WIDTH_MM
        edge += self._slip_mm + self._random.gauss(0, self._noise_mm)
        share = (edge - begin) / (end - begin)
        if share < 0:
            raise CalibrationError("edge_passed", "the input shows it", remedy="look")
        assert share <= 1
        self.crossings = crossing
        pairs = zip(self.frame.coordinates(), step.target.coordinates(), strict=True)
        return replace(step.target, **_between(pairs, share))

    def _across(self, beam, frame):
        nx, ny = beam.normal
        turned = rotation_of(frame)
        dx, dy, dz = turned @ self.tip.components()[:3]
        # The beam sees the part of the shaft at its height; the shaft runs along the axis of the
        # frame.
        up_mm = (STATION.z_mm - frame.z_mm - dz) / turned[2, 2]
        dx, dy = dx + up_mm * turned[0, 2], dy + up_mm * turned[1, 2]
        return nx * (frame.x_mm + dx) + ny * (frame.y_mm + dy) - beam.distance_mm


def _between(pairs, share):
    x_mm, y_mm, z_mm, *_ = (a + (b - a) * share for a, b in pairs)
    return {"x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm}


@pytest.mark.parametrize("turn_deg", [0.0, 180.0])
def test_an_ideal_tip_is_found_exactly_and_the_rest_is_kept(turn_deg):
    cell = IdealCell(TIP)
    procedure = measure_beams(STATION, BeamsParameters(turn_deg=turn_deg), here=HERE, stored=STORED)
    found = cell.run(procedure).offset
    assert (found.x_mm, found.y_mm) == pytest.approx((TIP.x_mm, TIP.y_mm), abs=1e-9)
    assert (found.z_mm, found.u_deg) == (STORED.z_mm, STORED.u_deg)


HANGING = [(0.0, 180.0), (180.0, 0.0), (5.0, -4.0), (3.0, 176.0)]
"""V and W of a flange that is not upright."""
TRUE_Z = replace(STORED, z_mm=TIP.z_mm)
TRUE_XY = replace(TIP, z_mm=STORED.z_mm)


@pytest.mark.parametrize(("v_deg", "w_deg"), HANGING)
def test_a_flange_that_hangs_otherwise_is_led_and_solved_as_it_hangs(v_deg, w_deg):
    here = replace(HERE, v_deg=v_deg, w_deg=w_deg)
    for turn_deg in (0.0, 180.0):
        plan = BeamsParameters(turn_deg=turn_deg)
        cell = IdealCell(TIP, here=here)
        found = cell.run(measure_beams(STATION, plan, here=here, stored=TRUE_Z)).offset
        # A tip 0.2 mm from its stored place dips by another amount: 2 um here, if ignored.
        assert (found.x_mm, found.y_mm) == pytest.approx((TIP.x_mm, TIP.y_mm), abs=1e-5)
    touching = measure_z_touch(PLATE, ZTouchParameters(), here=here, stored=TRUE_XY)
    assert IdealCell(TIP, here=here).run(touching).offset.z_mm == pytest.approx(TIP.z_mm)


def proofs(here, true, told):
    """Return the drift in a turn test by beams and in one by touching, mm."""
    crossing = verify_by_crossing(
        STATION, BeamsParameters(), here=here, angles_deg=(100.0,), tolerance_mm=0.1, aside=told
    )
    touching = verify_by_touching(
        PLATE, ZTouchParameters(), here=here, angles_deg=(100.0,), tolerance_mm=0.1, aside=told
    )
    crossed, touched = (IdealCell(true, here=here).run(way) for way in (crossing, touching))
    return crossed.max_drift_mm, touched.max_drift_mm


@pytest.mark.parametrize(("v_deg", "w_deg"), [*HANGING, (30.0, 20.0)])
def test_the_proof_of_a_frame_that_hangs_otherwise_shows_an_error_and_nothing_else(v_deg, w_deg):
    here, true = replace(HERE, v_deg=v_deg, w_deg=w_deg, tool=1), ToolOffset(2.0, -1.0, 0.5)
    assert proofs(here, true, true) == pytest.approx((0, 0), abs=1e-9)
    rise = abs(rotation_of(here)[2, 2])
    aside, _ = proofs(here, true, replace(true, y_mm=-0.7))
    _, longer = proofs(here, true, replace(true, z_mm=0.8))
    assert 0.2 < aside < 0.4
    assert longer == pytest.approx(0.3 * rise, abs=1e-9)


@pytest.mark.parametrize("stored", [STORED, None])
def test_a_flange_that_leans_too_much_is_refused_before_anything_moves(stored):
    here = replace(HERE, w_deg=-12.0 if stored else 1.0)
    for procedure in (
        measure_beams(STATION, BeamsParameters(), here=here, stored=stored),
        measure_z_touch(PLATE, ZTouchParameters(), here=here, stored=stored),
    ):
        cell = IdealCell(TIP, here=here)
        with refused("tilted_pose"):
            cell.run(procedure)
        assert cell.steps == []


def test_nothing_turns_and_no_joint_moves_while_the_tip_is_among_the_beams():
    cell = IdealCell(TIP)
    cell.run(measure_beams(STATION, BeamsParameters(turn_deg=180.0), here=HERE, stored=STORED))
    safe_mm = STATION.z_mm + BeamsParameters().lift_mm - STORED.z_mm
    require_safe_ways(cell)
    assert cell.frame.z_mm == pytest.approx(safe_mm)


def require_safe_ways(cell):
    """Check that moves among the beams are straight with constant U, and the others vertical.

    Nothing among them goes farther from a beam than planned.
    """
    safe_mm = STATION.z_mm + BeamsParameters().lift_mm - STORED.z_mm - 1e-9
    reach_mm = BeamsParameters().aside_mm + 1e-9
    for step, (before, after) in zip(cell.steps, cell.ways, strict=True):
        down, up = after.z_mm < safe_mm, before.z_mm < safe_mm
        if down or up:
            assert step.target.u_deg == before.u_deg
            assert getattr(step, "path", Path.STRAIGHT) is Path.STRAIGHT
        if down is not up:
            assert after.coordinates()[:2] == before.coordinates()[:2]
        if down:
            dx_mm, dy_mm = rotate_xy(STORED.x_mm, STORED.y_mm, step.target.u_deg)
            tip = step.target.x_mm + dx_mm, step.target.y_mm + dy_mm
            for beam in STATION.beams:
                nx, ny = beam.normal
                assert abs(nx * tip[0] + ny * tip[1] - beam.distance_mm) <= reach_mm


PLANS = [
    (0.0, 3, 4, "Crossing 4 at beam 2 is 0.", 4),
    (180.0, 2, 14, "Crossing 10 at beam 2 and U -60.0 is 0.", 4),
]
"""Second angle, repeats, the crossing in which the needle slips, its name, and its input.

The four crossings of the shaft, before the tool turns, have no number.
"""


def test_each_crossing_that_others_check_tells_how_it_fits_and_what_it_repeats_to():
    cell = IdealCell(TIP, noise_mm=0.003)
    cell.run(measure_beams(STATION, BeamsParameters(), here=HERE, stored=STORED))
    assert [text.partition(" agree")[0] for text in cell.told] == [
        f"{count} crossings" for count in (5, 6, 7, 8)
    ]
    assert all("the last is 0.00" in text for text in cell.told)
    assert all("X and Y: repeatable to +-0.0" in text for text in cell.told)
    assert "One more at beam 2 would make it about +-0.0" in cell.told[0]
    assert "One more" not in cell.told[-1]
    assert cell.offers == []


def test_where_the_beams_are_is_not_relied_on_before_the_tool_has_turned():
    cell = IdealCell(TIP, noise_mm=0.003)
    cell.run(measure_beams(STATION, BeamsParameters(turn_deg=180.0), here=HERE, stored=STORED))
    assert [int(text.split()[0]) for text in cell.told] == [5, 6, 7, 8, *range(10, 17)]
    assert ["repeatable to" in text for text in cell.told] == [False] * 4 + [True] * 7
    assert "One more at beam 1 and U -60.0" in cell.told[4]


@pytest.mark.parametrize(("turn_deg", "repeats", "slip", "named", "number"), PLANS)
def test_the_crossing_that_fits_worst_is_offered_and_it_alone_is_driven_again(
    turn_deg, repeats, slip, named, number
):
    cell = IdealCell(TIP, slips=[slip], accepts=1, noise_mm=1e-4)
    found = cell.run(
        measure_beams(
            STATION,
            BeamsParameters(repeats=repeats, turn_deg=turn_deg, retake=True),
            here=HERE,
            stored=STORED,
        )
    )
    (question, when), *_ = cell.offers
    assert question.startswith(named)
    assert question.endswith("Repeat it?")
    require_safe_ways(cell)
    again = cell.steps[when:]
    seeks = [step for step in again if isinstance(step, Seek)]
    assert len(seeks) == 2
    assert {step.edge.number for step in seeks} == {number}
    first, last = again[0], again[-1]
    assert first.target.z_mm == last.target.z_mm == cell.steps[when - 1].target.z_mm
    assert last.path is Path.STRAIGHT
    assert (found.offset.x_mm, found.offset.y_mm) == pytest.approx((TIP.x_mm, TIP.y_mm), abs=1e-3)
    assert found.max_residual_mm < 1e-3
    assert "the last is 0.000" in cell.told[-1]


def test_of_two_crossings_that_only_check_each_other_the_second_offer_is_the_other():
    cell = IdealCell(TIP, slips=[8], accepts=2)
    found = cell.run(measure_beams(STATION, BeamsParameters(retake=True), here=HERE, stored=STORED))
    assert [question[:10] for question, _ in cell.offers[:2]] == ["Crossing 4", "Crossing 8"]
    assert found.max_residual_mm < 1e-9


def test_who_declines_keeps_the_crossings_with_their_doubt():
    cell = IdealCell(TIP, slips=[4])
    found = cell.run(measure_beams(STATION, BeamsParameters(retake=True), here=HERE, stored=STORED))
    assert len(cell.offers) == 1
    assert "large_residual" in found.warnings


@pytest.mark.parametrize(
    ("sigma_mm", "turn_deg", "until_mm", "least"),
    [(None, 0.0, 0.03, 8), (0.003, 0.0, 0.3, 5), (None, 180.0, 0.03, 42)],
)
def test_crossings_end_when_the_interval_is_narrow_enough(sigma_mm, turn_deg, until_mm, least):
    """With two angles not before the tool has turned; the shaft is always measured."""
    cell = IdealCell(TIP, noise_mm=0.003)
    plan = BeamsParameters(repeats=10, turn_deg=turn_deg, until_mm=until_mm)
    found = cell.run(
        measure_beams(
            STATION,
            plan,
            here=HERE,
            stored=STORED,
            sigma_mm=sigma_mm,
        )
    )
    assert len(found.inputs) == least
    assert f"That is enough: {least} crossings were taken." in cell.told
    assert len(cell.seeks) == 2 * (least + 4)
    require_safe_ways(cell)
    assert max(found.half_width95) <= until_mm


def test_a_silent_beam_lifts_the_tip_straight_up_before_the_refusal():
    cell = IdealCell(TIP, silent=(4,))
    with refused("no_edge"):
        cell.run(measure_beams(STATION, BeamsParameters(), here=HERE, stored=STORED))
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
            STATION, BeamsParameters(), here=cell.frame, angles_deg=(-60.0,), tolerance_mm=0.2
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
            BeamsParameters(),
            here=cell.frame,
            angles_deg=(-60.0,),
            tolerance_mm=0.2,
            aside=off,
        )
    )
    assert result.max_drift_mm == pytest.approx(0.0, abs=1e-9)


def test_each_touch_begins_above_the_last_one_and_the_tip_ends_lifted():
    cell = IdealCell(TIP)
    plan = ZTouchParameters(back_off_mm=0.8)
    found = cell.run(measure_z_touch(PLATE, plan, here=HERE, stored=STORED)).offset
    assert found.z_mm == pytest.approx(TIP.z_mm)
    assert found.x_mm == STORED.x_mm
    touch_mm = PLATE.z_mm - TIP.z_mm
    after = [b for a, b in zip(cell.steps, cell.steps[1:], strict=False) if isinstance(a, Seek)]
    assert [step.target.z_mm for step in after] == pytest.approx([touch_mm + 0.8] * 4)
    assert cell.frame.z_mm == pytest.approx(PLATE.z_mm + plan.lift_mm - STORED.z_mm)


def test_each_touch_tells_how_it_fits_and_the_worst_alone_is_made_again():
    speeds = (2.0, 1.0, 2.0, 1.0, 2.0, 1.0)
    cell = IdealCell(TIP, slips=[3], accepts=1)
    plan = ZTouchParameters(speeds_mm_s=speeds, retake=True)
    found = cell.run(measure_z_touch(PLATE, plan, here=HERE, stored=STORED))
    assert [text.partition(" agree")[0] for text in cell.told] == [
        f"{count} touches" for count in (3, 4, 5, 6, 6)
    ]
    assert " Z: repeatable to +-" in cell.told[0]
    half, following = map(float, re.findall(r"\+-(\d\.\d+)", cell.told[0]))
    assert "One more at 1 mm/s would make it about" in cell.told[0]
    assert following == pytest.approx(0.745 * half, rel=0.01)
    (question, when), *_ = cell.offers
    assert question.startswith("Touch 3 at 2 mm/s is 0.2")
    down, seek, back_off, lift = cell.steps[when:]
    assert isinstance(seek, Seek)
    assert seek.speed_mm_s == 2.0
    assert down.target.z_mm < lift.target.z_mm
    assert back_off.target.coordinates()[:2] == lift.target.coordinates()[:2]
    assert found.offset.z_mm == pytest.approx(TIP.z_mm)


@pytest.mark.parametrize(("sigma_mm", "until_mm", "least"), [(None, 0.1, 6), (0.003, 2.0, 3)])
def test_touches_end_when_the_interval_is_narrow_enough(sigma_mm, until_mm, least):
    cell = IdealCell(TIP, noise_mm=0.003)
    plan = ZTouchParameters(speeds_mm_s=(2.0, 1.0) * 6, until_mm=until_mm)
    procedure = measure_z_touch(PLATE, plan, here=HERE, stored=STORED, sigma_mm=sigma_mm)
    found = cell.run(procedure)
    assert found.dof == least - 2
    assert len(cell.seeks) == least
    assert f"That is enough: {least} touches were taken." in cell.told


@pytest.mark.parametrize(("u_deg", "turned_deg"), [(90.0, -90.0), (0.0, 180.0), (-170.0, 10.0)])
def test_u_turns_toward_zero(u_deg, turned_deg):
    assert toward_zero(u_deg, 180.0) == turned_deg


@pytest.mark.parametrize("braking_mm_s2", [None, 200.0])
@pytest.mark.parametrize("overshoot", [0.0, 0.0005])
@pytest.mark.parametrize("latency_s", [-0.0004, 0.0, 0.02])
def test_a_touch_is_corrected_by_what_the_measurement_found(latency_s, overshoot, braking_mm_s2):
    """A latency just below zero is scatter: the measurement let it pass, so the test does."""
    lag = TriggerLag(latency_s, overshoot)
    for speed_mm_s in (1.0, 2.0, 5.0):
        by_braking = 0.0 if braking_mm_s2 is None else speed_mm_s**2 / (2 * braking_mm_s2)
        read_mm = 33.0 - speed_mm_s * latency_s - speed_mm_s**2 * overshoot - by_braking
        touch = Touch(read_mm, speed_mm_s)
        assert lag.height_mm(touch, braking_mm_s2) == pytest.approx(33.0, abs=1e-12)
