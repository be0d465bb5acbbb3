"""One commanded movement, from its command to its end."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import chain

from robolink.timing import NS_PER_S
from robolink_simulators.cell.frames import ORIGIN, Frame
from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.paths import JointPath, LinePath, Path
from robolink_simulators.softmotion.group.profile import Pace, SpeedProfile
from robolink_simulators.softmotion.kinematics.kinematics import AxisValues, CoordRef, CoordSystem


class SmcBufferMode(IntEnum):
    """``MC_BUFFER_MODE`` (documented, docs/reference/softmotion.md 2.4)."""

    ABORTING = 0
    BUFFERED = 1
    BLENDING_LOW = 2
    BLENDING_PREVIOUS = 3
    BLENDING_NEXT = 4
    BLENDING_HIGH = 5

    @property
    def blends(self) -> bool:
        """Whether the corner before the movement may be rounded."""
        return self >= SmcBufferMode.BLENDING_LOW


@dataclass(frozen=True, slots=True)
class ToolInForce:
    """``ToolOffset`` and ``Name`` of SMC_GroupSetTool."""

    frame: Frame = ORIGIN
    name: str = "ToolInForce"


@dataclass(frozen=True, slots=True)
class EdgeWatch:
    """The input that a movement waits for.

    Attributes:
        number: Which input.
        falling: Whether the falling edge counts instead of the rising one.
        stops: Whether the movement stops at the edge.
    """

    number: int
    falling: bool = False
    stops: bool = True


class Movement:
    """A movement in the queue of a group.

    Args:
        number: Its id, from 1.
        path: Where it leads.
        pace: How fast; ``None`` when there is no way to go.
        tool: The selected tool when it was commanded; it stays the movement's own.
        mode: How it joins the movement before.
        base: Where the coordinate system of its command stands in MCS.
        execution: What its block shows.
        watch: The input it ends at, if any.
        system: The coordinate system that its target counts in.

    Attributes:
        armed: Whether the input has shown what it shows before the edge.
    """

    def __init__(
        self,
        number: int,
        path: Path,
        pace: Pace | None,
        *,
        tool: ToolInForce,
        mode: SmcBufferMode,
        base: Frame,
        execution: BlockExecution,
        watch: EdgeWatch | None = None,
        system: CoordSystem = CoordSystem.MCS,
    ) -> None:
        self.number = number
        self.system = system
        self.path = path
        self.tool = tool
        self.mode = mode
        self.watch = watch
        self.execution = execution
        self.armed = False
        self._base = base
        self._pace = pace
        self._start_ns: int | None = None
        self._take_up(SpeedProfile.fastest(0.0, pace))
        self._braked = False

    @property
    def continuous(self) -> bool:
        """Whether it is a CP movement: on a line."""
        return isinstance(self.path, LinePath)

    @property
    def begun(self) -> bool:
        """Whether it has moved the group."""
        return self._start_ns is not None

    @property
    def braked(self) -> bool:
        """Whether it will stop, or has stopped, before its end."""
        return self._braked

    @property
    def unfinished(self) -> bool:
        """Whether it stopped before its end without reason, so that it can continue."""
        at_edge = self.latched and self.watch is not None and self.watch.stops
        return self.rest_share < 1 and not at_edge and not self.execution.ended

    @property
    def latched(self) -> bool:
        """Whether it met the edge that it watches for."""
        return self.execution.latched is not None

    @property
    def rest_ns(self) -> int:
        """When it stops."""
        return self._rest_ns

    @property
    def falls_ns(self) -> int:
        """When it begins to slow down."""
        return self._instant(self._profile.falls_after_s)

    @property
    def rest_share(self) -> float:
        """How much of its path it will have covered when it stops."""
        return self._profile.end

    def share_at(self, now_ns: int) -> float:
        """Return how much of its path it has covered."""
        if self._start_ns is None:
            return self._profile.start
        if now_ns >= self._rest_ns:
            return self._profile.end
        return self._profile.share_at((now_ns - self._start_ns) / NS_PER_S)

    def start(self, now_ns: int) -> None:
        """Begin, or continue after an interruption, from rest."""
        share = self._profile.end if self.begun else 0.0
        self._start_ns = now_ns
        self._take_up(SpeedProfile.fastest(share, self._pace))
        self._braked = False
        self.execution.activate()

    def brake(self, now_ns: int) -> None:
        """Stop on the path with the movement's own deceleration (assumed)."""
        self._take_up(self._braked_profile(now_ns))
        self._braked = self._profile.end < 1

    def share_if_braked(self, now_ns: int) -> float:
        """Return how much of its path it would cover if it were braked now."""
        return self._braked_profile(now_ns).end

    def latch(self, axes: AxisValues) -> None:
        """Note where the TCP is, in the coordinate system of the command."""
        if isinstance(self.path, LinePath):
            tcp = self.path.kinematics.flange(axes) @ self.tool.frame
            self.execution.latched = CoordRef.of(self._base.inverse() @ tcp)

    def can_blend_from(self, before: "Movement") -> bool:
        """Return whether the corner between two movements can be rounded.

        Both direct, or both on lines with the same tool; anything else is buffered (assumed).
        """
        if not self.mode.blends or before.braked:
            return False
        if isinstance(self.path, JointPath):
            return isinstance(before.path, JointPath)
        return isinstance(before.path, LinePath) and before.tool == self.tool

    def _braked_profile(self, now_ns: int) -> SpeedProfile:
        if self._start_ns is None or self._pace is None:
            return self._profile
        elapsed_s = (now_ns - self._start_ns) / NS_PER_S
        return self._profile.braked(elapsed_s, self._pace.fall_per_s2)

    def _take_up(self, profile: SpeedProfile) -> None:
        # Calculated once, because every cycle of the motion task reads it.
        self._profile, self._rest_ns = profile, self._instant(profile.duration_s)

    def _instant(self, elapsed_s: float) -> int:
        return (self._start_ns or 0) + round(elapsed_s * NS_PER_S)


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
        """Abort everything for a movement to come; what runs stops first (assumed)."""
        for movement in self.unfinished:
            movement.execution.abort()
        self.brake(now_ns)
        self._waiting.clear()

    def brake(self, now_ns: int) -> None:
        """Stop what runs on its path; what waits stays."""
        for movement in self._running:
            movement.brake(now_ns)

    def drop(self) -> list[Movement]:
        """Drop everything at once and return what was unfinished."""
        unfinished = self.unfinished
        self._running.clear()
        self._waiting.clear()
        return unfinished

    def resume(self, movements: list[Movement], now_ns: int) -> None:
        """Continue interrupted movements, those that had begun at once."""
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
        """Remove what has stopped by now, and return it."""
        rested = []
        # In order: in a corner, the second movement may be at rest before the first has arrived.
        while self._running and self._running[0].rest_ns <= now_ns:
            rested.append(self._running.pop(0))
        return rested

    def start_due(self, now_ns: int) -> Movement | None:
        """Begin what may begin now, and return it; ``None`` for nothing."""
        corner = self._corner_ahead() and self._running[0].falls_ns <= now_ns
        if not self._waiting or not (corner or not self._running):
            return None
        movement = self._waiting.popleft()
        movement.start(now_ns)
        self._running.append(movement)
        return movement

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
