"""runout-table: a calibrated camera sees how the tip wobbles, angle by angle."""

from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.declaration.look_parameters import PLACE, UNMEASURED_Z, camera_at
from robolink.methods.declaration.method import Method, Needs
from robolink.methods.declaration.site import Site
from robolink.methods.runout_table.parameters import RunoutTableParameters
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import KeptProof, TipSource


def _source(parameters: RunoutTableParameters, site: Site) -> "TipSource":
    from robolink.methods.runout_table.source import RunoutTableSource

    sensor, station = camera_at(parameters, site)
    return RunoutTableSource(
        sensor, station, parameters.look, sigma_mm=site.sigma_mm, retake=parameters.retake
    )


def _proof() -> "type[KeptProof]":
    from robolink.methods.runout_table.proof import WobbleTest

    return WobbleTest


METHOD = Method(
    name="runout-table",
    summary=declared("See how a pick nozzle wobbles: X and Y, and a table by angle."),
    description=declared(
        "See the tip with a calibrated, up-looking camera all round: X and Y, and a table of how "
        "far beside them it is at each angle of U; nobody touches anything.\n\n"
        "The table is for nozzles that wobble when they turn. It goes on record and into the JSON "
        "document; the controller has no place for it, so the program that places parts takes it "
        "back itself. Only X and Y are offered to be written."
    ),
    parameters=RunoutTableParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.CAMERA, sensor=True, place=PLACE),
    source=_source,
    unmeasured_z=UNMEASURED_Z,
    proof=_proof,
)
