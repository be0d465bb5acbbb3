"""The effect of the companion robolink_tools.prg in the simulated project.

The program is ours, so what it does is known; that the production program calls it at its
start and after each change of a tool is what the companion's documentation asks for.
"""

from collections.abc import Sequence
from typing import Final

from robolink.protocols.epson_text import VariableType
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.tools import HIGHEST_TOOL
from robolink_simulators.epson.memory.variables import Variables

LAYOUT: Final = 1
LAST_COUNT: Final = 1_000_000_000
"""The count after which publications are counted from 1 again."""

_TOOLS: Final = range(1, HIGHEST_TOOL + 1)
_UNDEFINED: Final = (0.0,) * 6


class Companion:
    """Copies a machine's tools into the project's Global Preserve variables.

    Args:
        machine: Whose tools.
        variables: Where the companion's variables are declared.
    """

    def __init__(self, machine: Machine, variables: Variables) -> None:
        self._machine = machine
        self._variables = variables
        self._published: tuple[Sequence[int], Sequence[float]] | None = None
        self._seen: tuple[int, int] | None = None
        self._count = 0
        variables.declare("robolink_begin", VariableType.LONG)
        variables.declare("robolink_end", VariableType.LONG)
        variables.declare("robolink_state", VariableType.LONG, 3 + HIGHEST_TOOL)
        variables.declare("robolink_tool", VariableType.DOUBLE, 6 * HIGHEST_TOOL - 1)

    def publish_changes(self) -> None:
        """Publish if a tool or the selection changed since it was looked at last."""
        tools = self._machine.tools
        mark = (tools.flash_writes, tools.selected)
        if mark != self._seen:
            self._seen = mark
            self.publish()

    def publish(self) -> None:
        """Carry out RobolinkPublish: nothing is stored when nothing has changed."""
        tools = self._machine.tools
        offsets = [tools.get(tool) for tool in _TOOLS]
        defined = [int(offset is not None) for offset in offsets]
        state = (LAYOUT, self._machine.robot_number, tools.selected, 0, *defined)
        rows = [offset.components() if offset else _UNDEFINED for offset in offsets]
        # V and W are left out by the program on a robot of four axes.
        table = [value for row in rows for value in (*row[:4], 0.0, 0.0)]
        if (state, table) == self._published:
            return
        self._published = (state, table)
        self._count = self._count % LAST_COUNT + 1
        self._variables.set("robolink_begin", str(self._count))
        for index, number in enumerate(state):
            self._variables.set(f"robolink_state({index})", str(number))
        for index, value in enumerate(table):
            self._variables.set(f"robolink_tool({index})", repr(value))
        self._variables.set("robolink_end", str(self._count))
