"""How a fixed camera maps the plane of the tips: linearly, from pixels to the base.

What a camera saw on the tool, and where the flange was then.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from robolink.calibration.core.pose_checks import check_poses, require_finite
from robolink.calibration.flange_plane import (
    FlangePlane,
    TipHeight,
    known_z_mm,
    require_flange_in_base,
    solvable_planes,
)
from robolink.deprecation import deprecated
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, angle_difference_deg

Matrix2 = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class CameraModel:
    """Base coordinates of a pixel: ``matrix (px, py) + origin``.

    Attributes:
        mm_per_px: The 2 x 2 matrix: scale, turn, shear and mirror.
        origin_mm: Base point that is seen at pixel (0, 0).
        centre_mm: Base point at which its place is known best; ``None`` where nobody knows.
        place_sigma_mm: Standard deviation there of where it sees a thing, each axis.
        scale_sigma: Relative standard deviation of its scale.
    """

    mm_per_px: Matrix2
    origin_mm: tuple[float, float]
    centre_mm: tuple[float, float] | None = field(default=None, compare=False)
    place_sigma_mm: float = field(default=0.0, compare=False)
    scale_sigma: float = field(default=0.0, compare=False)

    def sigma_at_mm(self, x_mm: float, y_mm: float) -> float:
        """Return the uncertainty of the place of something seen at a place of the base.

        u^2 = u_place^2 + (u_scale times the distance from the centre)^2
        (docs/reference/evidence.md 7).
        """
        centre = self.centre_mm or (x_mm, y_mm)
        away_mm = math.dist((x_mm, y_mm), centre)
        return math.hypot(self.place_sigma_mm, self.scale_sigma * away_mm)

    def base_mm(self, px: float, py: float) -> tuple[float, float]:
        """Return the place in the base that a pixel sees."""
        (a, b), (c, d) = self.mm_per_px
        return (a * px + b * py + self.origin_mm[0], c * px + d * py + self.origin_mm[1])

    def pixel(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        """Return the pixel that sees a place of the base."""
        (a, b), (c, d) = self.mm_per_px
        dx, dy, area = x_mm - self.origin_mm[0], y_mm - self.origin_mm[1], self.determinant
        return (d * dx - b * dy) / area, (a * dy - c * dx) / area

    @property
    def determinant(self) -> float:
        """Area of a pixel in mm^2, negative when the image is mirrored."""
        (a, b), (c, d) = self.mm_per_px
        return a * d - b * c

    @property
    def mirrored(self) -> bool:
        """Whether the image is mirrored against the base seen from above."""
        return self.determinant < 0

    @property
    def scale_mm_per_px(self) -> tuple[float, float]:
        """Length of a pixel along the image's two axes."""
        (a, b), (c, d) = self.mm_per_px
        return math.hypot(a, c), math.hypot(b, d)

    @property
    def largest_mm_per_px(self) -> float:
        """Largest size of a pixel in any direction: the larger singular value."""
        (a, b), (c, d) = self.mm_per_px
        half = (a * a + b * b + c * c + d * d) / 2
        return math.sqrt(half + math.sqrt(max(half * half - self.determinant**2, 0.0)))

    @property
    def turn_deg(self) -> float:
        """Direction of the image's first axis in the base."""
        (a, _), (c, _) = self.mm_per_px
        return math.degrees(math.atan2(c, a))

    @property
    def shear_deg(self) -> float:
        """How far the image's axes deviate from a right angle."""
        sx, sy = self.scale_mm_per_px
        return math.degrees(math.acos(min(abs(self.determinant) / (sx * sy), 1.0)))


