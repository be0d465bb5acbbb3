"""An up-looking camera that stands in the cell, and how marks are brought before it."""

from dataclasses import dataclass
from typing import Final

from robolink.calibration._camera import Sighting
from robolink.calibration._camera_model import CameraModel
from robolink.calibration._steps import SeenAt
from robolink.calibration._turning import toward_zero
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import SpotUnit

HALF_ROUND_DEG: Final = (0.0, 60.0, 120.0, 180.0)
"""Four angles over half a turn, which joints allow wherever they allow to turn about a tip at
all; a whole turn would bring 0.50 sigma in place of 0.55. In steps of less than half a turn, so
that no controller has two ways to choose from, and all in one direction."""

TWO_ANGLES_DEG: Final = (0.0, 120.0)
"""Two that tell the camera's own error from what is on the tool."""

LEAST_SPAN_MM: Final = 0.2
"""A smaller pattern does not tell what a pixel is."""


@dataclass(frozen=True, slots=True)
class CameraStation:
    """A camera that looks up.

    Attributes:
        x_mm, y_mm: Point of the base to which marks are brought, near the middle of the image.
        z_mm: Height in the base at which it is in focus.
        model: What its pixels mean, from :func:`find_camera`; ``None`` where it is unknown, or
            where the camera answers in millimetres itself.
    """

    x_mm: float
    y_mm: float
    z_mm: float
    model: CameraModel | None = None

    def base_mm(self, seen: SeenAt) -> tuple[float, float]:
        """Return where in the base something was seen.

        Raises:
            CalibrationError: ``camera_not_calibrated``.
        """
        if seen.unit is SpotUnit.BASE_MM:
            return seen.spot.x, seen.spot.y
        return self.require_model().base_mm(seen.spot.x, seen.spot.y)

    def require_model(self) -> CameraModel:
        """Return what the pixels mean.

        Raises:
            CalibrationError: ``camera_not_calibrated``.
        """
        if self.model is None:
            raise CalibrationError(
                "camera_not_calibrated",
                tr("The camera answers in pixels, and nothing says what they mean."),
                remedy=tr("Calibrate it first: robolink calibrate camera-affine."),
            )
        return self.model

    def sighting(self, seen: SeenAt) -> Sighting:
        """Return a look as what was seen in the base.

        Raises:
            CalibrationError: ``camera_not_calibrated``.
        """
        return Sighting(seen, *self.base_mm(seen))


@dataclass(frozen=True, slots=True)
class LookPlan:
    """How marks are brought before a camera.

    Attributes:
        turns_deg: Angles U of the looks, counted toward zero from where the tool stands.
        pictures: How many are taken at each; the median counts.
        lift_mm: How far the mark is lifted before anything turns.
        centre_first: Look once to find the mark, and bring it to the middle for the measurement:
            there an error of the camera's scale, or of the height, does no harm.
        search_mm: How far from where it is expected the first look may find the mark; the robot
            does not follow anything farther.
        beside_mm: Every place is approached from this far beside it in X and Y, always from the
            same side, so that play in the joints shifts all looks alike.
    """

    turns_deg: tuple[float, ...] = HALF_ROUND_DEG
    pictures: int = 3
    lift_mm: float = 10.0
    centre_first: bool = True
    search_mm: float = 5.0
    beside_mm: float = 1.0

    def angles_deg(self, u_deg: float) -> tuple[float, ...]:
        """Return U of every look for a tool that stands at ``u_deg``, in order."""
        return tuple(toward_zero(u_deg, turn_deg) for turn_deg in self.turns_deg)


@dataclass(frozen=True, slots=True)
class PatternPlan:
    """The pattern that finds a camera and an offset together.

    Attributes:
        look: Its angles, at which the tip is brought to the middle; pictures and heights.
        span_mm: How far from the middle the tip goes, in X and in Y, at the angle U at which the
            tool stands.
    """

    look: LookPlan = LookPlan()
    span_mm: float = 3.0

    @property
    def places(self) -> tuple[tuple[float, float, float], ...]:
        """Every look: X and Y from the middle in mm, turn in degrees."""
        span = self.span_mm
        cross = ((-span, -span), (span, -span), (span, span), (-span, span))
        return (*((dx, dy, 0.0) for dx, dy in cross), *((0.0, 0.0, t) for t in self.look.turns_deg))
