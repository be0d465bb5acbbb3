"""Waits of a task: a statement that takes time, a signal, a lock, a port."""

from collections.abc import Callable, Iterator
from typing import Final, Protocol

from robolink_simulators.epson.spel.execution import StatementExecution
from robolink_simulators.epson.spel.statements.conditions import NEVER_NS

POLL_NS: Final = 10_000_000
"""Interval in ns between checks of events outside the controller.

A condition that holds for less than 0.01 s may be missed (docs/reference/spel.md 16).
"""


class TaskWait(Protocol):
    """Something that a task waits for."""

    def next_poll_ns(self, seen_ns: int) -> int:
        """Return when it has to be checked again; nothing came before ``seen_ns``."""
        ...

    def poll(self, now_ns: int) -> bool:
        """Check it; return whether it is over.

        Raises:
            Refusal: It ended with an error.
        """
        ...

    def suspend(self, now_ns: int) -> None:
        """Hold it while the task is paused."""
        ...

    def resume(self, now_ns: int) -> None:
        """Continue it."""
        ...


class StatementWait:
    """A statement of the machine that takes time.

    Attributes:
        execution: The statement under way.
        finishing: Whether its motion goes on to its end although the task is paused: QP is off
            (docs/reference/spel.md 7.2).
    """

    def __init__(self, execution: StatementExecution) -> None:
        self.execution = execution
        self.finishing = False

    def next_poll_ns(self, seen_ns: int) -> int:
        """Return when the next part of it happens."""
        return self.execution.next_poll_ns(seen_ns)

    def poll(self, now_ns: int) -> bool:
        """Carry out what is due."""
        self.execution.advance(now_ns)
        return self.execution.done

    def suspend(self, now_ns: int) -> None:
        """Stop its motion."""
        self.finishing = False
        self.execution.suspend(now_ns)

    def resume(self, now_ns: int) -> None:
        """Continue its motion, or restart its time."""
        if not self.finishing:
            self.execution.resume(now_ns)
        self.finishing = False


class WaitSequence:
    """Waits that follow each other, with actions in between.

    Args:
        steps: Gives the next wait once the one before is over. There is at least one.
    """

    def __init__(self, steps: Iterator[TaskWait]) -> None:
        self._steps = steps
        self._present = next(steps)

    def next_poll_ns(self, seen_ns: int) -> int:
        """Return when something of the present one happens next."""
        return self._present.next_poll_ns(seen_ns)

    def poll(self, now_ns: int) -> bool:
        """Check the present one, and those after it that end at once."""
        while self._present.poll(now_ns):
            following = next(self._steps, None)
            if following is None:
                return True
            self._present = following
        return False

    def suspend(self, now_ns: int) -> None:
        """Hold the present one."""
        self._present.suspend(now_ns)

    def resume(self, now_ns: int) -> None:
        """Continue the present one."""
        self._present.resume(now_ns)

    @property
    def present(self) -> TaskWait:
        """The present wait."""
        return self._present


class WaitUntil:
    """Waits until something is ready, or its time is up.

    Args:
        ready: Tells whether it is; asked again whenever another task has done something.
        take: Called once when it is.
        end_ns: When its time is up, ``None`` for never.
        out_of_time: Called once when it is.
        polled: Whether it can become ready without a task doing anything.
    """

    def __init__(
        self,
        ready: Callable[[], bool],
        take: Callable[[], None],
        *,
        end_ns: int | None = None,
        out_of_time: Callable[[], None] | None = None,
        polled: bool = False,
    ) -> None:
        self._ready = ready
        self._take = take
        self._end_ns = NEVER_NS if end_ns is None else end_ns
        self._out_of_time = out_of_time
        self._polled = polled

    def next_poll_ns(self, seen_ns: int) -> int:
        """Return when it is ready or its time is up, as far as is known.

        What became ready outside did so after the last look: an instant that has been dealt
        with never comes again.
        """
        if self._ready():
            return seen_ns + 1
        return min(self._end_ns, seen_ns + POLL_NS) if self._polled else self._end_ns

    def poll(self, now_ns: int) -> bool:
        """Take what is ready, or note that its time is up."""
        if self._ready():
            self._take()
            return True
        if now_ns < self._end_ns:
            return False
        if self._out_of_time is not None:
            self._out_of_time()
        return True

    def suspend(self, now_ns: int) -> None:
        """Wait on: signals and locks of other tasks do not stop for a pause (assumed)."""

    def resume(self, now_ns: int) -> None:
        """Wait on."""
