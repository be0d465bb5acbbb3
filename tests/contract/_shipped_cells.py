"""A simulated cell for each shipped recipe, in virtual time, with a nozzle to measure in it."""

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

from robolink_simulators.cell.frames import Z_AXIS, Frame, about
from robolink_simulators.cell.tip_switches import LightBeam, TouchPlate
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import served

from robolink.model import ToolOffset
from robolink.runner import TouchedAt
from robolink.runner._place_question import PlaceQuestion
from tests._commands import Ended, run_command
from tests.contract._camera_cell import cell_of, furnish
from tests.contract._sensor_cell import sensor_cell

EXAMPLES: Final = Path(__file__).parents[2] / "examples" / "recipes"
BEAMS_MM: Final = (175.0, 488.0, -106.0)
START_MM_OF_THE_NEEDLE: Final = (158.6, 495.4, -80.0)
"""Where the flange of the EPSON's needle is before its change."""
PIN_MM_OF_THE_NEEDLE: Final = 0.35
"""By how much the needle of the one-touch recipe is longer than the one before."""


@dataclass(frozen=True)
class ShippedCell:
    """A cell in which a shipped recipe can be carried out.

    Attributes:
        simulator: What answers.
        url: Where.
        recipe: The file.
        more: What the command needs besides.
    """

    simulator: Any
    url: str
    recipe: Path
    more: tuple[str, ...]

    def change(self, *words: str) -> Ended:
        """Carry the recipe out."""
        return run_command("-c", self.url, "change", str(self.recipe), *self.more, *words)

    @property
    def words(self) -> tuple[str, ...]:
        """What lets the change run with nobody there, its result as a document."""
        return ("--nozzle", "N-7", "--lot", "L", "--yes", "--json")


AXES: Final = {
    "Kin_5Axes": ([500, 500, 500, 720, 360], [5000, 5000, 5000, 3600, 1800]),
    "Kin_Gantry3": ([500, 500, 500], [5000, 5000, 5000]),
    "T6-602S": ([360, 540, 1000, 1500], [1800, 2700, 5000, 7500]),
}
"""Joint speeds and accelerations of the simulated machines, as a cell file states them."""