@dataclass(frozen=True, slots=True)
class CameraLimits:
    """Limits of an unchanged camera, and of a good one.

    Attributes:
        unequal_scale: Largest |scale_x / scale_y - 1| without a warning.
        shear_deg: Largest shear without a warning; a tilted camera shows as shear.
        rms_px: Largest residual without a warning.
        scale_change: Largest relative change of a scale since the last calibration.
        turn_change_deg: Largest change of turn or shear since then.
        most_unequal_scale: Largest |scale_x / scale_y - 1| at all: a lens that leans by 37 degrees.
        most_shear_deg: Largest shear at all: two of the pixels' axes that are no square's.
        most_rms_px: Largest residual at all: twenty times what a finder scatters.
        most_mm_per_px: Longest pixel at all: in a longer one 0.1 px are the error of a touch.
        interval_mm: Largest half 95 % interval of a length of the offset at all.
    """

    unequal_scale: float = 0.05
    shear_deg: float = 10.0
    rms_px: float = 0.5
    scale_change: float = 0.02
    turn_change_deg: float = 1.0
    most_unequal_scale: float = 0.25
    most_shear_deg: float = 20.0
    most_rms_px: float = 2.0
    most_mm_per_px: float = 0.2
    interval_mm: float = 0.05

    def exceeded(self, camera: CameraModel, rms_px: float | None) -> tuple[str, ...]:
        """Return the codes of the limits for a warning that a camera exceeds."""
        sx, sy = camera.scale_mm_per_px
        found = []
        if abs(sx / sy - 1) > self.unequal_scale:
            found.append("unequal_scale")
        if camera.shear_deg > self.shear_deg:
            found.append("large_shear")
        if rms_px is not None and rms_px > self.rms_px:
            found.append("large_pixel_residual")
        return tuple(found)

    @deprecated("CameraLimits.exceeded")
    def doubts(self, camera: CameraModel, rms_px: float | None) -> tuple[str, ...]:
        """Return what :meth:`exceeded` returns."""
        return self.exceeded(camera, rms_px)

    def require_camera(self, camera: CameraModel) -> None:
        """Refuse values that no camera looking at tips can have.

        Raises:
            CalibrationError: ``camera_implausible``.
        """
        sx, sy = camera.scale_mm_per_px
        unequal = max(sx, sy) / min(sx, sy) - 1
        if max(sx, sy) > self.most_mm_per_px:
            what = tr(
                "A pixel would be {found:.0f} micrometres long, limit {limit:.0f}.",
                found=1000 * max(sx, sy),
                limit=1000 * self.most_mm_per_px,
            )
        elif unequal > self.most_unequal_scale:
            what = tr(
                "The image's two axes would differ in scale by {found:.0f} %, limit {limit:.0f} %.",
                found=100 * unequal,
                limit=100 * self.most_unequal_scale,
            )
        elif camera.shear_deg > self.most_shear_deg:
            what = tr(
                "The image would be askew by {found:.1f} degrees, limit {limit:.1f}.",
                found=camera.shear_deg,
                limit=self.most_shear_deg,
            )
        else:
            return
        raise CalibrationError("camera_implausible", what, remedy=_seen_wrongly())

    def require_fit(self, rms_px: float | None, half_width95_mm: float | None) -> None:
        """Refuse looks that no camera fits well enough, or that determine too little.

        Args:
            rms_px: Root mean square of the residuals, ``None`` without a degree of freedom.
            half_width95_mm: The widest half interval of the offset, ``None`` where nothing tells.

        Raises:
            CalibrationError: ``large_pixel_residual`` or ``large_interval``.
        """
        if rms_px is not None and rms_px > self.most_rms_px:
            what = tr(
                "The looks differ from each other by {found:.1f} pixels, limit {limit:g}.",
                found=rms_px,
                limit=self.most_rms_px,
            )
            raise CalibrationError("large_pixel_residual", what, remedy=_seen_wrongly())
        if half_width95_mm is not None and half_width95_mm > self.interval_mm:
            what = tr(
                "The offset would be known to +-{found:.3f} mm, limit {limit:g} mm.",
                found=half_width95_mm,
                limit=self.interval_mm,
            )
            raise CalibrationError("large_interval", what, remedy=_seen_wrongly())


def _seen_wrongly() -> str:
    return tr(
        "Look at the pictures: did the camera find the tip in all of them? Clean window "
        "and tip, check focus and mount, then measure again."
    )


USUAL_CAMERA = CameraLimits()


