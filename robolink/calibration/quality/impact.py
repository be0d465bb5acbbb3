"""How far a change of a tool offset moves the tip at points that are driven with the tool.

A controller drives the tip *that it believes in* to a point's numbers (x, y, u). With the
stored offset t and the tool's angle ``u_tool``, the flange goes to
``(x, y) - Rz(u - u_tool) t``. The nozzle on the flange is the one that was just measured, so
its tip really sits at t', and

* with the old offset stored it goes to ``(x, y) + Rz(u - u_tool) (t' - t)``,
* with the new offset stored it goes to ``(x, y)`` exactly.

The displacement shown is the second minus the first, ``-Rz(u - u_tool) (t' - t)``, and
``-(t'_z - t_z)`` in height. It is the same when no nozzle was changed and only the number is
corrected: then the tip leaves the place at which the point was taught by as much. A change of
the tool's angle turns the nozzle about the tip by ``-(u'_tool - u_tool)`` besides.

On four axes the length is the same at every point; its direction turns with the point's U.

Where something leans (V or W is not 0) the same is said with ``R_f = R_point R_tool^T``, the
flange's orientation with the old offset, in place of ``Rz(u - u_tool)``; the nozzle turns by the
angle between the two tools' orientations then, about whichever axis.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from robolink.model import Pose, ToolOffset, angle_difference_deg, rotate_xy


@dataclass(frozen=True, slots=True)
class PointImpact:
    """What happens at one taught point.

    Attributes:
        number: Number of the point.
        pose: What is stored for it: a tip pose in the base.
        dx_mm, dy_mm, dz_mm: Displacement of the tip in base axes.
        turn_deg: By how much the nozzle turns about the tip: about Z, or, where a tool leans,
            the size of the turn.
    """

    number: int
    pose: Pose
    dx_mm: float
    dy_mm: float
    dz_mm: float
    turn_deg: float

    @property
    def distance_mm(self) -> float:
        """Length of the displacement."""
        return math.hypot(self.dx_mm, self.dy_mm, self.dz_mm)


_SAME_MM: Final = 1e-6
"""Displacements that differ by less are equal but for rounding."""


@dataclass(frozen=True, slots=True)
class Impact:
    """What a change of a tool offset does at taught points.

    Attributes:
        entries: The points that could be judged.
        undefined: Numbers that were asked for and are not taught.
        other_local: Points left out because their axes are not the base's, number to local.
    """

    entries: tuple[PointImpact, ...]
    undefined: tuple[int, ...] = ()
    other_local: Mapping[int, int] = field(default_factory=dict)

    @property
    def largest(self) -> PointImpact | None:
        """The point with the largest displacement, ``None`` when none could be judged.

        The first of several: on four axes they differ by rounding alone.
        """
        return max(self.entries, key=lambda entry: round(entry.distance_mm, 9), default=None)

    @property
    def alike(self) -> bool:
        """Whether the tip moves equally far at all of several points: none is the largest."""
        if len(self.entries) < 2:
            return False
        lengths_mm = [entry.distance_mm for entry in self.entries]
        return max(lengths_mm) - min(lengths_mm) < _SAME_MM

    @property
    def farthest(self) -> PointImpact | None:
        """The largest, where the points differ; one point is its own. ``None`` where none is."""
        return None if self.alike else self.largest


def impact_on(points: Mapping[int, Pose | None], *, old: ToolOffset, new: ToolOffset) -> Impact:
    """Return what replacing ``old`` by ``new`` does at ``points``.

    Args:
        points: Taught points by number, ``None`` for one that is not taught.
        old: The offset stored while the points were right, mm and degrees.
        new: The offset that is to be written.

    Whether a program drives a point with this tool at all is not stored in the point.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import impact_on
        >>> points = {1: Pose(250, 200, -30, 0), 2: None}
        >>> old, new = ToolOffset(12, -3.5, -20), ToolOffset(12.3, -3.9, -20)
        >>> impact = impact_on(points, old=old, new=new)
        >>> impact.largest.number, round(impact.largest.distance_mm, 3)
        (1, 0.5)
    """
    taught = {number: pose for number, pose in points.items() if pose is not None}
    return Impact(
        entries=tuple(
            _at(number, pose, old, new) for number, pose in taught.items() if pose.local == 0
        ),
        undefined=tuple(number for number in points if number not in taught),
        other_local={number: pose.local for number, pose in taught.items() if pose.local != 0},
    )


def _at(number: int, pose: Pose, old: ToolOffset, new: ToolOffset) -> PointImpact:
    if any((pose.v_deg, pose.w_deg, old.v_deg, old.w_deg, new.v_deg, new.w_deg)):
        return _at_leaning(number, pose, old, new)
    flange_u_deg = pose.u_deg - old.u_deg
    dx_mm, dy_mm = rotate_xy(old.x_mm - new.x_mm, old.y_mm - new.y_mm, flange_u_deg)
    return PointImpact(
        number,
        pose,
        dx_mm,
        dy_mm,
        old.z_mm - new.z_mm,
        angle_difference_deg(old.u_deg, new.u_deg),
    )


def _at_leaning(number: int, pose: Pose, old: ToolOffset, new: ToolOffset) -> PointImpact:
    from robolink.calibration.core.rotations import rotation_of  # numpy, late

    before, after = (
        rotation_of(Pose(0.0, 0.0, 0.0, *tool.components()[3:])) for tool in (old, new)
    )
    ends = zip(old.components()[:3], new.components()[:3], strict=True)
    flange = rotation_of(pose) @ before.T
    dx_mm, dy_mm, dz_mm = (flange @ [a - b for a, b in ends]).tolist()
    if not (old.v_deg or old.w_deg or new.v_deg or new.w_deg):
        turn_deg = angle_difference_deg(old.u_deg, new.u_deg)
    else:
        cosine = (float((after @ before.T).trace()) - 1) / 2
        turn_deg = math.degrees(math.acos(min(1.0, max(-1.0, cosine))))
    return PointImpact(number, pose, dx_mm, dy_mm, dz_mm, turn_deg)
