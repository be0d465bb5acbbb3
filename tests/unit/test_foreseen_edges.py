"""A search looks only where an input can change; its edges are those of a look each millisecond."""

import math
import random

import pytest
from robolink_simulators.cell.surfaces import FlatPlate, RoundBall, SurfaceContact
from robolink_simulators.cell.tip_switches import LightBeam, MeasuredSwitch, PinContact, TouchPlate
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.epson.arm.arm import Arm
from robolink_simulators.epson.arm.robots import Joints, find_robot
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.memory.inputs import InputBits, TipInput
from robolink_simulators.epson.spel import Interpreter
from robolink_simulators.epson.spel.statements.conditions import Watch

from tests._rows import each_row

PLACE_MM = (250.0, 420.0, -60.0)
SEARCHES = 6
KINDS = ("plate", "pin", "plane", "ball", "beam")


def switch_near(kind: str, rng: random.Random) -> MeasuredSwitch:
    """Return a switch within a few millimetres of the place."""
    x, y, z = (at + rng.uniform(-3.0, 3.0) for at in PLACE_MM)
    match kind:
        case "plate":
            return TouchPlate(z)
        case "pin":
            return PinContact(lambda: (x, y, z), rng.uniform(0.2, 4.0))
        case "plane":
            leaning = FlatPlate.leaning((x, y, z), rng.uniform(0.0, 30.0), rng.uniform(0.0, 360.0))
            return SurfaceContact(lambda: leaning)
        case "ball":
            ball = RoundBall((x, y, z), rng.uniform(1.0, 8.0))
            return SurfaceContact(lambda: ball)
        case _:
            heading, tilt = rng.uniform(0.0, 360.0), rng.uniform(-20.0, 20.0)
            return LightBeam((x, y, z), heading, rng.uniform(0.1, 1.0), 0.1, tilt_deg=tilt)


class SearchingCell:
    """A simulated robot beside a switch at input 3, and what its searches asked."""

    def __init__(self, kind: str, seed: int) -> None:
        rng = random.Random(f"{kind} {seed}")
        world = WorldParameters(lean_deg=rng.choice((0.0, 2.0)))
        simulator = EpsonSimulator(seed=seed, world=world)
        late_s = rng.choice((0.0, 0.003))
        simulator.world.connect(3, switch_near(kind, rng), latency_s=late_s, noise_mm=0.003)
        self._interpreter: Interpreter = simulator._window._interpreter
        self._now_ns = simulator.now_ns
        self.run("Tool 1")
        x, y, z = (at + rng.uniform(-6.0, 6.0) for at in PLACE_MM)
        turn = rng.choice((0.0, 0.0, 15.0))
        self.run(f"SpeedS {rng.choice((2.0, 20.0, 60.0))}")
        self.run(f"Go XY({x:.3f}, {y:.3f}, {z + 8:.3f}, 0)")
        x, y, z = (at + rng.uniform(-6.0, 6.0) for at in PLACE_MM)
        word, edge = rng.choice(("Till", "Find")), rng.choice(("On", "Off"))
        self.search = f"Move XY({x:.3f}, {y:.3f}, {z - 8:.3f}, {turn}) {word} Sw(3) = {edge}"

    def run(self, statement: str) -> None:
        """Carry out a statement to its end."""
        execution = self._interpreter.start(statement, self._now_ns)
        while not execution.done:
            self._now_ns = execution.next_change() or self._now_ns
            execution.advance(self._now_ns)
        assert execution.error is None, (statement, execution.error)


def edges(kind, seeds, monkeypatch, *, each_ms):
    """Return the edges that searches foresee, and how many instants they asked for."""
    found, asked = [], []
    sense, foresee = TipInput.__call__, Watch.foresee

    def counted(self, instant_ns):
        asked.append(instant_ns)
        return sense(self, instant_ns)

    def noted(self, start_ns, end_ns):
        foresee(self, start_ns, end_ns)
        found.append(None if self._edge_ns is None else self._edge_ns - start_ns)

    with monkeypatch.context() as patch:
        patch.setattr(TipInput, "__call__", counted)
        patch.setattr(Watch, "foresee", noted)
        if each_ms:
            patch.setattr(InputBits, "last_until", lambda _self, _asked, instant_ns: instant_ns)
        for seed in seeds:
            cell = SearchingCell(kind, seed)
            cell.run(cell.search)
    return found, len(asked)


@pytest.mark.parametrize("kind", KINDS)
def test_edges_are_those_of_a_look_each_millisecond(kind, monkeypatch):
    skipping, few = edges(kind, range(SEARCHES), monkeypatch, each_ms=False)
    looking, many = edges(kind, range(SEARCHES), monkeypatch, each_ms=True)
    assert skipping == looking
    assert any(edge is not None for edge in looking), "some meet the switch"
    assert few < 0.9 * many


@pytest.mark.soak
@pytest.mark.parametrize("kind", KINDS)
def test_edges_are_those_of_a_look_each_millisecond_in_many_searches(kind, monkeypatch):
    seeds = range(SEARCHES, 300)
    skipping, _ = edges(kind, seeds, monkeypatch, each_ms=False)
    looking, _ = edges(kind, seeds, monkeypatch, each_ms=True)
    assert skipping == looking
    assert sum(edge is not None for edge in looking) > 50


def test_a_robot_with_play_and_one_that_turns_are_asked_each_millisecond():
    arm = Arm(find_robot("T6-602S"), joints=Joints(45, 60, -40.0, -105))
    assert arm.within_until(5, 10.0) == 5, "at rest there is no motion to foresee"
    arm.backlash_deg = 0.1
    assert arm.within_until(5, 10.0) == 5


@each_row("kind", KINDS)
def test_within_its_leeway_no_switch_changes(kind):
    rng = random.Random(kind)
    for _ in range(200):
        switch = switch_near(kind, rng)
        x, y, z = (at + rng.uniform(-8.0, 8.0) for at in PLACE_MM)
        shaft = (rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), 1.0)
        now = switch.trips((x, y, z), shaft)
        leeway_mm = 0.999 * switch.leeway_mm((x, y, z), shaft)
        for _ in range(5):
            dx, dy, dz = (rng.gauss(0.0, 1.0) for _ in range(3))
            by = leeway_mm / math.hypot(dx, dy, dz)
            assert switch.trips((x + by * dx, y + by * dy, z + by * dz), shaft) is now
