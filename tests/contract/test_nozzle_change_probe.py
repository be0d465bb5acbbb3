"""A nozzle change on a touch plate, from the mounted nozzle to the tested length."""

from dataclasses import replace

import pytest
from robolink_simulators.epson.options import EpsonOptions

from robolink.errors import CalibrationError, VerifyError
from robolink.methods import ZTouchParameters, ZTouchSource
from robolink.runner import Move, Seek
from tests.contract._sensor_cell import TOOL, Followed, sensor_cell

SPEEDS_MM_S = ZTouchParameters().speeds_mm_s
SLOWEST_MM_S, FASTEST_MM_S = min(SPEEDS_MM_S), max(SPEEDS_MM_S)
DECEL_MM_S2 = 200.0
BRAKING_MM = FASTEST_MM_S**2 / (2 * DECEL_MM_S2)

# A reading is printed to 0.001 mm, so half of that; two speeds 1 mm/s apart amplify it.
PRINTED_MM = 0.003
PRINTED_S = 0.003

BARELY_MM = 0.02
"""More than braking adds, and four times the 3.2 um that 2 um a reading cause in a length."""


ONE_TOUCH = ZTouchParameters(
    test_speeds_mm_s=(2.0,), clearance_mm=2.5, back_off_mm=0.3, lift_mm=4.0, proof_turn_deg=0.0
)
"""The plan of the recipe ``gantry-touch-probe``: one touch tests what four have measured."""


@pytest.fixture
def cell():
    with sensor_cell() as cell:
        yield cell


@pytest.mark.parametrize("latency_s", [0.0, 0.02])
def test_a_change_ends_with_the_length_and_the_latency_without_the_way_of_braking(latency_s):
    with sensor_cell(options=EpsonOptions(real_pos_noise_mm=0.0)) as cell:
        cell.mount_plate(latency_s=latency_s)
        report = cell.run(ZTouchSource(cell.plate))
        found, drift = report.proposal.result, report.verification.drifts[0]
        stored = cell.stored
        assert stored is not None
        assert stored.z_mm == pytest.approx(cell.truth.z_mm, abs=PRINTED_MM)
        assert found.latency_s == pytest.approx(latency_s, abs=PRINTED_S)
        assert drift.dz_mm == pytest.approx(0.0, abs=2 * PRINTED_MM)
        assert stored.x_mm == report.proposal.before.x_mm


def test_a_change_ends_with_the_true_length_written_and_proved(cell):
    cell.mount_plate()
    report = cell.run(ZTouchSource(cell.plate))
    assert cell.stored.z_mm == pytest.approx(cell.truth.z_mm, abs=BARELY_MM)
    assert abs(report.verification.drifts[0].dz_mm) < 2 * BARELY_MM


def test_the_interval_holds_the_true_length(cell):
    cell.mount_plate(noise_mm=0.005)
    result = cell.run(ZTouchSource(cell.plate), write=False).proposal.result
    (half,) = result.half_width95
    assert abs(result.offset.z_mm - cell.truth.z_mm) <= half < 0.2


def test_the_tip_stops_at_the_touch_and_retreats_before_anything_else(cell):
    cell.mount_plate()
    followed = Followed()
    cell.run(ZTouchSource(cell.plate), followed, write=False)
    touch_mm = cell.plate.z_mm - cell.truth.z_mm
    assert len(followed.edges) == len(ZTouchParameters().speeds_mm_s)
    for done in followed.edges:
        assert done.pose.z_mm > touch_mm - BRAKING_MM - 0.01
        after = followed.steps[followed.steps.index(done) + 1]
        assert after.pose.z_mm > done.pose.z_mm + 0.9
        assert isinstance(after.step, Move)
        assert after.step.target.coordinates()[:2] == done.pose.coordinates()[:2]


def test_a_plate_that_was_moved_is_not_noticed_by_touching_it_alone(cell):
    cell.mount_plate()
    higher = replace(cell.plate, z_mm=cell.plate.z_mm + 0.4)
    report = cell.run(ZTouchSource(higher))
    assert cell.stored.z_mm == pytest.approx(cell.truth.z_mm + 0.4, abs=BARELY_MM)
    assert report.verification.passed


def test_a_nozzle_that_slips_after_the_write_fails_the_proof(cell):
    cell.mount_plate()
    before = cell.stored
    longer = replace(cell.truth, z_mm=cell.truth.z_mm - 0.5)

    class Slips(Followed):
        def wrote(self, receipt):
            cell.simulator.world.tips[TOOL] = longer

    with pytest.raises(VerifyError, match=r"Turn test failed: 0\.(49|48[5-9]|50|51[0-5])"):
        cell.run(ZTouchSource(cell.plate), Slips())
    assert cell.stored == before


