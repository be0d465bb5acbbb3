"""calibrate one-touch: a pin whose place is known, touched once."""

from typing import TYPE_CHECKING

import click

from robolink.messages import tr
from robolink_cli.calibrate._frame import Frame
from robolink_cli.calibrate._options import calibration_options, sigma_option
from robolink_cli.options.motion import motion_option
from robolink_cli.options.pose_source import PoseSource, pose_source_options

if TYPE_CHECKING:
    from robolink.methods import Absolute, Difference
    from robolink.model import Controller


@click.command("one-touch")
@click.option("--station", metavar="ID", required=True, help=tr("Name of the pin."))
@click.option(
    "--absolute",
    is_flag=True,
    help=tr("Trust the place of the pin, and not the last touch of this tool on it."),
)
@click.option(
    "--max-changes",
    type=click.IntRange(min=1),
    default=20,
    show_default=True,
    help=tr("Differences after which a full calibration is due in any case."),
)
@motion_option("--lift", "lift_mm", type=click.FloatRange(1, 100), default=10.0, show_default=True)
@motion_option(
    "--clearance",
    "clearance_mm",
    type=click.FloatRange(0.5, 50),
    default=5.0,
    show_default=True,
    help=tr("How far above the pin the old tip would stop: more than the new one may be longer."),
)
@sigma_option
@pose_source_options(
    points=tr("The one point taught on the pendant with the tip on the pin."),
    typed=tr("The pose X,Y,Z,U in mm and degrees with the tip on the pin."),
    path=tr("A .json or .csv file with the one pose."),
)
@calibration_options
def one_touch(
    frame: Frame,
    *,
    station: str,
    absolute: bool,
    max_changes: int,
    lift_mm: float,
    clearance_mm: float,
    sigma_mm: float | None,
    poses: PoseSource | None,
) -> None:
    """Touch a pin once: X, Y and Z of the new tip, for a change of the needle.

    The tool must have been calibrated on that pin before, for example with n-angle --station ID.
    What is written is the stored offset moved by how much the tip differs from the old one. The
    uncertainty adds up over such changes, until a full calibration is due.
    """
    from robolink.methods import OneTouchSource
    from robolink_cli.calibrate._touch_plan import touch_plan

    frame = frame.at_pin(station, finds_pin=False)
    touch = touch_plan(lift_mm, clearance_mm)

    def solver(controller: "Controller") -> "Absolute | Difference":
        if absolute:
            return _absolute(frame, controller, sigma_mm)
        return _difference(frame, controller, sigma_mm, max_changes=max_changes)

    if poses is not None:
        frame.solve(poses, solver)
        return
    frame.measure(lambda controller: OneTouchSource(solver(controller), touch))


def _absolute(frame: Frame, controller: "Controller", sigma_mm: float | None) -> "Absolute":
    from robolink.methods import Absolute
    from robolink.stations import StationKind, pin_of
    from robolink_cli.calibrate._pins import station_at

    station = station_at(frame, controller, StationKind.PIN)
    # Whoever does not know how sure the pin is cannot say how sure the tip is.
    return Absolute(pin_of(station), sigma_mm if station.sigma_mm else None)


def _difference(
    frame: Frame, controller: "Controller", sigma_mm: float | None, *, max_changes: int
) -> "Difference":
    """Return how to solve against the last touch of the tool.

    Raises:
        CalibrationError: ``no_last_touch`` or ``reference_outdated``.
        ConfigError: Nothing tells how well a touch repeats, or the station is no pin.
    """
    from robolink.calibration import NeedleLimits
    from robolink.methods import difference_from_last
    from robolink.stations import StationKind
    from robolink_cli.calibrate._pins import station_at

    station_at(frame, controller, StationKind.PIN)
    limits = NeedleLimits(
        max_change_mm=frame.criteria.limit_mm,
        tolerance_mm=frame.criteria.interval_mm or NeedleLimits().tolerance_mm,
        max_changes=max_changes,
    )
    return difference_from_last(controller, frame.tool, frame.pin, sigma_mm=sigma_mm, limits=limits)
