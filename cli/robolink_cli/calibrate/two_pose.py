"""calibrate two-pose: one pin touched at two angles."""

import click

from robolink.messages import tr
from robolink_cli.calibrate._frame import Frame
from robolink_cli.calibrate._options import (
    calibration_options,
    pin_option,
    sigma_option,
    touch_options,
)
from robolink_cli.options.motion import motion_option
from robolink_cli.options.pose_source import PoseSource, pose_source_options


@click.command("two-pose")
@motion_option("--turn", "turn_deg", type=float, default=180.0, metavar="DEG", show_default=True)
@touch_options
@sigma_option
@pin_option
@pose_source_options(
    points=tr("Two points taught on the pendant, for example 901,902. Nothing moves."),
    typed=tr("A pose in mm and degrees, for example 287.5,103.25,180; give it twice."),
    path=tr("A .json or .csv file with the two poses."),
)
@calibration_options
def two_pose(
    frame: Frame,
    *,
    turn_deg: float,
    lift_mm: float,
    clearance_mm: float,
    sigma_mm: float | None,
    station: str | None,
    poses: PoseSource | None,
) -> None:
    """Touch one pin at two angles of U, half a turn apart.

    Put the tip some millimetres above a fixed pin first. The robot moves in Power Low only:
    it lifts before it turns and comes down to a clearance; you do the rest by typing steps.

    With --points, --pose or --poses the two poses exist already: nothing moves, no tool is
    selected, and nothing is proved by turning about the new tip.
    """
    from robolink.methods import TwoPoseSource, TwoTouches
    from robolink_cli.calibrate._touch_plan import touch_plan

    frame = frame.at_pin(station)
    touch = touch_plan(lift_mm, clearance_mm, turn_deg=turn_deg)
    if poses is not None:
        frame.solve(poses, lambda _controller: TwoTouches(sigma_mm))
        return
    frame.measure(lambda _controller: TwoPoseSource(touch, sigma_mm=sigma_mm))
