"""The tool table of a PLC that keeps offsets in registers or symbols of its own.

Settles what an earlier process left open.

By reading; and where there is a handshake, by asking the PLC once more to take over what
stands at the places of the map, which changes nothing if it did so before.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import ClassVar

from robolink.controllers.plc_map.handshake import Handshake
from robolink.controllers.plc_map.link import MappedPlc
from robolink.controllers.plc_map.slots import Slots
from robolink.controllers.preserving import Preserver
from robolink.controllers.resolving import MarkerResolver, examine_write
from robolink.controllers.tool_table import ToolTableCore
from robolink.controllers.tool_writing import ToolWrite
from robolink.errors import RejectedError
from robolink.messages import known_names, tr
from robolink.model import (
    PROOFS,
    Expected,
    Finding,
    Marker,
    MarkerKind,
    ToolOffset,
    ToolReceipt,
    Verdict,
    describe_offset,
    read_offset,
)


class RegisterToolTable(ToolTableCore):
    """The tools that a map names.

    Every write is compare-and-set and read back. The values go out first, in one request where
    they follow one another, and only then is the PLC asked to take them over. A refusal leaves the
    registers as they were; where it does not, another error says so.

    Where the map does not tell which tool is in force, nobody can keep it from losing its
    definition but who works at the machine.

    Args:
        plc: The PLC and its map.
    """

    machine_selects: ClassVar[bool] = True

    def __init__(self, plc: MappedPlc) -> None:
        super().__init__(plc)
        self._plc = plc
        self._places = plc.places
        self._map = plc.register_map
        self._slots = Slots(plc.places, plc.register_map)

    @property
    def handshake(self) -> Handshake:
        """How the PLC is asked to take values over."""
        return self._slots.handshake

    def indices(self) -> Sequence[int]:
        """Return the numbers of the tools in the map."""
        return tuple(sorted(self._map.slots))

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Return whether the registers store both alike; undefined equals undefined only."""
        return self._slots.values.same(a, b)

    def require_writable(self, tool: int) -> None:
        """Refuse a tool number that cannot be written; sends nothing.

        Raises:
            ReservedToolError, ToolIndexError: As :meth:`write` would.
            NotComparedError: Nobody has compared a value of this tool with the machine's screen.
            ToolError: The PLC's offsets can only be read.
        """
        super().require_writable(tool)
        with self._plc.asked(tr("tool {tool}", tool=tool)):
            self._plc.require_known_place(tool)
        self._places.require_writable(self._map.slots[tool])

    def preview_select(self, tool: int) -> tuple[str, ...]:
        """Refuse, as :meth:`select` does."""
        self.select(tool)
        return ()

    def select(self, tool: int, *, wait_s: float | None = None) -> None:  # noqa: ARG002 - alike
        """Refuse: the machine selects its tool itself.

        Raises:
            RejectedError: Always, unless the tool is in force already.
        """
        self._require_known(tool)
        if self.selected() != tool:
            self._send_selection(tool)

    def doubts(self, tools: Collection[int]) -> tuple[str, ...]:
        """Report registers that hold another value than the recorded one.

        Somebody changed it at the HMI, or a write ended before the PLC was asked to take it over
        and this PC has lost the record of that. The next request then brings it into force: with
        its own tool, and where the PLC is not told a number, with every other one.

        Args:
            tools: Those that are about to be changed.
        """
        if not self.handshake.answers:
            return ()
        alone = self._map.commit.tool_number is not None
        asked = sorted(tools) if alone else self.indices()
        return tuple(filter(None, (self._doubt(tool, tool in tools) for tool in asked)))

    def _doubt(self, tool: int, changed: bool) -> str:
        proofs = self._plc.markers.outcomes.recorded(tool=tool, kinds=PROOFS)
        entry = next(iter(proofs), None)
        if entry is None and not changed:
            return ""
        known = None if entry is None else read_offset(entry.details.get("value"))
        now = self.read(tool)
        if entry is not None and self.same(now, known):
            return ""
        return tr(
            "The PLC shows {now} for tool {tool}; on record is {known}. Only the HMI shows "
            "which of the two the machine uses: the PLC may not have accepted what it shows.",
            tool=tool,
            now=describe_offset(now),
            known=tr("nothing") if entry is None else describe_offset(known),
        )

    def take_over(self, tool: int, before: ToolOffset | None, request: str) -> None:
        """Ask the PLC once to take over the values in the registers.

        Args:
            tool: Number of the tool.
            before: What is in force, if the PLC refuses.
            request: What this is about, for a person.

        Raises:
            RejectedError: It refused; the registers show ``before`` again.
            RobolinkError: As :meth:`write`.
        """
        with self._plc.lock.held(request), self._plc.uninterrupted():
            self._slots.handshake.make_ready()
            self._slots.take_over(self._map.slots[tool], before)

    def _set(self, tool: int, requested: ToolOffset | None, expected: Expected) -> ToolReceipt:
        request = self._request(tool, requested)
        with self._plc.lock.held(request):
            self._plc.require_ready(tool)
            if not self.same(self.read(tool), requested):
                self._slots.handshake.make_ready()
            return _RegisterWrite(self, self._plc, tool, requested, self._slots).change(expected)

    def preview_clear(self, tool: int, *, then_select: int | None = None) -> tuple[str, ...]:
        """Return what :meth:`clear` would send besides its reads; raises what it would."""
        requests = super().preview_clear(tool, then_select=then_select)
        if requests:
            with self._plc.asked("; ".join(requests)):
                self._require_compared(tool, None)
        return requests

    def _require_possible(self, tool: int, offset: ToolOffset) -> None:
        self._require_compared(tool, offset)

    def _require_compared(self, tool: int, offset: ToolOffset | None) -> None:
        slot = self._map.slots[tool]
        changed = self._slots.changed(slot, self._slots.content(slot, offset))
        self._plc.require_compared(tool, changed)

    def _request(self, tool: int, requested: ToolOffset | None) -> str:
        return "; ".join(self._requests(tool, requested))

    def _requests(self, tool: int, requested: ToolOffset | None) -> tuple[str, ...]:
        slot = self._map.slots[tool]
        return self._slots.requests(slot, self._slots.content(slot, requested))

    def _clear_request(self, tool: int) -> str:
        return tr("tool {tool}", tool=tool)

    def _storable(self, tool: int, offset: ToolOffset) -> ToolOffset:
        return self._slots.values.rounded(self._map.slots[tool], offset)

    def _stored(self, tool: int) -> ToolOffset | None:
        return self._slots.read(self._map.slots[tool])

    def _selected(self) -> int | None:
        named = self._map.selected
        return None if named is None else self._places.word(named)

    def _select_request(self, tool: int) -> str:
        return tr("tool {tool}", tool=tool)

    def _send_selection(self, tool: int) -> None:
        raise RejectedError(
            tr("robolink does not select tools on this PLC."),
            remedy=tr("Select tool {tool} at the HMI.", tool=tool),
        )

    def _choices(self) -> str:
        return known_names(self.indices())

    def _known(self, lowest: int) -> str:  # noqa: ARG002 - alike for both
        return known_names(self.indices())


