"""A Modbus client for a PLC's registers and coils, over TCP or a serial line.

Nothing is sent twice and no connection is renewed by itself
(docs/decisions/0004-no-silent-retry.md). Addresses count from 0, as on the wire.
"""

from collections.abc import Callable, Sequence
from typing import Final, Protocol

from robolink import runtime
from robolink.errors import (
    ConfigError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.timing import Deadline
from robolink.transport.byte_stream import Transport
from robolink.transport.modbus.errors import refused
from robolink.transport.modbus.frames import (
    MOST_BITS_READ,
    MOST_REGISTERS_READ,
    MOST_REGISTERS_WRITTEN,
    WRITE_COIL,
    WRITE_REGISTERS,
    Area,
    ModbusReply,
    ModbusRequest,
)

_RETRY_S: Final = 0.75
"""Longest time for all repeats of an unanswered request together, in s."""

_REACTION_S: Final = 0.2
"""Reaction time of a server, in s, on a line so slow that it matters."""


class Exchange(Protocol):
    """Asks one question at a time; the caller holds the lock."""

    @property
    def recovers(self) -> bool:
        """Whether it can be used again after a time-out or an invalid answer."""

    @property
    def units(self) -> range:
        """The units that can be asked."""

    def takes_s(self, sent_bytes: int, answered_bytes: int) -> float:
        """Return how long frames of so many bytes take on the line; 0 on a network.

        Counted are the bytes behind the unit and before the checksum, as in a PDU.
        """

    def ask(self, request: ModbusRequest, deadline: Deadline) -> ModbusReply:
        """Send ``request`` once and return its own answer, which may be a refusal.

        Raises:
            TransportError: No answer, or no link.
            RemoteProtocolError: An answer that makes no sense.
        """


class ModbusClient:
    """Reads and writes the tables of one server. Thread-safe: one exchange at a time.

    Args:
        transport: Carries the bytes; owned by the client.
        exchange: How requests and answers pass over it.
        identity: Names the far end: the URL, with the unit where it is not the usual one.
        unit: Asked unless a call names another.
        timeout_s: Longest time for one request and its whole answer.
        most_registers: How many registers the server gives in one read; the standard allows 125,
            some give 61 or 50.

    Each method that reads or writes raises:
        ConfigError: The address, the count or a value cannot be sent; nothing was.
        RejectedError: The server refused; it did nothing.
        TransportTimeoutError: No answer. A write may have been done.
        TransportBrokenError, TransportClosedError: The link has ended.
        RemoteProtocolError: The answer makes no sense, or leaves open what was done.
    """

    def __init__(
        self,
        transport: Transport,
        exchange: Exchange,
        *,
        identity: str,
        unit: int,
        timeout_s: float,
        most_registers: int = MOST_REGISTERS_READ,
    ) -> None:
        self.most_registers = most_registers
        self._transport = transport
        self._exchange = exchange
        self.identity, self.clock = identity, transport.clock
        self._unit = unit
        self._timeout_s = timeout_s
        self._lock = runtime.lock()
        self._repeats_until: Deadline | None = None

    @property
    def place(self) -> str:
        """Where it was reached; the unit only where it is not the usual one."""
        unit = self.identity.partition("?")[2]
        return f"{self._transport.place}?{unit}" if unit else self._transport.place

    def read_takes_s(self, count: int) -> float:
        """Return how long a read of so many registers takes on the line alone; 0 on a network."""
        return self._exchange.takes_s(5, 2 + 2 * count)

    def write_takes_s(self, count: int) -> float:
        """Return how long a write of so many registers takes on the line alone; 0 on a network."""
        return self._exchange.takes_s(6 + 2 * count, 5)

    def read_holding(self, address: int, count: int, *, unit: int | None = None) -> tuple[int, ...]:
        """Return holding registers (function 3), at most ``most_registers``."""
        return self._read(Area.HOLDING, address, count, unit)

    def read_input(self, address: int, count: int, *, unit: int | None = None) -> tuple[int, ...]:
        """Return input registers (function 4), at most ``most_registers``."""
        return self._read(Area.INPUT, address, count, unit)

    def read_coils(self, address: int, count: int, *, unit: int | None = None) -> tuple[bool, ...]:
        """Return coils (function 1), at most 2000."""
        return tuple(map(bool, self._read(Area.COILS, address, count, unit)[:count]))

    def read_discrete(
        self, address: int, count: int, *, unit: int | None = None
    ) -> tuple[bool, ...]:
        """Return discrete inputs (function 2), at most 2000."""
        return tuple(map(bool, self._read(Area.DISCRETE, address, count, unit)[:count]))

    def write_registers(
        self,
        address: int,
        values: Sequence[int],
        *,
        unit: int | None = None,
        admit: Callable[[], None] = lambda: None,
    ) -> None:
        """Write holding registers in one request (function 16), at most 123.

        Args:
            address: Of the first.
            values: The words.
            unit: Asked in place of the usual one.
            admit: Asked when nothing else is under way on the link. If it raises, nothing is
                written, and the link stays: it has to carry a stop.
        """
        if values and not (min(values) >= 0 and max(values) <= 0xFFFF):
            raise ConfigError(
                tr("A register holds 0 to 65535."),
                remedy=tr("Check the values; a negative number is sent plus 65536."),
                controller=self.identity,
            )
        self._write(WRITE_REGISTERS, Area.HOLDING, address, tuple(values), unit, admit)

    def write_coil(self, address: int, value: bool, *, unit: int | None = None) -> None:
        """Write one coil (function 5)."""
        self._write(WRITE_COIL, Area.COILS, address, (int(value),), unit)

    def close(self) -> None:
        """Close. Idempotent; any thread may call it at any time."""
        self._transport.close()

    def _read(self, area: Area, address: int, count: int, unit: int | None) -> tuple[int, ...]:
        bits = area in (Area.COILS, Area.DISCRETE)
        self._require_range(area, address, count, MOST_BITS_READ if bits else self.most_registers)
        request = ModbusRequest(self._asked(unit), area.read_function, area, address, count)
        return self._ask(request).values

    def _write(
        self,
        function: int,
        area: Area,
        address: int,
        values: tuple[int, ...],
        unit: int | None,
        admit: Callable[[], None] = lambda: None,
    ) -> None:
        self._require_range(area, address, len(values), MOST_REGISTERS_WRITTEN)
        request = ModbusRequest(self._asked(unit), function, area, address, len(values), values)
        self._ask(request, admit)

    def _asked(self, unit: int | None) -> int:
        asked = self._unit if unit is None else unit
        units = self._exchange.units
        if asked in units:
            return asked
        raise ConfigError(
            tr("Modbus unit {unit} cannot be asked here.", unit=asked),
            remedy=tr("Give a unit from {first} to {last}.", first=units[0], last=units[-1]),
            controller=self.identity,
        )

    def _require_range(self, area: Area, address: int, count: int, most: int) -> None:
        if address >= 0 and 1 <= count <= most and address + count <= 0x10000:
            return
        raise ConfigError(
            tr(
                "{count} from {reference} (address {address}) cannot be asked for at once.",
                count=count,
                reference=area.reference(address),
                address=address,
            ),
            remedy=tr(
                "Addresses go from 0 to 65535, and one request carries at most {most}.", most=most
            ),
            controller=self.identity,
        )

    def _ask(self, request: ModbusRequest, admit: Callable[[], None] = lambda: None) -> ModbusReply:
        with self._lock:
            admit()
            deadline = self._deadline()
            try:
                reply = self._exchange.ask(request, deadline)
                if reply.refusal is not None:
                    raise refused(self.identity, request, reply.refusal)
            except RobolinkError as error:
                error.concern(self.identity)
                silent = isinstance(error, TransportTimeoutError)
                if self._exchange.recovers and (silent or isinstance(error, RemoteProtocolError)):
                    if silent and self._repeats_until is None:
                        self._repeats_until = Deadline.after(self.clock, self._retry_s)
                elif not isinstance(error, RejectedError):
                    self._transport.close()
                raise
            self._repeats_until = None
            return reply

    def _deadline(self) -> Deadline:
        """Return when to give up the next question.

        On a line that answered nothing, repeats share one short deadline: a PLC that lost its
        power is noticed soon after the first, and one lost answer ends nothing.
        """
        whole, repeats = Deadline.after(self.clock, self._timeout_s), self._repeats_until
        if repeats is not None and not repeats.expired:
            return min(whole, repeats, key=lambda one: one.at_ns)
        self._repeats_until = None
        return whole

    @property
    def _retry_s(self) -> float:
        """Time for the question that finds the place on a line again, and for the repeat."""
        return max(_RETRY_S, 2 * self.read_takes_s(MOST_REGISTERS_READ) + _REACTION_S)