@contextmanager
def with_cell_file(cell: ShippedCell, machine: str, *more: str) -> Iterator[ShippedCell]:
    """Name a cell in a file that states how fast its joints are.

    Args:
        cell: The cell.
        machine: Whose joints; those that a model has by itself are not stated.
        more: Further lines.
    """
    speeds, accelerations = AXES.get(machine, (None, None))
    lines = [f'[cells.shop]\nurl = "{cell.url}"', *more]
    if cell.url.startswith("epson"):
        lines += ["remote_timeout_s = 60", 'remote_timeout_confirmed_by = "M. Li, today"']
    if speeds:
        lines += [f"joint_speeds = {speeds}", f"joint_accelerations = {accelerations}"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robolink.toml"
        path.write_text("\n".join(lines) + "\n")
        with patch.dict(os.environ, {"ROBOLINK_CONFIG": str(path)}):
            yield replace(cell, url="shop")


@contextmanager
def touched(name: str, **habits: Any) -> Iterator[ShippedCell]:
    """Set up a SCARA with a pin, a second tool, and two beams.

    Args:
        name: The file of the recipe.
        habits: Of its controller.
    """
    with sensor_cell(seed=3, **habits) as cell:
        simulator = cell.simulator
        simulator.machine.motors_on = True
        simulator.machine.tools.set(2, ToolOffset(12.4, -3.7, -20.0))
        simulator.world.change_nozzle(2)
        for number, heading_deg in ((3, 2.0), (4, 91.0)):
            beam = LightBeam(BEAMS_MM, heading_deg, radius_mm=0.1)
            simulator.world.connect(number, beam, latency_s=0.002, noise_mm=0.003)
        yield ShippedCell(simulator, cell.url, EXAMPLES / name, ("--assist", cell.url))


@contextmanager
def _touched_once(name: str) -> Iterator[ShippedCell]:
    """Set up the same, with a full calibration on record and a longer needle since."""
    with touched(name) as cell:
        words = ("--station", "PIN-07", "--count", "4", "--speed", "100", "--tool", "1", "--yes")
        done = run_command("-c", cell.url, "calibrate", "n-angle", *cell.more, *words)
        assert done.code == 0, done.err
        tips = cell.simulator.world.tips
        longer_mm = tips[1].z_mm - PIN_MM_OF_THE_NEEDLE
        tips[1] = replace(tips[1], x_mm=tips[1].x_mm + 0.25, z_mm=longer_mm)
        yield cell


@contextmanager
def _seen(name: str) -> Iterator[ShippedCell]:
    """Set up a SCARA above a camera."""
    with cell_of("epson", seed=1) as cell:
        cell.simulator.machine.motors_on = True
        furnish(cell, board_held=name == "held-board.toml")
        yield ShippedCell(cell.simulator, cell.url, EXAMPLES / name, ("--sensor", cell.url))


@contextmanager
def _on_a_plc(name: str, kinematics: str, seed: int, touches: str = "") -> Iterator[ShippedCell]:
    """Set up a PLC; ``touches`` says what a person touches there, a pin unless given."""
    leaning = {"plane_lean_deg": 20.0, "plane_lean_toward_deg": 30.0}
    world: dict[str, Any] = {"person_touches": touches} if touches else {}
    world |= leaning if touches == "plane" else {}
    simulator = SoftMotionSimulator(kinematics, seed=seed, world=WorldParameters(**world))
    if kinematics == "Kin_Gantry3":
        simulator.world.connect(5, TouchPlate(33.0), noise_mm=0.002)
    with served(simulator) as url:
        person = () if kinematics == "Kin_Gantry3" else ("--assist", url)
        yield ShippedCell(simulator, url, EXAMPLES / name, person)


@contextmanager
def _needle_on_a_plc(rounds: int = 1, seed: int = 3) -> Iterator[ShippedCell]:
    """Set up the beams of the needle around a PLC's arm of the same lengths, at the same place.

    Args:
        rounds: How often it goes around the beams. The recipe says once; on a PLC that is too
            little for some needles (docs/reference/sensors.md 3).
        seed: Of the cell.
    """
    arms = {"dArmLength1": 325.0, "dArmLength2": 275.0}
    simulator = SoftMotionSimulator(seed=seed, parameters=arms)
    group = simulator.plc.group
    start = Frame(START_MM_OF_THE_NEEDLE, about(Z_AXIS, 0.0))
    configuration = group.kinematics.configuration(group.values)
    group.place(group.kinematics.axes_for(start, configuration, group.values))
    for number, heading_deg in ((3, 2.0), (4, 91.0)):
        beam = LightBeam(BEAMS_MM, heading_deg, radius_mm=0.1)
        simulator.world.connect(number, beam, noise_mm=0.003)
    text = (EXAMPLES / "needle-beams.toml").read_text()
    assert "repeats = 1 " in text
    with served(simulator) as url, tempfile.TemporaryDirectory() as folder:
        recipe = Path(folder) / "needle-beams.toml"
        recipe.write_text(text.replace("repeats = 1 ", f"repeats = {rounds} "))
        yield ShippedCell(simulator, url, recipe, ())


CELLS: Final[dict[str, Callable[[], AbstractContextManager[ShippedCell]]]] = {
    "scara-pin": lambda: touched("scara-pin.toml"),
    "two-nozzles": lambda: touched("two-nozzles.toml"),
    "needle-beams": lambda: touched("needle-beams.toml"),
    "needle-one-touch": lambda: _touched_once("needle-one-touch.toml"),
    "pick-nozzle-camera": lambda: _seen("pick-nozzle-camera.toml"),
    "nozzle-and-camera": lambda: _seen("nozzle-and-camera.toml"),
    "held-board": lambda: _seen("held-board.toml"),
    "five-axes-pivot": lambda: _on_a_plc("five-axes-pivot.toml", "Kin_5Axes", 1),
    "gantry-touch-probe": lambda: _on_a_plc("gantry-touch-probe.toml", "Kin_Gantry3", 1),
    "leaning-plate": lambda: _on_a_plc("leaning-plate.toml", "Kin_5Axes", 4, "plane"),
    "sphere": lambda: _on_a_plc("sphere.toml", "Kin_5Axes", 4, "sphere"),
}
"""The cell of each shipped recipe that moves a robot; by ``pendant-points`` nothing moves."""

PLC_CELLS: Final[dict[str, Callable[[], AbstractContextManager[ShippedCell]]]] = {
    "needle-beams on a PLC": _needle_on_a_plc,
    "needle-beams on a PLC, two rounds": lambda: _needle_on_a_plc(rounds=2),
}
"""The cell of a PLC for a recipe that is made for an EPSON."""


@contextmanager
def seconds_of_touches() -> Iterator[Callable[[], float]]:
    """Count the time in which a person is asked for a touch, until they have made it; jogs too."""
    answer, spent_ns = PlaceQuestion.answer, [0]

    def counted(question: PlaceQuestion) -> TouchedAt:
        clock = question._controller.clock
        began_ns = clock.now_ns()
        try:
            return answer(question)
        finally:
            spent_ns[0] += clock.now_ns() - began_ns

    with patch.object(PlaceQuestion, "answer", counted):
        yield lambda: spent_ns[0] / 1e9


@contextmanager
def shipped_cell(name: str, answer_ms: float = 0.0) -> Iterator[ShippedCell]:
    """Set up the cell of a shipped recipe; its record is forgotten with it.

    Args:
        name: Of the recipe.
        answer_ms: How long after a request the simulator's answer leaves, from the change on.
    """
    before = os.environ.get("ROBOLINK_STATE_DIR")
    folder = tempfile.mkdtemp(prefix="robolink-shipped-")
    os.environ["ROBOLINK_STATE_DIR"] = folder
    try:
        with (CELLS | PLC_CELLS)[name]() as cell:
            cell.simulator.answer_s = answer_ms / 1000
            yield cell
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if before is None:
            del os.environ["ROBOLINK_STATE_DIR"]
        else:
            os.environ["ROBOLINK_STATE_DIR"] = before
