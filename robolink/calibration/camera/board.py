"""A board held by the gripper: its place and direction as a tool, from fiducials.

Two fiducials (EPSON's CalcBoardTool): the origin is the middle between them and the
direction runs from the second to the first. A drawing that runs from 1 to 2 is off by
180 degrees (docs/reference/calibration.md 1.3). Both are seen from the flange's own axes, so its
lean and which way up it hangs go in first (docs/reference/evidence.md 3).

A board with fiducials, as its drawing shows it, and where they are on a tool.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from robolink.calibration.camera.camera_model import (
    CameraModel,
    Sighting,
    check_sightings,
    plane_gains,
    seen_in_flange,
)
from robolink.calibration.camera.camera_uncertainty import (
    camera_part,
    camera_sources,
    print_source,
)
from robolink.calibration.core.dispersion import Dispersion, interval_of
from robolink.calibration.core.pose_checks import (
    components,
    refuses_by_name,
    require_finite,
    require_poses,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.flange_plane import FlangePlane, TipHeight, height_of, with_height_error
from robolink.calibration.quality.station import with_station
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import ToolOffset, rotate_xy

LEAST_SPACING_MM = 5.0

SPACING_TOLERANCE = 0.01
"""Largest relative difference from the nominal spacing (docs/reference/calibration.md 3)."""


@refuses_by_name
def solve_board(
    first: Sighting,
    second: Sighting,
    *,
    stored: ToolOffset | None = None,
    height: TipHeight | None = None,
    spacing_mm: float | None = None,
    sigma_mm: float | None = None,
    camera: CameraModel | None = None,
    allow_mixed_hand: bool = False,
) -> CalibrationResult:
    """Return the tool of a board of which two fiducials were seen.

    Args:
        first: Fiducial 1, with the actual flange pose at its picture.
        second: Fiducial 2, likewise; each may have a pose of its own.
        stored: The offset stored now; Z, V and W are kept from it, or 0 without one.
        height: Z of the board, for a flange that leans; without it that of ``stored`` counts.
        spacing_mm: Nominal distance between the fiducials, checked when it is given.
        sigma_mm: Standard deviation of one coordinate of one sighting.
        camera: The camera, whose place and scale are as uncertain as they say.
        allow_mixed_hand: Warn instead of refusing when the arm was configured differently.

    Raises:
        CalibrationError: ``coincident_fiducials``, ``spacing_mismatch``, ``non_finite``,
            ``suspect_units``, ``mixed_hand``, ``mixed_local``, ``mixed_tool``, ``tool_pose``,
            ``local_pose``, ``tilted_pose`` or ``implausible_offset``.
        ConfigError: ``sigma_mm`` is not positive.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import Sighting, solve_board
        >>> flange = Pose(300, 100, -60, 0)
        >>> fiducials = Sighting(flange, 312, 96.5), Sighting(flange, 352, 96.5)
        >>> found = solve_board(*fiducials, spacing_mm=40)
        >>> offset = found.offset
        >>> [round(value, 3) for value in (offset.x_mm, offset.y_mm, offset.u_deg)]
        [32.0, -3.5, 180.0]
    """
    warnings = check_sightings((first, second), allow_mixed_hand=allow_mixed_hand)
    height = height_of(stored, height)
    places = seen_in_flange((first, second), height)
    x_mm, y_mm, u_deg = _middle_and_direction(places)
    spacing = math.dist(*places)
    check_spacing(spacing, spacing_mm)
    scatter = Dispersion.of(0.0, 0, sigma_mm)
    marks_mm = (spacing / 2, 0.0), (-spacing / 2, 0.0)
    gains = _pair_gains((first, second), places)
    one_mm = scatter.sigma_mm if scatter else 0.0
    half, angle = one_mm**2 / 2, 2 * (math.degrees(one_mm) / spacing) ** 2
    result = CalibrationResult(
        method="board",
        **components(stored, x_mm=x_mm, y_mm=y_mm, u_deg=u_deg),
        reference_point_mm=(),
        sigma_gain=1 / math.sqrt(2),
        warnings=warnings,
        inputs=(first.flange, second.flange),
        **interval_of(scatter, (half, half, angle), 2),
        sigma_mm=sigma_mm,
        sigma_stated=scatter is not None,
        interval_from=scatter.source if scatter else "",
        rank=3,
        # The spacing is known too, but serves only as a check.
        dof=0,
        sources=(
            *camera_sources((first, second), gains, camera=camera, finds_place=False),
            print_source((first, second), gains, marks_mm),
        ),
        marks_mm=marks_mm,
    )
    result = with_height_error(result, mean_by_height((first, second)), height)
    if camera is None:
        return result
    part = camera_part(
        camera,
        (first, second),
        lambda seen: _middle_and_direction(seen_in_flange(seen, height)),
        angles=(2,),
    )
    return with_station(result, part)


def _middle_and_direction(places: Sequence[tuple[float, float]]) -> tuple[float, float, float]:
    """Return the middle of two fiducials in the flange's axes, and the direction to the first."""
    (x1, y1), (x2, y2) = places
    return (x1 + x2) / 2, (y1 + y2) / 2, math.degrees(math.atan2(y1 - y2, x1 - x2))


