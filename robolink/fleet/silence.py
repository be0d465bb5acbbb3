"""Jobs that give no sign of life: they are cut off from their cells, and hold nobody else up.

Each exchange with a controller has a deadline, and each question to a server, so a cell that says
nothing ends its job by itself. What has none is this computer: a disk or a network drive that does
not answer, a lock that is not released. A job is silent when for :data:`SILENT_S` its connection
carried nothing; signs of life that others are given beside the work (docs/reference/rules.md 6)
keep it so for :data:`LONGEST_S` at most. Time in which the whole process stood still (a debugger, a
virtual machine that was paused) does not count: its jobs could give no sign either.

A thread cannot be ended. So the job is cut off instead: its controller is stopped where it may
have written, rest is proved, and from then on nothing of it reaches the controller, whenever it
wakes up. Its outcome is what is known of the controller; the order is carried out once all the
same, since only the next delivery begins it anew.
"""

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Final, Protocol

from robolink import runtime
from robolink.fleet.progress import JobOutcome

__all__ = ["CUT_S", "CellLine", "LONGEST_S", "SILENT_S", "SilentJobs", "hanging"]

SILENT_S: Final = 30.0
"""Without an exchange for so long a job is silent, in s."""

LONGEST_S: Final = 300.0
"""No job is at work longer, in s."""

CUT_S: Final = 15.0
"""How long a stop and its proof may take, in s."""

LOOK_S: Final = 1.0
"""How often is looked for silent jobs, in s."""

_STOOD_STILL_S: Final = 5.0
"""A look that comes so late, in s, shows that this process stood still meanwhile."""

_UNSETTLED: Final = 6
"""Exit code of a job whose outcome is not known."""


class CellLine(Protocol):
    """The connections of jobs to their cells, for who watches them."""

    def exchanges(self, order: str) -> int:
        """Return how many requests a job has sent; 0 before it is connected. Never waits."""

    def cut_off(self, order: str, ended: Callable[[JobOutcome | None], None]) -> None:
        """Have nothing of a job reach its controller any more; stop that where it was written to.

        Args:
            order: The job's.
            ended: Called as soon as it is known how the controller is left; what follows, such as
                closing the connection, may hang with the job. ``None`` says that the job had ended
                by itself.
        """


class _Job:
    """A job while it is at work.

    Attributes:
        attempt: Which attempt.
        writes: Whether it changes something at its controller.
        recorded: Whether how it was cut off is on record: that is told once, because a person may
            resume the plan while its thread still hangs.
        cut_s: When it was cut off; ``None`` before.
        outcome: How it ended by that; ``None`` while that is not known.
    """

    def __init__(self, attempt: int, *, writes: bool) -> None:
        self.attempt, self.writes, self.recorded = attempt, writes, False
        self.begun_s = self.seen_s = _now_s()
        self.exchanges = 0
        self.cut_s: float | None = None
        self.outcome: JobOutcome | None = None
        self._over = False
        self._room = runtime.waiting_room()

    def pass_over(self, still_s: float, now_s: float) -> None:
        """Do not count the last ``still_s``, in which this process stood still."""
        self.begun_s = min(self.begun_s + still_s, now_s)
        self.seen_s = min(self.seen_s + still_s, now_s)
        if self.cut_s is not None:
            self.cut_s = min(self.cut_s + still_s, now_s)

    def cut(self, now_s: float) -> bool:
        """Note that it is cut off now; return whether it had not ended before."""
        with self._room:
            if not self._over:
                self.cut_s = now_s
            return not self._over

    def settle(self, outcome: JobOutcome | None) -> None:
        """Note what cutting it off led to, ``None`` for nothing; the first word counts."""
        with self._room:
            if outcome is None:
                self._over = True
            else:
                self.outcome = self.outcome or outcome
            self._room.notify_all()

    def ended(self, own: JobOutcome) -> JobOutcome:
        """Return how it ended: of one that was cut off, what that showed; waits for it.

        What the thread itself saw by then is the cut connection. Only that something is unsettled
        is believed of it.
        """
        with self._room:
            if self.cut_s is None:
                self._over = True
            known = self._room.wait_for(lambda: self._over or self.outcome is not None, CUT_S)
            if not known:
                self.outcome = hanging(writes=self.writes, settled=False, at_rest=False)
            if self.outcome is None:
                return own
            return own if own.code == _UNSETTLED != self.outcome.code else self.outcome


class SilentJobs:
    """Watches the jobs of an agent.

    Args:
        line: Their connections; ``None`` where nothing is known of them.
    """

    def __init__(self, line: CellLine | None) -> None:
        self._line = line
        self._lock = runtime.lock()
        self._jobs: dict[str, _Job] = {}
        self._looked_s = _now_s()

    @contextmanager
    def watching(self, order: str, attempt: int, *, writes: bool) -> Iterator[_Job]:
        """Watch a job for the block that carries it out.

        Args:
            order: Its order.
            attempt: Which attempt.
            writes: Whether it changes something at its controller.
        """
        job = _Job(attempt, writes=writes)
        with self._lock:
            self._jobs[order] = job
        try:
            yield job
        finally:
            with self._lock:
                del self._jobs[order]

    def look(self) -> None:
        """Cut off what has become silent; never waits for a job."""
        now_s = _now_s()
        late_s, self._looked_s = now_s - self._looked_s - LOOK_S, now_s
        for order, job in self._all():
            if late_s > _STOOD_STILL_S:
                job.pass_over(late_s, now_s)
            if job.cut_s is not None:
                if job.outcome is None and now_s - job.cut_s > CUT_S:
                    job.settle(hanging(writes=job.writes, settled=False, at_rest=False))
                continue
            sent = self._line.exchanges(order) if self._line else 0
            if sent != job.exchanges:
                job.exchanges, job.seen_s = sent, now_s
            if now_s - job.seen_s > SILENT_S or now_s - job.begun_s > LONGEST_S:
                if not job.cut(now_s):
                    continue
                threading.Thread(
                    target=self._cut, args=(order, job), name=f"cut {order}", daemon=True
                ).start()

    def cut(self) -> Mapping[str, _Job]:
        """Return the jobs that were cut off, whose outcome is known, and that have not ended."""
        return {order: job for order, job in self._all() if job.outcome is not None}

    def given_up(self) -> frozenset[str]:
        """Return the orders of the jobs that nobody waits for."""
        return frozenset(self.cut())

    def _cut(self, order: str, job: _Job) -> None:
        if self._line is None:
            reads = not job.writes
            job.settle(hanging(writes=job.writes, settled=reads, at_rest=reads))
        else:
            self._line.cut_off(order, job.settle)

    def _all(self) -> list[tuple[str, _Job]]:
        with self._lock:
            return list(self._jobs.items())


def hanging(*, writes: bool, settled: bool, at_rest: bool) -> JobOutcome:
    """Return the outcome of a job that was cut off.

    Args:
        writes: Whether it changes something at its controller.
        settled: Whether it is known that no write of it is unproved.
        at_rest: Whether the controller has shown, after a stop, that the robot stands still.
    """
    silent = f"The job gave no sign of life for {SILENT_S:g} s: this computer hangs."
    if not writes or (settled and at_rest):
        return JobOutcome(2, "PlantError", what=silent)
    if at_rest:
        what = "It was stopped, and the robot stands still; whether it has written is not known."
    else:
        what = "Nothing shows that the robot stands still: press the emergency stop."
    return JobOutcome(_UNSETTLED, "OutcomeUnknownError", what=f"{silent} {what}")


def _now_s() -> float:
    return runtime.monotonic_ns() / 1e9
