"""What the tasks of a controller share: locks, signals, timers, counters of random numbers.

Source: docs/reference/spel.md 4.5, 4.6.
"""

import random
from typing import Final

from robolink.timing import NS_PER_S
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.values import out_of_range
from robolink_simulators.epson.spel.tasks.task import SpelTask

HIGHEST_NUMBER: Final = 63
"""Highest number of a lock, signal or timer."""


class TaskSharing:
    """Locks, signals and timers of all tasks.

    Attributes:
        rng: What Rnd draws from.
        elapsed_since_ns: When ResetElapsedTime was carried out last.
    """

    def __init__(self) -> None:
        self.rng = random.Random(0)
        self.elapsed_since_ns = 0
        self._locks: dict[int, SpelTask] = {}
        self._reserved: set[int] = set()
        self._waiting_for: dict[int, list[SpelTask]] = {}
        self._timers: dict[int, int] = {}

    def may_lock(self, number: int, task: SpelTask) -> bool:
        """Return whether a lock is free.

        Raises:
            Refusal: The task holds it already (documented; its number is not).
        """
        holder = self._locks.get(checked_number(number))
        if holder is task:
            raise SpelRefusal(RefusalKind.LOCK_TAKEN, f"Lock {number} is held by this task")
        return holder is None

    def lock(self, number: int, task: SpelTask) -> None:
        """Take a free lock."""
        self._locks[number] = task

    def unlock(self, number: int, task: SpelTask) -> None:
        """Release a lock.

        Raises:
            Refusal: Another task holds it, or none (documented that only its owner can).
        """
        if self._locks.get(checked_number(number)) is not task:
            raise SpelRefusal(RefusalKind.LOCK_NOT_HELD, f"Lock {number} is not held by this task")
        del self._locks[number]

    def reserve_lock(self) -> int:
        """Return the number of a lock that nobody uses (SyncLockReserve, seen)."""
        for number in range(HIGHEST_NUMBER, 0, -1):
            if number not in self._reserved and number not in self._locks:
                self._reserved.add(number)
                return number
        raise out_of_range("No lock is free")

    def release(self, task: SpelTask) -> None:
        """Release what an ended task held."""
        self._locks = {n: holder for n, holder in self._locks.items() if holder is not task}
        for tasks in self._waiting_for.values():
            if task in tasks:
                tasks.remove(task)

    def await_signal(self, number: int, task: SpelTask) -> None:
        """Start to wait: an earlier signal is lost (documented)."""
        self._waiting_for.setdefault(checked_number(number), []).append(task)

    def signalled(self, number: int, task: SpelTask) -> bool:
        """Return whether the signal has come since the task started to wait."""
        return task not in self._waiting_for.get(number, [])

    def cease(self, number: int, task: SpelTask) -> None:
        """Stop waiting."""
        if not self.signalled(number, task):
            self._waiting_for[number].remove(task)

    def signal(self, number: int) -> None:
        """Send a signal to those who wait for it."""
        self._waiting_for.pop(checked_number(number), None)

    def reset_timer(self, number: int, now_ns: int) -> None:
        """Let a timer begin at 0."""
        self._timers[checked_number(number)] = now_ns

    def timer_s(self, number: int, now_ns: int) -> float:
        """Return a timer in seconds, to the millisecond."""
        since_ns = self._timers.get(checked_number(number), 0)
        return round((now_ns - since_ns) / NS_PER_S, 3)


def checked_number(number: int) -> int:
    """Return the number of a lock, signal or timer.

    Raises:
        Refusal: There is none with that number.
    """
    if not 0 <= number <= HIGHEST_NUMBER:
        raise out_of_range(f"There is no number {number}, only 0 to {HIGHEST_NUMBER}")
    return number
