"""Sensors that the true tip of an EPSON robot switches: delay, scatter, play, a bent needle."""

import math
import random
from dataclasses import replace

import pytest
from robolink_simulators.cell.tip_switches import LightBeam, TouchPlate
from robolink_simulators.epson.arm.kinematics import inverse
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.spel import Interpreter

INPUT = 3
SPEED_MM_S = 10.0


class Cell:
    """A simulated controller and its world, run without a wire."""

    def __init__(self, *, seed=3):
        self.simulator = EpsonSimulator(seed=seed)
        self.machine, self.world = self.simulator.machine, self.simulator.world
        options, rng = self.simulator.options, random.Random(1)
        self._window = Interpreter(self.machine, options, rng)
        self._now_ns = 0
        self.run(f"Tool 0; SpeedS {SPEED_MM_S}")

    def run(self, statement):
        execution = self._window.start(statement, self._now_ns)
        while not execution.done:
            self._now_ns = execution.next_change() or self._now_ns
            execution.advance(self._now_ns)
        assert execution.error is None, execution.error

    def find(self, dx_mm=0.0, dz_mm=0.0):
        """Move past an edge and return where the flange was then."""
        here = self.machine.arm.flange()
        target = f"XY({here.x_mm + dx_mm}, {here.y_mm}, {here.z_mm + dz_mm}, {here.u_deg}) /R"
        self.run(f"Move {target} Find Sw({INPUT}) = On")
        assert self.machine.found is not None
        return self.machine.found.coordinates

    def beam(self, **options):
        """Return a beam across X through the place of the tip, deep enough to be broken."""
        x_mm, y_mm, z_mm = self.world.tip_mm()
        return LightBeam((x_mm, y_mm, z_mm + 2.0), heading_deg=90.0, **options)

    def shift(self, dx_mm):
        """Put the arm beside where it is, as by hand."""
        arm = self.machine.arm
        target = replace(arm.flange(), x_mm=arm.flange().x_mm + dx_mm)
        arm.place(inverse(arm.model, target, arm.hand), self._now_ns)


@pytest.fixture
def cell():
    return Cell()


def crossed(cell, **wiring):
    """Cross a beam both ways; return the flange's X at both edges, and at the beam's middle."""
    middle_mm = cell.machine.arm.flange().x_mm
    cell.world.connect(INPUT, cell.beam(nozzle_radius_mm=0.25, radius_mm=0.1), **wiring)
    cell.shift(-3.0)
    return cell.find(dx_mm=6.0)[0], cell.find(dx_mm=-6.0)[0], middle_mm


def test_a_plate_switches_the_input_where_the_true_tip_touches_it(cell):
    z_mm = cell.world.tip_mm()[2]
    cell.world.connect(INPUT, TouchPlate(z_mm - 4.0))
    flange = cell.machine.arm.flange()
    assert cell.find(dz_mm=-6.0)[2] == pytest.approx(flange.z_mm - 4.0, abs=1e-6)
    assert cell.machine.inputs.get(INPUT)
    assert cell.machine.inputs.get_byte(0) == 1 << INPUT


def test_a_crossing_shows_the_width_of_nozzle_and_beam(cell):
    going, coming, middle_mm = crossed(cell)
    assert going == pytest.approx(middle_mm - 0.35, abs=1e-6)
    assert coming == pytest.approx(middle_mm + 0.35, abs=1e-6)


def test_a_delay_shifts_each_edge_along_the_way(cell):
    going, coming, middle_mm = crossed(cell, latency_s=0.004)
    assert going == pytest.approx(middle_mm - 0.35 + 0.004 * SPEED_MM_S, abs=1e-6)
    assert coming == pytest.approx(middle_mm + 0.35 - 0.004 * SPEED_MM_S, abs=1e-6)


def test_play_shifts_both_edges_and_their_middle_stays(cell):
    cell.machine.arm.backlash_deg = 0.02
    going, coming, middle_mm = crossed(cell)
    assert abs(going - (middle_mm - 0.35)) > 0.01
    assert (going + coming) / 2 == pytest.approx(middle_mm, abs=0.003)


def test_scatter_is_drawn_anew_for_each_motion_and_by_the_seed_alone():
    edges = [crossed(Cell(), noise_mm=0.05) for _ in range(2)]
    assert edges[0] == edges[1]
    going, coming, middle_mm = edges[0]
    assert going - (middle_mm - 0.35) != pytest.approx(coming - (middle_mm + 0.35), abs=1e-4)


def test_a_bent_needle_breaks_the_beam_where_its_shaft_is(cell):
    lean = math.tan(math.radians(6.0))
    cell.world.leans[1] = (lean, 0.0)
    u_deg = cell.machine.arm.flange().u_deg
    going, coming, middle_mm = crossed(cell)
    shift_mm = lean * 2.0 * math.cos(math.radians(u_deg))
    assert (going + coming) / 2 == pytest.approx(middle_mm - shift_mm, abs=1e-3)


def test_a_tilted_beam_is_missed_on_the_side_where_it_runs_above_nothing():
    beam = LightBeam((100.0, 50.0, 20.0), heading_deg=0.0, tilt_deg=5.0)
    assert beam.trips((110.0, 50.0, 20.5))
    assert not beam.trips((90.0, 50.0, 19.5))


def test_switching_by_hand_takes_the_sensor_off(cell):
    cell.world.connect(INPUT, TouchPlate(1000.0))
    assert cell.machine.inputs.get(INPUT)
    cell.machine.inputs.set(INPUT, False)
    assert not cell.machine.inputs.get(INPUT)
