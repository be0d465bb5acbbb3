"""calibrate camera-affine: an up-looking camera of unknown pose, found together with the tip."""

from typing import TYPE_CHECKING

import click

from robolink.messages import tr
from robolink_cli.calibrate._cameras import CameraPlace, angles_from, camera_options, look_options
from robolink_cli.calibrate._frame import Frame
from robolink_cli.calibrate._options import calibration_options, sigma_option
from robolink_cli.options.motion import motion_option

if TYPE_CHECKING:
    from robolink.model import Controller
    from robolink.procedures import TipSource


@click.command("camera-affine")
@motion_option(
    "--span",
    "span_mm",
    type=click.FloatRange(0, 50),
    default=3.0,
    show_default=True,
    help=tr("How far the tip goes from the middle of the image, in X and in Y."),
)
@motion_option(
    "--new-camera",
    is_flag=True,
    help=tr("Camera, lens or mount were changed: do not compare with the last calibration."),
)
@look_options("0,60,120,180")
@sigma_option
@calibration_options
@camera_options
def camera_affine(
    frame: Frame,
    *,
    camera: CameraPlace,
    span_mm: float,
    new_camera: bool,
    angles: str,
    pictures: int,
    lift_mm: float,
    sigma_mm: float | None,
) -> None:
    """Find an up-looking camera and the tip together: X and Y, scale, turn and mirror.

    Say with --at, or in the cell file, where the camera looks to within its field of view. The tip
    goes to four corners of the image and turns in its middle. What was found is kept on record
    under the name of the station; a camera that is not as it was is refused.
    """
    from dataclasses import replace

    from robolink.methods import PatternPlan
    from robolink.procedures import LookPlan

    look = LookPlan(turns_deg=angles_from(angles), pictures=pictures, lift_mm=lift_mm)
    plan = PatternPlan(look, span_mm)

    def source(controller: "Controller") -> "TipSource":
        from robolink.methods import CameraAffineSource

        sensor, station = camera.look_up(frame, controller)
        if new_camera:
            station = replace(station, model=None)
        return CameraAffineSource(
            sensor, station, plan, sigma_mm=sigma_mm, retake=True, name=camera.station
        )

    frame.measure(source)
