"""calibrate n-angle: one pin touched at several angles, each checked by the others."""

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.calibrate._frame import Frame
from robolink_cli.calibrate._options import (
    calibration_options,
    pin_option,
    sigma_option,
    touch_options,
    until_option,
)
from robolink_cli.options.motion import motion_option
from robolink_cli.options.pose_source import PoseSource, pose_source_options


@click.command("n-angle")
@motion_option(
    "--count",
    type=click.IntRange(3, 24),
    default=6,
    show_default=True,
    help=tr("Number of touches, spread evenly over a full turn."),
)
@motion_option(
    "--angles",
    metavar="0,120,..",
    help=tr("Instead of --count: U of each touch, counted from the first one, which is 0."),
)
@until_option
@touch_options
@sigma_option
@pin_option
@pose_source_options(
    points=tr("Three points or more taught on the pendant, for example 901-904."),
    typed=tr("A pose in mm and degrees, for example 287.5,103.25,180; give three or more."),
    path=tr("A .json or .csv file with three poses or more."),
)
@calibration_options
def n_angle(
    frame: Frame,
    *,
    count: int,
    angles: str | None,
    until_mm: float | None,
    lift_mm: float,
    clearance_mm: float,
    sigma_mm: float | None,
    station: str | None,
    poses: PoseSource | None,
) -> None:
    """Touch one pin at several angles of U; the touches check each other.

    After each touch from the third on it says how well they agree and how sure the tip is. At the
    end the pose that fits worst is named and may be taken again.

    With --points, --pose or --poses the touches exist already: nothing moves.
    """
    from robolink.methods import ManyTouches, NAngleSource, most_informative_order
    from robolink.procedures import SamplingPolicy
    from robolink_cli.calibrate._touch_plan import touch_plan

    frame = frame.at_pin(station)
    touch = touch_plan(lift_mm, clearance_mm)
    turns_deg = most_informative_order(_turns(count, angles))
    if poses is not None:
        frame.solve(poses, lambda _controller: ManyTouches(sigma_mm))
        return
    sampling = SamplingPolicy(until_mm, retake=True)
    frame.measure(
        lambda _controller: NAngleSource(turns_deg, touch, sigma_mm=sigma_mm, sampling=sampling)
    )


def _turns(count: int, angles: str | None) -> tuple[float, ...]:
    """Return the angles of the further touches, counted from the first.

    Raises:
        ConfigError: They are no angles of this method.
    """
    if angles is None:
        return tuple(360.0 * number / count for number in range(1, count))
    try:
        first, *others = (float(part) for part in angles.split(","))
    except ValueError as error:
        raise _no_angles(angles) from error
    turned = {angle % 360.0 for angle in (first, *others)}
    if first != 0 or not 2 <= len(others) <= 23 or len(turned) <= len(others):
        raise _no_angles(angles)
    return tuple(others)


def _no_angles(angles: str) -> ConfigError:
    return ConfigError(
        tr("{angles!r} are not angles for this method.", angles=angles),
        remedy=tr("Write three or more, none twice, the first one 0: for example 0,90,180,270."),
    )
