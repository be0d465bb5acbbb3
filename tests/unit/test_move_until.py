"""Movements until a sensor switches: Till and Find, and the true tip at beams and pins."""

import math
import random
from dataclasses import replace
from typing import Any

import pytest
from robolink_simulators.cell.tip_switches import LightBeam, TouchPlate
from robolink_simulators.epson.arm.kinematics import inverse
from robolink_simulators.epson.arm.robots import Joints, find_robot
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions, SpelNumbers
from robolink_simulators.epson.spel import Interpreter

from robolink.errors import LocalProtocolError
from robolink.model import Hand, Pose
from robolink.protocols import spel
from tests._rows import each_row

# Till and Find: the statements sent, and their effect in a command window.

NUMBERS = SpelNumbers()
TARGET = Pose(200.0, 420.0, -70.0, 0.0, hand=Hand.RIGHT)
DOWN = "Move Here :Z(-60) Till Sw(3) = On"
HIGH_MM, DEEP_MM = -40.0, -60.0
PLATE_MM = -50.0
SPEED_MM_S = 20.0
BRAKING_MM = SPEED_MM_S**2 / (2 * 200.0)


class Cell:
    """A command window with time; input 3 is on while the flange is below -50."""

    def __init__(self, **habits: Any):
        self.machine = Machine(find_robot("T6-602S"), joints=Joints(45, 60, HIGH_MM, -105))
        self.machine.switch_motors(True)
        self.machine.inputs.connect(3, self._touches)
        self.interpreter = Interpreter(self.machine, EpsonOptions(**habits), random.Random(1))
        self.now_ns = 0
        self.run(f"SpeedS {SPEED_MM_S}")

    def _touches(self, instant_ns):
        arm = self.machine.arm
        flange = arm.true_flange() if instant_ns is None else arm.true_flange_at(instant_ns)
        return flange.z_mm <= PLATE_MM

    def run(self, statement):
        execution = self.interpreter.start(statement, self.now_ns)
        while not execution.done:
            self.now_ns = execution.next_change() or self.now_ns
            execution.advance(self.now_ns)
        assert execution.error is None, execution.error
        return execution.output.strip()

    def error(self, statement):
        execution = self.interpreter.start(statement, self.now_ns)
        assert execution.done
        assert execution.error is not None
        return execution.error.number

    @property
    def z_mm(self):
        return self.machine.tip().z_mm


@pytest.fixture
def cell():
    return Cell()


def test_the_statements_are_written_as_documented():
    till = spel.move_till(TARGET, 3, on=True, six_axes=False)
    find = spel.move_find(TARGET, 0, on=False, six_axes=False)
    assert till == "Move XY(200.000, 420.000, -70.000, 0.000) /R /0 Till Sw(3) = On"
    assert find == "Move XY(200.000, 420.000, -70.000, 0.000) /R /0 Find Sw(0) = Off"
    assert spel.print_input(65535) == "Print Sw(65535)"


@each_row("bit", [-1, 65536, True])
def test_an_input_that_cannot_exist_is_not_written(bit):
    with pytest.raises(LocalProtocolError, match="An input"):
        spel.move_till(TARGET, bit, on=True, six_axes=False)
    with pytest.raises(LocalProtocolError, match="An input"):
        spel.print_input(bit)


def test_till_brakes_at_the_edge_and_says_so(cell):
    cell.run(DOWN)
    assert cell.z_mm == pytest.approx(PLATE_MM - BRAKING_MM, abs=1e-5)
    assert cell.run(spel.print_till_on()) == "-1"
    assert cell.run(spel.print_position_found()) == "0"


def test_find_goes_on_and_keeps_the_place_of_the_edge(cell):
    cell.run(DOWN.replace("Till", "Find"))
    assert cell.z_mm == pytest.approx(DEEP_MM)
    assert cell.run(spel.print_position_found()) == "-1"
    found = spel.parse_point(cell.run(spel.print_found_position()))
    assert found.coordinates[2] == PLATE_MM
    assert cell.run(spel.print_till_on()) == "0"


def test_a_falling_edge_is_waited_for_with_off(cell):
    cell.run("Move Here :Z(-60)")
    cell.run(f"Move Here :Z({HIGH_MM}) Till Sw(3) = Off")
    assert cell.z_mm == pytest.approx(PLATE_MM + BRAKING_MM, abs=1e-5)


