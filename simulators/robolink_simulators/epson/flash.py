"""What a controller keeps over a power cycle, as one small file; and a whole moment of it."""

import json
from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr
from robolink_simulators.cell.workplace import Workplace
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.variables import Variables
from robolink_simulators.state_files import StateFile, StateNotKeptError

SCHEMA: Final = "robolink/sim-state/1"


class Flash:
    """Keeps tools, what else a robot is told once, and which it is (docs/reference/spel.md 6.3).

    Args:
        path: Where; ``None`` keeps nothing.
        machine: Whose tools.
    """

    def __init__(self, path: Path | None, machine: Machine) -> None:
        self._file = StateFile(path)
        self._machine = machine
        # Nothing is written yet: a serial number that was drawn is kept with the first writing.
        self._written: list[object] | None = None

    @property
    def failure(self) -> StateNotKeptError | None:
        """Why something could not be kept; ``None`` as long as all was."""
        return self._file.failure

    def restore(self) -> None:
        """Give the machine what the file holds, if there is one.

        An older file lacks the serial number, or all but tools; the machine keeps its own then.

        Raises:
            ConfigError: The file cannot be read or is not of this robot.
        """
        path = self._file.path
        if path is None or not path.exists():
            return
        first, *others = self._machine.robots
        robot = first.model.name
        try:
            state = json.loads(read_named(path))
            if state["schema"] != SCHEMA or state["robot"] != robot:
                raise ValueError(state["robot"])
            first.tools.restore(state["tools"])
            for other, tools in zip(others, state.get("other_tools", ()), strict=True):
                other.tools.restore(tools)
            for one, kept in zip(self._machine.robots, state.get("kept", ()), strict=False):
                one.kept.restore(kept)
                one.take_up_kept()
            serial = state.get("serial")
        except (OSError, KeyError, RecursionError, TypeError, ValueError) as error:
            raise ConfigError(
                tr(
                    "{path} is not a saved state of a simulated {robot}.",
                    path=path,
                    robot=robot,
                ),
                remedy=tr("Name another file, or delete this one to start afresh."),
            ) from error
        if serial is not None:
            first.serial = str(serial)
            self._written = self._mark()

    def save_changes(self) -> None:
        """Write the file if something of that changed since it was written last.

        Raises:
            StateNotKeptError: It cannot be written.
        """
        if self._file.path is None:
            return
        mark = self._mark()
        if mark == self._written:
            return
        first, *others = self._machine.robots
        document: dict[str, object] = {
            "schema": SCHEMA,
            "robot": first.model.name,
            "serial": first.serial,
            "tools": first.tools.to_state(),
            "kept": [robot.kept.to_state() for robot in self._machine.robots],
        }
        if others:
            document["other_tools"] = [other.tools.to_state() for other in others]
        self._file.save(document)
        self._written = mark

    def _mark(self) -> list[object]:
        robots = self._machine.robots
        return [(one.tools.flash_writes, one.tools.selected, one.kept.changes) for one in robots]


def moment_of(
    machine: Machine, variables: Variables, worlds: Sequence[Workplace]
) -> dict[str, Any]:
    """Return copies of tools, points, what is kept, variables, places and worlds."""
    robots = machine.robots
    return {
        "serials": [robot.serial for robot in robots],
        "tools": [robot.tools.to_state() for robot in robots],
        "kept": [deepcopy(robot.kept.to_state()) for robot in robots],
        "points": [deepcopy(robot.points) for robot in robots],
        "locals": [deepcopy(robot.locals) for robot in robots],
        "motors": [robot.motors_on for robot in robots],
        "joints": [robot.arm.joints for robot in robots],
        "robot": machine.robot_number,
        "variables": variables.values(),
        "worlds": [world.moment() for world in worlds],
    }


def put_back(
    held: Mapping[str, Any],
    machine: Machine,
    variables: Variables,
    worlds: Sequence[Workplace],
    *,
    now_ns: int,
) -> None:
    """Put back what :func:`moment_of` gave."""
    for number, robot in enumerate(machine.robots):
        robot.serial = held["serials"][number]
        robot.tools.restore(held["tools"][number])
        robot.kept.restore(deepcopy(held["kept"][number]))
        robot.take_up_kept()
        robot.points = deepcopy(held["points"][number])
        robot.locals = deepcopy(held["locals"][number])
        robot.switch_motors(held["motors"][number])
        robot.latch.forget()
        robot.arm.place(held["joints"][number], now_ns)
    machine.robot_number = held["robot"]
    variables.put_back(held["variables"])
    for world, moment in zip(worlds, held["worlds"], strict=True):
        world.put_back(moment)
