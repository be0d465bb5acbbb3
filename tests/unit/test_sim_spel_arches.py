"""Arch, and the corners of a Jump that it rounds (docs/reference/spel.md 7.1)."""

import math

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.arch import Arch

from tests.unit.test_sim_spel_motion import Cell

MS = 1_000_000


@pytest.fixture
def cell():
    cell = Cell()
    cell.run("Power High; Speed 50; Accel 50, 50; Arch 0, 15, 20")
    return cell


def way(cell, statement, *, every_ns=2 * MS):
    """Return the tips of a motion in short steps, from its start to its end."""
    execution, tips = cell.start(statement), [cell.tip()]
    while not execution.done:
        cell.now_ns += every_ns
        execution.advance(cell.now_ns)
        tips.append(cell.tip())
    assert execution.error is None
    return tips


def test_arches_are_listed_as_the_sample_shows_and_asked_for(cell):
    lines = cell.run("Arch").splitlines()
    assert lines[0] == "arch0 =   15.000   20.000"
    assert lines[6] == "arch6 =   90.000   90.000"
    assert cell.run("Print Arch(0, 1), Arch(0, 2), Arch(3, 1)") == "15 20 60\r\n"


@pytest.mark.parametrize(
    "wrong", ["Arch 7, 1, 1", "Arch 0, -1, 1", "Arch 0, 1", "Print Arch(7, 1)"]
)
def test_an_arch_that_cannot_be_is_refused_and_none_changes(cell, wrong):
    before = cell.run("Arch")
    assert cell.start(wrong).error is not None
    assert cell.run("Arch") == before


def test_an_arch_stays_straight_at_its_ends_alone(cell):
    tips = way(cell, "Jump XY(200, 420, -70, 50) C0")
    start, end = tips[0], (200, 420, -70, 50)
    assert tips[-1] == pytest.approx(end, abs=1e-9)
    aside = [tip for tip in tips if tip[:2] != start[:2]]
    # The step in which it leaves the straight rise is 2 ms long.
    assert -25 <= aside[0][2] < -20
    below = [tip for tip in tips[len(tips) // 2 :] if tip[2] < -50]
    assert below
    assert all(tip == pytest.approx((*end[:2], tip[2], 50), abs=1e-6) for tip in below)
    rounded = [tip for tip in aside if tip[2] < -1 and abs(tip[0] - 200) > 1]
    assert len(rounded) > 10


def test_an_arch_is_quicker_than_a_gate_and_reaches_the_same_height(cell):
    there, back = "Jump XY(200, 420, -70, 50)", "Jump XY(300, 300, -60, 0)"
    cell.run(back)
    gate = way(cell, there)
    cell.run(back)
    arch = way(cell, f"{there} C(0)")
    assert len(arch) < 0.8 * len(gate)
    assert -0.01 < max(tip[2] for tip in arch) <= 1e-9


@pytest.mark.parametrize("arch", ["Arch 0, 41, 5", "Arch 0, 5, 71"])
def test_an_arch_longer_than_the_way_up_or_down_is_a_gate(cell, arch):
    cell.run(arch)
    tips = way(cell, "Jump XY(200, 420, -70, 50) C0")
    start = tips[0]
    travelling = [tip for tip in tips if start[0] != tip[0] and abs(tip[0] - 200) > 1e-6]
    assert travelling
    assert all(tip[2] == pytest.approx(0, abs=1e-9) for tip in travelling)


def test_sense_is_looked_at_above_the_target(cell):
    cell.machine.inputs.set(5, True)
    cell.run("Jump XY(200, 420, -70, 50) C0 Sense Sw(5) = On")
    assert cell.tip() == pytest.approx((200, 420, 0, 50), abs=1e-6)
    assert cell.run("Print JS") == "-1\r\n"


def test_what_runs_beside_an_arch_begins_behind_the_straight_rise(cell):
    execution = cell.start("Jump XY(200, 420, -70, 50) C0 !D0; On 5!")
    while not cell.machine.outputs.get(5):
        cell.now_ns = execution.next_change()
        execution.advance(cell.now_ns)
    assert cell.tip()[2] == pytest.approx(-25, abs=1e-3)


def test_an_arch_that_is_left_comes_to_rest_on_its_way(cell):
    execution = cell.start("Jump XY(200, 420, -70, 50) C0 Till Sw(5) = On")
    cell.now_ns += 200 * MS
    execution.advance(cell.now_ns)
    left = cell.tip()
    cell.machine.inputs.set(5, True)
    while not execution.done:
        cell.now_ns = execution.next_change()
        execution.advance(cell.now_ns)
    rest = cell.tip()
    assert rest != left
    assert math.dist(rest[:2], (200, 420)) > 5
    assert cell.run("Print TillOn") == "-1\r\n"


def test_two_arches_are_one_too_many(cell):
    assert cell.error("Jump XY(200, 420, -70, 50) C0 C1") == 2100


def test_an_arch_outlives_a_power_cycle(tmp_path):
    kept = tmp_path / "flash.json"
    first = EpsonSimulator(state_path=kept)
    first.machine.kept.arches.set(2, Arch(1.5, 2.5))
    first.advance(1)
    first.restart()
    assert first.machine.kept.arches.get(2) == (1.5, 2.5)
    assert EpsonSimulator(state_path=kept).machine.kept.arches.get(2) == (1.5, 2.5)
