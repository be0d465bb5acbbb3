"""board: a held board, by its fiducials before an up-looking camera."""

from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.board.next_steps import board_steps
from robolink.methods.board.parameters import BoardParameters
from robolink.methods.declaration.look_parameters import PLACE, UNMEASURED_Z, camera_at
from robolink.methods.declaration.method import Method, Needs
from robolink.methods.declaration.site import Site
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import KeptProof, TipSource


def _source(parameters: BoardParameters, site: Site) -> "TipSource":
    from robolink.methods.board.source import BoardSource

    drawing = parameters.drawing
    assert drawing is not None  # noqa: S101 - the parameters were checked
    sensor, station = camera_at(parameters, site)
    return BoardSource(
        sensor, station, drawing, parameters.look, sigma_mm=site.sigma_mm, retake=parameters.retake
    )


def _proof() -> "type[KeptProof]":
    from robolink.methods.board.proof import BoardTest

    return BoardTest


METHOD = Method(
    name="board",
    summary=declared("See the fiducials of a held board: X, Y and U."),
    description=declared(
        "See the fiducials of a held board with an up-looking camera: X, Y and U of the board.\n\n"
        "The tool that is stored says where the board is expected: the fiducials must then lie in "
        "the image one at a time. Say where they are: how far two are apart, or where each of "
        "them is."
    ),
    parameters=BoardParameters,
    measures=("x_mm", "y_mm", "u_deg"),
    needs=Needs(station=StationKind.CAMERA, sensor=True, place=PLACE),
    source=_source,
    unmeasured_z=UNMEASURED_Z,
    proof=_proof,
    next_steps=board_steps,
)
