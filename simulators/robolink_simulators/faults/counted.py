"""Faults that wait for their request. Counted, never rolled."""

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from heapq import heappop, heappush
from typing import Any, Final, Generic, Protocol, TypeVar, cast

from robolink_simulators.device.wire_time import late_random
from robolink_simulators.faults.links import AnyAction, LinkKind, links_of, require_possible


class Planned(Protocol):
    """A fault that waits for its request."""

    @property
    def action(self) -> AnyAction:
        """What goes wrong."""

    @property
    def on_exchange(self) -> int:
        """Which of the requests that match, counted from 0."""

    @property
    def match(self) -> str:
        """Text that a counted request must contain; empty counts all."""

    @property
    def every(self) -> int:
        """0 for once; else the interval at which it keeps meeting matching requests."""


MOST_FIRED: Final = 2000
"""Number of fired faults that are reported: the latest ones."""

AnyFault = TypeVar("AnyFault", bound=Planned)


class _Waiting(Generic[AnyFault]):
    """Faults that count the same requests: how many came, and which fault each number meets."""

    def __init__(self) -> None:
        self.seen = 0
        self.due: list[tuple[int, int, AnyFault]] = []


class CountedFaults(Generic[AnyFault]):
    """Counts requests and hands out the faults that are due.

    Args:
        faults: What to plan; more may be added at any time.
        seed: Decides what no fault says: which byte and bit is garbled.
        links: The links on which the device may be served. A fault counts the requests of
            those on which it can happen.

    Attributes:
        fired: What has been handed out; at least the last :data:`MOST_FIRED`.
        times_fired: How often something was.
        on_fired: Told of each fault that is handed out, and of the request that it meets,
            passwords hidden. What it raises goes to the host.

    Raises:
        FaultNotPossibleError: There is no such fault on any of them.

    Example:
        >>> from robolink_simulators.faults import CountedFaults, Fault, FaultAction, LinkKind
        >>> lost = Fault(FaultAction.DROP_REQUEST, match="GetStatus", on_exchange=1)
        >>> faults = CountedFaults([lost], links={LinkKind.EPSON_TCP})
        >>> [len(faults.take(request)) for request in ("$GetStatus", "$Execute", "$GetStatus")]
        [0, 0, 1]
    """

    def __init__(
        self, faults: Iterable[AnyFault] = (), seed: int = 1, *, links: Collection[LinkKind]
    ) -> None:
        self.reseed(seed)
        self._links: Final = frozenset(links)
        self._groups: dict[tuple[str, frozenset[LinkKind]], _Waiting[AnyFault]] = {}
        self._added = 0
        self.fired: list[AnyFault] = []
        self.times_fired = 0
        self.on_fired: Callable[[AnyFault, str], None] | None = None
        for fault in faults:
            self.add(fault)

    def add(self, fault: AnyFault) -> None:
        """Plan one more; its count starts with the next request.

        Raises:
            FaultNotPossibleError: There is no such fault on any link of the device.
        """
        require_possible(fault.action, self._links)
        group = self._groups.setdefault((fault.match, links_of(fault.action)), _Waiting())
        self._added += 1
        heappush(group.due, (group.seen + fault.on_exchange, self._added, fault))

    def plan(self, faults: Iterable[Planned], seed: int, served: Collection[LinkKind]) -> None:
        """Plan the faults of a file, for a device that is served on certain links.

        Args:
            faults: What to plan.
            seed: Decides what no fault says.
            served: The links on which the device is served.

        Raises:
            FaultNotPossibleError: One of the faults can happen on none of these links. Nothing
                is planned then.

        Example:
            >>> from robolink_simulators.faults import CountedFaults, Fault, FaultAction, LinkKind
            >>> faults = CountedFaults(links={LinkKind.EPSON_TCP, LinkKind.EPSON_SERIAL})
            >>> faults.plan([Fault(FaultAction.DROP_REQUEST)], seed=7, served={LinkKind.EPSON_TCP})
            >>> len(faults.pending)
            1
        """
        wanted = tuple(faults)
        for fault in wanted:
            require_possible(fault.action, self._links.intersection(served) or served)
        self.reseed(seed)
        for fault in wanted:
            self.add(cast("AnyFault", fault))

    def reseed(self, seed: int) -> None:
        """Draw by another seed from here on."""
        self._random = late_random(f"faults {seed}")

    def clear(self) -> None:
        """Remove all plans; what fired stays in the list."""
        self._groups.clear()

    def forget(self) -> None:
        """Remove all plans, and what fired."""
        self.clear()
        self.fired.clear()
        self.times_fired = 0

    def require_possible(self, served: Collection[LinkKind]) -> None:
        """Refuse planned faults that can happen on none of the served links.

        Raises:
            FaultNotPossibleError: Names the first of them.
        """
        for fault in self.pending:
            require_possible(fault.action, served)

    @property
    def pending(self) -> tuple[AnyFault, ...]:
        """What has not fired yet, or continues, in the order in which it was planned."""
        waiting = [item for group in self._groups.values() for item in group.due]
        return tuple(fault for _, _, fault in sorted(waiting, key=lambda item: item[1]))

    def take_back(self, fault: AnyFault, request: str = "") -> None:
        """Let a fault that was handed out, but did not happen, wait for the next request.

        Args:
            fault: Which.
            request: What to wait for if the fault counts all requests.
        """
        if fault not in self.fired:  # forgotten meanwhile
            return
        self.fired.remove(fault)
        self.times_fired -= 1
        if not fault.every:  # otherwise the fault recurs by itself
            waiting: Any = fault
            self.add(replace(waiting, on_exchange=0, match=fault.match or request))

    def take(self, request: str, link: LinkKind | None = None) -> tuple[AnyFault, ...]:
        """Count one request and return the faults that it meets, in the order of planning.

        Args:
            request: What it is, passwords hidden.
            link: The link that it came over; ``None`` for any.
        """
        if not self._groups:
            return ()
        due: list[tuple[int, AnyFault]] = []
        for key, group in tuple(self._groups.items()):
            if key[0] not in request or (link is not None and link not in key[1]):
                continue
            while group.due and group.due[0][0] == group.seen:
                at, number, fault = heappop(group.due)
                due.append((number, fault))
                if fault.every:
                    heappush(group.due, (at + fault.every, number, fault))
            group.seen += 1
            if not group.due:
                del self._groups[key]
        faults = tuple(fault for _, fault in sorted(due, key=lambda item: item[0]))
        self.fired += faults
        self.times_fired += len(faults)
        if len(self.fired) > 2 * MOST_FIRED:
            del self.fired[:-MOST_FIRED]
        if self.on_fired is not None:
            for fault in faults:
                self.on_fired(fault, request)
        return faults
