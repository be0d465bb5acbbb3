"""The time by which two machines measure each other's silence.

A client at the other end of a real wire lives in real time, however simulated time is hastened:
at twenty times its pace a minute of silence would be three seconds, and 500 ms between two
heartbeats 25 ms, which a busy computer needs for nothing at all. So such patience is counted in
simulated seconds that pass no faster than real ones. Where simulated time runs in step with real
time or behind it, and in the process, where a client itself lets it pass, the two are the same.
"""

import random
from collections.abc import Callable
from typing import Any, Protocol, cast


class WireClock(Protocol):
    """A clock with both times."""

    def now_ns(self) -> int:
        """Return the simulated time."""

    def wire_at(self, now_ns: int) -> int:
        """Return the time on the wire at a simulated instant that is hardly past."""

    def simulated_at(self, wire_ns: int) -> int:
        """Return when, at the present pace, the wire time has that value."""


class WireTime:
    """The time by which a simulated controller measures silence; its given time without a host.

    Attributes:
        clock: That of its host, or none.
    """

    __slots__ = ("clock",)

    def __init__(self) -> None:
        self.clock: WireClock | None = None

    def at(self, now_ns: int) -> int:
        """Return the time on the wire at a simulated instant that is hardly past, in ns."""
        return now_ns if self.clock is None else self.clock.wire_at(now_ns)

    def simulated_at(self, wire_ns: int) -> int:
        """Return the simulated instant, in ns, at which the wire's time is or was that.

        Of a time to come it is an estimate, right as long as the pace stays: ask again.
        """
        return wire_ns if self.clock is None else self.clock.simulated_at(wire_ns)


class _LateRandom:
    """Stands for a generator that is made at first use."""

    __slots__ = ("__dict__", "_first", "_generator", "_seed")

    def __init__(self, seed: str, first: Callable[[random.Random], object] | None) -> None:
        self._seed = seed
        self._first = first
        self._generator: random.Random | None = None

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever a generator has
        if name.startswith("__"):
            raise AttributeError(name)
        if self._generator is None:
            self._generator = random.Random(self._seed)
            if self._first is not None:
                self._first(self._generator)
        found = getattr(self._generator, name)
        if callable(found):  # a method: it is found at once from here on
            self.__dict__[name] = found
        return found


def late_random(
    seed: str, *, first: Callable[[random.Random], object] | None = None
) -> random.Random:
    """Return a generator like ``random.Random(seed)``, made late; thousands of cells draw nothing.

    Args:
        seed: Its seed.
        first: Draws what was drawn from it already.
    """
    return cast("random.Random", _LateRandom(seed, first))
