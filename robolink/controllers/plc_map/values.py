"""From registers to tool offsets and back, and when two offsets are alike."""

from collections.abc import Iterator, Mapping
from itertools import groupby

from robolink.errors import LimitError, RemoteProtocolError, ToolError
from robolink.messages import tr
from robolink.model import ToolOffset, angle_difference_deg
from robolink.register_maps import (
    ANGLES,
    COMPONENTS,
    LREAL_TOLERANCE,
    AllZero,
    MapSlot,
    Number,
    RegisterMap,
)

Words = dict[int, int]
"""Registers of one table by address."""


class OffsetValues:
    """What the registers of one map can hold."""

    def __init__(self, register_map: RegisterMap, identity: str) -> None:
        self._map = register_map
        self._identity = identity

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
                    remedy=tr("Leave it out; nothing was sent."),
                    controller=self._identity,
                )
        self._require_believable(slot, words)
        return words

    def _require_believable(self, slot: MapSlot, words: Words) -> None:
        """Refuse registers that the map would take for no tool, or for none that can be true."""
        if not any(words.values()) and self._map.all_zero is not AllZero.TOOL:
            raise LimitError(
                tr(
                    "All registers of tool {tool} would be zero. This map takes that for "
                    "{meaning}, so it could not be read back; nothing was sent.",
                    tool=slot.tool,
                    meaning=tr("no tool")
                    if self._map.all_zero is AllZero.UNDEFINED
                    else tr("a lost link"),
                ),
                remedy=tr(
                    "Where zeros are a tool of this machine, say so in the map: "
                    'all_zero = "tool". To remove a tool: robolink tool clear.'
                ),
                controller=self._identity,
            )
        try:
            self.numbers(slot.components, words, largest_mm=self._map.largest_mm)
        except RemoteProtocolError as error:
            raise LimitError(
                tr(
                    "{cause} It would read like that after the write, so nothing was sent.",
                    cause=error.what,
                ),
                remedy=tr("Write 0 in place of so small a number."),
                controller=self._identity,
            ) from error

    def rounded(self, slot: MapSlot, offset: ToolOffset) -> ToolOffset:
        """Return the offset that the registers would hold; raises as :meth:`registers`."""
        words = self.registers(slot, offset)
        return ToolOffset(*self.numbers(slot.components, words, largest_mm=self._map.largest_mm))

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Tell whether registers hold both alike; undefined equals undefined only.

        Whole numbers: half a step; REAL: one unit in the last place; LREAL: 1e-9
        (docs/reference/rules.md 3).
        """
        if a is None or b is None:
            return a is b
        pairs = zip(COMPONENTS, a.components(), b.components(), strict=True)
        return all(self._alike(name, first, second) for name, first, second in pairs)

    def changed(self, slot: MapSlot, standing: Words, wanted: Words) -> tuple[str, ...]:
        """Return the components that ``wanted`` holds otherwise than ``standing``.

        What is no number is another one.
        """
        return tuple(
            name
            for name, number in slot.components.items()
            if not self._alike(
                name,
                number.decode(tuple(standing[address] for address in number.registers)),
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
                    "{axis} at {place} reads {value:g} mm, more than the {limit:g} mm that the map "
                    "allows (largest_mm).",
                    axis=name.upper(),
                    place=number.place,
                    value=value,
                    limit=limit,
                ),
                remedy=tr(
                    "If the tool really is that long, state a larger largest_mm in the map; "
                    "otherwise compare address, type, scale and word_order with the PLC's register "
                    "list."
                ),
                controller=self._identity,
            )
        raise RemoteProtocolError(
            tr(
                "{axis} at {place} reads {value:g}, which cannot be true.",
                axis=name.upper(),
                place=number.place,
                value=value,
            ),
            remedy=tr(
                "Compare address, type and word_order in the map with the PLC's register list; "
                "'robolink expert plc check-map' shows all values."
            ),
            controller=self._identity,
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
            controller=self._identity,
        )

    def _all_zero(self, slot: MapSlot) -> RemoteProtocolError:
        return RemoteProtocolError(
            tr(
                "All registers of tool {tool} are zero: a PLC whose link was lost shows just that.",
                tool=slot.tool,
            ),
            remedy=tr(
                "Look at the tool on the HMI. If zeros are normal there, say so in the map: "
                'all_zero = "undefined" or all_zero = "tool".'
            ),
            controller=self._identity,
        )


def runs(words: Words) -> Iterator[tuple[int, list[int]]]:
    """Return the stretches of neighbouring registers, each with its first address."""
    for _, stretch in groupby(enumerate(sorted(words)), key=lambda pair: pair[1] - pair[0]):
        addresses = [address for _, address in stretch]
        yield addresses[0], [words[address] for address in addresses]
