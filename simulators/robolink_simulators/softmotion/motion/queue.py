"""The movements of a group, in the order in which they run.

Theory of operation. At most two movements run at once: in a blended corner the second begins
when the first begins to slow down, and their ways add up (our model of blending, the same for
all four modes; real ones differ in the speed through the corner). The first is then slowing
down as hard as it ever does, so that it arrives in the corner even when both are braked.
Everything happens at cycles of the motion task.
"""

from collections import deque
from collections.abc import Iterator, Sequence
from itertools import chain

from robolink_simulators.softmotion.kinematics.kinematics import AxisValues
from robolink_simulators.softmotion.motion.movement import Movement


class MovementQueue:
    """What runs, and what waits.

    Args:
        cycle_ns: Period of the motion task.

    Attributes:
        last: The movement commanded last, finished or not.
    """

    def __init__(self, cycle_ns: int) -> None:
        self._cycle_ns = cycle_ns
        self._running: list[Movement] = []
        self._waiting: deque[Movement] = deque()
        self.last: Movement | None = None

    def __iter__(self) -> Iterator[Movement]:
        return chain(self._running, self._waiting)

    @property
    def running(self) -> Sequence[Movement]:
        """The movements that move the group, in order; two in a corner."""
        return self._running

    @property
    def empty(self) -> bool:
        """Whether nothing runs and nothing waits."""
        return not self._running and not self._waiting

    @property
    def unfinished(self) -> list[Movement]:
        """The movements whose blocks are busy, oldest first."""
        return [movement for movement in self if not movement.execution.ended]

    @property
    def active(self) -> Movement | None:
        """The active movement; in a blended corner the second.

        Source: docs/reference/softmotion.md 2.1 (documented).
        """
        active = [movement for movement in self if movement.execution.outputs.active]
        return active[-1] if active else None

    def axes_at(self, now_ns: int) -> AxisValues | None:
        """Return where the movements put the axes, ``None`` when none runs."""
        return self._joined([movement.share_at(now_ns) for movement in self._running])

    def last_axes(self) -> AxisValues | None:
        """Return where the group will rest when all is done, ``None`` when nothing runs."""
        if self._waiting:
            return self._waiting[-1].path.end
        return self._joined([movement.rest_share for movement in self._running])

    def axes_if_braked(self, now_ns: int) -> AxisValues | None:
        """Return where the group would rest if it were braked now, ``None`` when nothing runs."""
        return self._joined([movement.share_if_braked(now_ns) for movement in self._running])

    def append(self, movement: Movement) -> None:
        """Let a movement follow the others."""
        self._waiting.append(movement)
        self.last = movement

    def take_over(self, now_ns: int) -> None:
        """Abort everything for a movement to come; what runs comes to rest first (assumed)."""
        for movement in self.unfinished:
            movement.execution.abort()
        self.brake(now_ns)
        self._waiting.clear()

    def brake(self, now_ns: int) -> None:
        """Bring what runs to rest on its path; what waits stays."""
        for movement in self._running:
            movement.brake(now_ns)

    def drop(self) -> list[Movement]:
        """Forget everything at once and return what was unfinished."""
        unfinished = self.unfinished
        self._running.clear()
        self._waiting.clear()
        return unfinished

    def resume(self, movements: list[Movement], now_ns: int) -> None:
        """Let interrupted movements go on, those that had begun at once."""
        self._running = [movement for movement in movements if movement.begun]
        self._waiting = deque(movement for movement in movements if not movement.begun)
        for movement in self._running:
            movement.start(now_ns)

    def next_change(self, now_ns: int) -> int | None:
        """Return the cycle in which a movement ends or begins, after ``now_ns``."""
        if self._running:
            due_ns = self._running[0].rest_ns
            if self._corner_ahead():
                due_ns = min(due_ns, self._running[0].falls_ns)
        elif self._waiting:
            due_ns = now_ns
        else:
            return None
        return self._cycle_after(due_ns, now_ns)

    def settle(self, now_ns: int) -> list[Movement]:
        """Take off what has come to rest by now, and return it."""
        rested = []
        # In order: the second in a corner may be at rest before the first has arrived there.
        while self._running and self._running[0].rest_ns <= now_ns:
            rested.append(self._running.pop(0))
        return rested

    def start_due(self, now_ns: int) -> None:
        """Begin what may begin now."""
        corner = self._corner_ahead() and self._running[0].falls_ns <= now_ns
        if self._waiting and (corner or not self._running):
            movement = self._waiting.popleft()
            movement.start(now_ns)
            self._running.append(movement)

    def _corner_ahead(self) -> bool:
        if not self._waiting or len(self._running) != 1:
            return False
        return self._waiting[0].can_blend_from(self._running[0])

    def _joined(self, shares: list[float]) -> AxisValues | None:
        axes: AxisValues | None = None
        for movement, share in zip(self._running, shares, strict=True):
            path = movement.path
            axes = path.axes_at(share) if axes is None else path.axes_in_corner(share, axes)
        return axes

    def _cycle_after(self, at_ns: int, now_ns: int) -> int:
        return -(-max(at_ns, now_ns + 1) // self._cycle_ns) * self._cycle_ns
