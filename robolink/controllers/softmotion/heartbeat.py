"""Two heartbeats: whether the PLC's motion task still runs, and when ours is due.

When to look for something new, above all for the end of a movement: as often as it is worth, for
each look costs the PLC and the network an exchange. When a movement is likely to end decides that,
and nothing else.

Whose turn it is on the wire: the beat of who waits on a movement goes before everything.

A link carries one exchange at a time, and on a slow serial line one read of the response block
takes a quarter of a second (docs/reference/softmotion.md 4.2). A thread that reads and reads would
keep the waiter from beating for longer than the PLC bears. So while somebody waits on a movement,
every other thread is let in by the waiter alone: one exchange, just after a beat, before the
waiter's own. Then no two exchanges lie between two beats. On a network, where an exchange takes
milliseconds, the others also have the wire while the waiter pauses between two looks.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Final

from robolink import runtime
from robolink.protocols.mailbox import Six, heartbeat_word
from robolink.timing import NS_PER_S

FROZEN_S: Final = 1.0
"""Time without a new count after which a motion task counts as dead, in s: a running one counts
every few milliseconds."""

BUSY_BEAT_S: Final = 0.05
"""Interval between beats while something moves, in s: the PLC halts the movement after 0.5 s
without one.

The rest of that half second is left for a computer that is busy.
"""

PAUSED_BEAT_S: Final = 0.08
"""Usual interval between beats where there is no look between them, in s; the longest is
:data:`MOST_OVER` times that."""

MOST_OVER: Final = 1.25
"""Factor by which an interval may be longer than usual, so that none ends just before another."""

MOST_LOOK_S: Final = 0.4
"""Longest time on the line for a whole look and a beat, in s. On a slower line nothing may move: no
beat would arrive within the PLC's 0.5 s, part of which the PLC and the adapters need."""

IDLE_BEAT_S: Final = 1.0
"""Interval between beats at rest, in s: an owner that is silent for 10 s may be replaced."""


def shared_out(whole_s: float, usual_s: float) -> float:
    """Return the length of equal intervals that a time has room for, of about the usual one."""
    return whole_s / max(1, math.ceil(whole_s / usual_s - (MOST_OVER - 1)))


class PlcHeartbeat:
    """Notes the PLC's heartbeat wherever it is read."""

    def __init__(self) -> None:
        self._count = -1
        self._since_ns = 0
        self._looks = 0

    def note(self, count: int, now_ns: int) -> None:
        """Note the value that was just read."""
        if count != self._count:
            self._count, self._since_ns, self._looks = count, now_ns, 0
        self._looks += 1

    def frozen(self, now_ns: int) -> bool:
        """Whether the count has not changed under close observation.

        Two equal counts far apart prove nothing: the counter wraps.
        """
        return self._looks > 2 and now_ns - self._since_ns >= FROZEN_S * NS_PER_S


class ClientHeartbeat:
    """Makes the client's heartbeat words."""

    def __init__(self) -> None:
        self._count = 0
        self._last_ns: int | None = None

    def due(self, now_ns: int, *, busy: bool, ahead: bool = False) -> bool:
        """Whether it is time for the next word.

        Args:
            now_ns: The time.
            busy: Whether something moves.
            ahead: Whether an exchange follows that takes a good part of the PLC's patience.
        """
        period_s = (0.0 if ahead else BUSY_BEAT_S) if busy else IDLE_BEAT_S
        return self._last_ns is None or now_ns - self._last_ns >= period_s * NS_PER_S

    def word(self, epoch: int, now_ns: int) -> int:
        """Return the next word of the owner of ``epoch``."""
        self._last_ns = now_ns
        self._count += 1
        return heartbeat_word(epoch, self._count)

    def again(self, epoch: int) -> int:
        """Return the last word once more, which is no sign of life; 0 would be an end."""
        return heartbeat_word(epoch, self._count)


POLL_S: Final = 0.04
"""Longest time between two looks at the head of the response block, in s."""

_SHORTEST_POLL_S: Final = 0.0005
_POLLS_PER_WAIT: Final = 4
"""Number of looks in the time waited so far, so that the looks prolong each wait only slightly.

Most commands end within one or two PLC cycles; if a look itself takes that long, the next one
follows at once.
"""

LOOK_S: Final = 0.3
"""Longest time between two snapshots while waiting for something, in s."""


def poll_period_s(waited_s: float) -> float:
    """Return the time between two looks, in s, after waiting so long."""
    return min(max(waited_s / _POLLS_PER_WAIT, _SHORTEST_POLL_S), POLL_S)


FIRST_LOOK_S: Final = 0.05
"""Time until the first look at a movement of which nothing is known, in s."""

_LATE_S: Final = 0.008
"""Time in s by which a PLC begins later and reports the end later: two cycles of 4 ms."""

_SHORTEST_WATCH_S: Final = 0.004
"""Shortest time from look to look at a movement, in s: nothing changes within a usual cycle."""

_WATCHES_PER_WAIT: Final = 3
"""Number of looks, behind the expected end, in the time that has passed since."""

_WATCHES_UNFORESEEN: Final = 10
"""Number of looks in the time that a movement has taken of which no end can be expected."""

_MIDDLE: Final = 0.5
_NO_WAY: Final = 1e-6


def watch_period_s(waited_s: float) -> float:
    """Return the time until the next look at a movement that may end at any moment, in s.

    Args:
        waited_s: How long it has taken so far.
    """
    return max(FIRST_LOOK_S - waited_s, min(waited_s / _WATCHES_UNFORESEEN, POLL_S))


