"""calibrate beams: the robot drives the tip through two crossed light beams."""

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


@click.command("beams")
@click.option("--station", metavar="ID", required=True, help=tr("Name of the beams."))
@motion_option(
    "--turn",
    "turn_deg",
    type=click.FloatRange(0, 330),
    default=0.0,
    metavar="DEG",
    help=tr("Measure again with U turned by this, so that moved beams do no harm."),
)
@motion_option(
    "--repeats",
    type=click.IntRange(1, 10),
    default=2,
    show_default=True,
    help=tr("How often each beam is crossed both ways; once leaves no residual."),
)
@motion_option(
    "--search",
    "search_mm",
    type=click.FloatRange(0.5, 20),
    default=2.0,
    show_default=True,
    help=tr("How far beside the beam the tip starts; the new tip may be off by less."),
)
@motion_option(
    "--dip",
    "dip_mm",
    type=click.FloatRange(0.2, 20),
    default=1.5,
    show_default=True,
    help=tr("How far below the beams the end of the tip is."),
)
@motion_option(
    "--shaft",
    "shaft_mm",
    type=click.FloatRange(0, 20),
    default=3.0,
    show_default=True,
    help=tr("How much deeper the shaft is measured too, to tell a bent needle; 0 for not."),
)
@motion_option(
    "--crossing-speed",
    "crossing_mm_s",
    type=click.FloatRange(0.5, 20),
    default=5.0,
    show_default=True,
    help=tr("How fast the tip crosses a beam, mm/s."),
)
@motion_option(
    "--lift",
    "lift_mm",
    type=click.FloatRange(1, 100),
    default=10.0,
    show_default=True,
    help=tr("How far above the beams the tip comes, goes and turns."),
)
@until_option
@sigma_option
@calibration_options
def beams(
    frame: Frame,
    *,
    station: str,
    turn_deg: float,
    repeats: int,
    search_mm: float,
    dip_mm: float,
    shaft_mm: float,
    crossing_mm_s: float,
    lift_mm: float,
    until_mm: float | None,
    sigma_mm: float | None,
) -> None:
    """Drive the tip through two crossed light beams: X and Y; nobody touches anything.

    As soon as the crossings check each other it says after each how well they agree and how sure
    the tip is. At the end the one that fits worst is named and may be made again.

    The station is declared in the cell file, or was learnt with 'station learn'. Afterwards the tip
    turns half a turn about itself and crosses the beams again.
    """
    from robolink.methods import CrossingPlan
    from robolink.procedures import SamplingPolicy

    plan = CrossingPlan(
        search_mm=search_mm,
        dip_mm=dip_mm,
        lift_mm=lift_mm,
        speed_mm_s=crossing_mm_s,
        repeats=repeats,
        shaft_mm=shaft_mm,
    )
    if plan.aside_mm <= search_mm:
        raise ConfigError(
            tr("--search must be below {aside:g} mm.", aside=plan.aside_mm),
            remedy=tr("The tip would break both beams at once."),
        )
    sigma_stated = sigma_mm is not None
    if until_mm and not plan.may_end_early(turned=bool(turn_deg), sigma_stated=sigma_stated):
        raise ConfigError(
            tr("With {count} repeats --until has nothing to leave out.", count=repeats),
            remedy=tr("Give --repeats 3 or more; with --sigma or --turn, 2 or more."),
        )
    frame, sampling = frame.at(station), SamplingPolicy(until_mm, retake=True)

    def source(controller: "Controller") -> "TipSource":
        from robolink.methods import BeamsSource
        from robolink.stations import StationKind, beam_station
        from robolink_cli.calibrate._pins import station_at

        place = beam_station(station_at(frame, controller, StationKind.BEAMS))
        return BeamsSource(place, plan, turn_deg=turn_deg, sigma_mm=sigma_mm, sampling=sampling)

    frame.measure(source)