@pytest.mark.parametrize("latency_s", [0.0, 0.02])
@pytest.mark.parametrize("slip_mm", [0.0, 0.06, -0.06])
def test_one_touch_tests_a_length_by_the_latency_that_was_found(cell, slip_mm, latency_s):
    class Slips(Followed):
        def wrote(self, receipt):
            tip = replace(cell.truth, z_mm=cell.truth.z_mm + slip_mm)
            cell.simulator.world.tips[TOOL] = tip

    cell.mount_plate(latency_s=latency_s)
    source, followed = ZTouchSource(cell.plate, ONE_TOUCH), Slips()
    if slip_mm:
        with pytest.raises(VerifyError) as refused:
            cell.run(source, followed)
        assert refused.value.code == "proof_contradicts_accuracy"
    else:
        report = cell.run(source, followed)
        assert abs(report.verification.drifts[0].dz_mm) < BARELY_MM
    speeds = [one.step.speed_mm_s for one in followed.steps if isinstance(one.step, Seek)]
    assert speeds == [2.0, 1.0, 2.0, 1.0, 2.0]


def test_an_input_that_comes_later_than_it_did_is_not_taken_for_a_right_length(cell):
    """Four touches would find the new latency and say nothing of it."""

    class Slower(Followed):
        def wrote(self, receipt):
            cell.mount_plate(latency_s=0.03)

    cell.mount_plate(latency_s=0.002)
    with pytest.raises(VerifyError) as refused:
        cell.run(ZTouchSource(cell.plate, ONE_TOUCH), Slower())
    assert refused.value.code == "proof_contradicts_accuracy"


def test_the_tip_comes_down_from_its_safe_height_in_one_movement(cell):
    cell.mount_plate()
    followed = Followed()
    cell.run(ZTouchSource(cell.plate, ONE_TOUCH), followed, write=False)
    heights = [one.step.target.z_mm for one in followed.steps if isinstance(one.step, Move)]
    first = next(n for n, one in enumerate(followed.steps) if isinstance(one.step, Seek))
    clear_mm = cell.plate.z_mm + ONE_TOUCH.clearance_mm - cell.stored.z_mm
    assert heights[first - 1] == pytest.approx(clear_mm)
    assert all(one >= clear_mm + ONE_TOUCH.lift_mm - 2.5 for one in heights[: first - 1])


def test_a_length_that_jumps_is_refused_by_the_limit_of_the_change(cell):
    cell.mount_plate()
    before = cell.stored
    cell.simulator.world.tips[TOOL] = replace(cell.truth, z_mm=before.z_mm - 2.6)
    with pytest.raises(CalibrationError, match=r"would move 2\.[56]") as refusal:
        cell.run(ZTouchSource(cell.plate))
    assert refusal.value.code == "implausible_change"
    assert cell.stored == before
    cell.run(ZTouchSource(cell.plate), max_change_mm=3.0)
    assert cell.stored.z_mm == pytest.approx(before.z_mm - 2.6, abs=BARELY_MM)


def refused(cell, code, listener=None):
    before = cell.stored
    with pytest.raises(CalibrationError) as refusal:
        cell.run(ZTouchSource(cell.plate), listener)
    assert refusal.value.code == code
    assert refusal.value.remedy
    assert cell.stored == before
    assert cell.simulator.machine.tools.selected == TOOL
    assert cell.tip_z_mm > cell.plate.z_mm + 9.0


def test_a_surface_that_is_not_there_is_sought_so_far_and_no_further(cell):
    lowest = cell.plate.z_mm - ZTouchParameters().beyond_mm - cell.stored.z_mm
    followed = Followed()
    refused(cell, "no_edge", followed)
    assert not followed.edges
    targets = [s.step.target.z_mm for s in followed.steps if isinstance(s.step, Move | Seek)]
    assert min(targets) > lowest


def test_a_plate_that_is_on_from_the_start_is_refused_before_the_tip_comes_near(cell):
    cell.simulator.machine.inputs.set(cell.plate.input, True)
    followed = Followed()
    refused(cell, "edge_passed", followed)
    assert min(done.pose.z_mm for done in followed.steps) > cell.plate.z_mm - cell.stored.z_mm + 2
