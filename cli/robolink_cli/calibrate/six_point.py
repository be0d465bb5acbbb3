"""calibrate six-point: position and orientation of a tool, on six axes."""

from typing import Literal, NoReturn

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli._context import open_controller
from robolink_cli._pose_source import PoseSource, pose_source_options
from robolink_cli.calibrate._frame import Frame
from robolink_cli.calibrate._options import calibration_options, sigma_option


@click.command("six-point")
@click.option(
    "--second-is",
    type=click.Choice(["z", "xz"]),
    default="z",
    show_default=True,
    help=tr("What the last pose shows: the tool's +Z, or its XZ plane on the side of +Z."),
)
@sigma_option
@pose_source_options(
    points=tr("The points on the pin, then the one along X and the one along Z."),
    typed=tr("A pose X,Y,Z,U,V,W in mm and degrees; give it five times or more."),
    path=tr("A .json or .csv file with x_mm, y_mm, z_mm, u_deg, v_deg and w_deg of each pose."),
)
@calibration_options
def six_point(
    frame: Frame,
    *,
    second_is: Literal["z", "xz"],
    sigma_mm: float | None,
    poses: PoseSource | None,
) -> None:
    """Find all six components: a pivot, then a way along the tool's X and one along its Z.

    Three poses or more with the tip on one pin, tilted and turned; the last two, in this order,
    after a way of 50 mm or more along the tool's own +X and then +Z, both from the last pose on the
    pin and without turning.
    """
    from robolink.nozzle_change import SixPoints

    if poses is None:
        _refuse_live(frame)
    frame.solve(poses, lambda _controller: SixPoints(second_is, sigma_mm))


def _refuse_live(frame: Frame) -> NoReturn:
    """Say what to do instead of driving the ways along the tool's axes; reads only.

    Raises:
        CalibrationError: ``rank_deficient``: this robot cannot tilt its tool at all.
        ConfigError: It can; but the last two poses are driven by a person.
    """
    from robolink_cli.calibrate._tilting import require_tilting

    with open_controller(frame.context) as controller:
        require_tilting(controller, "six-point")
    raise ConfigError(
        tr("six-point is solved from poses that were taught; robolink drives none for it."),
        remedy=tr(
            "Teach them and give --points, --pose or --poses. X, Y and Z alone: 'calibrate pivot'."
        ),
    )
