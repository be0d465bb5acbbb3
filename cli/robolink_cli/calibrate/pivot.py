"""calibrate pivot: one pin touched in tilted orientations, on six axes."""

import click

from robolink.messages import tr
from robolink_cli._pose_source import PoseSource, pose_source_options
from robolink_cli.calibrate._frame import Frame
from robolink_cli.calibrate._options import calibration_options, pin_option, sigma_option


@click.command("pivot")
@sigma_option
@pin_option
@pose_source_options(
    points=tr("Three points or more taught on the pendant, the tool tilted and turned."),
    typed=tr("A pose X,Y,Z,U,V,W in mm and degrees; give it three times or more."),
    path=tr("A .json or .csv file with x_mm, y_mm, z_mm, u_deg, v_deg and w_deg of each pose."),
)
@calibration_options
def pivot(
    frame: Frame, *, sigma_mm: float | None, station: str | None, poses: PoseSource | None
) -> None:
    """Touch one pin with the tool tilted and turned: X, Y and Z, on six axes.

    The poses are taken by a person on the pendant and given with --points, --pose or --poses; tilt
    by 15 to 45 degrees and turn as well. A robot whose tool only turns about Z cannot do this.
    """
    from robolink.nozzle_change import PivotTouches

    frame = frame.at_pin(station)
    if poses is None:
        from robolink_cli.calibrate._tilting import refuse_live

        refuse_live(frame, "pivot")
        return
    frame.solve(poses, lambda _controller: PivotTouches(sigma_mm))
