"""The effect of a new offset: whether it may replace the stored one, and where the tip goes.

Whether a new offset may replace the stored one.

A correction with the wrong sign makes the next one about twice as large, and the one after
that twice again; the classic bug of every home-made calibration
(docs/reference/calibration.md 2.9). It is caught here by comparing corrections, not by trusting the
sign.

How far a change of a tool offset moves the tip at points that are driven with the tool.

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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from robolink.calibration.core.pose_checks import refuses_by_name
from robolink.calibration.core.result import CalibrationResult
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, angle_difference_deg, rotate_xy

NEEDLE_LIMIT_MM = 2.0
"""Largest plausible change by a new needle, in mm; 0.5 mm is usual for a nozzle
(docs/reference/calibration.md 2.9)."""

NOISE_MM = 0.05


TAKEN_AGAIN = ("step_in_run_order", "drift_in_run_order")
"""Doubts that require the touches to be repeated (docs/reference/evidence.md 8)."""

BIRGE_LIMIT = 3.0
"""Largest ratio of the residuals to the stated sigma; above it, a person has to check."""


def writes_refused_unattended(result: CalibrationResult) -> str:
    """Return the code of a doubt that only a person may override; empty without one.

    Something that moved while the touches were made leaves an offset between two truths, and
    nobody is there to take the run again.
    """
    for code in TAKEN_AGAIN:
        if code in result.warnings:
            return code
    ratio = result.evidence.birge_ratio if result.evidence is not None else None
    return "sigma_contradicted" if ratio is not None and ratio > BIRGE_LIMIT else ""


@dataclass(frozen=True, slots=True)
class Correction:
    """Difference between a new offset and the stored one, mm in the flange's axes.

    ``ratio`` is its length over that of the correction before, ``None`` for the first.
    """

    dx_mm: float
    dy_mm: float
    dz_mm: float
    ratio: float | None

    @property
    def distance_mm(self) -> float:
        """Length of the correction."""
        return math.hypot(self.dx_mm, self.dy_mm, self.dz_mm)


def update_guard(
    new: ToolOffset,
    *,
    stored: ToolOffset,
    earlier_mm: Sequence[float] = (),
    max_change_mm: float = NEEDLE_LIMIT_MM,
    noise_mm: float = NOISE_MM,
) -> Correction:
    """Return the correction if it is plausible.

    Args:
        new: The offset that is proposed.
        stored: The offset that is in force.
        earlier_mm: Lengths of the corrections made since the tip was mounted, oldest first.
        max_change_mm: Largest change that is believed.
        noise_mm: Corrections up to this may grow: they only repeat the noise.

    Raises:
        CalibrationError: ``implausible_change`` or ``diverging``.

    Example:
        >>> from robolink import ToolOffset
        >>> from robolink.calibration import update_guard
        >>> found = update_guard(ToolOffset(12.3, -3.9, -20), stored=ToolOffset(12, -3.5, -20))
        >>> round(found.distance_mm, 3)
        0.5
    """
    changes = (new.x_mm - stored.x_mm, new.y_mm - stored.y_mm, new.z_mm - stored.z_mm)
    length = math.hypot(*changes)
    # Divergence is checked first: a diverging series ends in an implausible change too.
    require_shrinking(length, earlier_mm, noise_mm=noise_mm)
    if length > max_change_mm:
        raise CalibrationError(
            "implausible_change",
            tr(
                "The tip would move {change:.3f} mm; {limit:.3f} mm is allowed. Nothing was "
                "written.",
                change=length,
                limit=max_change_mm,
            ),
            remedy=tr("Is the right needle mounted, and tight? Then measure again."),
        )
    before = earlier_mm[-1] if earlier_mm else None
    return Correction(*changes, ratio=length / before if before else None)


def require_shrinking(
    now_mm: float, earlier_mm: Sequence[float], *, noise_mm: float = NOISE_MM
) -> None:
    """Refuse a correction that is larger than the one before it on the same nozzle.

    Args:
        now_mm: Length of the correction that is proposed.
        earlier_mm: Lengths of those made since the nozzle was mounted, oldest first.
        noise_mm: Corrections up to this may grow: they only repeat the noise.

    Raises:
        CalibrationError: ``diverging``.

    Example:
        >>> from robolink.calibration import require_shrinking
        >>> require_shrinking(0.1, earlier_mm=[0.4])
        >>> require_shrinking(0.04, earlier_mm=[0.01])  # less than what touches scatter
    """
    if not earlier_mm or now_mm <= max(earlier_mm[-1], noise_mm):
        return
    raise CalibrationError(
        "diverging",
        tr(
            "The correction grew from {before:.3f} mm to {now:.3f} mm.",
            now=now_mm,
            before=earlier_mm[-1],
        ),
        remedy=tr(
            "Do not write it. A growing correction has the wrong sign, axis or angle; check how "
            "the camera or the sensor is turned."
        ),
    )


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
"""Largest difference between displacements that is only rounding, in mm."""


@dataclass(frozen=True, slots=True)
class Impact:
    """The effect of a changed tool offset at taught points.

    Attributes:
        entries: The points that could be judged.
        undefined: Numbers that were asked for and are not taught.
        other_local: Points left out because their axes are not the base's, number to local.
    """

    entries: tuple[PointImpact, ...]
    undefined: tuple[int, ...] = ()
    other_local: Mapping[int, int] = field(default_factory=dict, hash=False)

    @property
    def largest(self) -> PointImpact | None:
        """The point with the largest displacement, ``None`` if none could be judged.

        The first of several: on four axes they differ by rounding alone.
        """
        return max(self.entries, key=lambda entry: round(entry.distance_mm, 9), default=None)

    @property
    def alike(self) -> bool:
        """Whether the tip moves equally far at all of several points."""
        if len(self.entries) < 2:
            return False
        lengths_mm = [entry.distance_mm for entry in self.entries]
        return max(lengths_mm) - min(lengths_mm) < _SAME_MM

    @property
    def farthest(self) -> PointImpact | None:
        """The largest if the points differ; a single point itself; ``None`` without points."""
        return None if self.alike else self.largest


@refuses_by_name
def impact_on(points: Mapping[int, Pose | None], *, old: ToolOffset, new: ToolOffset) -> Impact:
    """Return the effect at ``points`` of replacing ``old`` by ``new``.

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
    from robolink.calibration.core.rotations import rotation_of  # numpy, imported late

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
