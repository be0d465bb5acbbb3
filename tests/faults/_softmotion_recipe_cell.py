"""A PLC in this process on which whole recipes run."""

import signal
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from typing import Final

import pytest
from robolink_simulators.hosting.in_process import softmotion
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.model import ToolOffset
from robolink.protocols.mailbox import COMMAND, Opcode, Six, from_frame, to_frame
from robolink.runtime import SystemRuntime, replaced
from tests.faults._recipe_cell import RecipeCell

_OPCODE: Final = COMMAND["opcode"].word
_UNIT_UM: Final = 1000.0
_OUTPUTS: Final = (8, 9, 10)
_MAY: Final = frozenset(
    {"OWNERSHIP", "SELECT_TOOL", "READ_TOOL", "WRITE_TOOL", "WRITE_OUTPUT"}
    | {"MOVE_LINEAR", "MOVE_DIRECT", "HALT"}
)
"""All commands that a run of a recipe may send to the PLC."""


class PlcRecipeCell(RecipeCell):
    """A SoftMotion PLC. Each command carries its own speed, so there are no settings to restore."""

    answer_ms = 0.0
    disturbances = ("e-stop", "drive fault", "permit")
    shows_its_tool = True
    before = {1: ToolOffset(12.0, -3.5, -20.0), 2: ToolOffset(12.4, -3.7, -20.0)}

    def __init__(self, recipe_tools: Sequence[int]) -> None:
        self.simulator = simulator = SoftMotionSimulator(seed=1, answer_ms=self.answer_ms)
        self._plc = simulator.plc
        self._written: list[int] = []
        simulator.world.change_nozzle(2)
        define = self._plc.memory.define
        define(2, to_frame(self.before[2].components(), unit_um=_UNIT_UM), "nozzle")

        def counted(number: int, tool: Six, name: str) -> None:
            self._written.append(number)
            define(number, tool, name)

        self._plc.memory.define = counted  # type: ignore[method-assign]
        self._plc.group.outputs.switch(8, on=True)
        super().__init__(simulator, recipe_tools)
        outputs = self._plc.group.outputs
        switch = outputs.switch

        def noted(number: int, on: bool) -> None:
            switch(number, on)
            self.switched[number] = on

        outputs.switch = noted  # type: ignore[method-assign]
        assert self.changed() == set()

    def _register(self) -> str:
        return softmotion.register(self.name, self.simulator, clock=self.clock)

    def _unregister(self) -> None:
        softmotion.unregister(self.name)

    def tools(self) -> dict[int, ToolOffset | None]:
        """Return the stored values of the recipe's tools, past the wire."""
        defined = self._plc.memory.defined()
        return {
            tool: ToolOffset(*from_frame(defined[tool].tool, unit_um=_UNIT_UM))
            for tool in self.before
        }

    @property
    def selected(self) -> int:
        """The selected tool, past the wire."""
        return self._plc.tools.selected

    def settings(self) -> object:
        """Return nothing: there are no other settings."""
        return None

    def outputs(self) -> Mapping[int, bool]:
        """Return the state of the outputs that recipes switch."""
        return {number: self._plc.group.outputs.read(number) for number in _OUTPUTS}

    @property
    def moving(self) -> bool:
        """Whether the robot moves."""
        return not self._plc.group.motion.resting

    def where(self) -> object:
        """Return the axis positions, past the wire."""
        return self._plc.group.motion.values

    def writes(self) -> list[int]:
        """Return the slots written so far, in order, as the PLC counts them."""
        return list(self._written)

    def moves_asked(self) -> int:
        """Return the number of movements requested so far."""
        return sum(name.startswith("MOVE") for name in self._commands())

    @property
    def moves_begun(self) -> int:
        """The number of movements the group began so far, past the wire."""
        return self._plc.group.movements_started

    def strange(self) -> list[str]:
        """Return requests that no run of a recipe may send."""
        return [name for name in self._commands() if name not in _MAY]

    def stops_asked(self) -> int:
        """Return the number of stops requested so far."""
        return self._commands().count("HALT")

    def sent_as(self, number: int, on: bool) -> str:
        """Return the request that switches an output, as its marker has it."""
        return f"WRITE_OUTPUT {number} 1" if on else f"WRITE_OUTPUT {number}"

    def disturb(self, how: str) -> None:
        """Cut the drives' power, let one fail, or withdraw the machine's permit."""
        panel = self.simulator.panel
        acts: dict[str, Callable[[], None]] = {
            "Ctrl-C": lambda: signal.raise_signal(signal.SIGINT),
            "e-stop": panel.press_estop,
            "drive fault": panel.fail_axis,
            "permit": panel.withdraw_permit,
        }
        acts[how]()

    def make_ready(self, how: str) -> None:
        """Undo the disturbance, reset, and enable the group."""
        panel = self.simulator.panel
        if how == "e-stop":
            panel.release_estop()
        if how == "permit":
            panel.give_permit()
        for words in (("reset",), ("enable", "--yes")):
            assert (done := self.run(*words)).code == 0, done.err

    def _commands(self) -> list[str]:
        sent = "write_command "
        return [text.split()[1] for text in self.requests() if text.startswith(sent)]


class _NoThreads(SystemRuntime):
    """Gives no signs of life: each takes simulated time, at an instant of the real one.

    So a run would be another one on a busy computer.
    """

    def regularly(self, every_s: float, act: Callable[[], None], name: str) -> Callable[[], None]:
        """See :meth:`robolink.runtime.SystemRuntime.regularly`; ``act`` is never called."""
        del every_s, act, name
        return lambda: None


class OpcuaRecipeCell(PlcRecipeCell):
    """The same behind its OPC UA server."""

    answer_ms = 4.0
    _due = 0
    """The number of movements that are asked for once the present command is written."""

    def moves_asked(self) -> int:
        """See :meth:`RecipeCell.moves_asked`; the beat before a movement belongs to it."""
        return max(super().moves_asked(), self._due)

    def _register(self) -> str:
        # They take a second, so not for collection.
        from robolink.transport.opcua.mailbox import OpcuaMailboxLink
        from tests._stepped_opcua import UNSECURED, SteppedOpcua

        self.assist = super()._register()
        self._patch = pytest.MonkeyPatch()
        self._surroundings = ExitStack()
        self._surroundings.enter_context(replaced(_NoThreads()))
        served = SteppedOpcua(self.simulator, self.clock)
        self._patch.setattr("robolink.transport.opcua.mailbox.open_client", served.client)
        self._patch.setattr(OpcuaMailboxLink, "durable", False)  # it ends with the process
        write = OpcuaMailboxLink.write_command

        def written(
            link: OpcuaMailboxLink, words: Sequence[int], admit: Callable[[], None]
        ) -> None:
            moves = Opcode(words[_OPCODE]).name.startswith("MOVE")
            self._due = super(OpcuaRecipeCell, self).moves_asked() + moves
            try:
                write(link, words, admit)
            finally:
                self._due = 0

        self._patch.setattr(OpcuaMailboxLink, "write_command", written)
        return f"softmotion+opcua://{self.name}?{UNSECURED}"

    def _unregister(self) -> None:
        self._surroundings.close()
        self._patch.undo()
        super()._unregister()
