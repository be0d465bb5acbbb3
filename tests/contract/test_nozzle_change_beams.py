"""A nozzle change on two crossed beams, from the mounted needle to the tested offset."""

import math
import sys
from dataclasses import replace

import pytest

from robolink.calibration import Beam
from robolink.errors import CalibrationError, LimitError, VerifyError
from robolink.methods import BeamsParameters, BeamsSource, trace_beams
from robolink.model import WorkBox
from robolink.runner import Runner, RunSettings
from tests.contract._sensor_cell import (
    HEADINGS,
    TOOL,
    EitherOf,
    Followed,
    Inverted,
    NobodyThere,
    miss_mm,
    sensor_cell,
    shifted,
)

POSITION_NOISE_MM = 0.002
"""Scatter of a position that the simulated controller prints."""

BARELY_MM = 0.012
"""The largest offset error that this scatter alone causes."""


@pytest.fixture
def cell():
    with sensor_cell() as cell:
        yield cell


@pytest.mark.parametrize(
    ("shape", "wiring"),
    [
        pytest.param({}, {}, marks=pytest.mark.soak),
        pytest.param({"nozzle_radius_mm": 0.6, "radius_mm": 0.2}, {}, marks=pytest.mark.soak),
        ({"tilt_deg": 3.0}, {}),
        ({}, {"latency_s": 0.01}),
    ],
    ids=["plain", "thick", "tilted", "late"],
)
def test_a_change_ends_with_the_true_offset_written_and_proved(cell, shape, wiring):
    cell.mount_beams(cell.beams(**shape), **wiring)
    report = cell.run(BeamsSource(cell.station))
    assert miss_mm(cell.stored, cell.truth) < BARELY_MM
    assert cell.stored.z_mm == report.proposal.before.z_mm
    assert report.verification.passed
    assert report.verification.max_drift_mm < 2 * BARELY_MM


def test_play_in_the_joints_cancels_between_the_two_directions(cell):
    cell.mount_beams(cell.beams())
    cell.simulator.machine.arm.backlash_deg = 0.005
    cell.run(BeamsSource(cell.station))
    assert miss_mm(cell.stored, cell.truth) < 1.5 * BARELY_MM


def test_a_needle_change_takes_less_than_12_s_of_the_robots_time(cell, capsys):
    # Counted by the simulated clock, which only movements advance here: 11.20 s, the same in each
    # run and on each machine.
    cell.mount_beams(cell.beams(radius_mm=0.1), latency_s=0.002, noise_mm=0.003)
    with cell.connected() as controller:
        began_ns = cell.clock.now_ns()
        report = cell.change(BeamsSource(cell.station))(controller)
        took_s = (cell.clock.now_ns() - began_ns) / 1e9
    with capsys.disabled():
        sys.stdout.write(f"\nneedle change on crossed beams: {took_s:.1f} s of robot time\n")
    assert took_s < 12.0
    # The needle stands upright, so it is told to lean by nothing.
    result = report.proposal.result
    assert "needle_leans" not in result.notes
    assert math.hypot(*result.lean.corrected_mm) < 0.003
    assert miss_mm(result.offset, cell.truth) < 1.2 * result.region95_radius_mm


@pytest.mark.parametrize(("runs", "least"), [(4, 7), pytest.param(24, 43, marks=pytest.mark.soak)])
def test_the_stated_scatter_gives_an_interval_that_holds_the_truth(runs, least):
    noise_mm = 0.01
    sigma_mm = math.hypot(noise_mm, POSITION_NOISE_MM) / math.sqrt(2)
    plan = BeamsParameters(shaft_mm=0.0)
    held = 0
    for seed in range(1, 1 + runs):
        with sensor_cell(seed) as cell:
            cell.mount_beams(cell.beams(), noise_mm=noise_mm)
            source = BeamsSource(cell.station, plan, sigma_mm=sigma_mm)
            result = cell.run(source, write=False).proposal.result
            errors = (
                result.offset.x_mm - cell.truth.x_mm,
                result.offset.y_mm - cell.truth.y_mm,
            )
            pairs = zip(errors, result.half_width95, strict=True)
            held += sum(abs(error) <= half for error, half in pairs)
    assert held >= least


def test_repeated_crossings_tell_their_own_scatter(cell):
    cell.mount_beams(cell.beams(), noise_mm=0.01)
    source = BeamsSource(cell.station, BeamsParameters(repeats=3, shaft_mm=0.0))
    result = cell.run(source, write=False).proposal.result
    assert result.dof == 8
    assert 0.003 < result.sigma_mm < 0.02
    assert miss_mm(result.offset, cell.truth) < math.hypot(*result.half_width95)


def test_moved_beams_fail_the_proof_and_the_old_value_comes_back(cell):
    first, second = cell.beams()
    cell.mount_beams((first, shifted(second, 0.3)))
    before = cell.stored
    with pytest.raises(VerifyError, match=r"Turn test failed: 0\.(59|60)"):
        cell.run(BeamsSource(cell.station))
    assert cell.stored == before
    assert cell.simulator.machine.tools.selected == TOOL


