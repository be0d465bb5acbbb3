"""Chance, times and locks of a history: all from its seed and its virtual clock."""

import random
from collections.abc import Callable
from typing import Final

from robolink.ambient import Ambience, WaitingLock, WaitingRoom
from robolink.timing import NS_PER_S
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.soak.threads import SteppedLock, SteppedRoom, TurnTaking

_FIRST_DAY_S: Final = 1_767_603_600.0
"""2026-01-05 09:00 UTC, a Monday: when every history begins."""


class SeededSurroundings(Ambience):
    """What a cell's computers draw and see, in place of the real world.

    Time passes where it is stepped, and for everybody.

    Args:
        clock: The virtual time.
        turns: Decides who goes on at a lock.
        rng: From which everything is drawn.

    Attributes:
        wall_jump_s: By how much the computer's wall clock is wrong.
        booted_ns: When the computer was switched on, in virtual time.
        rng: From which everything is drawn; replaced for each hour, whose draws are its own.
    """

    steps_time = True

    def __init__(self, clock: ManualClock, turns: TurnTaking, rng: random.Random) -> None:
        self.rng = rng
        self.wall_jump_s = 0.0
        self.booted_ns = 0
        self._clock = clock
        self._turns = turns

    def random_bytes(self, count: int) -> bytes:
        """Return bytes that the seed decides."""
        return self.rng.randbytes(count)

    def wall_s(self) -> float:
        """Return the virtual time of day, wrong by as much as the clock was set wrong."""
        return _FIRST_DAY_S + self._clock.now_ns() / NS_PER_S + self.wall_jump_s

    def monotonic_ns(self) -> int:
        """Return the virtual time."""
        return self._clock.now_ns()

    def boot_ns(self) -> int:
        """Return the virtual time since the computer was switched on."""
        return self._clock.now_ns() - self.booted_ns

    def sleep(self, seconds: float) -> None:
        """Let others run, then let the time pass."""
        self._turns.pass_on()
        self._clock.sleep(seconds)

    def lock(self) -> WaitingLock:
        """Return a lock at which the turn passes on."""
        return SteppedLock(self._turns, reentrant=False)

    def reentrant_lock(self) -> WaitingLock:
        """Return one that its holder may take again."""
        return SteppedLock(self._turns, reentrant=True)

    def regularly(self, every_s: float, act: Callable[[], None], name: str) -> Callable[[], None]:
        """Have ``act`` called by a thread of the same process, in virtual time."""
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
