"""A pose is where the tip is, and what was sent somewhere arrives there: by the machine itself."""

import math
import weakref
from typing import Final

from robolink.model import Motion, Pose, ToolOffset, WorkBox
from robolink_simulators.cell.frames import Frame, axis_and_angle, product, transposed
from robolink_simulators.epson.arm.kinematics import frame_of
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.rules.so_far import Grounds

_NEAR_MM: Final = 0.05
_NEAR_DEG: Final = 0.05
"""Room for three decimals, for the noise of a measured position, and for an arm's resolution."""

_MOVED_MM: Final = 1e-6


class PlaceRules:
    """Compares poses and targets with where the machine's tip is.

    Args:
        grounds: What the rules rest on.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds
        self._before: dict[int, Frame | None] = {}
        # Not the movement itself: it holds the controller of a process that may be killed.
        self._sent: dict[int, tuple[weakref.ref[Motion], ToolOffset | None]] = {}

    def begin(self) -> None:
        """Begin an hour."""
        self._before.clear()
        self._sent.clear()

    def begins(self, process: VirtualProcess) -> None:
        """Note where the tip is when a call of a process begins; nothing while it moves."""
        self._before[process.number] = self._standing()

    def begun(
        self, process: VirtualProcess, motion: Motion, target: Pose, box: WorkBox
    ) -> tuple[bool, str]:
        """Return whether a movement goes where it was sent, in its box; and what was seen."""
        self._sent[process.number] = weakref.ref(motion), self._value_of(target.tool)
        limits = (
            (box.x_min_mm, target.x_mm, box.x_max_mm),
            (box.y_min_mm, target.y_mm, box.y_max_mm),
            (box.z_min_mm, target.z_mm, box.z_max_mm),
        )
        inside = all(low <= value <= high for low, value, high in limits)
        return (
            inside and motion.target == target,
            f"a movement goes to {motion.target}, sent to {target}, in {box}",
        )

    def arrived(self, process: VirtualProcess, motion: Motion) -> tuple[bool, str]:
        """Return whether a movement that arrived is where it was sent; and what was seen."""
        tip, target = self._standing(), motion.target
        sent, value = self._sent.get(process.number, (None, None))
        if sent is None or sent() is not motion or tip is None:
            return True, ""  # one that ends at an input ends somewhere on its way
        if target.tool != self._on.plant.state().selected or value != self._value_of(target.tool):
            return True, ""  # somebody has selected another one meanwhile, or typed its value
        return _alike(tip, frame_of(target)), f"it arrived at {tip}, sent to {target}"

    def read(self, process: VirtualProcess, pose: Pose) -> tuple[bool, str]:
        """Return whether a pose that was read is where the tip stands; and what was seen."""
        before, now = self._before.get(process.number), self._standing()
        if before is None or now is None or math.dist(before.shift_mm, now.shift_mm) > _MOVED_MM:
            return True, ""  # it was somewhere on the way
        return _alike(now, frame_of(pose)), f"{pose} was read, the tip is at {now}"

    def _value_of(self, tool: int | None) -> ToolOffset | None:
        return None if tool is None else self._on.plant.state().tools.get(tool)

    def _standing(self) -> Frame | None:
        return None if self._on.plant.moving else self._on.plant.tip()


def _alike(one: Frame, other: Frame) -> bool:
    turn = product(transposed(one.rotation), other.rotation)
    off_mm, (_, off_deg) = math.dist(one.shift_mm, other.shift_mm), axis_and_angle(turn)
    return off_mm <= _NEAR_MM and abs(off_deg) <= _NEAR_DEG
