"""A PLC with two tools, for programs that are killed while changing them."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.softmotion.mailbox.plc import Plc

from robolink.model import ToolOffset
from robolink.protocols.mailbox import Six, from_frame, to_frame
from tests.contract._softmotion_cell import hosted
from tests.faults._change_cell import ChangeCell, kept
from tests.faults._change_process import OLD

_UNIT_UM: Final = 1000.0
_WRITE: Final = re.compile("write_command (WRITE|CLEAR)_TOOL")
_CYCLES_S: Final = 0.05
"""The mailbox program has read and carried out a command after this time."""

_SPEED: Final = 2000.0
"""Simulated seconds per second: the mailbox of a killed owner is free after 5 ms."""


class _HastenedSilence(ScaledClock):
    """Simulated time in which a client's silence passes as fast as everything else."""

    def wire_at(self, now_ns: int) -> int:
        return now_ns

    def simulated_at(self, wire_ns: int) -> int:
        return wire_ns


class PlcChangeCell(ChangeCell):
    """A SoftMotion PLC; counts the changes of its slots, past the wire.

    Attributes:
        executed: Slot and tool of each write that the PLC carried out; for a clear, no tool.
    """

    matters = re.compile("write_command ")

    def __init__(self, simulator: SoftMotionSimulator, url: str, folder: Path) -> None:
        super().__init__(simulator, url, folder)
        self._plc = simulator.plc
        self._acting = simulator.acting
        self.executed: list[tuple[int, Six | None]] = []
        define, clear = self._plc.memory.define, self._plc.memory.clear
        define(2, to_frame(OLD[2].components(), unit_um=_UNIT_UM), "nozzle")

        def counted(number: int, tool: Six, name: str) -> None:
            self.executed.append((number, tool))
            define(number, tool, name)

        def cleared(number: int) -> None:
            self.executed.append((number, None))
            clear(number)

        self._plc.memory.define = counted  # type: ignore[method-assign]
        self._plc.memory.clear = cleared  # type: ignore[method-assign]

    @property
    def tools(self) -> dict[int, ToolOffset | None]:
        """The stored values of both slots, past the wire."""
        defined = self._now().memory.defined()
        return {tool: _offset(defined[tool].tool) if tool in defined else None for tool in OLD}

    @property
    def selected(self) -> int:
        """The selected slot, past the wire."""
        return self._now().tools.selected

    @property
    def owner(self) -> int:
        """The token of the client that owns the mailbox; 0 if there is none."""
        return self._now().program.holder

    def writes(self) -> list[int]:
        """Return the slots that were written or cleared so far, in order."""
        self._now()
        sent = [text for text in self.requests if _WRITE.match(text)]
        assert len(sent) == len(self.executed)
        return [slot for slot, _ in self.executed]

    def values_written(self, tool: int = 1) -> list[ToolOffset]:
        """Return the values written to a slot so far, in order."""
        self._now()
        return [_offset(value) for slot, value in self.executed if slot == tool and value]

    def act(self) -> None:
        """Run the mailbox program up to the cycle in which it reads the command."""
        self.skip(_CYCLES_S)
        self._now()

    def _now(self) -> Plc:
        """Return the PLC after it has read everything written."""
        with self._acting():
            return self._plc


@contextmanager
def plc_change_cell(
    folder: Path, clock: ScaledClock | None = None, *, wire: str = "modbus-tcp"
) -> Iterator[PlcChangeCell]:
    """Open a PLC that holds ``OLD``, with its own journal.

    Args:
        folder: The folder of the journal.
        clock: The simulated time; by default so fast that nobody owns the mailbox for long.
        wire: One of the links of ``BACKENDS``.
    """
    folder.mkdir(parents=True)
    simulator = SoftMotionSimulator(seed=1)
    time = ManualClock() if wire == "sim" else clock or _HastenedSilence(_SPEED)
    with hosted(wire, simulator, time) as url:
        cell = PlcChangeCell(simulator, url, folder)
        if isinstance(time, ManualClock):
            cell.skip = time.sleep
        assert cell.tools == OLD
        with kept(cell):
            yield cell


def _offset(tool: Six) -> ToolOffset:
    return ToolOffset(*from_frame(tool, unit_um=_UNIT_UM))
