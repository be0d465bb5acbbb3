"""Till and Find: what is written, and what a command window makes of it."""

import random
from typing import Any

import pytest
from robolink_simulators.epson.arm.robots import Joints, find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions, SpelNumbers
from robolink_simulators.epson.spel import Interpreter

from robolink.errors import LocalProtocolError
from robolink.model import Hand, Pose
from robolink.protocols import spel

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


@pytest.mark.parametrize("bit", [-1, 65536, True])
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
