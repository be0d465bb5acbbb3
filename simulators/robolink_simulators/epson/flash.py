"""What a controller retains over a power cycle, as one small file; and a whole state of it."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any, Final

from robolink.messages import tr
from robolink_simulators.cell.workplace import Workplace
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.variables import Variables
from robolink_simulators.state_files import StateFile

SCHEMA: Final = "robolink/sim-state/1"


class Flash(StateFile):
    """Keeps tools, what else a robot is told once, and which it is (docs/reference/spel.md 6.3).

    An older file lacks the serial number, or all but tools; the machine keeps its own then. A
    serial number that was drawn is kept with the first writing.

    Args:
        path: Where; ``None`` keeps nothing.
        machine: Whose tools.
    """

    def __init__(self, path: Path | None, machine: Machine) -> None:
        super().__init__(path)
        self._machine = machine

    def _document(self) -> dict[str, object]:
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
        return document

    def _take(self, document: Any) -> bool:  # noqa: ANN401 - whatever the file holds
        first, *others = self._machine.robots
        if document["schema"] != SCHEMA or document["robot"] != first.model.name:
            raise ValueError(document["robot"])
        first.tools.restore(document["tools"])
        for other, tools in zip(others, document.get("other_tools", ()), strict=True):
            other.tools.restore(tools)
        for one, kept in zip(self._machine.robots, document.get("kept", ()), strict=False):
            one.kept.restore(kept)
            one.take_up_kept()
        serial = document.get("serial")
        first.serial = first.serial if serial is None else str(serial)
        return serial is not None

    def _foreign(self, path: Path) -> str:
        robot = self._machine.robots[0].model.name
        return tr("{path} is not a saved state of a simulated {robot}.", path=path, robot=robot)


def moment_of(
    machine: Machine, variables: Variables, worlds: Sequence[Workplace]
) -> dict[str, Any]:
    """Return copies of tools, points, retained values, variables, places and worlds."""
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
    """Restore what :func:`moment_of` returned."""
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
