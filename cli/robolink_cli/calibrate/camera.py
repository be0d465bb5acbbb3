"""calibrate camera: a calibrated, up-looking camera sees the tip."""

from typing import TYPE_CHECKING

import click

from robolink_cli.calibrate._cameras import CameraPlace, angles_from, camera_options, look_options
from robolink_cli.calibrate._frame import Frame
from robolink_cli.calibrate._options import calibration_options, sigma_option

if TYPE_CHECKING:
    from robolink.model import Controller
    from robolink.procedures import TipSource


@click.command("camera")
@look_options("0,60,120,180")
@sigma_option
@calibration_options
@camera_options
def camera(
    frame: Frame,
    *,
    camera: CameraPlace,
    angles: str,
    pictures: int,
    lift_mm: float,
    sigma_mm: float | None,
) -> None:
    """See the tip with an up-looking camera: X and Y; nobody touches anything.

    What a pixel means is known from 'calibrate camera-affine', or stands in the cell file, or the
    camera answers in millimetres. Looks at several angles tell the tip from what the camera itself
    is off by; a single one believes the camera.
    """
    from robolink.procedures import LookPlan

    plan = LookPlan(turns_deg=angles_from(angles), pictures=pictures, lift_mm=lift_mm)

    def source(controller: "Controller") -> "TipSource":
        from robolink.methods import CameraSource

        sensor, station = camera.look_up(frame, controller)
        return CameraSource(sensor, station, plan, sigma_mm=sigma_mm, retake=True)

    frame.measure(source)
