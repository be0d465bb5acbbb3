"""What every part of this driver uses: registers, their map, and when both are valid.

Reads and writes the places of a map, one exchange at a time.

Whether the PLC is the one of the map: its constant, and the number that it is known by.

Wrong word order and addresses off by one are the mistakes that users of Modbus report most
(docs/reference/softmotion.md 4.4); both make plausible numbers.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import product
from typing import Final, NoReturn, Protocol

from robolink import runtime
from robolink.checkpoints import Checkpoint, checkpoint
from robolink.controllers.driver_link import DriverLink
from robolink.errors import (
    NotComparedError,
    NotReadyError,
    NotReadyReason,
    RejectedError,
    RemoteProtocolError,
)
from robolink.interrupts import InterruptGate
from robolink.messages import tr
from robolink.model import Identity, OutcomeLog
from robolink.register_maps import (
    Confirmation,
    MapProbe,
    MapValue,
    Number,
    RegisterMap,
    RegisterTable,
    Signal,
    Word,
    confirmation_of,
    describe_place,
)
from robolink.stop_latch import CommandClass, StopLatch
from robolink.timing import AnswerTimes, Clock

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
        """How many registers it returns in one read."""

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
        answers: How long reads took to be answered.
        gate: Holds Ctrl-C back inside an exchange, and inside whatever else enters it.
        latch: Refuses writes while a stop is active.
    """

    def __init__(self, client: RegisterClient) -> None:
        self._client = client
        self.identity, self.place, self.clock = client.identity, client.place, client.clock
        self.exchanges = 0
        self.answers = AnswerTimes(client.clock)
        self.gate = InterruptGate()
        self.gate.open()
        self.latch = StopLatch(client.identity)
        self._writing = runtime.lock()

    def read(self, table: RegisterTable, addresses: range) -> tuple[int, ...]:
        """Return the registers: in one request, or in parts if the server returns fewer.

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
                sent_ns = self.clock.now_ns()
                found += map(int, readers[table](start, min(most, addresses.stop - start)))
                self.answers.answered(sent_ns)
        return tuple(found)

    def read_twice(self, table: RegisterTable, addresses: range) -> tuple[int, ...]:
        """Return the registers as soon as two reads agree.

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
                "The registers from {place} on change at every reading.",
                place=describe_place(table, addresses.start),
            ),
            remedy=tr(
                "Compare the map's addresses with the PLC's; or another program writes them."
            ),
        )

    def word(self, word: Word) -> int:
        """Return the number in one register."""
        return self.read(word.table, range(word.address, word.address + 1))[0]

    def is_on(self, signal: Signal | None) -> bool:
        """Return whether a signal is on; one that the map does not have is off."""
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


_AROUND: Final = 8
"""Number of registers before and after its declared place that are searched."""


def _diagnosis(registers: Registers, probe: MapProbe) -> str:
    number = probe.number
    found = _found(registers, probe)
    if found is None:
        return tr("Check the unit in the URL, the map's addresses, and whether the PLC runs.")
    hints = []
    if found.address != number.address:
        hints.append(
            tr(
                "It was found at {place}: the addresses are off by {shift:+d}.",
                place=describe_place(found.table, found.address),
                shift=number.address - found.address,
            )
        )
    if found.low_word_first != number.low_word_first:
        order = "low_first" if found.low_word_first else "high_first"
        hints.append(tr('Set word_order = "{order}".', order=order))
    if found.swapped_bytes != number.swapped_bytes:
        order = "little" if found.swapped_bytes else "big"
        hints.append(tr('Set byte_order = "{order}".', order=order))
    return " ".join(hints)


def _found(registers: Registers, probe: MapProbe) -> Number | None:
    """Search for the constant in every order, nearest first."""
    number = probe.number
    count = len(number.registers)
    start = max(0, number.address - _AROUND)
    stop = min(0x10000, number.registers.stop + _AROUND)
    try:
        words = registers.read(number.table, range(start, stop))
    except RejectedError:  # the table may end sooner; then read only the declared place
        start, stop = number.registers.start, number.registers.stop
        words = registers.read(number.table, number.registers)
    places = sorted(range(start, stop - count + 1), key=lambda at: abs(at - number.address))
    for at, low_first, swapped in product(places, (True, False), (False, True)):
        tried = replace(number, address=at, low_word_first=low_first, swapped_bytes=swapped)
        if words[at - start : at - start + count] == tried.encode(probe.value):
            return tried
    return None