class _RegisterWrite(ToolWrite):
    """The writing of one slot, and the request to take it over."""

    def __init__(
        self,
        table: RegisterToolTable,
        plc: MappedPlc,
        tool: int,
        requested: ToolOffset | None,
        slots: Slots,
    ) -> None:
        slot = plc.register_map.slots[tool]
        content = slots.content(slot, requested)
        request = "; ".join(slots.requests(slot, content))
        super().__init__(plc, tool, requested, request, same=table.same)
        self._plc, self._slot, self._content = plc, slot, content
        self._slots = slots

    def read_before(self, expected: Expected) -> ToolOffset | None:  # noqa: ARG002 - one way only
        """Read what the write replaces.

        It was read before the PLC was made ready, too: that may have meant to wait for another
        request of the machine, which may have stored another value.

        Raises:
            NotComparedError: The write would change what nobody has compared.
        """
        changed = self._slots.changed(self._slot, self._content)
        self._plc.require_compared(self.tool, changed)
        return self._slots.read(self._slot)

    def send(self) -> None:
        """Write the registers and have the PLC take them over.

        What stands there is read once more for that, register by register: should the PLC refuse,
        it has to stand there again to the last bit.
        """
        self._slots.bring_into_force(self._slot, self._content)

    def read_back(self) -> ToolOffset | None:
        """Read what is stored.

        Registers have no proof of their word order, and numbers in another order may be those of
        a tool (docs/reference/faults.md F33): so the probe is compared behind them.
        """
        stored = self._slots.read(self._slot)
        self._plc.require_probe()
        return stored


class RegisterResolver(MarkerResolver):
    """Examines and recovers the open markers that this driver begins."""

    def __init__(self, plc: MappedPlc, tools: RegisterToolTable, preserver: Preserver) -> None:
        super().__init__(plc, tools, preserver)
        self._plc = plc
        self._registers = tools
        self._waited = False

    def fence(self) -> None:
        """Wait until what was sent earlier has arrived, once a session.

        A request that stands then is switched off before the PLC is asked for anything.
        """
        if not self._waited:
            self._registers.handshake.wait_out()
            self._waited = True

    def settle(self, finding: Finding) -> None:
        """Do what ``finding.action`` says and remove the marker."""
        marker = finding.marker
        if finding.verdict is Verdict.NOT_FINISHED:
            tool = int(str(marker.details["tool"]))
            with self._plc.asked(marker.request):
                self._plc.require_ready(tool)
            before = read_offset(marker.details.get("before"))
            self._registers.take_over(tool, before, marker.request)
        super().settle(finding)

    def _examine_more(self, marker: Marker) -> Finding | None:
        """Judge a write.

        Registers that hold the new value do not prove that the PLC took it over: the process
        may have died between the values and the request. Nor does the old value prove that it is
        in force: a roll-back that a failing journal could not record may have written it, and the
        PLC still uses what it had taken over before.
        """
        if marker.kind is not MarkerKind.SET or "tool" not in marker.details:
            return None
        finding = examine_write(self._registers, marker)
        if finding.verdict is Verdict.CONFLICT or not self._registers.handshake.answers:
            return finding
        if finding.verdict is Verdict.DONE:
            holds = finding.sentence
        else:
            holds = tr("The PLC shows the old value for tool {tool}.", tool=marker.details["tool"])
        sentence = tr("{holds} robolink could not confirm that the PLC accepted it.", holds=holds)
        action = tr("ask the PLC again to accept the values that it shows")
        return replace(finding, verdict=Verdict.NOT_FINISHED, sentence=sentence, action=action)