@pytest.mark.parametrize("word", ["Till", "Find"])
def test_without_an_edge_the_motion_ends_at_its_target_and_nothing_is_found(cell, word):
    cell.run(DOWN.replace("Till Sw(3)", f"{word} Sw(4)"))
    assert cell.z_mm == pytest.approx(DEEP_MM)
    assert cell.run(spel.print_till_on()) == "0"
    assert cell.run(spel.print_position_found()) == "0"


def test_the_next_motion_forgets_the_last_edge(cell):
    cell.run(DOWN)
    cell.run(f"Move Here :Z({HIGH_MM})")
    assert cell.run(spel.print_till_on()) == "0"


@pytest.mark.parametrize(("habit", "starts"), [("stays", 0), ("starts", 1)])
def test_a_condition_that_holds_already_keeps_the_robot_where_it_is(habit, starts):
    cell = Cell(till_already_met=habit)
    cell.run("Move Here :Z(-55)")
    moved = cell.machine.arm.moves_started
    cell.run(DOWN)
    assert cell.z_mm == pytest.approx(-55)
    assert cell.machine.arm.moves_started == moved + starts
    assert cell.run(spel.print_till_on()) == "-1"


def test_a_find_whose_condition_holds_already_finds_the_start_and_goes_on(cell):
    cell.run("Move Here :Z(-55)")
    cell.run(DOWN.replace("Till", "Find"))
    found = spel.parse_point(cell.run(spel.print_found_position()))
    assert found.coordinates[2] == pytest.approx(-55)
    assert cell.z_mm == pytest.approx(DEEP_MM)


def test_an_input_switched_by_hand_on_the_way_stops_the_motion_at_once(cell):
    execution = cell.interpreter.start(DOWN.replace("Sw(3)", "Sw(5)"), cell.now_ns)
    middle_ns = cell.now_ns + 200_000_000
    execution.advance(middle_ns)
    before_mm = cell.z_mm
    cell.machine.inputs.set(5, True)
    while not execution.done:
        execution.advance(execution.next_change())
    assert cell.z_mm == pytest.approx(before_mm - BRAKING_MM, abs=1e-3)


def test_a_bare_till_waits_for_input_0(cell):
    cell.machine.inputs.set(0, True)
    cell.run("Move Here :Z(-60) Till")
    assert cell.z_mm == pytest.approx(HIGH_MM)


def test_conditions_may_be_joined(cell):
    cell.run(DOWN.replace("Sw(3) = On", "Sw(3) = On And Sw(4) = Off"))
    assert cell.z_mm == pytest.approx(PLATE_MM - BRAKING_MM, abs=1e-5)


def test_one_motion_takes_one_of_till_and_find(cell):
    assert cell.error("Move Here :Z(-60) Till Sw(3) = On Find Sw(4) = On") == NUMBERS.syntax


def test_an_input_that_does_not_exist_is_an_error_and_nothing_moves(cell):
    moved = cell.machine.arm.moves_started
    assert cell.error("Move Here :Z(-60) Till Sw(9999) = On") == NUMBERS.io_bit
    assert cell.machine.arm.moves_started == moved


def test_before_anything_was_found_there_is_no_place_of_it(cell):
    assert cell.error("Print FindPos") == NUMBERS.point_undefined


# Sensors that the true tip of an EPSON robot switches: delay, scatter, play, a bent needle.

INPUT = 3
SENSED_SPEED_MM_S = 10.0


class SensedCell:
    """A simulated controller and its world, run without a wire."""

    def __init__(self, *, seed=3):
        self.simulator = EpsonSimulator(seed=seed)
        self.machine, self.world = self.simulator.machine, self.simulator.world
        options, rng = self.simulator.options, random.Random(1)
        self._window = Interpreter(self.machine, options, rng)
        self._now_ns = 0
        self.run(f"Tool 0; SpeedS {SENSED_SPEED_MM_S}")

    def run(self, statement):
        execution = self._window.start(statement, self._now_ns)
        while not execution.done:
            self._now_ns = execution.next_change() or self._now_ns
            execution.advance(self._now_ns)
        assert execution.error is None, execution.error

    def find(self, dx_mm=0.0, dz_mm=0.0):
        """Move past an edge and return the flange's place at the edge."""
        here = self.machine.arm.flange()
        target = f"XY({here.x_mm + dx_mm}, {here.y_mm}, {here.z_mm + dz_mm}, {here.u_deg}) /R"
        self.run(f"Move {target} Find Sw({INPUT}) = On")
        assert self.machine.found is not None
        return self.machine.found.coordinates

    def beam(self, **options):
        """Return a beam across X through the tip's place, deep enough to be broken."""
        x_mm, y_mm, z_mm = self.world.tip_mm()
        return LightBeam((x_mm, y_mm, z_mm + 2.0), heading_deg=90.0, **options)

    def shift(self, dx_mm):
        """Move the arm a little, as by hand."""
        arm = self.machine.arm
        target = replace(arm.flange(), x_mm=arm.flange().x_mm + dx_mm)
        arm.place(inverse(arm.model, target, arm.hand), self._now_ns)


