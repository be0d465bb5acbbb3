"""The registers and coils of a simulated PLC, with its mailbox among them."""

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Final

from robolink.timing import Clock
from robolink_simulators.faults import LinkKind
from robolink_simulators.softmotion.mailbox.exchange import ServedAccess
from robolink_simulators.softmotion.mailbox.image import (
    REGISTERS,
    Bank,
    MailboxPlace,
    places_of,
)
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

WORD_BITS: Final = 16


class PlcRegisters:
    """Holding and input registers; coils overlay the first, discrete inputs the second.

    As CODESYS does it (documented, docs/reference/softmotion.md 4.1). Registers beside the mailbox
    only keep what is written.

    Args:
        simulator: The PLC.
        clock: The simulated time.
        link: The kind of link that they are served on.
    """

    def __init__(
        self,
        simulator: SoftMotionSimulator,
        clock: Clock,
        link: LinkKind = LinkKind.MODBUS_TCP,
    ) -> None:
        self._link = link
        self._simulator = simulator
        self._clock = clock
        self._places = places_of(simulator.options.mailbox)
        self._plain = {bank: [0] * REGISTERS for bank in Bank}

    @property
    def lock(self) -> AbstractContextManager[object]:
        """Held while the PLC is touched."""
        return self._simulator.lock

    @property
    def ends(self) -> tuple[int, int]:
        """Counts the ends of all connections: starts, and pulled cables."""
        return self._simulator.plc.starts, self._simulator.plc.cuts

    def late(self) -> ServedAccess:
        """Return an answer without words that leaves after the PLC's answer time."""
        return ServedAccess(delay_s=self._simulator.answer_s)

    def read(self, bank: Bank, address: int, count: int) -> ServedAccess:
        """Serve a client that reads registers."""
        with self._simulator.lock:
            now_ns = self._clock.now_ns()
            self._simulator.hear(now_ns)
            words = self._plain[bank][address : address + count]
            served = self.late()
            for place, start, end in self._parts(bank, address, count):
                first = place.first + start - place.start
                if place.written:
                    part = self._simulator.plc.program.inbox.words[first : first + end - start]
                else:
                    served = self._simulator.read(first, end - start, now_ns, self._link)
                    part = served.words
                if part:
                    words[start - address : end - address] = part
            return replace(served, words=tuple(words))

    def write(self, address: int, words: Sequence[int]) -> ServedAccess:
        """Serve a client that writes holding registers."""
        with self._simulator.lock:
            now_ns = self._clock.now_ns()
            self._simulator.hear(now_ns)
            self._plain[Bank.HOLDING][address : address + len(words)] = words
            served = self.late()
            for place, start, end in self._parts(Bank.HOLDING, address, len(words)):
                if place.written:
                    part = words[start - address : end - address]
                    served = self._simulator.write(start - place.start, part, now_ns, self._link)
            return served

    def switch(self, coil: int, bits: Sequence[int]) -> ServedAccess:
        """Serve a client that writes coils, and with them bits of holding registers."""
        with self._simulator.lock:
            first, last = coil // WORD_BITS, (coil + len(bits) - 1) // WORD_BITS
            words = self.peek(Bank.HOLDING, first, last - first + 1)
            for number, bit in enumerate(bits, coil - first * WORD_BITS):
                mask = 1 << number % WORD_BITS
                word = words[number // WORD_BITS]
                words[number // WORD_BITS] = word | mask if bit else word & ~mask
            return self.write(first, words)

    def read_bits(self, bank: Bank, address: int, count: int) -> ServedAccess:
        """Serve a client that reads coils or discrete inputs, which are bits of registers."""
        first, last = address // WORD_BITS, (address + count - 1) // WORD_BITS
        served = self.read(bank, first, last - first + 1)
        places = range(address - first * WORD_BITS, address - first * WORD_BITS + count)
        bits = (served.words[at // WORD_BITS] >> at % WORD_BITS & 1 for at in places)
        return replace(served, words=tuple(bits))

    def peek(self, bank: Bank, address: int, count: int) -> list[int]:
        """Return registers as part of another exchange."""
        with self._simulator.lock:
            plc = self._simulator.plc
            words = self._plain[bank][address : address + count]
            for place, start, end in self._parts(bank, address, count):
                first, size = place.first + start - place.start, end - start
                if place.written:
                    part = plc.program.inbox.words[first : first + size]
                else:
                    part = plc.read(first, size, self._simulator.now_ns)
                words[start - address : end - address] = part
            return words

    def _parts(
        self, bank: Bank, address: int, count: int
    ) -> Iterator[tuple[MailboxPlace, int, int]]:
        """Give each block that a range touches, and where the common part starts and ends."""
        for place in self._places:
            start, end = max(address, place.start), min(address + count, place.end)
            if place.bank is bank and start < end:
                yield place, start, end