class ExpectedEnd:
    """When a movement is likely to end, for how often to look; nothing else follows from it.

    A straight movement takes as long as its numbers say, unless it turns far, or the machine has an
    override. A movement that brakes as it accelerates takes twice the time to its middle. One that
    leads nowhere takes no time.

    Args:
        start: Where its tip begins.
        target: Where it goes.
        now_ns: When it began.
        takes_s: How long it takes by its numbers, 0 where they do not say.
    """

    def __init__(self, start: Six, target: Six, now_ns: int, *, takes_s: float = 0.0) -> None:
        self._begun_ns = now_ns
        self._start, self._target = start, target
        self._takes_s = takes_s
        self._known = takes_s > 0 or _apart(start, target) < _NO_WAY
        self._before = 0.0, 0.0

    def saw(self, tip: Six, now_ns: int) -> None:
        """Learn from where the tip is now."""
        if not all(map(math.isfinite, tip)):
            return
        passed_s = (now_ns - self._begun_ns) / NS_PER_S
        gone, left = _apart(self._start, tip), _apart(tip, self._target)
        share = gone / (gone + left) if gone + left else 0.0
        if share < _MIDDLE:
            self._before = passed_s, share
            if self._takes_s < 2 * passed_s:
                self._takes_s, self._known = 2 * passed_s, False
        elif not self._known:
            before_s, before = self._before
            at_s = before_s + (passed_s - before_s) * (_MIDDLE - before) / (share - before)
            self._takes_s, self._known = 2 * at_s, True

    def patience_s(self, now_ns: int) -> float:
        """Return the time until the next whole look, in s.

        There is one when the movement is likely to end, or ends at the earliest: until its middle
        it takes as long again as it has taken.
        """
        left_s = self._left_s(now_ns)
        if not self._known:
            left_s = max(left_s, FIRST_LOOK_S)
        return shared_out(left_s, LOOK_S) if left_s > 0 else LOOK_S

    def pause_s(self, now_ns: int) -> float:
        """Return the time until the next look, in s; before the end a whole one will do."""
        late_s = -self._left_s(now_ns)
        if not self._known or late_s < 0:
            return math.inf
        return min(max(late_s / _WATCHES_PER_WAIT, _SHORTEST_WATCH_S), POLL_S)

    def _left_s(self, now_ns: int) -> float:
        return self._takes_s + _LATE_S - (now_ns - self._begun_ns) / NS_PER_S


def _apart(one: Six, other: Six) -> float:
    """Return how far apart two frames are: lengths and angles together, to compare ways by."""
    turns = (math.remainder(a - b, 360.0) for a, b in zip(one[3:], other[3:], strict=True))
    return math.hypot(math.dist(one[:3], other[:3]), *turns)


_PATIENCE_S: Final = 1.0
"""Longest time without a sign from the waiter, in s: by then the PLC has ended the movement."""

_LONGEST_EXCHANGE_S: Final = 10.0
"""Longest time in s in which another thread's exchange ends; the deadline of a link is shorter."""


class Turns:
    """Orders threads on the wire. The link's own lock orders its exchanges.

    A ``with`` block is one exchange.
    """

    def __init__(self) -> None:
        self._changed = runtime.waiting_room()
        self._waiters = 0
        self._waiting = 0
        self._let_in = 0
        self._pausing = False
        self._inside = 0
        self._sign_s = 0.0

    @property
    def waited_on(self) -> bool:
        """Whether somebody waits on a movement."""
        return bool(self._waiters)

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Decide who comes in, as long as this thread waits on a movement."""
        counted = False
        try:
            with self._changed:
                self._waiters += 1
                counted = True
                self._sign_s = _now_s()
                # Ctrl-C may interrupt this wait.
                self._changed.wait_for(self._nobody_inside, _LONGEST_EXCHANGE_S)
            yield
        finally:
            if counted:
                with self._changed:
                    self._waiters -= 1
                    self._changed.notify_all()

    @contextmanager
    def pausing(self) -> Iterator[None]:
        """Let other threads have the wire, one exchange at a time, while the waiter pauses."""
        try:
            with self._changed:
                self._pausing = True
                self._changed.notify_all()
            yield
        finally:
            with self._changed:
                self._pausing = False
                self._changed.wait_for(self._nobody_inside, _LONGEST_EXCHANGE_S)
                self._sign_s = _now_s()

    def let_one_in(self) -> bool:
        """Let another thread have one exchange and wait for its end; False if none wants it."""
        with self._changed:
            self._sign_s = _now_s()
            if not self._waiting:
                return False
            self._let_in = 1
            self._changed.notify_all()
            self._changed.wait_for(self._nobody_inside, _LONGEST_EXCHANGE_S)
            self._sign_s = _now_s()
            return True

    # No generator: every exchange passes here and would be slower.
    def __enter__(self) -> None:
        """Wait until the waiter, if there is one, lets this thread in for one exchange."""
        with self._changed:
            self._waiting += 1
            try:
                # Real time: a clock that does not advance would block this thread for ever.
                while self._waiters and not self._let_in and not self._free_in_a_pause():
                    left_s = self._sign_s + _PATIENCE_S - _now_s()
                    if left_s <= 0:
                        break
                    self._changed.wait(left_s)
            finally:
                self._waiting -= 1
            self._let_in = 0
            self._inside += 1

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Let the next one onto the wire."""
        with self._changed:
            self._inside -= 1
            self._changed.notify_all()

    def _free_in_a_pause(self) -> bool:
        return self._pausing and not self._inside

    def _nobody_inside(self) -> bool:
        return not self._inside and not (self._let_in and self._waiting)


def _now_s() -> float:
    return runtime.monotonic_ns() / NS_PER_S
