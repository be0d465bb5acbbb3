"""What a controller keeps over a power cycle, as one small file."""

import json
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr
from robolink_simulators.epson.machine import Machine
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
        self._written: list[tuple[int, int]] | None = None

    def restore(self) -> None:
        """Give the machine the tools and the serial number of the file, if there is one.

        A file of before serial numbers were drawn has none; the machine keeps its own then.

        Raises:
            ConfigError: The file cannot be read or is not of this robot.
        """
        if self._path is None or not self._path.exists():
            return
        first, *others = self._machine.robots
        robot = first.model.name
        try:
            state = json.loads(read_named(self._path))
            if state["schema"] != SCHEMA or state["robot"] != robot:
                raise ValueError(state["robot"])
            first.tools.restore(state["tools"])
            for other, tools in zip(others, state.get("other_tools", ()), strict=True):
                other.tools.restore(tools)
            serial = state.get("serial")
        except (OSError, KeyError, RecursionError, TypeError, ValueError) as error:
            raise ConfigError(
                tr(
                    "{path} is no saved state of a simulated {robot}.", path=self._path, robot=robot
                ),
                remedy=tr("Name another file, or delete this one to start afresh."),
            ) from error
        if serial is not None:
            first.serial = str(serial)
            self._written = self._mark()

    def save_changes(self) -> None:
        """Write the file if a tool or the selection changed since it was written last.

        Raises:
            ConfigError: It cannot be written.
        """
        if self._path is None:
            return
        mark = self._mark()
        if mark == self._written:
            return
        self._written = mark
        first, *others = self._machine.robots
        document: dict[str, object] = {
            "schema": SCHEMA,
            "robot": first.model.name,
            "serial": first.serial,
            "tools": first.tools.to_state(),
        }
        if others:
            document["other_tools"] = [other.tools.to_state() for other in others]
        save_state(self._path, document)

    def _mark(self) -> list[tuple[int, int]]:
        tables = [robot.tools for robot in self._machine.robots]
        return [(tools.flash_writes, tools.selected) for tools in tables]
