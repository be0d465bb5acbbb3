"""A PLC with a register map and two tools, for programs that are killed while changing them."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import pytest
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.testkit.media import served

import robolink
from robolink.model import ToolOffset
from robolink.register_maps import load_map
from robolink.testing import confirm_whole_map
from tests.faults._change_cell import ChangeCell, kept
from tests.faults._change_process import OLD

MAP: Final = Path("examples/plc-maps/commit-bit.toml").absolute()
_FIRST_ADDRESS: Final = {"fc16 100": 1, "fc16 110": 2}
"""The request that writes the registers of a tool."""

_TAKEN_OVER_S: Final = 0.5
"""The PLC applies a request within this time."""


class MappedChangeCell(ChangeCell):
    """A PLC whose registers hold the tools; they take effect once the PLC has applied them."""

    matters = re.compile("fc16 |fc5 ")

    def __init__(self, simulator: PlcSimulator, url: str, folder: Path) -> None:
        super().__init__(simulator, url, folder)
        self._program = simulator.program

    @property
    def tools(self) -> dict[int, ToolOffset | None]:
        """The values in use, past the wire."""
        return {tool: _offset(self._program.in_force[tool]) for tool in OLD}

    @property
    def selected(self) -> int:
        """The machine's selected tool: the first one; robolink selects none."""
        return 1

    def writes(self) -> list[int]:
        """Return the tools whose registers were written so far, in order."""
        return [_FIRST_ADDRESS[text] for text in self.requests if text in _FIRST_ADDRESS]

    def values_written(self, tool: int = 1) -> list[ToolOffset]:
        """Fail: writes are known by address only here, so no check may rest on their values."""
        pytest.fail(f"the values written to tool {tool} are not kept for a map: look at `tools`")

    def act(self) -> None:
        """Let the PLC apply the request."""
        self.skip(_TAKEN_OVER_S)
        with self.simulator.acting():
            pass


@contextmanager
def mapped_change_cell(folder: Path, *, wire: str = "sim") -> Iterator[MappedChangeCell]:
    """Open a PLC that holds ``OLD``, with its own journal, in this process or over TCP."""
    folder.mkdir(parents=True)
    simulator = PlcSimulator(load_map(MAP), seed=1)
    for tool, offset in OLD.items():
        x, y, z, u, *_ = offset.components()
        simulator.program.set_tool(tool, {"x": x, "y": y, "z": z, "u": u})
    clock = ManualClock() if wire == "sim" else ScaledClock(20.0)
    with (
        pytest.MonkeyPatch.context() as environment,
        served(simulator, wire, clock=clock, map_file=MAP) as url,
    ):
        environment.setenv("ROBOLINK_STATE_DIR", str(folder))
        with robolink.connect(url) as controller:
            confirm_whole_map(controller)
        with kept(MappedChangeCell(simulator, url, folder)) as cell:
            if isinstance(clock, ManualClock):
                cell.skip = clock.sleep
            assert cell.tools == OLD
            yield cell


def _offset(values: dict[str, float]) -> ToolOffset:
    return ToolOffset(values["x"], values["y"], values["z"], values["u"])
