"""The content of a slot, and how other content takes effect.

From what stands at the places of a map to tool offsets and back, and when two offsets are alike.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from robolink.controllers.plc_map.handshake import Handshake
from robolink.controllers.plc_map.places import Places
from robolink.errors import (
    LimitError,
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    StoppedError,
    ToolError,
)
from robolink.messages import listed, tr
from robolink.model import ToolOffset, angle_difference_deg, require_offset
from robolink.register_maps import (
    ANGLES,
    COMPONENTS,
    LREAL_TOLERANCE,
    AllZero,
    AnyMap,
    Cells,
    PlacedNumber,
    PlacedSignal,
    ToolSlot,
)

Slot = ToolSlot[PlacedNumber, PlacedSignal]
"""Where a tool is, in a map of registers or of symbols."""


class OffsetValues:
    """What the places of one map can hold."""

    def __init__(self, register_map: AnyMap) -> None:
        self._map = register_map

    def offset(self, slot: Slot, cells: Cells) -> ToolOffset | None:
        """Return the tool that stands there; ``None`` for zeros that mean none.

        Raises:
            RemoteProtocolError: They hold no tool.
        """
        taken = [cells[cell] for n in slot.components.values() for cell in n.cells]
        if not any(taken) and self._map.all_zero is not AllZero.TOOL:
            if self._map.all_zero is AllZero.UNDEFINED:
                return None
            raise self._all_zero(slot)
        return ToolOffset(*self.numbers(slot.components, cells, largest_mm=self._map.largest_mm))

    def numbers(
        self,
        components: Mapping[str, PlacedNumber],
        cells: Cells,
        *,
        largest_mm: float,
        largest_deg: float = 360.0,
    ) -> tuple[float, float, float, float, float, float]:
        """Return six values in mm and degrees; components that the map lacks are 0.

        Raises:
            RemoteProtocolError: One of them cannot be true.
        """
        limits = dict.fromkeys("xyz", largest_mm) | dict.fromkeys("uvw", largest_deg)
        x, y, z, u, v, w = (
            self._number(name, components[name], cells, limits[name]) if name in components else 0.0
            for name in COMPONENTS
        )
        return x, y, z, u, v, w

    def stored(self, slot: Slot, offset: ToolOffset) -> Cells:
        """Return what stands for ``offset`` as nearly as it can.

        Raises:
            ToolError: A component is not 0 that the PLC does not have.
            LimitError: A component is too large for its place, or the map would not believe
                them when it reads them back.
        """
        cells: Cells = {}
        for name, value in zip(COMPONENTS, offset.components(), strict=True):
            number = slot.components.get(name)
            if number is not None:
                cells.update(zip(number.cells, self._encode(slot, name, value), strict=True))
            elif value:
                raise ToolError(
                    tr(
                        "The PLC keeps no {axis} for tool {tool}: it must be 0, not {value:g}.",
                        axis=name.upper(),
                        tool=slot.tool,
                        value=value,
                    ),
                    remedy=tr("Nothing was sent. Leave it out."),
                )
        self._require_believable(slot, cells)
        return cells

    def _require_believable(self, slot: Slot, cells: Cells) -> None:
        """Refuse values that the map reads as no tool, or as an impossible one."""
        if not any(cells.values()) and self._map.all_zero is not AllZero.TOOL:
            raise LimitError(
                tr(
                    "Tool {tool} would be all zeros, which this map takes for {meaning}.",
                    tool=slot.tool,
                    meaning=tr("no tool")
                    if self._map.all_zero is AllZero.UNDEFINED
                    else tr("a lost link"),
                ),
                remedy=tr(
                    'Nothing was sent. If zeros are a tool: all_zero = "tool" in the map. To '
                    "remove one: robolink tool clear"
                ),
            )
        try:
            self.numbers(slot.components, cells, largest_mm=self._map.largest_mm)
        except RemoteProtocolError as error:
            raise LimitError(
                listed(
                    tr("Nothing was sent, because after the write it would read like this:"),
                    [error.what],
                ),
                remedy=tr("Write 0 in place of so small a number."),
            ) from error

    def rounded(self, slot: Slot, offset: ToolOffset) -> ToolOffset:
        """Return the offset as the PLC would store it; raises as :meth:`stored`."""
        cells = self.stored(slot, offset)
        return ToolOffset(*self.numbers(slot.components, cells, largest_mm=self._map.largest_mm))

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Return whether the PLC stores both alike; undefined equals undefined only.

        Whole numbers: half a step; REAL: one unit in the last place; LREAL: 1e-9
        (docs/reference/rules.md 3).
        """
        if a is None or b is None:
            return a is b
        require_offset("a", a)
        require_offset("b", b)
        pairs = zip(COMPONENTS, a.components(), b.components(), strict=True)
        return all(self._alike(name, first, second) for name, first, second in pairs)

    def changed(self, slot: Slot, standing: Cells, wanted: Cells) -> tuple[str, ...]:
        """Return the components in which ``wanted`` differs from ``standing``.

        What is no number is another one.
        """
        return tuple(
            name
            for name, number in slot.components.items()
            if not self._alike(
                name,
                number.decode([standing[cell] for cell in number.cells]),
                number.decode([wanted[cell] for cell in number.cells]),
            )
        )

    def _alike(self, name: str, a: float, b: float) -> bool:
        difference = angle_difference_deg(a, b) if name in ANGLES else a - b
        numbers = [
            slot.components[name] for slot in self._map.slots.values() if name in slot.components
        ]
        slacks = [number.slack(value) for number in numbers for value in (a, b)]
        return abs(difference) <= max(slacks, default=0.0) + LREAL_TOLERANCE

    def _number(self, name: str, number: PlacedNumber, cells: Cells, limit: float) -> float:
        value = number.decode([cells[cell] for cell in number.cells])
        if not number.is_absurd(value) and abs(value) <= limit:
            return value
        if not number.is_absurd(value) and name not in ANGLES and limit == self._map.largest_mm:
            raise RemoteProtocolError(
                tr(
                    "{axis} at {place} reads {value:g} mm; the map allows {limit:g} mm "
                    "(largest_mm).",
                    axis=name.upper(),
                    place=number.place,
                    value=value,
                    limit=limit,
                ),
                remedy=tr(
                    "Compare place, type, scale and word_order with the PLC, or raise largest_mm."
                ),
            )
        raise RemoteProtocolError(
            tr(
                "{axis} at {place} reads {value:g}, which is impossible.",
                axis=name.upper(),
                place=number.place,
                value=value,
            ),
            remedy=tr(
                "Compare place, type and word_order in the map with the PLC's own list; "
                "'robolink expert plc check-map' shows all values."
            ),
        )

    def _encode(self, slot: Slot, name: str, value: float) -> Sequence[float]:
        number = slot.components[name]
        limit = 360.0 if name in ANGLES else self._map.largest_mm
        try:
            stored = number.encode(value)
        except OverflowError:
            stored = None
        if stored is not None and abs(value) <= limit:
            return stored
        raise LimitError(
            tr(
                "{axis} = {value:g} for tool {tool} is more than {place} may hold "
                "({type}, largest_mm {largest:g}); nothing was sent.",
                axis=name.upper(),
                value=value,
                tool=slot.tool,
                place=number.place,
                type=number.type,
                largest=self._map.largest_mm,
            ),
            remedy=tr("Check the value, then type, scale and largest_mm in the map."),
        )

    def _all_zero(self, slot: Slot) -> RemoteProtocolError:
        return RemoteProtocolError(
            tr(
                "All values of tool {tool} are zero, as after a lost link.",
                tool=slot.tool,
            ),
            remedy=tr(
                'Look at the HMI. If zeros are normal, write all_zero = "undefined" or "tool" '
                "in the map."
            ),
        )


