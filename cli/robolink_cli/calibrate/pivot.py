"""calibrate pivot: one pin touched in tilted orientations, on five axes and six."""

from typing import TYPE_CHECKING

import click

from robolink.messages import tr
from robolink_cli.calibrate._frame import Frame
from robolink_cli.calibrate._options import (
    calibration_options,
    pin_option,
    sigma_option,
    touch_options,
    until_option,
)
from robolink_cli.calibrate._tilting import tilt_options
from robolink_cli.options.pose_source import PoseSource, pose_source_options

if TYPE_CHECKING:
    from robolink.methods import PivotSource
    from robolink.model import Controller


@click.command("pivot")
@tilt_options
@until_option
@touch_options
@sigma_option
@pin_option
@pose_source_options(
    points=tr("Three points or more taught on the pendant, the tool tilted and turned."),
    typed=tr("A pose X,Y,Z,U,V,W in mm and degrees; give it three times or more."),
    path=tr("A .json or .csv file with x_mm, y_mm, z_mm, u_deg, v_deg and w_deg of each pose."),
)
@calibration_options
def pivot(
    frame: Frame,
    *,
    count: int,
    tilt_deg: float,
    until_mm: float | None,
    lift_mm: float,
    clearance_mm: float,
    sigma_mm: float | None,
    station: str | None,
    poses: PoseSource | None,
) -> None:
    """Touch one pin with the tool tilted and turned: X, Y and Z, on five axes or six.

    Put the tip some millimetres above a fixed pin first, the tool as it stands in production. After
    the first touch the robot lifts it, tilts and turns it in the air, and comes down to a
    clearance; you do the rest. The tool must be defined already, to a millimetre or two. A robot
    whose tool only turns about Z cannot do this.

    With --points, --pose or --poses the touches exist already: nothing moves.
    """
    from robolink.methods import PivotSource, PivotTouches, informative_tilts, require_tilting
    from robolink.procedures import SamplingPolicy
    from robolink_cli.calibrate._touch_plan import touch_plan

    frame = frame.at_pin(station)
    touch = touch_plan(lift_mm, clearance_mm)
    if poses is not None:
        frame.solve(poses, lambda _controller: PivotTouches(sigma_mm))
        return
    tilts, sampling = informative_tilts(count - 1, tilt_deg), SamplingPolicy(until_mm, retake=True)

    def source(controller: "Controller") -> "PivotSource":
        require_tilting(controller, "pivot")
        return PivotSource(tilts, touch, sigma_mm=sigma_mm, sampling=sampling)

    frame.measure(source)
