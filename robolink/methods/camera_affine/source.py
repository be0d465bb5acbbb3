"""An up-looking camera whose place and scale are unknown: found together with the tip."""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from robolink.calibration import CalibrationResult, offset_sigma_mm
from robolink.messages import tr
from robolink.methods.camera_affine.parameters import CameraAffineParameters
from robolink.model import Pose, TipSensor, ToolOffset
from robolink.procedures import (
    MeasurementContext,
    ProvesAgain,
    pixel_camera,
    proof_angles,
    radius_of,
)
from robolink.runner import Procedure
from robolink.sensing import sensor_name
from robolink.stations import CameraStation, Found, StationKind

if TYPE_CHECKING:
    from robolink.methods.camera.proof import LookTest


@dataclass(frozen=True, slots=True)
class CameraAffineSource(ProvesAgain):
    """Measures X and Y of a tip, and the camera that sees it, in one pattern of looks.

    Attributes:
        sensor: URL or name of the camera, or the camera; it answers in pixels.
        station: Where it is to within its field of view; with its model of before, a camera
            that changed is refused.
        plan: The pattern.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        name: Name of the station, under which the camera is kept on record; empty for not.
    """

    sensor: str | TipSensor
    station: CameraStation
    plan: CameraAffineParameters = field(default_factory=CameraAffineParameters)
    sigma_mm: float | None = None
    name: str = ""

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: camera {sensor} and tip found together by {count} looks",
            sensor=sensor_name(self.sensor),
            count=len(self.plan.places),
        )

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr(
            "Look at the pictures: is it the tip that was found in all of them, and is it clean?"
        )

    def found_station(self, result: CalibrationResult, tool: int) -> Found | None:
        """Return what a kept measurement says about the camera, ``None`` without a name."""
        from robolink.calibration import CameraCalibration  # numpy, which a look does without

        if not self.name or not isinstance(result, CameraCalibration):
            return None
        model = result.camera
        return Found(
            id=self.name,
            kind=StationKind.CAMERA,
            x_mm=self.station.x_mm,
            y_mm=self.station.y_mm,
            z_mm=self.station.z_mm,
            sigma_mm=offset_sigma_mm(result),
            how=tr("{method} with tool {tool}", method=result.method, tool=tool),
            tool=tool,
            details={
                "seen_by": sensor_name(self.sensor),
                "mm_per_px": [list(row) for row in model.mm_per_px],
                "origin_mm": list(model.origin_mm),
                "centre_mm": None if model.centre_mm is None else list(model.centre_mm),
                "place_sigma_mm": model.place_sigma_mm,
                "scale_sigma": model.scale_sigma,
            },
        )

    def require_ready(self) -> None:
        """Find out whether the camera is there.

        See :class:`~robolink.procedures.RequiresSensor`.
        """
        with pixel_camera(self.sensor):
            pass

    def measure(
        self,
        context: MeasurementContext,
        tool: int,  # noqa: ARG002 - the flange is what moves
        stored: ToolOffset | None,
    ) -> CalibrationResult:
        """Look and solve; see :class:`~robolink.procedures.MovingSource`."""
        with pixel_camera(self.sensor) as camera:
            return context.measure(lambda here: self.procedure(stored, here), camera=camera)

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`."""
        from robolink.methods.camera_affine.procedure import measure_camera_affine  # numpy, late

        return measure_camera_affine(
            self.station,
            self.plan,
            here=here,
            stored=stored,
            sigma_mm=self.sigma_mm,
        )

    def proof(
        self,
        context: MeasurementContext,  # noqa: ARG002 - nothing of it is read
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> "LookTest":
        """Return the proof at other angles; see :class:`~robolink.procedures.KeepsProof`.

        Raises:
            TypeError: The result is not that of a camera that was found.
        """
        from robolink.calibration import CameraCalibration
        from robolink.methods.camera.proof import LookTest  # numpy

        if not isinstance(result, CameraCalibration):
            raise TypeError(f"no camera was found by {result.method}")
        return LookTest(
            tool=tool,
            written=result.offset,
            tip=tip,
            tolerance_mm=tolerance_mm,
            sensor=self.sensor,
            station=replace(self.station, model=result.camera),
            plan=self.plan.look,
            angles_deg=proof_angles(result, tool),
            radius_px=radius_of(result),
        )
