"""Reads and writes the places of a map, one exchange at a time."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final, Protocol

from robolink import ambient
from robolink.checkpoints import Checkpoint, checkpoint
from robolink.errors import RemoteProtocolError
from robolink.interrupts import InterruptGate
from robolink.messages import tr
from robolink.register_maps import RegisterTable, Signal, Word, describe_place
from robolink.stop_latch import CommandClass, StopLatch
from robolink.timing import Clock

_TRIES: Final = 3


class RegisterClient(Protocol):
    """What the driver needs of a Modbus client, as ``open_modbus`` returns one."""

    @property
    def identity(self) -> str:
        """Which PLC this is."""

    @property
    def place(self) -> str:
        """Where it was reached, the same for each spelling of the URL."""

    @property
    def clock(self) -> Clock:
        """The clock on which its time passes."""

    @property
    def most_registers(self) -> int:
        """How many registers it gives in one read."""

    def read_holding(self, address: int, count: int) -> tuple[int, ...]:
        """Return holding registers."""

    def read_input(self, address: int, count: int) -> tuple[int, ...]:
        """Return input registers."""

    def read_coils(self, address: int, count: int) -> tuple[bool, ...]:
        """Return coils."""

    def read_discrete(self, address: int, count: int) -> tuple[bool, ...]:
        """Return discrete inputs."""

    def write_registers(self, address: int, values: Sequence[int]) -> None:
        """Write holding registers in one request."""

    def write_coil(self, address: int, value: bool) -> None:
        """Write one coil."""

    def close(self) -> None:
        """Close."""


class Registers:
    """The tables of one PLC.

    Attributes:
        identity: Which PLC this is.
        place: Where it was reached, the same for each spelling of the URL.
        clock: The clock on which its time passes.
        exchanges: Requests sent so far.
        gate: Holds Ctrl-C back inside an exchange, and inside whatever else enters it.
        latch: What holds writes back while a stop is in force.
    """

    def __init__(self, client: RegisterClient) -> None:
        self._client = client
        self.identity, self.place, self.clock = client.identity, client.place, client.clock
        self.exchanges = 0
        self.gate = InterruptGate()
        self.gate.open()
        self.latch = StopLatch(client.identity)
        self._writing = ambient.lock()

    def read(self, table: RegisterTable, addresses: range) -> tuple[int, ...]:
        """Return what stands there: in one request, or in parts where the server gives fewer.

        Parts may be of different moments: whoever needs them to belong together reads twice.
        """
        readers = {
            RegisterTable.HOLDING: self._client.read_holding,
            RegisterTable.INPUT: self._client.read_input,
            RegisterTable.COIL: self._client.read_coils,
            RegisterTable.DISCRETE: self._client.read_discrete,
        }
        words = table in (RegisterTable.HOLDING, RegisterTable.INPUT)
        most = self._client.most_registers if words else len(addresses)
        found: list[int] = []
        for start in range(addresses.start, addresses.stop, most):
            with self.gate:
                self.exchanges += 1
                found += map(int, readers[table](start, min(most, addresses.stop - start)))
        return tuple(found)

    def read_twice(self, table: RegisterTable, addresses: range) -> tuple[int, ...]:
        """Return what stands there as soon as two reads agree.

        A server may change registers between the words of one answer
        (docs/reference/softmotion.md 4.1, docs/reference/faults.md F31).

        Raises:
            RemoteProtocolError: No two reads in a row agree.
        """
        found = self.read(table, addresses)
        for _ in range(_TRIES):
            before, found = found, self.read(table, addresses)
            if found == before:
                return found
        raise RemoteProtocolError(
            tr(
                "The registers from {place} on are different at every reading.",
                place=describe_place(table, addresses.start),
            ),
            remedy=tr(
                "Compare the addresses in the map with the PLC's register list; or "
                "another program is writing them now."
            ),
            controller=self.identity,
        )

    def word(self, word: Word) -> int:
        """Return the number in one register."""
        return self.read(word.table, range(word.address, word.address + 1))[0]

    def is_on(self, signal: Signal | None) -> bool:
        """Tell whether a signal is on; one that the map does not have is off."""
        if signal is None:
            return False
        found = self.read(signal.table, range(signal.address, signal.address + 1))[0]
        if signal.bit is not None:
            found = found >> signal.bit & 1
        return found == signal.on

    def switch(self, signal: Signal, on: bool, *, kind: CommandClass = CommandClass.WRITE) -> None:
        """Switch a coil, or write a whole register.

        Args:
            signal: Which one.
            on: Whether on.
            kind: What that does to the machine; a request that is taken back calms.

        Raises:
            StoppedError: A stop forbids it; it was not sent.
        """
        value = signal.on if on else signal.off
        with self._admitted(signal.place, kind):
            self.exchanges += 1
            if signal.table is RegisterTable.COIL:
                self._client.write_coil(signal.address, bool(value))
            else:
                self._client.write_registers(signal.address, [value])

    def write(self, address: int, words: Sequence[int]) -> None:
        """Write holding registers in one request (function 16); raises like :meth:`switch`."""
        with self._admitted(describe_place(RegisterTable.HOLDING, address), CommandClass.WRITE):
            self.exchanges += 1
            self._client.write_registers(address, words)

    def close(self) -> None:
        """Close the link. Idempotent."""
        self._client.close()
        self.gate.close()

    @contextmanager
    def _admitted(self, place: str, kind: CommandClass) -> Iterator[None]:
        """Hold the lock of a write that no stop forbids."""
        request = tr("the write to {place}", place=place)
        checkpoint(Checkpoint.LOCK, request)
        try:
            with self.gate, self._writing:
                checkpoint(Checkpoint.HELD, request)
                self.latch.admit(kind, request)
                yield
        finally:
            checkpoint(Checkpoint.EXCHANGE, request)
