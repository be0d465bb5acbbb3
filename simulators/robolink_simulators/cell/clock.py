"""Clocks for simulated time: one that a test steps, and one at a factor of real time."""

import threading
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.timing import NS_PER_S, Clock, SystemClock

_LOOK_S: Final = 0.05
"""Longest time in seconds until a sleeping thread notices that the pace has changed."""

_PAUSED_S: Final = 86_400.0

EXCHANGE_S: Final = 0.05
"""Simulated duration of a request in seconds, used in tests and where time does not pass by itself.
A client that polls the progress of a movement then needs no waits of its own.
"""


class ManualClock:
    """A clock that stands still until someone waits on it or advances it. Thread-safe.

    Args:
        start_ns: The time at first.
    """

    def __init__(self, start_ns: int = 0) -> None:
        self._lock = threading.Lock()
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Return the simulated time in nanoseconds."""
        return self._now_ns

    def exchanged(self) -> None:
        """Learn that a request has come in; time passes if somebody waits for it."""

    def sleep(self, seconds: float) -> None:
        """Let ``seconds`` pass at once."""
        self.advance(max(0.0, seconds))

    def advance(self, seconds: float) -> None:
        """Move the time forward.

        Raises:
            ConfigError: ``seconds`` is negative.
        """
        if seconds < 0:
            raise ConfigError(
                tr("A clock cannot go back by {seconds} s.", seconds=-seconds),
                remedy=tr("Advance by zero or more seconds."),
            )
        with self._lock:
            self._now_ns += round(seconds * NS_PER_S)

    def advance_to(self, now_ns: int) -> None:
        """Move the time forward to ``now_ns``; an instant that has passed changes nothing."""
        with self._lock:
            self._now_ns = max(self._now_ns, now_ns)

    def wire_at(self, now_ns: int) -> int:
        """See :class:`~robolink_simulators.device.wire_time.WireClock`: clients wait by it, too."""
        return now_ns

    def simulated_at(self, wire_ns: int) -> int:
        """See :meth:`wire_at`."""
        return wire_ns


class ScaledClock:
    """Simulated time that runs ``factor`` times as fast as another clock.

    Args:
        factor: Simulated seconds per second of ``base``; above zero.
        base: The clock that really passes.

    Raises:
        ConfigError: ``factor`` is not above zero.
    """

    def __init__(self, factor: float = 1.0, base: Clock | None = None) -> None:
        if not 0 < factor < float("inf"):
            raise ConfigError(
                tr("Simulated time cannot run at a factor of {factor}.", factor=factor),
                remedy=tr("Give a number above zero, for example 1 or 10."),
            )
        self._factor = factor
        self._base = base or SystemClock()
        self._origin_ns = self._base.now_ns()
        self._hastened = factor > 1

    def exchanged(self) -> None:
        """Learn that a request has come in; time passes anyway."""

    def stepped(self, seconds: float) -> bool:  # noqa: ARG002 - it does not stand still
        """Let simulated time pass at once where it stands still; False where it passes anyway."""
        return False

    def now_ns(self) -> int:
        """Return the simulated time in nanoseconds."""
        passed_ns = self._base.now_ns() - self._origin_ns
        return self._origin_ns + (passed_ns if self._factor == 1 else int(passed_ns * self._factor))

    def sleep(self, seconds: float) -> None:
        """Block until ``seconds`` of simulated time have passed."""
        self._base.sleep(seconds / self._factor)

    def real_seconds(self, until_ns: int, now_ns: int | None = None) -> float:
        """Return how long it really takes until the simulated instant, 0.0 when it passed.

        Args:
            until_ns: The instant.
            now_ns: The simulated time, where it was read a moment ago.
        """
        left_ns = until_ns - (self.now_ns() if now_ns is None else now_ns)
        return left_ns / NS_PER_S / self._factor if left_ns > 0 else 0.0

    def really_takes_s(self, seconds: float) -> float:
        """Return how many seconds of the base clock these simulated ones take."""
        return seconds / self._factor

    def wire_at(self, now_ns: int) -> int:
        """Return the wire time, which is never sped up, at a simulated instant, in ns.

        See :class:`~robolink_simulators.device.wire_time.WireClock`. Right for an instant since
        the pace was changed last.
        """
        if not self._hastened:
            return now_ns
        wire_ns, there_ns = self._both_now()
        return wire_ns + int((now_ns - there_ns) / max(1.0, self._factor))

    def simulated_at(self, wire_ns: int) -> int:
        """Return the simulated instant of a wire time, at the present pace; see above."""
        if not self._hastened:
            return wire_ns
        passed_ns, there_ns = self._both_now()
        return there_ns + int((wire_ns - passed_ns) * max(1.0, self._factor))

    def _both_now(self) -> tuple[int, int]:
        """Return the wire time and the simulated time, both of this instant."""
        now_ns = self.now_ns()
        passed_ns = (now_ns - self._origin_ns) / max(1.0, self._factor)
        return self._origin_ns + int(passed_ns), now_ns


class SteeredClock(ScaledClock):
    """Simulated time whose pace is changed while it runs, or that is paused and stepped.

    Args:
        factor: Simulated seconds per second of ``base``; 0 pauses.
        base: The clock that really passes.
        exchange_s: Simulated seconds that pass with each request besides: a client that looks
            how far a movement is then waits for it no longer than it looks. With a factor of 0
            time passes with requests alone.

    Raises:
        ConfigError: A number is negative, or not finite.
    """

    def __init__(
        self, factor: float = 1.0, base: Clock | None = None, *, exchange_s: float = 0.0
    ) -> None:
        super().__init__(1.0, base)
        if not 0 <= exchange_s < float("inf"):
            raise ConfigError(
                tr("An exchange cannot take {seconds} simulated seconds.", seconds=exchange_s),
                remedy=tr("Give 0 or more."),
            )
        self._exchange_s = exchange_s
        self._lock = threading.Lock()
        self._since_ns = self._held_ns = self._wire_ns = self._origin_ns
        self.run(factor)

    @property
    def factor(self) -> float:
        """Simulated seconds per real one; 0 in a pause."""
        return self._factor

    def run(self, factor: float) -> None:
        """Continue at another factor; 0 pauses.

        Raises:
            ConfigError: It is negative, or not finite.
        """
        if not 0 <= factor < float("inf"):
            raise ConfigError(
                tr("Simulated time cannot run at a factor of {factor}.", factor=factor),
                remedy=tr("Give a number above zero, for example 1 or 10."),
            )
        with self._lock:
            base_ns = self._base.now_ns()
            self._wire_ns, self._held_ns = self._on_wire(base_ns), self._at(base_ns)
            self._since_ns, self._factor = base_ns, factor
            self._hastened |= factor > 1

    def advance(self, seconds: float) -> None:
        """Let so many simulated seconds pass at once."""
        with self._lock:
            self._held_ns += round(max(0.0, seconds) * NS_PER_S)
            self._hastened = True

    def exchanged(self) -> None:
        """Let pass what a request takes."""
        if self._exchange_s:
            self.advance(self._exchange_s)

    def stepped(self, seconds: float) -> bool:
        """See :meth:`ScaledClock.stepped`."""
        if self._factor:
            return False
        self.advance(seconds)
        return True

    def now_ns(self) -> int:
        """Return the simulated time in nanoseconds."""
        with self._lock:
            return self._at(self._base.now_ns())

    def sleep(self, seconds: float) -> None:
        """Block until ``seconds`` of simulated time have passed, at whatever pace."""
        until_ns = self.now_ns() + round(seconds * NS_PER_S)
        while (left_s := self.real_seconds(until_ns)) > 0:
            self._base.sleep(min(left_s, _LOOK_S))

    def real_seconds(self, until_ns: int, now_ns: int | None = None) -> float:
        """Return how long it really takes until an instant, at this pace; a day if paused."""
        left_s = max(0, until_ns - (self.now_ns() if now_ns is None else now_ns)) / NS_PER_S
        return left_s / self._factor if self._factor else left_s and _PAUSED_S

    def really_takes_s(self, seconds: float) -> float:
        """Return how many seconds of the base clock these simulated ones take, at this pace."""
        return seconds / self._factor if self._factor else seconds and _PAUSED_S

    def _at(self, base_ns: int) -> int:
        return self._held_ns + int((base_ns - self._since_ns) * self._factor)

    def _on_wire(self, base_ns: int) -> int:
        return self._wire_ns + int((base_ns - self._since_ns) * min(1.0, self._factor))

    def _both_now(self) -> tuple[int, int]:
        with self._lock:
            base_ns = self._base.now_ns()
            return self._on_wire(base_ns), self._at(base_ns)
