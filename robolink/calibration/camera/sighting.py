"""What a camera saw on the tool, and where the flange was then."""

from collections.abc import Sequence
from dataclasses import dataclass

from robolink.calibration.core.pose_checks import check_poses, require_finite
from robolink.calibration.flange_checks import require_flange_in_base
from robolink.calibration.flange_plane import FlangePlane, TipHeight, known_z_mm, solvable_planes
from robolink.model import Pose


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
    """Refuse sightings that are no numbers or do not belong together, or not to the base.

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
