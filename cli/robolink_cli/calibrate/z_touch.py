"""calibrate z-touch: the robot touches a surface that switches an input."""

from typing import TYPE_CHECKING

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.calibrate._frame import Frame
from robolink_cli.calibrate._options import calibration_options, sigma_option, until_option
from robolink_cli.options.motion import motion_option

if TYPE_CHECKING:
    from robolink.model import Controller
    from robolink.procedures import TipSource


@click.command("z-touch")
@click.option("--station", metavar="ID", required=True, help=tr("Name of the surface."))
@motion_option(
    "--speeds",
    default="2,1,2,1",
    metavar="2,1,..",
    show_default=True,
    help=tr("Speed of each touch, mm/s; two that differ tell the latency of the trigger."),
)
@motion_option(
    "--clearance",
    "clearance_mm",
    type=click.FloatRange(0.5, 20),
    default=3.0,
    show_default=True,
    help=tr("How far above the expected touch the tip begins to seek it."),
)
@motion_option(
    "--beyond",
    "beyond_mm",
    type=click.FloatRange(0.1, 10),
    default=2.0,
    show_default=True,
    help=tr("How far below it the search ends; a new tip may be shorter by less."),
)
@motion_option("--lift", "lift_mm", type=click.FloatRange(1, 100), default=10.0, show_default=True)
@motion_option(
    "--proof-turn",
    "proof_turn_deg",
    type=click.FloatRange(0, 330),
    default=180.0,
    metavar="DEG",
    help=tr("By how much U differs in the proof; 0 on a machine that cannot turn."),
)
@until_option
@sigma_option
@calibration_options
def z_touch(
    frame: Frame,
    *,
    station: str,
    speeds: str,
    clearance_mm: float,
    beyond_mm: float,
    lift_mm: float,
    proof_turn_deg: float,
    until_mm: float | None,
    sigma_mm: float | None,
) -> None:
    """Touch a surface that switches an input: Z; nobody touches anything.

    X and Y are kept. The tip stops at the touch and retreats; two speeds tell the latency.
    After each touch from the third on it says how well they agree and how sure Z is; at the end the
    one that fits worst is named and may be made again.
    """
    from robolink.methods import ZTouchPlan
    from robolink.procedures import SamplingPolicy

    if clearance_mm >= lift_mm:
        raise ConfigError(
            tr("The clearance must be smaller than the lift."),
            remedy=tr("For example --lift 10 --clearance 2."),
        )
    plan = ZTouchPlan(
        clearance_mm=clearance_mm,
        beyond_mm=beyond_mm,
        lift_mm=lift_mm,
        speeds_mm_s=_speeds(speeds),
    )
    if until_mm and not plan.may_end_early(sigma_stated=sigma_mm is not None):
        raise ConfigError(
            tr("{speeds!r} are too few touches for --until to leave any out.", speeds=speeds),
            remedy=tr("Give 7 or more --speeds; with --sigma, 4 or more."),
        )
    frame, sampling = frame.at(station), SamplingPolicy(until_mm, retake=True)

    def source(controller: "Controller") -> "TipSource":
        from robolink.methods import ZTouchSource
        from robolink.stations import StationKind, touch_station
        from robolink_cli.calibrate._pins import station_at

        place = touch_station(station_at(frame, controller, StationKind.TOUCH))
        return ZTouchSource(
            place, plan, sigma_mm=sigma_mm, proof_turn_deg=proof_turn_deg, sampling=sampling
        )

    frame.measure(source)


def _speeds(text: str) -> tuple[float, ...]:
    """Read speeds in mm/s.

    Raises:
        ConfigError: They are no speeds from 0.1 to 10, or fewer than two.
    """
    try:
        speeds = tuple(float(part) for part in text.split(","))
    except ValueError:
        speeds = ()
    if len(speeds) < 2 or not all(0.1 <= speed <= 10 for speed in speeds):
        raise ConfigError(
            tr("{text!r} are no speeds for touches.", text=text),
            remedy=tr("Write two or more from 0.1 to 10 mm/s, for example 2,1,2,1."),
        )
    return speeds
