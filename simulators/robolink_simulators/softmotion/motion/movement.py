"""One commanded movement, from its command to its end."""

from dataclasses import dataclass
from enum import IntEnum

from robolink.timing import NS_PER_S
from robolink_simulators.cell.frames import ORIGIN, Frame
from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.kinematics.coordinates import CoordRef, CoordSystem
from robolink_simulators.softmotion.kinematics.kinematics import AxisValues
from robolink_simulators.softmotion.motion.paths import JointPath, LinePath, Path
from robolink_simulators.softmotion.motion.profile import Pace, SpeedProfile


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
        tool: The tool in force when it was commanded; it stays the movement's own.
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
        self._profile = SpeedProfile.fastest(0.0, pace)
        self._start_ns: int | None = None
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
        """Whether its rest is neither its end nor what it stops for, so that it can go on."""
        at_edge = self.latched and self.watch is not None and self.watch.stops
        return self.rest_share < 1 and not at_edge and not self.execution.ended

    @property
    def latched(self) -> bool:
        """Whether it met the edge that it watches for."""
        return self.execution.latched is not None

    @property
    def rest_ns(self) -> int:
        """When it comes to rest."""
        return self._instant(self._profile.duration_s)

    @property
    def falls_ns(self) -> int:
        """When it begins to slow down."""
        return self._instant(self._profile.falls_after_s)

    @property
    def rest_share(self) -> float:
        """How much of its path it will have covered at rest."""
        return self._profile.end

    def share_at(self, now_ns: int) -> float:
        """Return how much of its path it has covered."""
        if self._start_ns is None:
            return self._profile.start
        if now_ns >= self.rest_ns:
            return self._profile.end
        return self._profile.share_at((now_ns - self._start_ns) / NS_PER_S)

    def start(self, now_ns: int) -> None:
        """Begin, or go on after an interruption, from rest."""
        share = self._profile.end if self.begun else 0.0
        self._profile = SpeedProfile.fastest(share, self._pace)
        self._start_ns = now_ns
        self._braked = False
        self.execution.activate()

    def brake(self, now_ns: int) -> None:
        """Come to rest on the path with the movement's own deceleration (assumed)."""
        self._profile = self._braked_profile(now_ns)
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
        """Tell whether the corner between two movements can be rounded.

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

    def _instant(self, elapsed_s: float) -> int:
        return (self._start_ns or 0) + round(elapsed_s * NS_PER_S)
