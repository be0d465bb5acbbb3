"""How far a new value takes the tip of a tool from where the stored one has it."""

import math
from dataclasses import dataclass

from robolink.model import ToolOffset


@dataclass(frozen=True, slots=True)
class Jump:
    """The difference of two values of one tool.

    Attributes:
        length_mm: How far apart the tips are.
        angle_deg: By how much the orientations differ: one turn about one axis, 0 to 180.
    """

    length_mm: float
    angle_deg: float

    @classmethod
    def between(cls, before: ToolOffset, after: ToolOffset) -> "Jump":
        """Return how far ``after`` is from ``before``."""
        length_mm = math.dist(before.components()[:3], after.components()[:3])
        ours, theirs = _quaternion(before), _quaternion(after)
        # By the chord, because the cosine of a small angle says little about it; q and -q are one
        # orientation, so the nearer of them counts.
        opposite = (-a for a in ours)
        chord = min(math.dist(ours, theirs), math.dist(tuple(opposite), theirs))
        return cls(length_mm, math.degrees(4.0 * math.asin(min(1.0, chord / 2.0))))

    def exceeds(self, length_mm: float | None, angle_deg: float | None) -> bool:
        """Tell whether it is larger than a limit; ``None`` is none."""
        too_far = length_mm is not None and self.length_mm > length_mm
        return too_far or (angle_deg is not None and self.angle_deg > angle_deg)


def _quaternion(offset: ToolOffset) -> tuple[float, float, float, float]:
    """Return the unit quaternion of R = Rz(U) Ry(V) Rx(W)."""
    (cu, su), (cv, sv), (cw, sw) = (
        (math.cos(half), math.sin(half))
        for half in (math.radians(deg) / 2.0 for deg in offset.components()[3:])
    )
    return (
        cu * cv * cw + su * sv * sw,
        cu * cv * sw - su * sv * cw,
        cu * sv * cw + su * cv * sw,
        su * cv * cw - cu * sv * sw,
    )
