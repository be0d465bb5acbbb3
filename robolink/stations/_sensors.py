"""Sensors that stand in the cell: beams, a surface that switches an input, a camera."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from robolink.model import InputEdge

if TYPE_CHECKING:
    from robolink.calibration import Beam  # numpy, not for --help
from robolink.calibration import CameraModel, Sighting
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import SpotUnit
from robolink.runner import SeenAt


@dataclass(frozen=True, slots=True)
class BeamStation:
    """Two crossed light beams.

    Attributes:
        beams: Where they are, from the reference record (:func:`robolink.calibration.find_beams`).
        z_mm: Their height in the base, where they cross.
        inputs: The input that each of them switches; the same one twice where both act on it.
        off_when_broken: Whether an input goes off, not on, while its beam is broken.
    """

    beams: "tuple[Beam, Beam]"
    z_mm: float
    inputs: tuple[int, int]
    off_when_broken: bool = False

    def edge(self, beam: int, *, broken: bool) -> InputEdge:
        """Return what the input of a beam does when the tip breaks it, or frees it."""
        return InputEdge(self.inputs[beam], falling=broken is self.off_when_broken)


@dataclass(frozen=True, slots=True)
class TouchStation:
    """A level surface that switches an input when a tip touches it.

    Attributes:
        x_mm, y_mm: Where it is touched, base.
        z_mm: Its height in the base.
        input: The input that it switches.
        off_when_touched: Whether that goes off, not on.
    """

    x_mm: float
    y_mm: float
    z_mm: float
    input: int
    off_when_touched: bool = False

    @property
    def edge(self) -> InputEdge:
        """What the input does at a touch."""
        return InputEdge(self.input, falling=self.off_when_touched)


@dataclass(frozen=True, slots=True)
class CameraStation:
    """A camera that looks up.

    Attributes:
        x_mm, y_mm: Point of the base to which marks are brought, near the middle of the image.
        z_mm: Height in the base at which it is in focus.
        model: What its pixels mean, from ``calibrate camera-affine``; ``None`` where it is
            unknown, or where the camera answers in millimetres itself.
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
