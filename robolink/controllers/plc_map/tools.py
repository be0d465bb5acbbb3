"""The tool table of a PLC that keeps offsets in registers of its own."""

from collections.abc import Callable, Sequence

from robolink.controllers.markers import MarkerStore, ProcedureLock
from robolink.controllers.plc_map.handshake import Handshake
from robolink.controllers.plc_map.registers import Registers
from robolink.controllers.plc_map.slots import Slots
from robolink.controllers.tool_clearing import clear_after_selecting, preview_clearing
from robolink.controllers.tool_writing import ToolWrite, ToolWriter
from robolink.errors import (
    RejectedError,
    ReservedToolError,
    ToolError,
    ToolIndexError,
)
from robolink.messages import tr
from robolink.model import Expected, ToolOffset, ToolReceipt
from robolink.register_maps import MapSlot, RegisterMap


class RegisterToolTable:
    """The tools that a map names.

    Every write is compare-and-set and read back. The values go out first, in one request where
    they follow one another, and only then is the PLC asked to take them over.

    Args:
        registers: The PLC's tables.
        register_map: Where everything stands.
        markers: Keeps the markers.
        lock: One procedure at a time.
        require_confirmed: Refuses every change while nobody knows the map to be right; sends
            nothing.
        require_ready: Refuses a write that the machine or the map does not allow.
    """

    def __init__(
        self,
        registers: Registers,
        register_map: RegisterMap,
        markers: MarkerStore,
        lock: ProcedureLock,
        *,
        require_confirmed: Callable[[str], None],
        require_ready: Callable[[str], None],
    ) -> None:
        self._registers = registers
        self._map = register_map
        self._markers = markers
        self._lock = lock
        self._require_confirmed = require_confirmed
        self._require_ready = require_ready
        self._slots = Slots(registers, register_map)
        self._writer = ToolWriter(
            markers,
            same=self.same,
            uninterrupted=lambda: registers.gate,
            # A refusal leaves the registers as they were; where it does not, another error says so.
            not_executed=lambda _error: True,
        )

    @property
    def handshake(self) -> Handshake:
        """How the PLC is told to take values over."""
        return self._slots.handshake

    def indices(self) -> Sequence[int]:
        """Return the numbers of the tools in the map."""
        return tuple(sorted(self._map.slots))

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Tell whether the registers hold both alike; undefined equals undefined only."""
        return self._slots.values.same(a, b)

    def require_writable(self, tool: int) -> None:
        """Refuse a tool number that cannot be written; sends nothing.

        Raises:
            ConfigError: The map has no probe, and nobody has confirmed it.
            ReservedToolError, ToolIndexError: As :meth:`write` would.
            ToolError: The PLC's offsets can only be read.
        """
        self._require_confirmed(tr("tool {tool}", tool=tool))
        if tool == 0:
            raise ReservedToolError(
                tr("Tool 0 is the flange itself and is never written."),
                remedy=tr("Choose one of these: {tools}.", tools=self._known()),
            )
        slot = self._slot(tool)
        if not slot.table.writable:
            raise ToolError(
                tr("Tool {tool} stands in input registers, which nobody can write.", tool=tool),
                remedy=tr("Change it at the HMI, or map holding registers."),
                controller=self._registers.identity,
            )

    def read_all(self) -> dict[int, ToolOffset | None]:
        """Read every tool of the map."""
        return {tool: self.read(tool) for tool in self.indices()}

    def read(self, tool: int) -> ToolOffset | None:
        """Read one tool, ``None`` when it is undefined; tool 0 reads as all zeros."""
        if tool == 0 and not isinstance(tool, bool):
            return ToolOffset()
        found = self._slots.read(self._slot(tool))
        self._markers.ledger.saw_tool(tool, found)
        return found

    def write(self, tool: int, offset: ToolOffset, *, expected: Expected) -> ToolReceipt:
        """Write and read back; see :class:`robolink.model.ToolTable`.

        Raises:
            ToolError: A component is not 0 that the PLC does not have; nothing was sent.
            LimitError: A component is too large for its registers; nothing was sent.
            RejectedError: The PLC refused the value; the old one stands and is in force.
        """
        self.require_writable(tool)
        return self._set(tool, self._slots.values.rounded(self._slot(tool), offset), expected)

    def clear(
        self, tool: int, *, expected: Expected, then_select: int | None = None
    ) -> ToolReceipt:
        """Make a tool undefined, where the map says how; see :meth:`write`.

        Where the map does not tell which tool is in force, nobody can keep it from losing its
        definition but who works at the machine.
        """
        self.require_writable(tool)
        return clear_after_selecting(
            self,
            tool,
            lambda: self._set(tool, None, expected),
            expected=expected,
            then_select=then_select,
            uninterrupted=lambda: self._registers.gate,
            stays_selected=True,
        )

    def preview_write(self, tool: int, offset: ToolOffset) -> tuple[str, ...]:
        """Return what :meth:`write` would send, in words; reads only.

        Empty when the value is stored already.
        """
        self.require_writable(tool)
        return self._preview(tool, self._slots.values.rounded(self._slot(tool), offset))

    def preview_clear(self, tool: int, *, then_select: int | None = None) -> tuple[str, ...]:
        """Return what :meth:`clear` would send, in words."""
        self.require_writable(tool)
        return preview_clearing(self, tool, self._preview(tool, None), then_select)

    def preview_select(self, tool: int) -> tuple[str, ...]:
        """Refuse, as :meth:`select` does."""
        self.select(tool)
        return ()

    def selected(self) -> int | None:
        """Return the number of the tool in force; ``None`` where the map does not name it."""
        if self._map.selected is None:
            return None
        found = self._registers.word(self._map.selected)
        self._markers.ledger.saw_selected(found)
        return found

    def select(self, tool: int) -> None:
        """Refuse: which tool is in force is the machine's affair.

        Raises:
            RejectedError: Always, unless the tool is in force already.
        """
        if tool != 0:
            self._slot(tool)
        if self.selected() != tool:
            raise RejectedError(
                tr("robolink does not select tools on this PLC."),
                remedy=tr("Select tool {tool} at the HMI.", tool=tool),
                controller=self._registers.identity,
            )

    def take_over(self, tool: int, before: ToolOffset | None, request: str) -> None:
        """Ask the PLC once to take over what stands in the registers.

        Args:
            tool: Number of the tool.
            before: What is in force, if the PLC refuses.
            request: What this is about, for a person.

        Raises:
            RejectedError: It refused; the registers show ``before`` again.
            RobolinkError: As :meth:`write`.
        """
        with self._lock.held(request), self._registers.gate:
            self._slots.handshake.make_ready(request)
            self._slots.take_over(self._slot(tool), before, request)

    def _set(self, tool: int, requested: ToolOffset | None, expected: Expected) -> ToolReceipt:
        slot = self._slot(tool)
        content = self._slots.content(slot, requested)
        request = "; ".join(self._slots.requests(slot, content))
        with self._lock.held(request):
            self._require_ready(request)
            if not self.same(self.read(tool), requested):
                self._slots.handshake.make_ready(request)
            write = ToolWrite(
                tool,
                requested,
                request,
                send=lambda: self._slots.bring_into_force(slot, content, request),
                read=lambda: self.read(tool),
            )
            return self._writer.change(write, expected)

    def _preview(self, tool: int, requested: ToolOffset | None) -> tuple[str, ...]:
        slot = self._slot(tool)
        content = self._slots.content(slot, requested)
        return () if self.same(self.read(tool), requested) else self._slots.requests(slot, content)

    def _slot(self, tool: int) -> MapSlot:
        if isinstance(tool, bool) or tool not in self._map.slots:
            raise ToolIndexError(
                tr("There is no tool {tool}.", tool=tool),
                remedy=tr("The map has these: {tools}.", tools=self._known()),
            )
        return self._map.slots[tool]

    def _known(self) -> str:
        return ", ".join(map(str, self.indices()))
