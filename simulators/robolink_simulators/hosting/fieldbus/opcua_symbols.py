"""What a PLC publishes over OPC UA, without the protocol: variables, and one exchange with them.

A request of a client is one exchange: however many variables it names, the plan of faults counts
it once, and without a fault all its values are of one instant. What CODESYS does there has not
been compared; the fault TEAR_NODES is the unkind answer.
"""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Final, Protocol

from robolink.protocols.mailbox import COMMAND, COMMAND_WORDS, RESPONSE_WORDS
from robolink.timing import Clock
from robolink_simulators.faults import Departure, Fault, LinkKind, PlcFault
from robolink_simulators.softmotion.mailbox.exchange import ServedAccess
from robolink_simulators.softmotion.mailbox.image import OUTPUT_WORDS
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

Value = bool | int | float | str
SymbolValue = Value | tuple[Value, ...]
"""Value of a variable; an array or a structure is a tuple."""

MAILBOX_LIST: Final = "RL_Symbols"
"""The list of the mailbox's variables, docs/reference/simulated-softmotion.md, "Field buses"."""

_HEARTBEAT: Final = COMMAND["client_heartbeat"].word
_FRAME_WORDS: Final = 2
"""Words around the response, which count the PLC's cycles."""
_SLOTS_WORDS: Final = OUTPUT_WORDS - RESPONSE_WORDS


@dataclass(frozen=True, slots=True)
class Symbol:
    """A variable of a global variable list.

    Attributes:
        variables: Name of the list.
        name: Of the variable.
        kind: Built-in type of OPC UA that it has, or its elements: ``UInt16``, ``Double``.
        length: Number of elements; ``None`` for a variable that is no array.
        writable: Whether clients may write it.
        node: Its number, as in ``ns=4;s=...``; empty for that which CODESYS would give it.
        fields: Of a structure, name and built-in type of each; its ``kind`` is empty then, and its
            value has one after the other.
    """

    variables: str
    name: str
    kind: str
    length: int | None = None
    writable: bool = False
    node: str = ""
    fields: tuple[tuple[str, str], ...] = ()

    @property
    def path(self) -> str:
        """List and name, as requests and fault plans have it."""
        return f"{self.variables}.{self.name}"


@dataclass(frozen=True, slots=True)
class ServedSymbols:
    """What comes of one exchange.

    Attributes:
        values: What was read, in the order of the request; empty for a write.
        departures: Returns what is sent instead of an answer, and when, from its bytes.
        met: For each variable the faults that only the server can do, as OF_OPCUA lists them.
        answered: Whether the server answers at all: an answer that it never makes leaves no gap
            in the numbers of its messages.
        stalled_s: How long the link carries nothing first; then the request is served anew.
    """

    values: tuple[SymbolValue, ...]
    departures: Callable[[bytes], Sequence[Departure]]
    met: tuple[tuple[Fault | PlcFault, ...], ...] = ()
    answered: bool = True
    stalled_s: float | None = None

    def meets(self, action: str, place: int | None = None) -> Any:  # noqa: ANN401 - of either family
        """Return the fault with this name that a variable meets, or any of them; else ``None``."""
        met = self.met if place is None else self.met[place : place + 1]
        return next((one for faults in met for one in faults if one.action.name == action), None)


class PublishedSymbols(Protocol):
    """The variables of a PLC as a server has them. Time is given, never taken."""

    @property
    def symbols(self) -> Sequence[Symbol]:
        """All of them."""

    @property
    def device(self) -> str:
        """Name of the controller in the tree."""

    @property
    def cycle_s(self) -> float:
        """The cycle of the PLC's task in simulated seconds."""

    @property
    def answer_s(self) -> float:
        """How long after a request its answer leaves, in simulated seconds."""

    @property
    def lock(self) -> AbstractContextManager[object]:
        """Held while the PLC is touched."""

    @property
    def ends(self) -> tuple[int, int]:
        """Counts the ends of all connections: starts of the PLC, and pulled cables."""

    def read(
        self, symbols: Sequence[Symbol], now_ns: int, *, counted: bool = False
    ) -> ServedSymbols:
        """Serve a client that reads variables in one request.

        Args:
            symbols: Which.
            now_ns: When.
            counted: Whether the request met its faults before, so that it meets none again.
        """

    def write(
        self, values: Sequence[tuple[Symbol, SymbolValue]], now_ns: int, *, counted: bool = False
    ) -> ServedSymbols:
        """Serve a client that writes variables in one request; as :meth:`read`."""

    def note(self, shown: str, now_ns: int) -> None:
        """Add a request to the record of the wire that goes no further."""

    def take_back(self, faults: Sequence[Any]) -> None:
        """Let faults that did not happen after all wait for the next request."""

    def peek(self, symbols: Sequence[Symbol], now_ns: int) -> tuple[SymbolValue, ...]:
        """Return values without an exchange: nothing is counted, and no fault is met."""


