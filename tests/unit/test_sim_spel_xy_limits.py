"""XYLim holds targets inside, and by XYLimMode 1 the way (docs/reference/spel.md 7.2)."""

import pytest
from robolink_simulators.epson import EpsonSimulator

from tests.unit.test_sim_spel_motion import Cell


@pytest.fixture
def cell():
    """A robot whose tip stands at about X 159, Y 495, Z -40."""
    return Cell()


def outcome(cell, statement):
    """Return the number of the error of a statement that moves, 0 where it ends well."""
    execution = cell.start(statement)
    while not execution.done:
        cell.now_ns = execution.next_change()
        execution.advance(cell.now_ns)
    return execution.error.number if execution.error else 0


def test_limits_are_listed_and_asked_for_as_they_were_given(cell):
    assert cell.run("Print XYLimDef; XYLim") == "0\r\n0.000, 0.000, 0.000, 0.000\r\n"
    cell.run("XYLim -200, 300, 0, 500")
    assert cell.run("XYLim") == "-200.000, 300.000, 0.000, 500.000\r\n"
    cell.run("XYLim -200, 300, 10, 500, -50, -1")
    assert cell.run("XYLim").endswith("500.000, -50.000, -1.000\r\n")
    assert (
        cell.run("Print CX(XYLim(1)), CY(XYLim(1)), CZ(XYLim(2)), XYLimDef") == "-200 10 -1 -1\r\n"
    )
    cell.run("XYLimClr")
    assert cell.run("Print XYLimDef") == "0\r\n"


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("XYLim 1, 0, 0, 500", 4002),
        ("XYLim 0, 1, 0", 2100),
        ("Print CX(XYLim(3))", 4002),
        ("XYLimMode 2", 4002),
    ],
)
def test_what_cannot_be_is_refused(cell, statement, number):
    assert cell.error(statement) == number


@pytest.mark.parametrize("verb", ["Go", "Move", "Jump", "Pass"])
def test_a_target_outside_is_refused_before_anything_moves(cell, verb):
    cell.run("XYLim 0, 300, 0, 550, -50, 0")
    assert (
        cell.run("Print TargetOK(XY(-5, 450, -40, 0)), TargetOK(XY(5, 450, -40, 0))") == "0 -1\r\n"
    )
    assert cell.error(f"{verb} XY(-5, 450, -40, 0)") == 4001
    assert cell.error(f"{verb} XY(5, 450, -51, 0)") == 4001
    assert outcome(cell, f"{verb} XY(5, 450, -49, 0)") == 0


def test_a_jump_may_rise_past_the_limit_of_z_unless_its_way_counts(cell):
    cell.run("XYLim 0, 300, 0, 550, -50, -30")
    assert outcome(cell, "Jump XY(5, 450, -40, 0)") == 0
    cell.run("XYLimMode 1; Print XYLimMode")
    assert outcome(cell, "Jump XY(50, 450, -40, 0)") == 4001
    assert outcome(cell, "Move XY(50, 450, -40, 0)") == 0


def test_by_mode_1_the_way_of_a_go_counts(cell):
    cell.run("Go XY(300, 300, -40, 0); XYLim -310, 310, 290, 360")
    there = "Go XY(-300, 300, -40, 0)"
    cell.run("XYLimMode 1")
    assert outcome(cell, there) == 4001
    cell.run("XYLimMode 0")
    assert outcome(cell, there) == 0


def test_pulses_count_by_mode_1_alone_and_the_way_in_is_open(cell):
    cell.run("XYLim 200, 300, 0, 550; XYLimMode 1")
    # It stands outside: it may come nearer, not go farther.
    assert outcome(cell, "JTran 1, 5") == 4001
    assert outcome(cell, "JTran 1, -2") == 0
    assert outcome(cell, "Move Here +X(60)") == 0
    assert outcome(cell, "JTran 1, 20") == 4001
    cell.run("XYLimMode 0")
    assert outcome(cell, "JTran 1, 20") == 0


@pytest.mark.parametrize(("counts", "number"), [("tip", 4001), ("flange", 0)])
def test_what_is_limited_is_an_option(counts, number):
    cell = Cell(xylim_counts=counts)
    cell.run("TLSet 1, XY(0, 0, -20, 0); Tool 1; XYLim 0, 0, 0, 0, -45, 0")
    assert cell.run("Print TargetOK(Here)") == ("0\r\n" if number else "-1\r\n")
    assert outcome(cell, "Go Here +X(-1)") == number


def test_limits_outlive_a_power_cycle_and_their_mode_does_not(tmp_path):
    kept = tmp_path / "flash.json"
    first = EpsonSimulator(state_path=kept)
    first.machine.kept.limits.set((1, 2, 3, 4))
    first.machine.kept.limits.strict = True
    first.advance(1)
    first.restart()
    assert not first.machine.kept.limits.strict
    reborn = EpsonSimulator(state_path=kept).machine.kept.limits
    assert (reborn.values, reborn.strict) == ((1, 2, 3, 4), False)
