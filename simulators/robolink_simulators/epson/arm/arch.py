"""The arches of Jump, and a Jump whose corners are rounded.

The seven arches of Jump (docs/reference/spel.md 7.1).

A Jump whose corners are rounded: up, across and down run into one another.

The reference says how far the tip rises straight and falls straight (docs/reference/spel.md 7.1).
What it does between is assumed: each part keeps the time law that it has in a gate motion, the way
across begins once the straight rise is behind, and the descent so late that the way across has
ended when what is left is the straight fall. It never begins before the rise has ended.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, NamedTuple

from robolink.model import Pose
from robolink_simulators.epson.arm.kinematics import forward
from robolink_simulators.epson.arm.robots import Joints
from robolink_simulators.epson.arm.trajectory import JointLeg
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

GATE: Final = 7
"""Arch number C7, the default: straight up, across, straight down (documented)."""


class Arch(NamedTuple):
    """How far a Jump rises before it begins to travel, and falls after it has travelled, in mm."""

    depart_mm: float
    approach_mm: float


AT_DELIVERY: Final = tuple(Arch(10.0 * n, 10.0 * n) for n in range(3, 10))
"""Arches at delivery: 30, 40 ... 90 mm on both sides (docs/reference/spel.md 6.3)."""


class ArchTable:
    """Arches 0 to 6 of one robot; no reset changes them (documented)."""

    def __init__(self) -> None:
        self._arches = list(AT_DELIVERY)

    def get(self, number: int) -> Arch | None:
        """Return an arch, ``None`` for C7, the gate.

        Raises:
            Refusal: There is no such number.
        """
        if number == GATE:
            return None
        self._require(number)
        return self._arches[number]

    def set(self, number: int, arch: Arch) -> None:
        """Change an arch; that neither distance is below 0 is assumed.

        Raises:
            Refusal: No such number, or such a distance.
        """
        self._require(number)
        if min(arch) < 0:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "An arch is not below 0 mm")
        self._arches[number] = arch

    def all(self) -> tuple[Arch, ...]:
        """Return arches 0 to 6."""
        return tuple(self._arches)

    def to_state(self) -> list[list[float]]:
        """Return what survives power-off, ready for JSON."""
        return [list(arch) for arch in self._arches]

    def restore(self, state: object) -> None:
        """Restore what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        if not isinstance(state, list) or len(state) != len(AT_DELIVERY):
            raise ValueError("not the arches of a robot")
        self._arches = [Arch(float(depart), float(approach)) for depart, approach in state]

    def _require(self, number: int) -> None:
        if not 0 <= number < GATE:
            raise SpelRefusal(RefusalKind.ARCH_NUMBER, f"There is no arch {number}")


_Part = tuple[int, JointLeg]


@dataclass(frozen=True, slots=True)
class ArchedLeg:
    """A stretch of a motion whose parts overlap.

    Attributes:
        parts: When each part begins, in ns from the start of the whole motion, and the part.
        begin_ns: When the stretch begins, likewise.
        end_ns: When it ends.
    """

    parts: tuple[_Part, ...]
    begin_ns: int
    end_ns: int

    @property
    def duration_ns(self) -> int:
        """How long it takes."""
        return self.end_ns - self.begin_ns

    def joints_at(self, elapsed_ns: int) -> Joints:
        """Return the joints that long after the start of the stretch."""
        now_ns = self.begin_ns + min(max(elapsed_ns, 0), self.duration_ns)
        at = self.parts[0][1].start
        for at_ns, leg in self.parts:
            if now_ns <= at_ns:
                break
            there = leg.joints_at(now_ns - at_ns)
            if at == leg.start:
                at = there
            else:
                triples = zip(at, leg.start, there, strict=True)
                at = Joints(*(a + (c - b) for a, b, c in triples))
        return at

    def flange_at(self, elapsed_ns: int) -> Pose:
        """Return the pose of the flange that those joints give."""
        return forward(self.parts[0][1].model, self.joints_at(elapsed_ns))

    def braked(self, elapsed_ns: int) -> "ArchedLeg":
        """Return the same stretch, left to come to rest: each part that has begun brakes."""
        now_ns = self.begin_ns + elapsed_ns
        parts = tuple(
            (at_ns, leg.braked(now_ns - at_ns) if now_ns < at_ns + leg.duration_ns else leg)
            for at_ns, leg in self.parts
            if at_ns <= now_ns
        )
        end_ns = max(at_ns + leg.duration_ns for at_ns, leg in parts)
        return replace(self, parts=parts, end_ns=max(now_ns, end_ns))


def arched(gate: list[JointLeg], arch: Arch, *, looks: bool) -> list[ArchedLeg] | None:
    """Return rise, crossing and descent of a gate motion, rounded by an arch.

    Args:
        gate: The three legs of the gate motion.
        arch: How far the ends stay straight.
        looks: Whether something is looked at before the descent: that begins then when the way
            across has ended (assumed).

    Returns:
        The straight rise, what lies between, the straight fall; ``None`` where an end of the arch
        is longer than the way up or down, which makes a gate motion (documented; that one end
        is enough for that is assumed).
    """
    rise, across, fall = gate
    up_mm = rise.end.j3_mm - rise.start.j3_mm
    down_mm = fall.start.j3_mm - fall.end.j3_mm
    if arch.depart_mm >= up_mm or arch.approach_mm >= down_mm:
        return None
    across_ns = _after(rise, arch.depart_mm / up_mm)
    across_end_ns = across_ns + across.duration_ns
    early_ns = 0 if looks else _after(fall, 1 - arch.approach_mm / down_mm)
    fall_ns = max(rise.duration_ns, across_end_ns - early_ns)
    straight_ns = max(fall_ns, across_end_ns)
    end_ns = max(fall_ns + fall.duration_ns, straight_ns)
    parts = ((0, rise), (across_ns, across), (fall_ns, fall))
    marks = (0, across_ns, straight_ns, end_ns)
    return [ArchedLeg(parts, a, b) for a, b in pairwise(marks)]


def _after(leg: JointLeg, share: float) -> int:
    """Return when a leg of joint 3 alone has covered a share of its path."""
    low_ns, high_ns = 0, leg.duration_ns
    begin_mm, way_mm = leg.start.j3_mm, leg.end.j3_mm - leg.start.j3_mm
    while high_ns - low_ns > 1:
        middle_ns = (low_ns + high_ns) // 2
        if (leg.joints_at(middle_ns).j3_mm - begin_mm) / way_mm < share:
            low_ns = middle_ns
        else:
            high_ns = middle_ns
    return high_ns