class MappedPlc(DriverLink):
    """One PLC that is reached through a map.

    Attributes:
        registers: The PLC's tables.
        register_map: Where everything stands.

    Args:
        client: An open Modbus client.
        register_map: Where everything stands.
        outcomes: Where doubtful outcomes of this PLC are kept.
        simulated: Whether it is a simulator's address.
    """

    def __init__(
        self,
        client: RegisterClient,
        register_map: RegisterMap,
        outcomes: OutcomeLog,
        *,
        simulated: bool,
    ) -> None:
        self._simulated = simulated
        registers = self.registers = Registers(client)
        self.register_map = register_map
        outcomes.ask(self.read_identity)
        super().__init__(
            client.identity, registers.clock, registers.latch, outcomes, gate=registers.gate
        )

    @property
    def simulated(self) -> bool:
        """Whether it is a simulator's address; the registers of a machine do not show it."""
        return self._simulated

    @property
    def permitted(self) -> bool:
        """Whether the machine permits changes now; always if it has no permit."""
        permit = self.register_map.permit
        return permit is None or self.registers.is_on(permit)

    def no_motion(self) -> RejectedError:
        """Return the error for anything that would move, stop or switch the machine."""
        return RejectedError(
            tr("robolink neither moves nor stops a PLC with a register map."),
            remedy=tr("Do it at the machine; in danger press the emergency stop."),
        )

    def read_identity(self) -> Identity:
        """Return who it is: by its own number, if the map says where that is.

        Raises:
            TransportError, RemoteProtocolError: The link failed, or the number does not stand
                still.
            RejectedError: The PLC has no such registers.
        """
        address, place = self.registers.identity, f"plc@{self.registers.place}"
        number = self.register_map.device_id
        if number is None:
            return Identity(place, address, place)
        words = self.registers.read_twice(number.table, number.registers)
        if not any(words):
            # A watchdog cleared the registers, or the program has not started
            # (docs/reference/softmotion.md 4.1).
            return Identity(place, address, place, certain=False)
        return Identity(f"plc:{''.join(f'{word:04X}' for word in words)}", address, place)

    def who(self) -> Identity:
        """Return which PLC this is: what a person confirms about a map is valid for that one.

        Raises:
            TransportError, RemoteProtocolError: The link failed, or its number does not stand
                still.
            NotReadyError: The map knows where the PLC's number stands, and there is none now.
        """
        found = self.read_identity()
        if found.certain:
            return found
        raise NotReadyError(
            tr(
                "The number that identifies {identity} in the map reads zero.",
                identity=self.identity,
            ),
            reason=NotReadyReason.NOT_REMOTE,
            remedy=tr("Nothing was written. Check that the PLC's program runs, then try again."),
        )

    def require_probe(self) -> None:
        """Compare the PLC's constant with the map's, if there is one.

        Raises:
            RemoteProtocolError: It differs; says what the map should say, if that can be found.
        """
        probe = self.register_map.probe
        if probe is None:
            return
        number = probe.number
        words = self.registers.read(number.table, number.registers)
        if words == number.encode(probe.value):
            return
        raise RemoteProtocolError(
            tr(
                "The probe at {place} should be {value:g}, but reads {found:g}.",
                place=number.place,
                value=probe.value,
                found=number.decode(words),
            ),
            remedy=_diagnosis(self.registers, probe),
        )

    def require_ready(self, tool: int) -> None:
        """Refuse a write if the map is not confirmed, or the machine refuses."""
        self.require_known_place(tool)
        self.require_probe()
        permit = self.register_map.permit
        if permit is not None and not self.registers.is_on(permit):
            raise NotReadyError(
                tr("The machine does not permit changes now ({place}).", place=permit.place),
                reason=NotReadyReason.NOT_REMOTE,
                remedy=tr("Nothing was written. Permit them at the machine, then try again."),
            )

    def require_known_place(self, tool: int) -> None:
        """Refuse a change of a tool whose values were never compared; writes nothing.

        Raises:
            NotComparedError: Nobody has, with this map at this PLC.
        """
        confirmation = self._confirmation()
        if confirmation is None or not confirmation.knows_tool(tool):
            self._refuse(tool, tuple(self.register_map.slots[tool].components))

    def require_compared(self, tool: int, components: tuple[str, ...]) -> None:
        """Refuse a change of components that were never compared; writes nothing.

        Args:
            tool: Number of the tool.
            components: Those that would change.

        Raises:
            NotComparedError: One was not, with this map at this PLC.
        """
        confirmation = self._confirmation()
        missing = confirmation.missing(self.register_map) if confirmation is not None else []
        lacking = tuple(name for name in components if MapValue(tool, name) in missing)
        if lacking or confirmation is None:
            self._refuse(tool, lacking or components)

    def _confirmation(self) -> Confirmation | None:
        return confirmation_of(self.who().name, self.register_map)

    def _refuse(self, tool: int, components: tuple[str, ...]) -> NoReturn:
        raise NotComparedError(
            tr(
                "Nobody has compared {values} of the map {name!r} with the screen at {identity}.",
                values=", ".join(f"{tool}.{name}" for name in components),
                name=self.register_map.name,
                identity=self.identity,
            ),
            tool=tool,
            components=components,
            remedy=tr("Nothing was written. Compare them there: robolink expert plc check-map"),
        )
