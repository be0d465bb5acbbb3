"""Checks that a camera sees a mark move as the robot moved it.

With the tool held in one orientation, every point of it moves by the vector by which the robot
moved, so a spot that is the tip moves by that vector too, whatever the offset is. A spot that
stands still does not, and one seen by a camera whose scale or turn changed moves by another one
(docs/reference/vision.md 7).
"""

import cmath
import math
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from robolink.errors import CalibrationError
from robolink.messages import tr

FOLLOWS_WITHIN: Final = 0.1
"""Largest difference between seen and known movement, as a share of the length, if the pixel size
is known."""

FOLLOWS_UNCALIBRATED: Final = 0.2
"""The same share if the pixel size is still unknown: both movements then include play of the
joints."""

LEAST_SHARE: Final = 1 / 3
"""Smallest share of the expected movement; a spot that moves less counts as stationary."""

PIXEL_SIGMA: Final = 0.1
"""Standard deviation of a found position, in pixels, unless the pictures show a larger one."""

CAMERA_SIGMA_MM: Final = 0.005
"""Standard deviation of a found position if the camera answers in mm."""

ROBOT_SIGMA_MM: Final = 0.005
"""Standard deviation of the distance that the robot really moves between two places, per axis."""

RADIUS_WITHIN: Final = 0.03
"""Largest relative difference between the radius of a spot and that in the other looks of a run."""

LEAST_RADIUS_PX: Final = 0.3
"""Smallest limit, in pixels, on a difference in radius: a finder scatters by 0.1 px."""

_FACTOR: Final = 3.0
"""Number of standard uncertainties that count as chance."""

_PLAY_AGAIN: Final = 1.5
"""Factor by which backlash may exceed the measured value at another place."""

_SAME_DIRECTION_DEG: Final = 5.0
"""Movements whose directions differ by less than this count as parallel."""

_DULLEST: Final = 0.1
"""Largest scatter of a movement, as a share of its length; a movement with more shows nothing."""


@dataclass(frozen=True, slots=True)
class CameraChangeRows:
    """Possible undetected change of a camera since its calibration; rectangular half widths.

    Attributes:
        scale: Relative change of its scale since it was calibrated.
        turn_deg: Change of its direction since then.
        height: Relative change of scale because the tip is longer or shorter than believed: 1 mm
            at a lens 100 mm away.
        scale_sigma: Standard deviation of scale and direction (radians) at its calibration.
    """

    scale: float = 0.005
    turn_deg: float = 0.5
    height: float = 0.01
    scale_sigma: float = 0.0

    @property
    def u_scale(self) -> float:
        """Standard uncertainty of its scale, relative."""
        return math.hypot(self.scale / math.sqrt(3), self.height / math.sqrt(3), self.scale_sigma)

    @property
    def u_turn_deg(self) -> float:
        """Standard uncertainty of its direction."""
        return math.hypot(self.turn_deg / math.sqrt(3), math.degrees(self.scale_sigma))


class MovementVerdict(Enum):
    """What a seen movement shows."""

    AS_KNOWN = auto()
    """The spot moved as the robot did."""

    ANOTHER = auto()
    """The spot moved, but not as the robot did."""

    NONE = auto()
    """The spot hardly moved."""