class MailboxSymbols:
    """The mailbox as three arrays of words and a heartbeat; see :class:`PublishedSymbols`.

    The program takes the heartbeat from its own variable: word 62 of the command array is not
    looked at, because whoever writes that array whole would overwrite another client's command.

    Args:
        simulator: The PLC.
        clock: The simulated time.
    """

    def __init__(self, simulator: SoftMotionSimulator, clock: Clock) -> None:
        self._simulator = simulator
        self._clock = clock
        of_list = MAILBOX_LIST
        self._command = Symbol(of_list, "command", "UInt16", COMMAND_WORDS, writable=True)
        self._heartbeat = Symbol(of_list, "heartbeat", "UInt16", writable=True)
        self._response = Symbol(of_list, "response", "UInt16", RESPONSE_WORDS + _FRAME_WORDS)
        self._slots = Symbol(of_list, "slots", "UInt16", _SLOTS_WORDS)

    @property
    def symbols(self) -> Sequence[Symbol]:
        """See :attr:`PublishedSymbols.symbols`."""
        return (self._command, self._response, self._slots, self._heartbeat)

    @property
    def device(self) -> str:
        """See :attr:`PublishedSymbols.device`."""
        return "Simulated SoftMotion PLC"

    @property
    def cycle_s(self) -> float:
        """See :attr:`PublishedSymbols.cycle_s`."""
        return self._simulator.options.group.cycle_us / 1e6

    @property
    def answer_s(self) -> float:
        """See :attr:`PublishedSymbols.answer_s`."""
        return self._simulator.answer_s

    @property
    def lock(self) -> AbstractContextManager[object]:
        """See :attr:`PublishedSymbols.lock`."""
        return self._simulator.lock

    @property
    def ends(self) -> tuple[int, int]:
        """See :attr:`PublishedSymbols.ends`."""
        return self._simulator.plc.starts, self._simulator.plc.cuts

    def read(
        self,
        symbols: Sequence[Symbol],
        now_ns: int,
        *,
        counted: bool = False,  # noqa: ARG002 - a stall delays what is written, not the link
    ) -> ServedSymbols:
        """See :meth:`PublishedSymbols.read`."""
        with self._simulator.lock:
            self._simulator.hear(now_ns)
            return self._together([self._read(symbol, now_ns) for symbol in symbols])

    def write(
        self,
        values: Sequence[tuple[Symbol, SymbolValue]],
        now_ns: int,
        *,
        counted: bool = False,  # noqa: ARG002 - as above
    ) -> ServedSymbols:
        """See :meth:`PublishedSymbols.write`."""
        with self._simulator.lock:
            self._simulator.hear(now_ns)
            return self._together([(None, self._write(*one, now_ns)) for one in values])

    def note(self, shown: str, now_ns: int) -> None:
        """See :meth:`PublishedSymbols.note`."""
        with self._simulator.lock:
            self._simulator.log.add(now_ns, ">", shown)

    def take_back(self, faults: Sequence[PlcFault]) -> None:
        """See :meth:`PublishedSymbols.take_back`."""
        with self._simulator.lock:
            for fault in faults:
                self._simulator.faults.take_back(fault)

    def peek(self, symbols: Sequence[Symbol], now_ns: int) -> tuple[SymbolValue, ...]:
        """See :meth:`PublishedSymbols.peek`."""
        with self._simulator.lock:
            self._simulator.advance(now_ns)
            return tuple(map(self._held, symbols))

    def _write(self, symbol: Symbol, value: Any, now_ns: int) -> ServedAccess:  # noqa: ANN401 - checked by the server
        if symbol == self._heartbeat:
            return self._simulator.write(_HEARTBEAT, (value,), now_ns, LinkKind.OPCUA)
        words = list(value)
        words[_HEARTBEAT] = self._simulator.plc.program.inbox.heartbeat
        return self._simulator.write(0, words, now_ns, LinkKind.OPCUA)

    def _held(self, symbol: Symbol) -> SymbolValue:
        plc, now_ns = self._simulator.plc, self._simulator.now_ns
        if symbol == self._response:
            return plc.framed(now_ns)
        if symbol == self._slots:
            return plc.read(RESPONSE_WORDS, _SLOTS_WORDS, now_ns)
        inbox = plc.program.inbox
        return inbox.heartbeat if symbol == self._heartbeat else inbox.words

    def _read(self, symbol: Symbol, now_ns: int) -> tuple[SymbolValue, ServedAccess]:
        if symbol == self._heartbeat:
            beat = self._simulator.read_back(_HEARTBEAT, 1, now_ns, LinkKind.OPCUA)
            return (beat.words or (0,))[0], beat
        if symbol == self._command:
            access = self._simulator.read_back(0, COMMAND_WORDS, now_ns, LinkKind.OPCUA)
        elif symbol == self._response:
            access = self._simulator.read_framed(now_ns)
        else:
            access = self._simulator.read(RESPONSE_WORDS, _SLOTS_WORDS, now_ns, LinkKind.OPCUA)
        return access.words, access

    def _together(self, served: Sequence[tuple[SymbolValue | None, ServedAccess]]) -> ServedSymbols:
        """Return what comes of the accesses of one request: the worst of each."""
        accesses = [access for _, access in served]
        whole = ServedAccess(
            delay_s=max(access.delay_s for access in accesses),
            answered=all(access.answered for access in accesses),
            cut=any(access.cut for access in accesses),
            met=tuple(fault for access in accesses for fault in access.met),
        )
        values = tuple(value for value, _ in served if value is not None)
        met = tuple(access.met for access in accesses)
        answered = whole.answered or whole.cut
        return ServedSymbols(values, whole.departures, met, answered=answered)
