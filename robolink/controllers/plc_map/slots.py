"""The content of a slot, and how other content takes effect.

From registers to tool offsets and back, and when two offsets are alike.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby

from robolink.controllers.plc_map.handshake import Handshake
from robolink.controllers.plc_map.link import Registers
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
    MapSlot,
    Number,
    RegisterMap,
    RegisterTable,
    describe_place,
)

Words = dict[int, int]
"""Registers of one table by address."""


class OffsetValues:
    """What the registers of one map can hold."""

    def __init__(self, register_map: RegisterMap) -> None:
        self._map = register_map

    def offset(self, slot: MapSlot, words: Words) -> ToolOffset | None:
        """Return the tool that registers hold; ``None`` for zeros that mean none.

        Raises:
            RemoteProtocolError: They hold no tool.
        """
        taken = [words[address] for n in slot.components.values() for address in n.registers]
        if not any(taken) and self._map.all_zero is not AllZero.TOOL:
            if self._map.all_zero is AllZero.UNDEFINED:
                return None
            raise self._all_zero(slot)
        return ToolOffset(*self.numbers(slot.components, words, largest_mm=self._map.largest_mm))

    def numbers(
        self,
        components: Mapping[str, Number],
        words: Words,
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
            self._number(name, components[name], words, limits[name]) if name in components else 0.0
            for name in COMPONENTS
        )
        return x, y, z, u, v, w

    def registers(self, slot: MapSlot, offset: ToolOffset) -> Words:
        """Return the registers that hold ``offset`` as nearly as they can.

        Raises:
            ToolError: A component is not 0 that the PLC does not have.
            LimitError: A component is too large for its registers, or the map would not believe
                them when it reads them back.
        """
        words: Words = {}
        for name, value in zip(COMPONENTS, offset.components(), strict=True):
            number = slot.components.get(name)
            if number is not None:
                words.update(zip(number.registers, self._encode(slot, name, value), strict=True))
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
        self._require_believable(slot, words)
        return words

    def _require_believable(self, slot: MapSlot, words: Words) -> None:
        """Refuse registers that the map reads as no tool, or as an impossible one."""
        if not any(words.values()) and self._map.all_zero is not AllZero.TOOL:
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
            self.numbers(slot.components, words, largest_mm=self._map.largest_mm)
        except RemoteProtocolError as error:
            raise LimitError(
                listed(
                    tr("Nothing was sent, because after the write it would read like this:"),
                    [error.what],
                ),
                remedy=tr("Write 0 in place of so small a number."),
            ) from error

    def rounded(self, slot: MapSlot, offset: ToolOffset) -> ToolOffset:
        """Return the offset as the registers would store it; raises as :meth:`registers`."""
        words = self.registers(slot, offset)
        return ToolOffset(*self.numbers(slot.components, words, largest_mm=self._map.largest_mm))

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Return whether registers store both alike; undefined equals undefined only.

        Whole numbers: half a step; REAL: one unit in the last place; LREAL: 1e-9
        (docs/reference/rules.md 3).
        """
        if a is None or b is None:
            return a is b
        require_offset("a", a)
        require_offset("b", b)
        pairs = zip(COMPONENTS, a.components(), b.components(), strict=True)
        return all(self._alike(name, first, second) for name, first, second in pairs)

    def changed(self, slot: MapSlot, outcome: Words, wanted: Words) -> tuple[str, ...]:
        """Return the components in which ``wanted`` differs from ``standing``.

        What is no number is another one.
        """
        return tuple(
            name
            for name, number in slot.components.items()
            if not self._alike(
                name,
                number.decode(tuple(outcome[address] for address in number.registers)),
                number.decode(tuple(wanted[address] for address in number.registers)),
            )
        )

    def _alike(self, name: str, a: float, b: float) -> bool:
        difference = angle_difference_deg(a, b) if name in ANGLES else a - b
        numbers = [
            slot.components[name] for slot in self._map.slots.values() if name in slot.components
        ]
        slacks = [number.slack(value) for number in numbers for value in (a, b)]
        return abs(difference) <= max(slacks, default=0.0) + LREAL_TOLERANCE

    def _number(self, name: str, number: Number, words: Words, limit: float) -> float:
        value = number.decode(tuple(words[address] for address in number.registers))
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
                    "Compare address, type, scale and word_order with the PLC, or raise largest_mm."
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
                "Compare address, type and word_order in the map with the PLC's register list; "
                "'robolink expert plc check-map' shows all values."
            ),
        )

    def _encode(self, slot: MapSlot, name: str, value: float) -> tuple[int, ...]:
        number = slot.components[name]
        limit = 360.0 if name in ANGLES else self._map.largest_mm
        try:
            words = number.encode(value)
        except OverflowError:
            words = None
        if words is not None and abs(value) <= limit:
            return words
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

    def _all_zero(self, slot: MapSlot) -> RemoteProtocolError:
        return RemoteProtocolError(
            tr(
                "All registers of tool {tool} are zero, as after a lost link.",
                tool=slot.tool,
            ),
            remedy=tr(
                'Look at the HMI. If zeros are normal, write all_zero = "undefined" or "tool" '
                "in the map."
            ),
        )


def runs(words: Words) -> Iterator[tuple[int, list[int]]]:
    """Return the stretches of neighbouring registers, each with its first address."""
    for _, stretch in groupby(enumerate(sorted(words)), key=lambda pair: pair[1] - pair[0]):
        addresses = [address for _, address in stretch]
        yield addresses[0], [words[address] for address in addresses]


