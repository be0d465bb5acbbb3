"""calibrate six-point: position and orientation of a tool, on five axes and six."""

from dataclasses import replace
from typing import TYPE_CHECKING, Literal

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
from robolink_cli.options.motion import motion_option
from robolink_cli.options.pose_source import PoseSource, pose_source_options

if TYPE_CHECKING:
    from robolink.methods import SixPointSource
    from robolink.model import Controller


@click.command("six-point")
@tilt_options
@until_option
@motion_option(
    "--way",
    "way_mm",
    type=click.FloatRange(10, 200),
    default=50.0,
    metavar="MM",
    show_default=True,
    help=tr("Least length of each of the two ways; the longer, the surer the axes."),
)
@click.option(
    "--second-is",
    type=click.Choice(["z", "xz"]),
    default="z",
    show_default=True,
    help=tr("What the second way shows: the tool's +Z, or its XZ plane on the side of +Z."),
)
@touch_options
@sigma_option
@pin_option
@pose_source_options(
    points=tr("The points on the pin, then the one along X and the one along Z."),
    typed=tr("A pose X,Y,Z,U,V,W in mm and degrees; give it five times or more."),
    path=tr("A .json or .csv file with x_mm, y_mm, z_mm, u_deg, v_deg and w_deg of each pose."),
)
@calibration_options
def six_point(
    frame: Frame,
    *,
    count: int,
    tilt_deg: float,
    until_mm: float | None,
    way_mm: float,
    second_is: Literal["z", "xz"],
    lift_mm: float,
    clearance_mm: float,
    sigma_mm: float | None,
    station: str | None,
    poses: PoseSource | None,
) -> None:
    """Find all six components: a pivot, then a way along the tool's X and one along its Z.

    The touches go as in 'calibrate pivot'. Then, in the air and without turning, you bring the tip
    to where it has room, and jog it along the tool's own +X; the robot goes straight back; and
    along its own +Z. A way that is too short or has turned is said at once. The work box reaches
    higher by the length of a way.

    With --points, --pose or --poses the poses exist already: three or more on one pin, tilted and
    turned; the last two, in this order, after a way along +X and one along +Z, both from the last
    pose on the pin. Nothing moves.
    """
    from robolink.methods import (
        AxisTeachPlan,
        SixPoints,
        SixPointSource,
        informative_tilts,
        require_tilting,
    )
    from robolink.procedures import SamplingPolicy
    from robolink_cli.calibrate._touch_plan import touch_plan

    frame = frame.at_pin(station)
    touch = touch_plan(lift_mm, clearance_mm)
    if poses is not None:
        frame.solve(poses, lambda _controller: SixPoints(second_is, sigma_mm))
        return
    tilts, sampling = informative_tilts(count - 1, tilt_deg), SamplingPolicy(until_mm, retake=True)
    ways, limits = AxisTeachPlan(way_mm, second_is), frame.limits
    frame = replace(frame, limits=replace(limits, box_up_mm=limits.box_up_mm + way_mm))

    def source(controller: "Controller") -> "SixPointSource":
        require_tilting(controller, "six-point")
        return SixPointSource(tilts, touch, sigma_mm=sigma_mm, sampling=sampling, ways=ways)

    frame.measure(source)