@dataclass(frozen=True, slots=True)
class SeenMovement:
    """A movement of a mark by the robot, and as the camera saw it.

    Attributes:
        known_mm: The robot's movement, base X and Y.
        seen: The spot's movement, in mm of the base or in pixels; compared in mm only.
        noise: Standard deviation of one coordinate of ``seen``, in its unit.
    """

    known_mm: tuple[float, float]
    seen: tuple[float, float]
    noise: float

    @property
    def known_length_mm(self) -> float:
        """How far the robot moved."""
        return math.hypot(*self.known_mm)

    @property
    def seen_length(self) -> float:
        """How far the spot moved."""
        return math.hypot(*self.seen)

    @property
    def ratio(self) -> complex:
        """Seen movement divided by the robot's: scale, and turn as its argument."""
        return complex(*self.seen) / complex(*self.known_mm)

    @property
    def turn_deg(self) -> float:
        """The angle by which the camera turned it."""
        return math.degrees(cmath.phase(self.ratio)) if self.seen_length else 0.0

    def along(self, other: "SeenMovement") -> bool:
        """Return whether the robot made another movement in the same direction."""
        turn = cmath.phase(complex(*self.known_mm) / complex(*other.known_mm))
        return abs(math.degrees(turn)) < _SAME_DIRECTION_DEG

    @property
    def tells(self) -> bool:
        """Return whether the movement is long enough to stand out from its scatter; in mm."""
        return self.noise <= _DULLEST * self.known_length_mm

    def judged(self, rows: CameraChangeRows, *, play_mm: float = 0.0) -> MovementVerdict:
        """Return the verdict on a calibrated camera.

        Args:
            rows: How much the camera may differ from its calibration.
            play_mm: By how much the joints were found to have play; up to 10 % are allowed for it.

        Example:
            >>> from robolink.calibration import CameraChangeRows, SeenMovement
            >>> rows = CameraChangeRows()
            >>> SeenMovement((1, 1), (1.01, 0.99), noise=0.003).judged(rows, play_mm=0).name
            'AS_KNOWN'
            >>> SeenMovement((1, 1), (0.81, 1.16), noise=0.003).judged(rows, play_mm=0).name
            'ANOTHER'
            >>> SeenMovement((1, 1), (0.002, -0.001), noise=0.003).judged(rows, play_mm=0).name
            'NONE'
        """
        length_mm = self.known_length_mm
        off_mm = math.dist(self.seen, self.known_mm)
        chance = _FACTOR * self.noise
        if self.seen_length < LEAST_SHARE * length_mm:
            return MovementVerdict.NONE
        play_mm = min(_PLAY_AGAIN * play_mm, FOLLOWS_WITHIN * length_mm)
        if play_mm and off_mm <= play_mm + chance:
            return MovementVerdict.AS_KNOWN
        along = abs(self.seen_length / length_mm - 1)
        across = abs(math.radians(self.turn_deg))
        share = self.noise / length_mm
        u_scale = math.hypot(rows.u_scale, share)
        u_turn = math.hypot(math.radians(rows.u_turn_deg), share)
        if along <= _FACTOR * u_scale and across <= _FACTOR * u_turn:
            return MovementVerdict.AS_KNOWN
        return MovementVerdict.ANOTHER

    def like(self, other: "SeenMovement", *, within: float) -> bool:
        """Return whether two movements were seen alike, each per mm of the robot's own.

        Args:
            other: The other one, of the same direction.
            within: By which share of its length they may differ, besides their scatter.
        """
        whole = abs(other.ratio)
        chance = _FACTOR * math.hypot(
            self.noise / self.known_length_mm, other.noise / other.known_length_mm
        )
        return abs(self.ratio - other.ratio) <= min(within * whole + chance, whole / 2)


def mm_camera_noise() -> float:
    """Return the standard deviation of a movement between two pictures of a camera of mm, mm."""
    return math.hypot(CAMERA_SIGMA_MM, CAMERA_SIGMA_MM, ROBOT_SIGMA_MM)


def same_radius(radius_px: float, usual_px: float) -> bool:
    """Return whether a spot is as wide as the others of a run: within 3 %, or 0.3 px."""
    return abs(radius_px - usual_px) <= max(RADIUS_WITHIN * usual_px, LEAST_RADIUS_PX)


def tip_did_not_move(movement: SeenMovement | None, *, in_mm: bool) -> CalibrationError:
    """Return the refusal of a spot that does not move with the tip.

    Args:
        movement: What was seen; ``None`` where it was seen at one of two places only.
        in_mm: Whether that is in mm; else in pixels that nobody can translate yet.
    """
    if movement is None:
        what = tr(
            "The camera found the tip at one place only: this does not show that it really "
            "is the tip."
        )
    elif in_mm and movement.seen_length < LEAST_SHARE * movement.known_length_mm:
        what = tr(
            "The camera's spot does not move with the tip: the robot moved {known:.2f} mm, "
            "the spot {seen:.2f} mm.",
            known=movement.known_length_mm,
            seen=movement.seen_length,
        )
    elif in_mm:
        what = tr(
            "The spot does not follow the tip: the robot moved {known:.2f} mm, the spot "
            "{seen:.2f} mm another way.",
            known=movement.known_length_mm,
            seen=movement.seen_length,
        )
    else:
        what = tr(
            "The camera's spot does not move with the tip: the robot moved {known:.2f} mm, "
            "the spot {seen:.1f} pixels.",
            known=movement.known_length_mm,
            seen=movement.seen_length,
        )
    return CalibrationError(
        "tip_did_not_move",
        what,
        remedy=tr("Look at the picture: is it dirt or a reflection? Clean window and tip."),
    )


def camera_changed(movement: SeenMovement) -> CalibrationError:
    """Return the refusal of a camera that does not see a known movement as it was calibrated."""
    return CalibrationError(
        "camera_changed",
        tr(
            "The robot moved the tip {known:.3f} mm; the camera saw {seen:.3f} mm, turned by "
            "{turn:+.1f} degrees.",
            known=movement.known_length_mm,
            seen=movement.seen_length,
            turn=movement.turn_deg,
        ),
        remedy=tr("Check lens, mount and picture, then calibrate the camera again."),
    )


def spot_changed(radius_px: float, usual_px: float) -> CalibrationError:
    """Return the refusal of a spot that is not as wide as in the other looks of a run."""
    return CalibrationError(
        "spot_changed",
        tr(
            "The spot has a radius of {radius:.2f} px; in the other pictures, {usual:.2f} px.",
            radius=radius_px,
            usual=usual_px,
        ),
        remedy=tr("Look at the pictures: is it the tip in all of them, in focus and clean?"),
    )