@dataclass(frozen=True, slots=True)
class SlotContent:
    """The present or the intended content of a slot.

    Attributes:
        words: Registers by address; none when only the flag is to change.
        defined: The flag of a tool that is defined; True where there is none to write.
    """

    words: Words
    defined: bool = True

    def is_part_of(self, other: "SlotContent") -> bool:
        """Whether ``other`` contains all of this."""
        return self.defined == other.defined and self.words.items() <= other.words.items()


class Slots:
    """Writes the slots of one map, and has the PLC take them over.

    Attributes:
        values: From registers to offsets and back.
        handshake: How the PLC is told.
    """

    def __init__(self, registers: Registers, register_map: RegisterMap) -> None:
        self._registers = registers
        self._map = register_map
        self.values = OffsetValues(register_map)
        self.handshake = Handshake(registers, register_map.commit)

    def read(self, slot: MapSlot) -> ToolOffset | None:
        """Read a tool, ``None`` when it is undefined."""
        if slot.defined is not None and not self._registers.is_on(slot.defined):
            return None
        return self.values.offset(slot, self._words(slot))

    def content(self, slot: MapSlot, offset: ToolOffset | None) -> SlotContent:
        """Return the content for an offset, or for no tool.

        Raises:
            ToolError: This slot cannot hold it; nothing was sent.
            LimitError: A component is too large for its registers; nothing was sent.
        """
        if offset is not None:
            return SlotContent(self.values.registers(slot, offset))
        if _has_flag(slot):
            return SlotContent({}, defined=False)
        if slot.defined is None and self._map.all_zero is AllZero.UNDEFINED:
            addresses = (a for number in slot.components.values() for a in number.registers)
            return SlotContent(dict.fromkeys(addresses, 0))
        raise ToolError(
            tr("Tool {tool} of this PLC cannot be made undefined.", tool=slot.tool),
            remedy=tr("Write another offset; or zeros, if zeros mean no tool on this machine."),
        )

    def changed(self, slot: MapSlot, content: SlotContent) -> tuple[str, ...]:
        """Return which components other registers than now would stand for."""
        if not content.words:
            return ()
        return self.values.changed(slot, self._words(slot), content.words)

    def requests(self, slot: MapSlot, content: SlotContent) -> tuple[str, ...]:
        """Return all that :meth:`bring_into_force` writes, in words and in this order."""
        requests = [
            tr(
                "write {place}: {values}",
                place=describe_place(RegisterTable.HOLDING, address),
                values=" ".join(f"{value:04X}" for value in values),
            )
            for address, values in runs(content.words)
        ]
        if slot.defined is not None and slot.defined.writable:
            place = slot.defined.place
            on, off = tr("switch {place} on", place=place), tr("switch {place} off", place=place)
            requests.append(on if content.defined else off)
        return (*requests, *self.handshake.requests(slot.tool))

    def bring_into_force(self, slot: MapSlot, content: SlotContent) -> None:
        """Write ``content``, then ask the PLC; after a refusal the former content is restored.

        Raises:
            RejectedError: The PLC refused; nothing has changed.
            OutcomeUnknownError: It did not answer, or the registers could not be restored.
        """
        before = self._stored(slot)
        kept = SlotContent({a: before.words[a] for a in content.words}, before.defined)

        def write_and_ask() -> None:
            self._write(slot, content)
            self.handshake.carry_out(slot.tool)

        self._or_put_back(slot, kept, write_and_ask)

    def take_over(self, slot: MapSlot, before: ToolOffset | None) -> None:
        """Ask the PLC once to take over the registers; raises as :meth:`bring_into_force`.

        Args:
            slot: The slot.
            before: What is in force, if the PLC refuses.
        """
        kept = self.content(slot, before)
        self._or_put_back(slot, kept, lambda: self.handshake.carry_out(slot.tool))

    def _or_put_back(self, slot: MapSlot, kept: SlotContent, act: Callable[[], None]) -> None:
        """Act; if it is refused or stopped, let the registers show the active values again."""
        try:
            act()
        except (RejectedError, StoppedError) as error:
            with self._registers.latch.putting_back(slot.tool):
                restored = self._restored(slot, kept)
            if not restored:
                raise OutcomeUnknownError(
                    listed(
                        tr(
                            "robolink could not restore the registers of tool {tool} after this:",
                            tool=slot.tool,
                        ),
                        [error.what],
                    ),
                    remedy=tr("Look at the tool on the HMI, then run 'robolink recover'."),
                    request=error.request,
                ) from error
            raise

    def _restored(self, slot: MapSlot, kept: SlotContent) -> bool:
        """Restore ``kept`` where it is not there, with one write; return whether it is there."""
        if kept.is_part_of(self._stored(slot)):
            return True
        try:
            self._write(slot, kept)
        except RejectedError:
            return False
        return kept.is_part_of(self._stored(slot))

    def _write(self, slot: MapSlot, content: SlotContent) -> None:
        for address, values in runs(content.words):
            self._registers.write(address, values)
        if slot.defined is not None and slot.defined.writable:
            self._registers.switch(slot.defined, content.defined)

    def _stored(self, slot: MapSlot) -> SlotContent:
        flagged = _has_flag(slot) and not self._registers.is_on(slot.defined)
        return SlotContent(self._words(slot), defined=not flagged)

    def _words(self, slot: MapSlot) -> Words:
        return dict(zip(slot.span, self._registers.read_twice(slot.table, slot.span), strict=True))


def _has_flag(slot: MapSlot) -> bool:
    return slot.defined is not None and slot.defined.writable
