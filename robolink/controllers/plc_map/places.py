"""Reads and writes the places of a map, one exchange at a time, whatever they are on the wire."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

from robolink import runtime
from robolink.checkpoints import Checkpoint, checkpoint
from robolink.interrupts import InterruptGate
from robolink.messages import tr
from robolink.register_maps import Cells, MapProbe, PlacedNumber
from robolink.stop_latch import CommandClass, StopLatch
from robolink.timing import AnswerTimes, Clock

TRIES: Final = 3
"""How often values are read again that were not the same in two readings."""


class Places(ABC):
    """The places of one map at one PLC.

    Attributes:
        identity: Which PLC this is.
        place: Where it was reached, the same for each spelling of the URL.
        clock: The clock on which its time passes.
        exchanges: Requests sent so far.
        answers: How long reads took to be answered.
        gate: Holds Ctrl-C back inside an exchange, and inside whatever else enters it.
        latch: Refuses writes while a stop is active.
    """

    def __init__(self, identity: str, place: str, clock: Clock) -> None:
        self.identity, self.place, self.clock = identity, place, clock
        self.exchanges = 0
        self.answers = AnswerTimes(clock)
        self.gate = InterruptGate()
        self.gate.open()
        self.latch = StopLatch(identity)
        self._writing = runtime.lock()

    @abstractmethod
    def require_fit(self) -> None:
        """Refuse a PLC that has other things at the places of the map, as far as it says so.

        Raises:
            RemoteProtocolError: It has; every place is named.
        """

    @abstractmethod
    def once(self, components: Mapping[str, Any]) -> Cells:
        """Return what stands at the places of numbers, read once: one may be half changed."""

    @abstractmethod
    def stable(self, components: Mapping[str, Any]) -> Cells:
        """Return the same as soon as two readings agree.

        Raises:
            RemoteProtocolError: No two readings in a row agree.
        """

    @abstractmethod
    def word(self, word: Any) -> int:  # noqa: ANN401 - each kind of place has its own
        """Return a whole number."""

    @abstractmethod
    def is_on(self, signal: Any) -> bool:  # noqa: ANN401 - as above
        """Return whether a signal is on; one that the map does not have is off."""

    @abstractmethod
    def switch(
        self,
        signal: Any,  # noqa: ANN401 - as above
        on: bool,
        *,
        kind: CommandClass = CommandClass.WRITE,
    ) -> None:
        """Switch a signal, in one request.

        Args:
            signal: Which one.
            on: Whether on.
            kind: What that does to the machine; a request that is taken back calms.

        Raises:
            StoppedError: A stop forbids it; it was not sent.
        """

    @abstractmethod
    def tell(self, word: Any, value: int) -> None:  # noqa: ANN401 - as above
        """Write a whole number; raises as :meth:`switch`."""

    @abstractmethod
    def write(self, cells: Cells) -> None:
        """Write values of one tool, in as few requests as can be; raises as :meth:`switch`."""

    @abstractmethod
    def write_requests(self, cells: Cells) -> tuple[str, ...]:
        """Return what :meth:`write` sends, in words."""

    @abstractmethod
    def require_writable(self, slot: Any) -> None:  # noqa: ANN401 - as above
        """Refuse a tool that cannot be written; sends nothing but questions.

        Raises:
            ToolError: The map says so.
            ConfigError, RejectedError: The link or the server does not let this program write.
        """

    @abstractmethod
    def own_number(self) -> str | None:
        """Return the number that the map knows this machine by, hexadecimal.

        ``None`` where it knows none, empty where a 0 stands there.
        """

    @abstractmethod
    def diagnosis(self, probe: MapProbe[Any]) -> str:
        """Return what to do about a probe that reads another value."""

    @abstractmethod
    def close(self) -> None:
        """Close the link. Idempotent."""

    def require_probe(self, probe: MapProbe[PlacedNumber] | None) -> tuple[float, float] | None:
        """Return what a probe should be and what it reads, ``None`` where the two are the same."""
        if probe is None:
            return None
        number = probe.number
        found = self.once({"": number})
        stored = [found[cell] for cell in number.cells]
        if stored == list(number.encode(probe.value)):
            return None
        return probe.value, number.decode(stored)

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
