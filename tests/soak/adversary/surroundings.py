"""The surroundings that a seed decides: time, chance, locks, and the running thread."""

import random
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import ceil
from types import TracebackType
from typing import Final, Protocol

from robolink_simulators.cell.clock import ManualClock

from robolink.runtime import SystemRuntime, WaitingLock, WaitingRoom
from robolink.timing import NS_PER_S

_REAL_PATIENCE_S: Final = 300.0
"""Nothing here waits in real time; a thread that never gives up its turn is a defect."""

_LONGEST_FAVOUR: Final = 100_000

_CHANGES_SHARE: Final = 0.75
"""Share of the runs with a favoured new thread in which the favour changes once."""

_CHANGES: Final = (2, 3, 3, 3, 8, 11)
"""The exchange at whose end it changes: an EPSON stop has three, one of a PLC eleven."""

_CATCHING_UP: Final = 12
"""The most points for which the thread that waited until then is favoured."""

_SHORT_FAVOUR: Final = 40
"""The most points for which the thread that started another one is favoured."""


class Killed(BaseException):
    """The process to which this thread belongs is dead; raised again at each further point."""


class DeadlockError(RuntimeError):
    """Every thread waits for another one."""


class Mortal(Protocol):
    """The owner of a thread."""

    @property
    def alive(self) -> bool:
        """Whether it still runs."""


class SteppedThread:
    """One thread of a history.

    Args:
        name: The thread's name in the event log.
        owner: The process it belongs to; ``None`` for the outer one.

    Attributes:
        error: The error that ended it, ``None`` for none.
        over: Whether it has ended.
        suspended: Whether its whole process is suspended.
    """

    def __init__(self, name: str, owner: Mortal | None) -> None:
        self.name = name
        self.owner = owner
        self.error: BaseException | None = None
        self.over = False
        self.suspended = False
        self.ready: Callable[[], bool] | None = None
        self.until_ns: int | None = None
        self.turn = threading.Semaphore(0)

    def can_go_on(self, now_ns: int) -> bool:
        """Return whether its condition holds, its time has come, or its process is dead."""
        if self.over or self.suspended:
            return False
        if self.ready is None or self.ready() or (self.owner is not None and not self.owner.alive):
            return True
        return self.until_ns is not None and now_ns >= self.until_ns


