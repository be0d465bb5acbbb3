"""calibrate board: a held board, by its fiducials before an up-looking camera."""

from typing import TYPE_CHECKING

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.calibrate._cameras import CameraPlace, angles_from, camera_options, look_options
from robolink_cli.calibrate._frame import Frame
from robolink_cli.calibrate._options import calibration_options, sigma_option

if TYPE_CHECKING:
    from robolink.calibration import BoardDrawing
    from robolink.model import Controller
    from robolink.procedures import TipSource


@click.command("board")
@click.option(
    "--fiducial",
    "fiducials",
    multiple=True,
    metavar="X,Y",
    help=tr("A fiducial in the axes that the tool is to have, mm; in the order of their numbers."),
)
@click.option(
    "--spacing",
    "spacing_mm",
    type=click.FloatRange(min=0, min_open=True),
    metavar="MM",
    help=tr("Two fiducials this far apart: the origin half way, X from 2 to 1 (EPSON's board)."),
)
@look_options("0,120")
@sigma_option
@calibration_options
@camera_options
def board(
    frame: Frame,
    *,
    camera: CameraPlace,
    fiducials: tuple[str, ...],
    spacing_mm: float | None,
    angles: str,
    pictures: int,
    lift_mm: float,
    sigma_mm: float | None,
) -> None:
    """See the fiducials of a held board with an up-looking camera: X, Y and U of the board.

    The tool that is stored says where the board is expected: the fiducials must then lie in the
    image one at a time. Say where they are with --spacing, or with --fiducial for each of them.
    """
    from robolink.procedures import LookPlan

    drawing = _drawing(fiducials, spacing_mm)
    plan = LookPlan(turns_deg=angles_from(angles), pictures=pictures, lift_mm=lift_mm)

    def source(controller: "Controller") -> "TipSource":
        from robolink.methods import BoardSource

        sensor, station = camera.look_up(frame, controller)
        return BoardSource(sensor, station, drawing, plan, sigma_mm=sigma_mm, retake=True)

    frame.measure(source)


def _drawing(fiducials: tuple[str, ...], spacing_mm: float | None) -> "BoardDrawing":
    """Return the drawing of the board.

    Raises:
        ConfigError: It is not said, or twice, or is no drawing.
        CalibrationError: ``coincident_fiducials``.
    """
    from robolink.calibration import BoardDrawing

    if (spacing_mm is None) == (not fiducials):
        raise ConfigError(
            tr("The drawing of the board is missing, or given twice."),
            remedy=tr("Give --spacing for two fiducials, or --fiducial X,Y for each."),
        )
    if spacing_mm is not None:
        drawing = BoardDrawing.of_two(spacing_mm)
    else:
        drawing = BoardDrawing(tuple(map(_place, fiducials)))
    drawing.require_apart()
    return drawing


def _place(text: str) -> tuple[float, float]:
    try:
        x_mm, y_mm = (float(part) for part in text.split(","))
    except ValueError as error:
        raise ConfigError(
            tr("{text!r} is no fiducial.", text=text),
            remedy=tr("Write X,Y in mm, for example --fiducial 20,12.5."),
        ) from error
    return x_mm, y_mm