def test_both_beams_may_switch_the_same_input_off(cell):
    both = EitherOf(cell.beams())
    cell.mount_beams((Inverted(both), Inverted(both)))
    cell.run(BeamsSource(replace(cell.station, inputs=(3, 3), off_when_broken=True)))
    assert miss_mm(cell.stored, cell.truth) < BARELY_MM


def refused(cell, code, station=None, listener=None):
    """Check a refusal: nothing written, the tip above the beams, the tool restored."""
    before = cell.stored
    with pytest.raises(CalibrationError) as refusal:
        cell.run(BeamsSource(station or cell.station), listener)
    assert refusal.value.code == code
    assert refusal.value.remedy
    assert cell.stored == before
    assert cell.simulator.machine.flash_writes == 0
    assert cell.simulator.machine.tools.selected == TOOL
    assert cell.tip_z_mm > cell.place_mm[2] + 8.0


def test_a_beam_that_is_never_broken_is_refused(cell):
    refused(cell, "no_edge")


def test_an_input_that_is_on_from_the_start_is_refused_before_the_tip_crosses(cell):
    cell.simulator.machine.inputs.set(3, True)
    followed = Followed()
    refused(cell, "edge_passed", listener=followed)
    assert not followed.edges


def test_swapped_inputs_are_refused(cell):
    cell.mount_beams(cell.beams())
    refused(cell, "no_edge", replace(cell.station, inputs=(4, 3)))


@pytest.mark.parametrize("lean_deg", [4.0, pytest.param(-6.0, marks=pytest.mark.soak)])
def test_a_bent_needle_is_refused(cell, lean_deg):
    cell.mount_beams(cell.beams())
    cell.simulator.world.leans[TOOL] = (0.0, math.tan(math.radians(lean_deg)))
    refused(cell, "bent_needle")


def test_beams_outside_the_limits_are_not_driven_to(cell):
    cell.mount_beams(cell.beams())
    deep = replace(cell.station, z_mm=cell.place_mm[2] - 40.0)
    with cell.connected() as controller:
        (foreseen, *_) = [s for s in cell.foresee(controller, BeamsSource(deep)) if s.refusal]
        assert "Z" in foreseen.refusal
        with pytest.raises(LimitError):
            cell.change(BeamsSource(deep))(controller)
    assert cell.tip_z_mm > cell.place_mm[2]


def test_every_step_is_foreseen_before_anything_moves(cell):
    cell.mount_beams(cell.beams())
    followed = Followed()
    source = BeamsSource(cell.station)
    with cell.connected() as controller:
        foreseen = cell.foresee(controller, source)
        assert cell.simulator.machine.arm.moves_started == 0
        cell.change(source, followed)(controller, write=False)
        requests = [step.requests(controller.groups[0])[-1] for step in foreseen]
    assert not any(step.refusal for step in foreseen)
    assert ["Till Sw(" in text for text in requests] == [bool(step.edge) for step in foreseen]
    assert [step.text for step in foreseen] == [done.step.purpose for done in followed.steps]
    sought = [step.edge for step in foreseen if step.edge is not None]
    assert sought == [done.edge for done in followed.edges]


class Halfway(Followed):
    """Proposes half of the measured change, as where only a difference is written."""

    def adjusted(self, proposal, bench):
        half = replace(
            proposal.offset, x_mm=(proposal.offset.x_mm + proposal.before.x_mm) / 2, u_deg=20.0
        )
        result = replace(proposal.result, offset=half)
        return replace(proposal, result=result, measured=proposal.offset)


def test_the_proof_knows_when_another_offset_than_the_measured_one_is_written(cell):
    cell.mount_beams(cell.beams())
    report = cell.run(BeamsSource(cell.station), Halfway())
    assert miss_mm(cell.stored, cell.truth) > 0.05
    assert report.verification.max_drift_mm < 2 * BARELY_MM


def test_a_pin_whose_tip_is_known_finds_beams_that_serve_for_a_needle(cell):
    cell.mount_beams(cell.beams(), noise_mm=0.005)
    x_mm, y_mm, _ = cell.place_mm
    askew = tuple(Beam(x_mm + 0.4, y_mm - 0.3, heading + 2.0) for heading in HEADINGS)
    guess = replace(cell.station, beams=askew)
    with cell.connected() as controller:
        controller.tools.select(0)
        group = controller.groups[0]
        runner = Runner(controller, group, NobodyThere(), RunSettings(WorkBox()))
        pin = cell.truth
        found = runner.run(trace_beams(guess, BeamsParameters(), here=group.pose(), tip=pin))
        cell.simulator.world.change_nozzle()
        station = replace(cell.station, beams=found)
        cell.change(BeamsSource(station))(controller)
    assert miss_mm(cell.stored, cell.truth) < 0.02


def test_a_sensor_that_dies_before_the_proof_takes_the_value_back(cell):
    cell.mount_beams(cell.beams())
    before = cell.stored

    class Unplugged(Followed):
        def wrote(self, receipt):
            cell.simulator.machine.inputs.set(3, False)

    with pytest.raises(CalibrationError, match="did not switch"):
        cell.run(BeamsSource(cell.station), Unplugged())
    assert cell.stored == before
    assert cell.simulator.machine.tools.selected == TOOL
