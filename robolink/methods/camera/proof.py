"""The proof of a tip by looks of a camera, as a value."""

from dataclasses import dataclass
from typing import ClassVar, cast

from robolink.calibration import VerifyResult, seen_from
from robolink.model import Pose, TipSensor
from robolink.procedures import (
    LookPlan,
    MeasurementContext,
    PlacedProof,
    calibrated_camera,
    verify_by_looking,
)
from robolink.runner import Procedure
from robolink.sensing import sensor_name
from robolink.stations import CameraStation


@dataclass(frozen=True, slots=True, kw_only=True)
class LookTest(PlacedProof):
    """All that a proof by a camera needs.

    Attributes:
        sensor: URL or name of the camera, or the camera itself, which cannot be kept.
        station: Where it is, and what its pixels mean.
        plan: Pictures and heights.
        angles_deg: U of the new tool at which the tip is looked at.
        camera_error_mm: What the measurement found the camera to be off by, base X and Y.
        radius_px: How wide the spot was in the measurement; ``None`` where nobody told.
    """

    method: ClassVar[str] = "camera"
    by_touch: ClassVar[bool] = False

    # A str or a TipSensor; a value that is read back is a str.
    sensor: object
    station: CameraStation
    plan: LookPlan
    angles_deg: tuple[float, ...]
    camera_error_mm: tuple[float, float] = (0.0, 0.0)
    radius_px: float | None = None

    @property
    def obstacle(self) -> str:
        """Why it cannot be kept: an open camera is none that another process can open."""
        if not isinstance(self.sensor, str):
            return "camera_open"
        if sensor_name(self.sensor) != self.sensor:
            return "camera_token"  # kept nowhere
        return ""

    def prove(self, context: MeasurementContext) -> VerifyResult:
        """Make it; see :meth:`~robolink.procedures.KeptProof.prove`."""
        # As the source gave it; a type with a protocol in it could not be read back from a record.
        camera = cast("str | TipSensor", self.sensor)
        here = context.controller.groups[0].pose()
        with calibrated_camera(camera, self.station) as eye:
            return context.run(self.steps(here), tip=self.written, camera=eye)

    def prove_after_a_break(self, context: MeasurementContext) -> VerifyResult:
        """Make it: it goes straight up first, then over the camera."""
        return self.prove(context)

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from wherever the frame is."""
        return verify_by_looking(
            self.station,
            self.plan,
            here=here,
            angles_deg=self.angles_deg,
            tolerance_mm=self.tolerance_mm,
            camera_error_mm=self.camera_error_mm,
            aside=seen_from(self.written, self.tip),
            radius_px=self.radius_px,
        )

    def steps_after_a_break(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the same steps: they begin straight up."""
        return self.steps(here)
