"""What stands in a slot, and how other contents come into force."""

from collections.abc import Callable
from dataclasses import dataclass

from robolink.controllers.plc_map.handshake import Handshake
from robolink.controllers.plc_map.registers import Registers
from robolink.controllers.plc_map.values import OffsetValues, Words, runs
from robolink.errors import OutcomeUnknownError, RejectedError, StoppedError, ToolError
from robolink.messages import tr
from robolink.model import ToolOffset
from robolink.register_maps import AllZero, MapSlot, RegisterMap, RegisterTable, describe_place


@dataclass(frozen=True, slots=True)
class SlotContent:
    """What stands in a slot, or is to stand there.

    Attributes:
        words: Registers by address; none when only the flag is to change.
        defined: The flag of a tool that is defined; True where there is none to write.
    """

    words: Words
    defined: bool = True

    def is_part_of(self, other: "SlotContent") -> bool:
        """Whether ``other`` holds all of this."""
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
        self.values = OffsetValues(register_map, registers.identity)
        self.handshake = Handshake(registers, register_map.commit)

    def read(self, slot: MapSlot) -> ToolOffset | None:
        """Read a tool, ``None`` when it is undefined."""
        if slot.defined is not None and not self._registers.is_on(slot.defined):
            return None
        return self.values.offset(slot, self._words(slot))

    def content(self, slot: MapSlot, offset: ToolOffset | None) -> SlotContent:
        """Return what stands for an offset, or for no tool.

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
            remedy=tr("Write another offset; or zeros, if this machine takes zeros as no tool."),
            controller=self._registers.identity,
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

    def bring_into_force(self, slot: MapSlot, content: SlotContent, request: str) -> None:
        """Write ``content``, then ask the PLC; after a refusal what was there stands there again.

        Raises:
            RejectedError: The PLC refused; nothing has changed.
            OutcomeUnknownError: It did not answer, or the registers could not be put back.
        """
        before = self._stored(slot)
        kept = SlotContent({a: before.words[a] for a in content.words}, before.defined)

        def write_and_ask() -> None:
            self._write(slot, content)
            self.handshake.carry_out(slot.tool, request)

        self._or_put_back(slot, kept, write_and_ask)

    def take_over(self, slot: MapSlot, before: ToolOffset | None, request: str) -> None:
        """Ask the PLC once to take over what stands there; raises as :meth:`bring_into_force`.

        Args:
            slot: The slot.
            before: What is in force, if the PLC refuses.
            request: What this is about, for a person.
        """
        kept = self.content(slot, before)
        self._or_put_back(slot, kept, lambda: self.handshake.carry_out(slot.tool, request))

    def _or_put_back(self, slot: MapSlot, kept: SlotContent, act: Callable[[], None]) -> None:
        """Act; if it is refused or stopped, let the registers show again what is in force."""
        try:
            act()
        except (RejectedError, StoppedError) as error:
            with self._registers.latch.putting_back(slot.tool):
                restored = self._restored(slot, kept)
            if not restored:
                raise OutcomeUnknownError(
                    tr(
                        "{refusal} The registers of tool {tool} could not be put back.",
                        refusal=error.what,
                        tool=slot.tool,
                    ),
                    remedy=tr("Look at the tool on the HMI, then run 'robolink recover'."),
                    controller=self._registers.identity,
                    request=error.request,
                ) from error
            raise

    def _restored(self, slot: MapSlot, kept: SlotContent) -> bool:
        """Put ``kept`` back where it does not stand, with one write; tell whether it stands."""
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
