"""pivot: one pin touched in tilted orientations, on five axes and six."""

from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.declaration.method import Method, Needs, PoseHelp
from robolink.methods.declaration.site import Site
from robolink.methods.pivot.parameters import PivotParameters
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import KeptProof, PoseMethod, TipSource


def _source(parameters: PivotParameters, site: Site) -> "TipSource":
    from robolink.methods.pivot.source import PivotSource, require_tilting
    from robolink.methods.pivot.tilts import informative_tilts  # numpy, for this robot alone

    require_tilting(site.controller, METHOD.name)
    return PivotSource(
        informative_tilts(parameters.count - 1, parameters.tilt_deg),
        parameters.touch,
        sigma_mm=site.sigma_mm,
        sampling=parameters.sampling,
    )


def _from_poses(_parameters: PivotParameters, site: Site) -> "PoseMethod":
    from robolink.methods.pivot.source import PivotTouches

    return PivotTouches(site.sigma_mm)


def _proof() -> "type[KeptProof]":
    from robolink.methods.pivot.proof import TiltTest

    return TiltTest


METHOD = Method(
    name="pivot",
    summary=declared(
        "Touch one pin with the tool tilted and turned: X, Y and Z, on five axes or six."
    ),
    description=declared(
        "Touch one pin with the tool tilted and turned: X, Y and Z, on five axes or six.\n\n"
        "Put the tip some millimetres above a fixed pin first, the tool as it stands in "
        "production. After the first touch the robot lifts it, tilts and turns it in the air, and "
        "comes down to a clearance; you do the rest. The tool must be defined already, to a "
        "millimetre or two. A robot whose tool only turns about Z cannot do this.\n\n"
        "With poses that exist already nothing moves."
    ),
    parameters=PivotParameters,
    measures=("x_mm", "y_mm", "z_mm"),
    needs=Needs(station=StationKind.PIN, named=False, finds_pin=True, tilt=True),
    source=_source,
    from_poses=_from_poses,
    pose_help=PoseHelp(
        points=declared("Three points or more taught on the pendant, the tool tilted and turned."),
        typed=declared("A pose X,Y,Z,U,V,W in mm and degrees; give it three times or more."),
        path=declared("A file of poses that state X to W."),
    ),
    proof=_proof,
)