@dataclass(frozen=True, slots=True)
class SlotContent:
    """The present or the intended content of a slot.

    Attributes:
        cells: What stands where; nothing when only the flag is to change.
        defined: The flag of a tool that is defined; True where there is none to write.
    """

    cells: Cells
    defined: bool = True

    def is_part_of(self, other: "SlotContent") -> bool:
        """Whether ``other`` contains all of this."""
        return self.defined == other.defined and self.cells.items() <= other.cells.items()


class Slots:
    """Writes the slots of one map, and has the PLC take them over.

    Attributes:
        values: From cells to offsets and back.
        handshake: How the PLC is told.
    """

    def __init__(self, places: Places, register_map: AnyMap) -> None:
        self._places = places
        self._map = register_map
        self.values = OffsetValues(register_map)
        self.handshake = Handshake(places, register_map.commit)

    def read(self, slot: Slot) -> ToolOffset | None:
        """Read a tool, ``None`` when it is undefined."""
        if slot.defined is not None and not self._places.is_on(slot.defined):
            return None
        return self.values.offset(slot, self._places.stable(slot.components))

    def content(self, slot: Slot, offset: ToolOffset | None) -> SlotContent:
        """Return the content for an offset, or for no tool.

        Raises:
            ToolError: This slot cannot hold it; nothing was sent.
            LimitError: A component is too large for its place; nothing was sent.
        """
        if offset is not None:
            return SlotContent(self.values.stored(slot, offset))
        if _has_flag(slot):
            return SlotContent({}, defined=False)
        if slot.defined is None and self._map.all_zero is AllZero.UNDEFINED:
            zeros = {
                cell: stored
                for number in slot.components.values()
                for cell, stored in zip(number.cells, number.encode(0.0), strict=True)
            }
            return SlotContent(zeros)
        raise ToolError(
            tr("Tool {tool} of this PLC cannot be made undefined.", tool=slot.tool),
            remedy=tr("Write another offset; or zeros, if zeros mean no tool on this machine."),
        )

    def changed(self, slot: Slot, content: SlotContent) -> tuple[str, ...]:
        """Return which components would read otherwise than now."""
        if not content.cells:
            return ()
        return self.values.changed(slot, self._places.stable(slot.components), content.cells)

    def requests(self, slot: Slot, content: SlotContent) -> tuple[str, ...]:
        """Return all that :meth:`bring_into_force` writes, in words and in this order."""
        requests = [*self._places.write_requests(content.cells)]
        if slot.defined is not None and slot.defined.writable:
            place = slot.defined.place
            on, off = tr("switch {place} on", place=place), tr("switch {place} off", place=place)
            requests.append(on if content.defined else off)
        return (*requests, *self.handshake.requests(slot.tool))

    def bring_into_force(self, slot: Slot, content: SlotContent) -> None:
        """Write ``content``, then ask the PLC; after a refusal the former content is restored.

        Raises:
            RejectedError: The PLC refused; nothing has changed.
            OutcomeUnknownError: It did not answer, or the former content could not be restored.
        """
        before = self._stored(slot)
        kept = SlotContent({a: before.cells[a] for a in content.cells}, before.defined)

        def write_and_ask() -> None:
            self._write(slot, content)
            self.handshake.carry_out(slot.tool)

        self._or_put_back(slot, kept, write_and_ask)

    def take_over(self, slot: Slot, before: ToolOffset | None) -> None:
        """Ask the PLC once to take over what stands there; raises as :meth:`bring_into_force`.

        Args:
            slot: The slot.
            before: What is in force, if the PLC refuses.
        """
        kept = self.content(slot, before)
        self._or_put_back(slot, kept, lambda: self.handshake.carry_out(slot.tool))

    def _or_put_back(self, slot: Slot, kept: SlotContent, act: Callable[[], None]) -> None:
        """Act; if it is refused or stopped, let the PLC show the active values again."""
        try:
            act()
        except (RejectedError, StoppedError) as error:
            with self._places.latch.putting_back(slot.tool):
                restored = self._restored(slot, kept)
            if not restored:
                raise OutcomeUnknownError(
                    listed(
                        tr(
                            "robolink could not restore the values of tool {tool} after this:",
                            tool=slot.tool,
                        ),
                        [error.what],
                    ),
                    remedy=tr("Look at the tool on the HMI, then run 'robolink recover'."),
                    request=error.request,
                ) from error
            raise

    def _restored(self, slot: Slot, kept: SlotContent) -> bool:
        """Restore ``kept`` where it is not there, with one write; return whether it is there."""
        try:
            if kept.is_part_of(self._stored(slot)):
                return True
            self._write(slot, kept)
            return kept.is_part_of(self._stored(slot))
        except RejectedError:  # of reading, too: then nothing shows what stands there
            return False

    def _write(self, slot: Slot, content: SlotContent) -> None:
        self._places.write(content.cells)
        if slot.defined is not None and slot.defined.writable:
            self._places.switch(slot.defined, content.defined)

    def _stored(self, slot: Slot) -> SlotContent:
        flagged = _has_flag(slot) and not self._places.is_on(slot.defined)
        return SlotContent(self._places.stable(slot.components), defined=not flagged)


def _has_flag(slot: Slot) -> bool:
    return slot.defined is not None and slot.defined.writable
