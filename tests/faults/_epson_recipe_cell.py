"""An EPSON controller in this process on which whole recipes run."""

import re
import signal
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process import epson

from robolink.model import ToolOffset
from tests.faults._recipe_cell import RecipeCell
from tests.faults._requests import changes

_CHANGES: Final = re.compile(
    r'\$Execute,"(Tool [012]|TLSet [12], XY\(.*\)|Power (Low|High)|SpeedS? [\d., ]+'
    r'|(Move|Go) XY\(.*\).*)"|\$Abort|\$SetIO,(8|9|10),[01]'
)
_MOVE: Final = re.compile(r'\$Execute,"(Move|Go) ')


class EpsonRecipeCell(RecipeCell):
    """An EPSON controller; power and speed are those of the cell's own program."""

    disturbances = ("e-stop", "guard")
    shows_its_tool = False
    before = {1: ToolOffset(12.0, -3.5, -20.0), 2: ToolOffset(12.4, -3.7, -20.0)}

    def __init__(self, recipe_tools: Sequence[int]) -> None:
        self.simulator = simulator = EpsonSimulator(seed=1)
        self._machine = machine = simulator.machine
        simulator.world.change_nozzle(2)
        for tool, offset in self.before.items():
            machine.tools.set(tool, offset)
        self._written: list[int] = []
        store = machine.tools.set

        def counted(tool: int, offset: ToolOffset) -> None:
            store(tool, offset)
            self._written.append(tool)

        machine.tools.set = counted  # type: ignore[method-assign]
        machine.power_high, machine.parameters.speed = True, (30, 40, 50)
        machine.outputs.set(8, on=True)
        super().__init__(simulator, recipe_tools)
        switch = machine.outputs.set

        def noted(number: int, on: bool) -> None:
            switch(number, on)
            self.switched[number] = on

        machine.outputs.set = noted  # type: ignore[method-assign]

    def _register(self) -> str:
        return epson.register(self.name, self.simulator, clock=self.clock)

    def _unregister(self) -> None:
        epson.unregister(self.name)

    def tools(self) -> dict[int, ToolOffset | None]:
        """Return the stored values of the recipe's tools, past the wire."""
        return {tool: self._machine.tools.get(tool) for tool in self.before}

    @property
    def selected(self) -> int:
        """The selected tool, past the wire."""
        return self._machine.tools.selected

    def settings(self) -> object:
        """Return power and speed."""
        parameters = self._machine.parameters
        return self._machine.power_high, parameters.speed, parameters.speed_s

    def outputs(self) -> Mapping[int, bool]:
        """Return the state of the outputs that recipes switch."""
        return {number: self._machine.outputs.get(number) for number in (8, 9, 10)}

    @property
    def moving(self) -> bool:
        """Whether the robot moves."""
        return self.simulator.status_flags().running

    def where(self) -> object:
        """Return the flange pose, past the wire."""
        return self._machine.arm.joints

    def writes(self) -> list[int]:
        """Return the tools written so far, in order, as the controller counts them."""
        return list(self._written)

    def moves_asked(self) -> int:
        """Return the number of movements requested so far."""
        return sum(_MOVE.match(text) is not None for text in self.requests())

    @property
    def moves_begun(self) -> int:
        """The number of movements begun so far, past the wire."""
        return self._machine.arm.moves_started

    def strange(self) -> list[str]:
        """Return requests that no run of a recipe may send."""
        return [text for text in changes(self.requests()) if not _CHANGES.fullmatch(text)]

    def stops_asked(self) -> int:
        """Return the number of stops requested so far."""
        return self.requests().count("$Abort")

    def sent_as(self, number: int, on: bool) -> str:
        """Return the request that switches an output, as its marker has it."""
        return f"$SetIO,{number},{on:d}"

    def disturb(self, how: str) -> None:
        """Press the emergency stop, or open the safety guard."""
        acts: dict[str, Callable[[], None]] = {
            "Ctrl-C": lambda: signal.raise_signal(signal.SIGINT),
            "e-stop": self.simulator.panel.press_estop,
            "guard": self.simulator.panel.open_guard,
        }
        acts[how]()

    def make_ready(self, how: str) -> None:
        """Undo the disturbance, and reset."""
        panel = self.simulator.panel
        panel.release_estop() if how == "e-stop" else panel.close_guard()
        assert (done := self.run("reset")).code == 0, done.err
