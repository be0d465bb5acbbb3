"""The wizard's line dialogue in a Windows console that wine draws on a pseudo terminal."""

import pytest


@pytest.fixture
def console(opened):
    """``change --plain`` up to the first touch."""
    console = opened("calls", "change", "needle.toml", "--plain", rows=60)
    console.see("Scan the id of the new needle.")
    console.rest(0.5)
    console.type("N-0418\r")
    console.see("Type the number of a row")
    console.type("1\r")
    console.rest(0.5)
    console.type("2\r")
    console.see("All rows are confirmed.")
    return console


def start(console):
    """Start the robot, and wait for the first touch."""
    console.type("y\r")
    console.see("Touch 1 of 2.")
    console.see("take, stop, or help.")


def test_a_person_types_steps_is_refused_an_unjogged_touch_and_stops(console, simulator):
    start(console)
    console.type("take\r")
    console.see("Not yet: the tip is still where the robot stopped.")
    console.type("z-0.1\r")
    console.see(r"Z -80\.(09|10)")  # the arm repeats to a few microns
    console.type("stop\r")
    console.see("STOPPED")
    assert console.exit_code() == 9
    assert simulator.machine.flash_writes == 0


@pytest.mark.parametrize("pace", [1.0])
def test_half_a_line_that_was_typed_too_early_is_no_part_of_the_answer(console, simulator):
    console.type("y\r")
    console.see("Moving to")
    console.type("sto", later_s=0.0)
    console.see("take, stop, or help.")
    console.type("p\r")
    console.see("> p|'p'|p ")
    console.type("z-0.1\r")
    console.see(r"Z -80\.(09|10)")  # the arm repeats to a few microns
    console.type("xyz\b\b\bstop\r")
    console.see("STOPPED")
    assert console.exit_code() == 9
    assert simulator.machine.tools.selected == 1


@pytest.mark.parametrize(("how", "code"), [("ctrl-c", 130), ("close", 129)])
def test_each_other_end_is_in_order(console, simulator, how, code):
    start(console)
    assert simulator.machine.tools.selected == 0
    console.rest(0.6)
    console.send(how)
    assert console.exit_code() == code
    assert simulator.machine.tools.selected == 1
    assert simulator.machine.flash_writes == 0
