"""What a controller keeps over a power cycle, as one small file."""

import json
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr
from robolink_simulators.epson.arm.robot_settings import RobotSettings
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import LocalTable, PointTable
from robolink_simulators.state_files import save_state

SCHEMA: Final = "robolink/sim-state/1"


class Flash:
    """Keeps the tools and the selected tool (docs/reference/spel.md 6.1), and which robot it is.

    Args:
        path: Where; ``None`` keeps nothing.
        machine: Whose tools.
    """

    def __init__(self, path: Path | None, machine: Machine) -> None:
        self._path = path
        self._machine = machine
        # Nothing is written yet: a serial number that was drawn is kept at the first occasion.
        self._written: tuple[int, int] | None = None

    def restore(self) -> None:
        """Give the machine the tools and the serial number of the file, if there is one.

        A file of before serial numbers were drawn has none; the machine keeps its own then.

        Raises:
            ConfigError: The file cannot be read or is not of this robot.
        """
        if self._path is None or not self._path.exists():
            return
        robot = self._machine.model.name
        try:
            state = json.loads(read_named(self._path))
            if state["schema"] != SCHEMA or state["robot"] != robot:
                raise ValueError(state["robot"])
            self._machine.tools.restore(state["tools"])
            serial = state.get("serial")
        except (OSError, KeyError, RecursionError, TypeError, ValueError) as error:
            raise ConfigError(
                tr(
                    "{path} is no saved state of a simulated {robot}.", path=self._path, robot=robot
                ),
                remedy=tr("Name another file, or delete this one to start afresh."),
            ) from error
        if serial is not None:
            self._machine.serial = str(serial)
            self._written = self._mark()

    def save_changes(self) -> None:
        """Write the file if a tool or the selection changed since it was written last.

        Raises:
            ConfigError: It cannot be written.
        """
        mark = self._mark()
        if mark == self._written:
            return
        self._written = mark
        if self._path is None:
            return
        document = {
            "schema": SCHEMA,
            "robot": self._machine.model.name,
            "serial": self._machine.serial,
            "tools": self._machine.tools.to_state(),
        }
        save_state(self._path, document)

    def _mark(self) -> tuple[int, int]:
        return (self._machine.tools.flash_writes, self._machine.tools.selected)


def forget_volatile(machine: Machine, now_ns: int) -> None:
    """Let a machine forget what a power cycle takes: all but tools, HomeSet and its place."""
    machine.arm.halt(now_ns)
    machine.switch_motors(False)
    machine.reset_motion_parameters()
    machine.outputs.clear()
    machine.memory.clear()
    machine.timed_bits.clear()
    home = machine.settings.home_pulses
    machine.settings = RobotSettings.of(machine.model.axes)
    machine.settings.home_pulses = home
    machine.points = PointTable()
    machine.locals = LocalTable(tilting=machine.model.six_axes)
