"""``recalibrate`` with tilted touches, on a PLC whose flange tilts."""

import sys
from pathlib import Path

import pytest
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.journal import memory_journal
from robolink.model import EntryKind
from tests._commands import run_command

pytestmark = pytest.mark.simulator_only

EXAMPLE = Path(__file__).parents[2] / "examples" / "recipes" / "five-axes-pivot.toml"
STORED = (12.0, -3.5, -20.0)


@pytest.fixture
def machine(serve_simulator):
    """Opens a simulated machine in virtual time; ``url`` is its URL."""

    def open_machine(kinematics="Kin_5Axes"):
        simulator = SoftMotionSimulator(kinematics, seed=1)
        serve_simulator(simulator)
        return simulator

    return open_machine


def recalibrate(simulator, path, *more):
    """Run a recipe with the simulated person; return exit code, document and messages."""
    words = ("recalibrate", str(path), "--assist", simulator.url, "--yes", "--json", *more)
    ended = run_command("-c", simulator.url, *words)
    return ended.code, ended.document, ended.err


def slot(simulator):
    """Return the lengths in the PLC's tool slot."""
    return simulator.plc.memory.slot(1).tool[:3]


def truth(simulator):
    return simulator.world.tips[1].components()[:3]


@pytest.mark.soak
def test_the_example_finds_the_whole_tip_as_the_interval_leads_to_expect(machine, capsys):
    simulator = machine()
    code, document, messages = recalibrate(simulator, EXAMPLE, "--nozzle", "N-1")
    assert code == 0, messages
    (tool,) = document["tools"]
    halves = tool["fit"]["half_width95"]
    assert list(halves) == ["x_mm", "y_mm", "z_mm"]
    for found, true, half in zip(slot(simulator), truth(simulator), halves.values(), strict=True):
        # Standoffs are drawn anew each time: one in 20 lies outside a 95 % interval.
        assert abs(found - true) <= 2 * half < 0.1
    assert tool["verification"]["passed"]
    with capsys.disabled():
        took_s = simulator.now_ns / 1e9
        sys.stdout.write(f"\nfive axes, pivot recipe: {took_s:.1f} s of robot time\n")
    (pin,) = memory_journal(simulator.url).entries(kinds=[EntryKind.STATION])
    place = [pin.details[name] for name in ("x_mm", "y_mm", "z_mm")]
    assert place == pytest.approx(simulator.world.pin_mm, abs=0.03)


def test_a_look_before_shows_each_tilt_and_moves_nothing(machine):
    simulator = machine()
    code, document, messages = recalibrate(simulator, EXAMPLE, "--dry-run")
    assert code == 0, messages
    steps = document["steps"]
    assert sum("onto the pin" in step["text"] for step in steps) == 6
    leaning = {round(step["target"]["v_deg"], 3) for step in steps if step["target"]}
    assert {-20.0, 0.0, 20.0} <= leaning
    assert not any(step["refusal"] for step in steps)
    assert simulator.plc.group.movements_started == 0


def test_a_robot_that_cannot_tilt_is_refused_before_anything_moves(machine):
    simulator = machine("Kin_Scara3_Z")
    code, document, _ = recalibrate(simulator, EXAMPLE, "--nozzle", "N-1")
    assert code == 7
    assert document["error"]["code"] == "rank_deficient"
    assert simulator.plc.group.movements_started == 0


def test_a_box_that_a_tilt_leaves_is_refused_before_anything_moves(machine, tmp_path):
    simulator = machine()
    path = tmp_path / "narrow.toml"
    path.write_text(EXAMPLE.read_text().replace("sideways_mm = 60", "sideways_mm = 6"))
    code, document, _ = recalibrate(simulator, path, "--nozzle", "N-1")
    assert code == 2
    assert "would leave the allowed area" in document["error"]["what"]
    assert simulator.plc.group.movements_started == 0
    assert slot(simulator) == STORED
