"""plane-touch: a plane touched upright and tilted, on robots that tilt their tool."""

from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.declaration.method import Method, Needs, PoseHelp
from robolink.methods.declaration.site import Site
from robolink.methods.plane_touch.parameters import PlaneTouchParameters
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import KeptProof, PoseMethod, TipSource


def _source(parameters: PlaneTouchParameters, site: Site) -> "TipSource":
    from robolink.methods.pivot import axes_of, require_tilting
    from robolink.methods.plane_touch.source import PlaneTouchSource

    require_tilting(site.controller, METHOD.name)
    return PlaneTouchSource(
        parameters.touch,
        parameters.survey,
        axes=axes_of(site.controller),
        sigma_mm=site.sigma_mm,
        sampling=parameters.sampling,
    )


def _from_poses(_parameters: PlaneTouchParameters, site: Site) -> "PoseMethod":
    from robolink.methods.plane_touch.source import PlaneTouches

    return PlaneTouches(site.sigma_mm)


def _proof() -> "type[KeptProof]":
    from robolink.methods.plane_touch.proof import PlaneTest

    return PlaneTest


METHOD = Method(
    name="plane-touch",
    summary=declared("Touch a flat surface with the tool upright and tilted: X, Y and Z."),
    description=declared(
        "Touch a flat surface with the tool upright and tilted: X, Y and Z. No pin is needed, and "
        "nobody has to hit a point.\n\n"
        "Put the tip some millimetres above the surface first, the tool as it stands in "
        "production. Three touches tell how the surface lies; then the robot tilts the tool in "
        "the air, and stops near the surface each time; you do the rest. The tool must be defined "
        "already, to a millimetre or two. A robot of five axes needs a surface at an angle of 15 "
        "to 30 degrees; one of six may have it level. Z is known less well than X and Y.\n\n"
        "With poses that exist already nothing moves."
    ),
    parameters=PlaneTouchParameters,
    measures=("x_mm", "y_mm", "z_mm"),
    needs=Needs(station=StationKind.TOUCH, named=False, tilt=True),
    source=_source,
    from_poses=_from_poses,
    pose_help=PoseHelp(
        points=declared("Seven points or more taught on the pendant, the tool upright and tilted."),
        typed=declared("A pose X,Y,Z,U,V,W in mm and degrees; give it seven times or more."),
        path=declared("A file of poses that state X to W."),
    ),
    proof=_proof,
)