@pytest.fixture
def sensed_cell():
    return SensedCell()


def crossed(cell, **wiring):
    """Cross a beam both ways; return the flange's X at both edges, and at the beam's middle."""
    middle_mm = cell.machine.arm.flange().x_mm
    cell.world.connect(INPUT, cell.beam(nozzle_radius_mm=0.25, radius_mm=0.1), **wiring)
    cell.shift(-3.0)
    return cell.find(dx_mm=6.0)[0], cell.find(dx_mm=-6.0)[0], middle_mm


def test_a_plate_switches_the_input_where_the_true_tip_touches_it(sensed_cell):
    z_mm = sensed_cell.world.tip_mm()[2]
    sensed_cell.world.connect(INPUT, TouchPlate(z_mm - 4.0))
    flange = sensed_cell.machine.arm.flange()
    assert sensed_cell.find(dz_mm=-6.0)[2] == pytest.approx(flange.z_mm - 4.0, abs=1e-6)
    assert sensed_cell.machine.inputs.get(INPUT)
    assert sensed_cell.machine.inputs.get_byte(0) == 1 << INPUT


def test_a_crossing_shows_the_width_of_nozzle_and_beam(sensed_cell):
    going, coming, middle_mm = crossed(sensed_cell)
    assert going == pytest.approx(middle_mm - 0.35, abs=1e-6)
    assert coming == pytest.approx(middle_mm + 0.35, abs=1e-6)


def test_a_delay_shifts_each_edge_along_the_way(sensed_cell):
    going, coming, middle_mm = crossed(sensed_cell, latency_s=0.004)
    assert going == pytest.approx(middle_mm - 0.35 + 0.004 * SENSED_SPEED_MM_S, abs=1e-6)
    assert coming == pytest.approx(middle_mm + 0.35 - 0.004 * SENSED_SPEED_MM_S, abs=1e-6)


def test_play_shifts_both_edges_and_their_middle_stays(sensed_cell):
    sensed_cell.machine.arm.backlash_deg = 0.02
    going, coming, middle_mm = crossed(sensed_cell)
    assert abs(going - (middle_mm - 0.35)) > 0.01
    assert (going + coming) / 2 == pytest.approx(middle_mm, abs=0.003)


def test_scatter_is_drawn_anew_for_each_motion_and_by_the_seed_alone():
    edges = [crossed(SensedCell(), noise_mm=0.05) for _ in range(2)]
    assert edges[0] == edges[1]
    going, coming, middle_mm = edges[0]
    assert going - (middle_mm - 0.35) != pytest.approx(coming - (middle_mm + 0.35), abs=1e-4)


def test_a_bent_needle_breaks_the_beam_where_its_shaft_is(sensed_cell):
    lean = math.tan(math.radians(6.0))
    sensed_cell.world.leans[1] = (lean, 0.0)
    u_deg = sensed_cell.machine.arm.flange().u_deg
    going, coming, middle_mm = crossed(sensed_cell)
    shift_mm = lean * 2.0 * math.cos(math.radians(u_deg))
    assert (going + coming) / 2 == pytest.approx(middle_mm - shift_mm, abs=1e-3)


def test_a_tilted_beam_is_missed_on_the_side_where_it_runs_above_nothing():
    beam = LightBeam((100.0, 50.0, 20.0), heading_deg=0.0, tilt_deg=5.0)
    assert beam.trips((110.0, 50.0, 20.5))
    assert not beam.trips((90.0, 50.0, 19.5))


def test_switching_by_hand_takes_the_sensor_off(sensed_cell):
    sensed_cell.world.connect(INPUT, TouchPlate(1000.0))
    assert sensed_cell.machine.inputs.get(INPUT)
    sensed_cell.machine.inputs.set(INPUT, False)
    assert not sensed_cell.machine.inputs.get(INPUT)