def require_same_camera(
    now: CameraModel, before: CameraModel, limits: CameraLimits = USUAL_CAMERA
) -> None:
    """Refuse a camera that has changed; only where it looks may have moved.

    Args:
        now: The camera as it was found.
        before: The camera as it was at its last calibration.
        limits: How much may differ.

    Raises:
        CalibrationError: ``camera_changed``.

    Example:
        >>> from robolink.calibration import CameraModel, require_same_camera
        >>> before = CameraModel(((0.02, 0), (0, 0.02)), origin_mm=(290, 80))
        >>> moved = CameraModel(((0.02, 0), (0, 0.02)), origin_mm=(291, 80))
        >>> require_same_camera(moved, before)
    """
    changes = [
        abs(a / b - 1) for a, b in zip(now.scale_mm_per_px, before.scale_mm_per_px, strict=True)
    ]
    if now.mirrored != before.mirrored:
        what = tr("The image is mirrored against the last calibration.")
    elif max(changes) > limits.scale_change:
        what = tr("The scale of the image changed by {change:.1f} %.", change=100 * max(changes))
    elif abs(angle_difference_deg(now.turn_deg, before.turn_deg)) > limits.turn_change_deg:
        what = tr(
            "The camera turned by {turn:.2f} degrees.",
            turn=angle_difference_deg(now.turn_deg, before.turn_deg),
        )
    elif abs(now.shear_deg - before.shear_deg) > limits.turn_change_deg:
        what = tr(
            "The camera tilted: the shear changed from {before:.2f} to {now:.2f} degrees.",
            before=before.shear_deg,
            now=now.shear_deg,
        )
    else:
        return
    raise CalibrationError(
        "camera_changed", what, remedy=tr("Check camera, lens and mount, then calibrate it again.")
    )


@dataclass(frozen=True, slots=True)
class Sighting:
    """Something on the tool, seen by a camera while the flange stood still.

    Attributes:
        flange: Actual flange pose (Tool 0) at the picture, mm and degrees.
        x_mm, y_mm: Where it was seen, in the base.
        z_mm: Its height there, ``None`` for a camera that does not tell it.
    """

    flange: Pose
    x_mm: float
    y_mm: float
    z_mm: float | None = None

    def in_flange_mm(self, tip_z_mm: float = 0.0) -> tuple[float, float]:
        """Return X and Y of what was seen, in the flange's axes, where its Z is ``tip_z_mm``."""
        dx, dy = self.x_mm - self.flange.x_mm, self.y_mm - self.flange.y_mm
        return FlangePlane.of(self.flange).in_flange(dx, dy, tip_z_mm)


def check_sightings(
    sightings: tuple[Sighting, ...], *, allow_mixed_hand: bool = False
) -> tuple[str, ...]:
    """Refuse sightings that are not numbers, do not belong together, or are not of the base.

    Raises:
        CalibrationError: ``non_finite``, ``suspect_units``, ``mixed_hand``, ``mixed_local``,
            ``mixed_tool``, ``tool_pose`` or ``local_pose``.
    """
    for number, sighting in enumerate(sightings, start=1):
        require_finite(
            **{f"x_mm of sighting {number}": sighting.x_mm},
            **{f"y_mm of sighting {number}": sighting.y_mm},
            **{f"z_mm of sighting {number}": sighting.z_mm or 0.0},
        )
    flanges = [sighting.flange for sighting in sightings]
    doubts = check_poses(flanges, allow_mixed_hand=allow_mixed_hand)
    require_flange_in_base(flanges)
    return doubts


def seen_in_flange(
    sightings: Sequence[Sighting], height: TipHeight | None
) -> list[tuple[float, float]]:
    """Return X and Y of everything seen, in the flange's axes.

    Raises:
        CalibrationError: ``tilted_pose``.
    """
    solvable_planes([sighting.flange for sighting in sightings], height)
    return [sighting.in_flange_mm(known_z_mm(height)) for sighting in sightings]


def plane_gains(planes: Sequence[FlangePlane]) -> list[list[float]]:
    """Return by how much the mean of what was seen, in the flange's axes, changes with each.

    A line for X and for Y; X and Y of the base for each of the sightings, mm for 1 mm.
    """
    share = 1 / len(planes)
    columns = [plane.in_flange(*along) for plane in planes for along in ((1.0, 0.0), (0.0, 1.0))]
    return [[share * x for x, _ in columns], [share * y for _, y in columns]]