class TurnTaking:
    """Decides which thread runs.

    Args:
        clock: The virtual time.
        rng: Draws the next thread.
        note: Receives the name of the next thread when the turn changes.
    """

    def __init__(
        self,
        clock: ManualClock,
        rng: random.Random,
        note: Callable[[str], None] = lambda _name: None,
    ) -> None:
        self.rng = rng
        self._clock = clock
        self._note = note
        self._main = SteppedThread("main", None)
        self._threads = [self._main]
        self._favoured: SteppedThread | None = None
        self._favour_left = 0
        self._then: SteppedThread | None = None
        self._exchanges_left = 0
        self._by_ident = {threading.get_ident(): self._main}

    @property
    def current(self) -> SteppedThread:
        """The running thread."""
        return self._by_ident[threading.get_ident()]

    @property
    def alone(self) -> bool:
        """Whether there is no other thread."""
        return len(self._threads) == 1

    def start(
        self, name: str, owner: Mortal | None, work: Callable[[], None], *, favoured: bool = True
    ) -> SteppedThread:
        """Begin another thread; it runs when its turn comes.

        Args:
            name: The thread's name in the event log.
            owner: The process it belongs to.
            work: Its work.
            favoured: Whether it may be favoured, as below; not for periodic work.

        Mostly either it or the thread that started it is favoured: then the other one waits at one
        point as long as possible, which a fair draw at each point never shows. At times the favour
        changes once, at the end of one of the first exchanges: the waiting thread goes on while the
        other one is nearly done (a priority change point, as in Burckhardt et al., "A randomized
        scheduler with probabilistic guarantees of finding bugs", ASPLOS 2010).
        """
        thread = SteppedThread(name, owner)

        def run() -> None:
            thread.turn.acquire()
            self._by_ident[threading.get_ident()] = thread
            try:
                work()
            except BaseException as error:
                thread.error = error
            finally:
                del self._by_ident[threading.get_ident()]
                self._end(thread)

        self._threads.append(thread)
        if favoured:
            self._favour(thread)
        threading.Thread(target=run, name=f"soak {name}", daemon=True).start()
        return thread

    def _favour(self, thread: SteppedThread) -> None:
        me = self.current
        self._favoured = self.rng.choice((thread, thread, thread, thread, me, None))
        self._favour_left = (
            _LONGEST_FAVOUR if self._favoured is thread else self.rng.randint(1, _SHORT_FAVOUR)
        )
        changes = self._favoured is thread and self.rng.random() < _CHANGES_SHARE
        self._then = me if changes else None
        self._exchanges_left = self.rng.choice(_CHANGES)

    def pass_on(self, *, exchanged: bool = False) -> None:
        """Let the seed choose the next thread: this one, or another.

        Args:
            exchanged: Whether the thread has ended an exchange, and holds no lock of one.
        """
        if self.alone:
            return
        if exchanged and self._then is not None and self.current is self._favoured:
            self._exchanges_left -= 1
            if not self._exchanges_left:
                self._favoured, self._then = self._then, None
                self._favour_left = self.rng.randint(1, _CATCHING_UP)
        self._hand_over(self._drawn())

    def wait_until(self, ready: Callable[[], bool], timeout_s: float | None = None) -> bool:
        """Let others run until ``ready`` holds, or the time is over; return whether it holds.

        Raises:
            Killed: The thread's process has died meanwhile.
            DeadlockError: Nobody can go on, ever.
        """
        me = self.current
        me.ready = ready
        if timeout_s is not None:
            # Less than a nanosecond counts as one: a thread that repeats such waits would wait for
            # ever.
            me.until_ns = self._clock.now_ns() + ceil(timeout_s * NS_PER_S)
        try:
            while not me.can_go_on(self._clock.now_ns()):
                self._hand_over(self._drawn())
            if me.owner is not None and not me.owner.alive:
                raise Killed
            return ready()
        finally:
            me.ready = me.until_ns = None

    @contextmanager
    def suspended(self, owner: Mortal) -> Iterator[None]:
        """Suspend every other thread of a process during the block."""
        others = [one for one in self._threads if one.owner is owner and one is not self.current]
        for thread in others:
            thread.suspended = True
        try:
            yield
        finally:
            for thread in others:
                thread.suspended = False

    def join(self) -> None:
        """Run every other thread to its end."""
        me = self.current
        self.wait_until(lambda: all(other.over for other in self._threads if other is not me))
        self._threads, self._favoured, self._then = [me], None, None

    def _drawn(self) -> SteppedThread:
        while True:
            now_ns = self._clock.now_ns()
            ready = [thread for thread in self._threads if thread.can_go_on(now_ns)]
            if self._favoured in ready and self._favour_left:
                self._favour_left -= 1
                return self._favoured
            if ready:
                return ready[0] if len(ready) == 1 else self.rng.choice(ready)
            waiting_for = [t for t in self._threads if not (t.over or t.suspended)]
            times = [t.until_ns for t in waiting_for if t.until_ns is not None]
            if not times:
                waiting = ", ".join(t.name for t in self._threads if not t.over)
                message = f"everybody waits: {waiting}"
                raise DeadlockError(message)
            self._clock.advance_to(min(times))

    def _hand_over(self, to: SteppedThread) -> None:
        me = self.current
        if to is me:
            return
        self._note(to.name)
        to.turn.release()
        if not me.turn.acquire(timeout=_REAL_PATIENCE_S):
            message = f"the turn never came back to {me.name}"
            raise DeadlockError(message)

    def _end(self, thread: SteppedThread) -> None:
        thread.over = True
        # The main thread waits for the last one; some thread can always go on.
        following = self._drawn()
        self._note(following.name)
        following.turn.release()


