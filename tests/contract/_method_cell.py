"""A cell of each controller kind in which every calibration method can be run from commands."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from robolink_simulators.cell.clock import ManualClock

from robolink.journal import memory_journal
from robolink.model import EntryKind, Recorded, ToolOffset
from tests._commands import Ended, run_command
from tests.contract._sensor_cell import SensorCell, plc_sensor_cell, sensor_cell

KINDS = ("epson", "plc")


def on(kind: str) -> list[Any]:
    """Return both kinds; the one not named runs only in ``make soak``."""
    return [one if one == kind else pytest.param(one, marks=pytest.mark.soak) for one in KINDS]


CELL = """
[cells.a]
url = "{url}"
remote_timeout_s = 60.0
remote_timeout_confirmed_by = "K. Sato, at the controller"

[cells.a.stations.PIN-07]
kind = "pin"
gauge = "G-123"
gauge_due = 2020-01-31

[cells.a.stations.BEAMS-02]
kind = "beams"
check_every_days = 90
z_mm = {beams[2]}
beams = [
    {{ input = 3, x_mm = {beams[0]}, y_mm = {beams[1]}, direction_deg = 3.0 }},
    {{ input = 4, x_mm = {beams[0]}, y_mm = {beams[1]}, direction_deg = 88.0 }},
]

[cells.a.stations.PLATE]
kind = "touch"
x_mm = {plate.x_mm}
y_mm = {plate.y_mm}
z_mm = {plate.z_mm}
input = {plate.input}
"""


class MethodCell:
    """A cell with commands to run on it."""

    def __init__(self, cell: SensorCell) -> None:
        self.cell = cell
        self.world = cell.simulator.world

    @property
    def clock(self) -> ManualClock:
        """The simulated time."""
        return self.cell.clock

    @property
    def truth(self) -> ToolOffset:
        """The real place of the tip."""
        return self.cell.truth

    @property
    def stored(self) -> ToolOffset:
        """The offset stored in tool 1, read by a separate connection."""
        held = self.held(1)
        assert held is not None
        return held

    def held(self, tool: int) -> ToolOffset | None:
        """Return the stored offset, read by a separate connection."""
        with self.cell.connected() as controller:
            return controller.tools.read(tool)

    def mount(self) -> None:
        """Mount the sensors."""
        self.cell.mount_beams(self.cell.beams())
        self.cell.mount_plate()

    def run(self, *words: str) -> Ended:
        """Run a command on the cell."""
        return run_command("-c", "a", *words)

    def calibrate(self, method: str, *more: str, tool: int = 1) -> Ended:
        """Calibrate with the simulated person, who confirms everything; prints the document."""
        assist = ("--assist", self.cell.url, "--yes", "--json", "--speed", "100")
        return self.run("calibrate", method, "--tool", str(tool), *assist, *more)

    def recorded(self, *kinds: EntryKind) -> list[Recorded]:
        """Return the journal entries, newest first."""
        return list(memory_journal(self.cell.url).entries(kinds=kinds))

    def bump_pin(self, dx_mm: float, dy_mm: float) -> None:
        """Move the pin."""
        x_mm, y_mm, z_mm = self.world.pin_mm
        self.world.pin_mm = (x_mm + dx_mm, y_mm + dy_mm, z_mm)

    def lengthen(self, by_mm: float, dx_mm: float = 0.0, dy_mm: float = 0.0, tool: int = 1) -> None:
        """Mount a longer needle."""
        tip = self.world.tips[tool]
        # The flange looks along its Z axis, so a longer needle ends farther along Z.
        down_mm = by_mm if tip.z_mm > 0 else -by_mm
        self.world.tips[tool] = replace(
            tip, x_mm=tip.x_mm + dx_mm, y_mm=tip.y_mm + dy_mm, z_mm=tip.z_mm + down_mm
        )


@contextmanager
def epson_cell(kind: str, seed: int = 3) -> Iterator[SensorCell]:
    """Set up a cell around the default EPSON robot, or another one by name."""
    robot: dict[str, Any] = {} if kind == "epson" else {"robot": kind}
    with sensor_cell(seed, **robot) as cell:
        cell.simulator.machine.motors_on = True
        yield cell


@contextmanager
def method_cell(
    kind: str, folder: Path, monkeypatch: Any, *, seed: int = 3
) -> Iterator[MethodCell]:
    """Set up a cell and its cell file; ``kind`` is one of :data:`KINDS` or an EPSON robot."""
    for name in [name for name in os.environ if name.startswith("ROBOLINK")]:
        monkeypatch.delenv(name)
    with plc_sensor_cell(seed) if kind == "plc" else epson_cell(kind, seed) as cell:
        path = folder / "robolink.toml"
        path.write_text(CELL.format(url=cell.url, beams=cell.place_mm, plate=cell.plate))
        monkeypatch.setenv("ROBOLINK_CONFIG", str(path))
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(folder / "state"))
        yield MethodCell(cell)
