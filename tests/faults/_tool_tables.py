"""Tool tables of both kinds of controller, as a state machine reads them past the wire."""

from abc import ABC, abstractmethod
from itertools import count
from typing import ClassVar, Final

from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import (
    Fault,
    FaultAction,
    FaultPlan,
    PlcFault,
    PlcFaultAction,
)
from robolink_simulators.hosting.in_process import epson, softmotion
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.softmotion.mailbox.exchange import WireFaults
from robolink_simulators.softmotion.mailbox.plc import Plc

import robolink
from robolink.journal import memory_journal
from robolink.model import Controller, ToolOffset
from robolink.protocols.mailbox import from_frame, to_frame

TOOLS: Final = (1, 2, 3)
_UNIT_UM: Final = 1000.0
_OWNER_SILENCE_S: Final = 10.1
"""A mailbox is free after its owner has been silent for this long.

Source: docs/reference/mailbox.md, "Owners".
"""

_names = count()

Held = dict[int, ToolOffset | None]


class TableUnderTest(ABC):
    """A controller with a tool table.

    Attributes:
        mishaps: The possible faults of a write.
    """

    mishaps: ClassVar[tuple[str, ...]]

    def __init__(self, url: str) -> None:
        self.journal = memory_journal(url)
        self._url = url

    def connect(self) -> Controller:
        """Connect anew, with the record that all sessions share."""
        return robolink.connect(self._url, outcomes=self.journal.log(self._url))

    @abstractmethod
    def held(self) -> Held:
        """Return the stored value, past the wire."""

    @abstractmethod
    def selected(self) -> int:
        """Return the selected tool, past the wire."""

    @abstractmethod
    def put(self, tool: int, offset: ToolOffset) -> None:
        """Store a value, as a pendant or another program does."""

    @abstractmethod
    def plan(self, mishap: str) -> None:
        """Plan a fault for the next write."""

    @abstractmethod
    def calm_down(self) -> None:
        """Plan nothing more, and wait until a new session is accepted."""

    @abstractmethod
    def restart(self) -> None:
        """Switch the controller off and on."""

    @abstractmethod
    def close(self) -> None:
        """Stop serving it."""


class EpsonTable(TableUnderTest):
    """The tool table of an EPSON controller."""

    mishaps = ("DROP_REPLY", "DISCONNECT", "DISCONNECT_BEFORE", "IGNORE_WRITE", "TRUNCATE_REPLY")

    def __init__(self) -> None:
        self._simulator = EpsonSimulator(seed=1)
        self._name = f"tables-{next(_names)}"
        super().__init__(epson.register(self._name, self._simulator))

    def held(self) -> Held:
        """Return the stored value, past the wire."""
        return {tool: self._simulator.machine.tools.get(tool) for tool in TOOLS}

    def selected(self) -> int:
        """Return the selected tool, past the wire."""
        return self._simulator.machine.tools.selected

    def put(self, tool: int, offset: ToolOffset) -> None:
        """Store a value, as a pendant or another program does."""
        self._simulator.machine.tools.set(tool, offset)

    def plan(self, mishap: str) -> None:
        """Plan a fault for the next write."""
        self._simulator.faults.add(Fault(FaultAction[mishap], match="TLSet "))

    def calm_down(self) -> None:
        """Plan nothing more: the next login replaces the old one."""
        self._simulator.faults = FaultPlan()

    def restart(self) -> None:
        """Switch the controller off and on."""
        self._simulator.restart()

    def close(self) -> None:
        """Stop serving it."""
        epson.unregister(self._name)
        self.journal.close()


class PlcTable(TableUnderTest):
    """The tool table of a PLC mailbox."""

    mishaps = ("DROP_REPLY", "DISCONNECT", "DISCONNECT_BEFORE", "IGNORE_WRITE", "GARBLE_WRITE")

    def __init__(self) -> None:
        self._simulator = SoftMotionSimulator(seed=1)
        self._name = f"tables-{next(_names)}"
        super().__init__(softmotion.register(self._name, self._simulator))

    def held(self) -> Held:
        """Return the stored value, past the wire."""
        defined = self._now().memory.defined()
        return {
            tool: ToolOffset(*from_frame(defined[tool].tool, unit_um=_UNIT_UM))
            if tool in defined
            else None
            for tool in TOOLS
        }

    def selected(self) -> int:
        """Return the selected tool, past the wire."""
        return self._simulator.plc.tools.selected

    def put(self, tool: int, offset: ToolOffset) -> None:
        """Store a value, as another program does."""
        with self._simulator.acting():
            frame = to_frame(offset.components(), unit_um=_UNIT_UM)
            self._simulator.plc.memory.define(tool, frame, "by another")

    def plan(self, mishap: str) -> None:
        """Plan a fault for the next write."""
        fault = PlcFault(PlcFaultAction[mishap], match="write_command WRITE_TOOL")
        self._simulator.faults.add(fault)

    def calm_down(self) -> None:
        """Plan nothing more, and pass the ten seconds for which a silent owner keeps it."""
        self._simulator.faults = WireFaults()
        softmotion.clock_of(self._name).advance(_OWNER_SILENCE_S)
        self._now()

    def restart(self) -> None:
        """Switch the PLC off and on."""
        self._simulator.panel.restart()

    def close(self) -> None:
        """Stop serving it."""
        softmotion.unregister(self._name)
        self.journal.close()

    def _now(self) -> Plc:
        """Return the PLC after it has read everything written."""
        with self._simulator.acting():
            return self._simulator.plc