class SteppedLock:
    """A lock at which another thread may get the turn.

    Args:
        turns: Decides which thread runs.
        reentrant: Whether its holder may take it again.
    """

    def __init__(self, turns: TurnTaking, *, reentrant: bool) -> None:
        self._turns = turns
        self._reentrant = reentrant
        self._holder: SteppedThread | None = None
        self._depth = 0

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        """See :class:`robolink.runtime.WaitingLock`."""
        me = self._turns.current
        if self._holder is me and self._reentrant:
            self._depth += 1
            return True
        if self._holder is not None:
            if not blocking:
                return False
            limit_s = None if timeout < 0 else timeout
            if not self._turns.wait_until(lambda: self._holder is None, limit_s):
                return False
        self._holder, self._depth = me, 1
        return True

    def release(self) -> None:
        """See :class:`robolink.runtime.WaitingLock`."""
        self._depth -= 1
        if not self._depth:
            self._holder = None

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.release()


class SteppedRoom:
    """A condition variable whose waits take virtual time only."""

    def __init__(self, turns: TurnTaking) -> None:
        self._turns = turns
        self._lock = SteppedLock(turns, reentrant=True)
        self._news = 0

    def wait(self, timeout: float | None = None) -> bool:
        """See :class:`robolink.runtime.WaitingRoom`."""
        seen = self._news
        self._lock.release()
        try:
            return self._turns.wait_until(lambda: self._news != seen, timeout)
        finally:
            self._lock.acquire()

    def wait_for(self, predicate: Callable[[], bool], timeout: float | None = None) -> bool:
        """See :class:`robolink.runtime.WaitingRoom`."""
        if predicate():
            return True
        self._lock.release()
        try:
            self._turns.wait_until(predicate, timeout)
        finally:
            self._lock.acquire()
        return predicate()

    def notify_all(self) -> None:
        """See :class:`robolink.runtime.WaitingRoom`."""
        self._news += 1

    def __enter__(self) -> bool:
        return self._lock.acquire()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._lock.release()


_FIRST_DAY_S: Final = 1_767_603_600.0
"""2026-01-05 09:00 UTC, a Monday: the beginning of every history."""


class SeededSurroundings(SystemRuntime):
    """The surroundings of a cell's computers, in place of the real world.

    Time passes when it is stepped, for all of them.

    Args:
        clock: The virtual time.
        turns: Decides which thread runs at a lock.
        rng: The source of all draws.

    Attributes:
        wall_jump_s: The error of the computer's wall clock.
        booted_ns: The time at which the computer was switched on, in virtual time.
        rng: The source of all draws; replaced for each hour, which has its own draws.
    """

    steps_time = True

    def __init__(self, clock: ManualClock, turns: TurnTaking, rng: random.Random) -> None:
        self.rng = rng
        self.wall_jump_s = 0.0
        self.booted_ns = 0
        self._clock = clock
        self._turns = turns

    def random_bytes(self, count: int) -> bytes:
        """Return bytes drawn from the seed."""
        return self.rng.randbytes(count)

    def wall_s(self) -> float:
        """Return the virtual time of day, with the error of the clock."""
        return _FIRST_DAY_S + self._clock.now_ns() / NS_PER_S + self.wall_jump_s

    def monotonic_ns(self) -> int:
        """Return the virtual time."""
        return self._clock.now_ns()

    def boot_ns(self) -> int:
        """Return the virtual time since the computer was switched on."""
        return self._clock.now_ns() - self.booted_ns

    def sleep(self, seconds: float) -> None:
        """Let others run, then advance the time."""
        self._turns.pass_on()
        self._clock.sleep(seconds)

    def lock(self) -> WaitingLock:
        """Return a lock at which another thread may get the turn."""
        return SteppedLock(self._turns, reentrant=False)

    def reentrant_lock(self) -> WaitingLock:
        """Return a reentrant lock of that kind."""
        return SteppedLock(self._turns, reentrant=True)

    def regularly(self, every_s: float, act: Callable[[], None], name: str) -> Callable[[], None]:
        """Call ``act`` periodically in a thread of the same process, in virtual time."""
        room, ending = SteppedRoom(self._turns), [False]

        def run() -> None:
            while True:
                with room:
                    if ending[0] or room.wait_for(lambda: ending[0], every_s):
                        return
                act()

        thread = self._turns.start(name, self._turns.current.owner, run, favoured=False)

        def end() -> None:
            with room:
                ending[0] = True
                room.notify_all()
            self._turns.wait_until(lambda: thread.over)

        return end

    def waiting_room(self) -> WaitingRoom:
        """Return a condition variable in virtual time."""
        return SteppedRoom(self._turns)