def _pair_gains(
    pair: Sequence[Sighting], places: Sequence[tuple[float, float]]
) -> list[list[float]]:
    """Return by how much middle and direction change with each of two sightings, base X and Y."""
    planes = [FlangePlane.of(sighting.flange) for sighting in pair]
    (x1, y1), (x2, y2) = places
    along, square = (x1 - x2, y1 - y2), (x1 - x2) ** 2 + (y1 - y2) ** 2
    turns = []
    for plane, sign in zip(planes, (1.0, -1.0), strict=True):
        for axis in ((1.0, 0.0), (0.0, 1.0)):
            dx, dy = plane.in_flange(*axis)
            turns.append(sign * math.degrees(along[0] * dy - along[1] * dx) / square)
    return [*plane_gains(planes), turns]


def mean_by_height(sightings: Sequence[Sighting]) -> tuple[float, float]:
    """Return how far the middle of what was seen moves, in the flange, for 1 mm of its height."""
    moved = [FlangePlane.of(s.flange).in_flange(0.0, 0.0, 1.0) for s in sightings]
    return sum(x for x, _ in moved) / len(moved), sum(y for _, y in moved) / len(moved)


def check_spacing(spacing_mm: float, nominal_mm: float | None) -> None:
    """Refuse fiducials that cannot be the intended ones.

    Raises:
        CalibrationError: ``coincident_fiducials`` or ``spacing_mismatch``.
    """
    if spacing_mm < LEAST_SPACING_MM:
        raise CalibrationError(
            "coincident_fiducials",
            tr("The fiducials are {spacing:.3f} mm apart.", spacing=spacing_mm),
            remedy=tr(
                "Use fiducials far apart; at {least:.0f} mm or less no direction is found.",
                least=LEAST_SPACING_MM,
            ),
        )
    if nominal_mm is not None and abs(spacing_mm - nominal_mm) > SPACING_TOLERANCE * nominal_mm:
        raise CalibrationError(
            "spacing_mismatch",
            tr(
                "The fiducials are {spacing:.3f} mm apart; the drawing says {nominal:.3f} mm.",
                spacing=spacing_mm,
                nominal=nominal_mm,
            ),
            remedy=tr("Check the marks that the camera found, and its scale."),
        )


@dataclass(frozen=True, slots=True)
class BoardDrawing:
    """Fiducials of a board, in the axes of its tool.

    Attributes:
        fiducials_mm: X and Y of each, in the order of their numbers.
    """

    fiducials_mm: tuple[tuple[float, float], ...]

    @classmethod
    def of_two(cls, spacing_mm: float) -> "BoardDrawing":
        """Return EPSON's board: the origin half way between two fiducials, X from 2 to 1."""
        return cls(((spacing_mm / 2, 0.0), (-spacing_mm / 2, 0.0)))

    @property
    def is_pair(self) -> bool:
        """Whether it is EPSON's board of two fiducials."""
        spacing_mm = math.dist(self.fiducials_mm[0], self.fiducials_mm[1])
        return self == BoardDrawing.of_two(spacing_mm)

    def require_apart(self) -> None:
        """Refuse a drawing in which fiducials coincide.

        Raises:
            CalibrationError: ``too_few_poses``, ``non_finite`` or ``coincident_fiducials``.
        """
        require_poses(len(self.fiducials_mm), 2)
        for number, (x, y) in enumerate(self.fiducials_mm, start=1):
            require_finite(**{f"x of fiducial {number}": x, f"y of fiducial {number}": y})
        for one, other in combinations(self.fiducials_mm, 2):
            check_spacing(math.dist(one, other), None)

    def seen_from(self, board: ToolOffset) -> tuple[ToolOffset, ...]:
        """Return where the fiducials are, seen from the frame that holds the board there."""
        turned = [rotate_xy(x, y, board.u_deg) for x, y in self.fiducials_mm]
        return tuple(ToolOffset(board.x_mm + dx, board.y_mm + dy, board.z_mm) for dx, dy in turned)
