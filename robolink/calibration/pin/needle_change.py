"""A new needle, from the difference between two looks at the same flange pose.

``t_new = t_old + Rz(-U) d`` with d the shift of the tip in base axes. What the camera or pin
gets wrong is in both looks and cancels; what every difference adds is counted in a chain,
until a full calibration is due (docs/reference/calibration.md 2.9). A flange that leans or hangs
upside down has R' d in place of Rz(-U) d (docs/reference/evidence.md 3).
"""

import math
from dataclasses import dataclass, replace

from robolink.calibration.core.dispersion import Dispersion, interval_of, require_positive
from robolink.calibration.core.pose_checks import (
    check_poses,
    components,
    refuses_by_name,
    require_finite,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.rotations import rotation_of
from robolink.calibration.core.statistics import NORMAL_95
from robolink.calibration.flange_plane import FlangePlane, require_flange_in_base
from robolink.calibration.pin.needle_chain import NeedleChain, NeedleLimits, StoredZ
from robolink.calibration.pin.one_touch import one_touch_sources
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, json_fields

Point = tuple[float, ...]
"""(x, y) or (x, y, z) in the base, mm."""

USUAL_LIMITS = NeedleLimits()

_LEAN_WITHOUT_HEIGHT_DEG = 0.5
"""Largest lean if heights are unknown: beyond it, a change of length of 1 mm, which two coordinates
cannot show, shifts the tip in X and Y by more than 0.009 mm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NeedleChangeResult(CalibrationResult):
    """A calibration by difference.

    Attributes:
        shift_mm: By how much the tip moved, base axes.
        chain: The chain with this change.
        full_calibration_due: Whether the chain asks for a full calibration now.
        stored_z: What is known of the Z that the change is added to; ``None`` where nobody looked.
        change_z_mm: Change of Z by the touch, new minus stored; ``None`` without a height.
        change_z_half95_mm: Half its 95 % interval: that of two touches.
    """

    shift_mm: Point
    chain: NeedleChain
    full_calibration_due: bool
    stored_z: StoredZ | None = None
    change_z_mm: float | None = None
    change_z_half95_mm: float | None = None

    def details(self) -> dict[str, object]:
        """Return the change of Z by name, and what is known of the value that it is added to."""
        if self.stored_z is None:
            return {}
        return json_fields(self, "change_z_mm", "change_z_half95_mm", "stored_z")

    def added_to(self, stored: StoredZ, *, touch_sigma_mm: float) -> "NeedleChangeResult":
        """Return the same with Z named as a change of the stored one.

        Where an earlier measurement is on record, Z has an interval of its own: that of then, with
        two touches more, since the touches between cancel (:meth:`NeedleChain.after`).

        Args:
            stored: What is known of the stored Z.
            touch_sigma_mm: Standard deviation of one coordinate of one touch.

        Example:
            >>> from robolink import Pose, ToolOffset
            >>> from robolink.calibration import NeedleChain, StoredZ, solve_needle_change
            >>> found = solve_needle_change(
            ...     Pose(300, 100, -60, 0),
            ...     before_mm=(312.0, 96.5, -80.0),
            ...     after_mm=(312.3, 96.3, -79.6),
            ...     stored=ToolOffset(12, -3.5, -20),
            ...     chain=NeedleChain(sigma_mm=0.02),
            ...     sigma_mm=0.01,
            ... ).added_to(StoredZ(-20.0), touch_sigma_mm=0.01)
            >>> found.measured, found.changed, round(found.change_z_mm, 3)
            (('x_mm', 'y_mm'), ('z_mm',), 0.4)
        """
        if "z_mm" not in self.measured:
            return self
        at = self.measured.index("z_mm")
        u_mm = math.sqrt(2) * touch_sigma_mm
        named = replace(
            self,
            stored_z=stored,
            change_z_mm=self.offset.z_mm - stored.value_mm,
            change_z_half95_mm=NORMAL_95 * u_mm,
        )
        if stored.half95_mm is None:
            return replace(
                named,
                measured=self.measured[:at],
                changed=("z_mm",),
                covariance=tuple(row[:at] for row in self.covariance[:at]),
                half_width95=self.half_width95[:at],
                region95_radius_mm=_region_mm(self.covariance[0][0], at, touch_sigma_mm),
                rank=at,
                sources=one_touch_sources(at),
            )
        u_z_mm = math.hypot(stored.half95_mm / NORMAL_95, u_mm)
        rows = [list(row) for row in self.covariance]
        rows[at][at] = u_z_mm**2
        return replace(
            named,
            covariance=tuple(map(tuple, rows)),
            half_width95=(*self.half_width95[:at], NORMAL_95 * u_z_mm),
            region95_radius_mm=_region_mm(
                max(self.covariance[0][0], u_z_mm**2), at + 1, touch_sigma_mm
            ),
        )


def _region_mm(variance: float, lengths: int, sigma_mm: float) -> float | None:
    """Return the radius of the region of so many lengths, the worst of which has a variance."""
    scatter = Dispersion.of(0.0, 0, sigma_mm)
    return None if scatter is None else scatter.region_mm(variance, lengths)


@refuses_by_name
def solve_needle_change(
    flange: Pose,
    before_mm: Point,
    after_mm: Point,
    *,
    stored: ToolOffset,
    chain: NeedleChain,
    sigma_mm: float,
    limits: NeedleLimits = USUAL_LIMITS,
    shared_touch: bool = False,
) -> NeedleChangeResult:
    """Return the offset of a new needle from the places of the old tip and of the new one.

    Args:
        flange: The flange pose (Tool 0) of both looks. It may lean where all three coordinates
            are given, and by half a degree where only X and Y are.
        before_mm: Where the old tip was seen, (x, y) or (x, y, z) in the base.
        after_mm: Where the new tip is seen.
        stored: The offset of the old needle; what is not measured is kept from it.
        chain: What has happened since the last full calibration.
        sigma_mm: Standard deviation of one coordinate of one look.
        limits: When a shift is not believed, and when a full calibration is due.
        shared_touch: Whether the old tip's place is that of the change before, so that it was not
            touched again; see :meth:`NeedleChain.after`.

    Raises:
        CalibrationError: ``implausible_change``, ``non_finite``, ``suspect_units``,
            ``tool_pose``, ``local_pose``, ``tilted_pose`` or ``implausible_offset``.
        ConfigError: A standard deviation or limit is not positive.
        ValueError: The two places do not have two or three coordinates each.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import NeedleChain, solve_needle_change
        >>> found = solve_needle_change(
        ...     Pose(300, 100, -60, 0),
        ...     before_mm=(312.0, 96.5),
        ...     after_mm=(312.3, 96.3),
        ...     stored=ToolOffset(12, -3.5, -20),
        ...     chain=NeedleChain(sigma_mm=0.02),
        ...     sigma_mm=0.01,
        ... )
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.3, -3.7)
    """
    _check_places(before_mm, after_mm)
    require_positive(limits.tolerance_mm, "tolerance_mm")
    check_poses((flange,), allow_mixed_hand=False)
    require_flange_in_base((flange,))
    shift = tuple(b - a for a, b in zip(before_mm, after_mm, strict=True))
    _require_plausible(math.hypot(*shift), limits.max_change_mm)
    names = ("x_mm", "y_mm", "z_mm")
    found = {
        name: getattr(stored, name) + change
        for name, change in zip(names, _in_flange(flange, shift), strict=False)
    }
    scatter = Dispersion.of(0.0, 0, sigma_mm)
    now = chain.after(math.sqrt(2) * sigma_mm, shared_touch=shared_touch)
    due = now.is_due(limits)
    return NeedleChangeResult(
        method="needle_change",
        **components(stored, **found),
        reference_point_mm=tuple(after_mm),
        sigma_gain=now.sigma_mm / sigma_mm,
        warnings=("full_calibration_due",) if due else (),
        inputs=(flange,),
        **interval_of(scatter, (now.sigma_mm**2,) * len(found), len(found)),
        sigma_mm=sigma_mm,
        sigma_stated=True,
        rank=len(found),
        dof=0,
        sources=one_touch_sources(len(found)),
        shift_mm=shift,
        chain=now,
        full_calibration_due=due,
    )


def _in_flange(flange: Pose, shift: Point) -> list[float]:
    """Return a shift of the base in the flange's axes.

    Raises:
        CalibrationError: ``tilted_pose``: a change of length would mix in unseen.
    """
    if len(shift) == 3:
        turned: list[float] = (rotation_of(flange).T @ shift).tolist()
        return turned
    plane = FlangePlane.of(flange)
    if plane.lean_deg > _LEAN_WITHOUT_HEIGHT_DEG:
        raise CalibrationError(
            "tilted_pose",
            tr(
                "The flange leans by {lean:.2f} degrees, so a longer or shorter "
                "needle would look as if it had moved sideways.",
                lean=plane.lean_deg,
            ),
            remedy=tr("Hold the flange upright or straight upside down, or give the height too."),
        )
    return list(plane.in_flange(*shift))


def _check_places(before_mm: Point, after_mm: Point) -> None:
    if len(before_mm) != len(after_mm) or len(before_mm) not in (2, 3):
        raise ValueError("both places need two coordinates, or both three")
    for name, before, after in zip("xyz", before_mm, after_mm, strict=False):
        require_finite(**{f"{name} before": before, f"{name} after": after})


def _require_plausible(shift_mm: float, limit_mm: float) -> None:
    if shift_mm > limit_mm:
        raise CalibrationError(
            "implausible_change",
            tr(
                "This needle is {shift:.3f} mm away from the last one; up to {limit:.3f} mm "
                "is usual.",
                shift=shift_mm,
                limit=limit_mm,
            ),
            remedy=tr("Check how it is seated, or run a full calibration."),
        )
