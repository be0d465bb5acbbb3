"""sphere-touch: a sphere touched from several sides, on robots that tilt their tool."""

from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.declaration.method import Method, Needs, PoseHelp
from robolink.methods.declaration.site import Site
from robolink.methods.sphere_touch.parameters import SphereTouchParameters
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import KeptProof, PoseMethod, TipSource


def _source(parameters: SphereTouchParameters, site: Site) -> "TipSource":
    from robolink.methods.pivot import axes_of, require_tilting
    from robolink.methods.sphere_touch.source import SphereTouchSource

    require_tilting(site.controller, METHOD.name)
    return SphereTouchSource(
        parameters.touch,
        parameters.survey,
        axes=axes_of(site.controller),
        sigma_mm=site.sigma_mm,
        sampling=parameters.sampling,
    )


def _from_poses(_parameters: SphereTouchParameters, site: Site) -> "PoseMethod":
    from robolink.methods.sphere_touch.source import SphereTouches

    return SphereTouches(site.sigma_mm)


def _proof() -> "type[KeptProof]":
    from robolink.methods.sphere_touch.proof import SphereTest

    return SphereTest


METHOD = Method(
    name="sphere-touch",
    summary=declared("Touch a sphere from several sides, the tool upright and tilted: X, Y and Z."),
    description=declared(
        "Touch a sphere from several sides, the tool upright and tilted: X, Y and Z. A ball of a "
        "bearing or of a gauge will do; nobody has to hit a point.\n\n"
        "Put the tip some millimetres above the top of the sphere first, the tool as it stands in "
        "production. Four touches tell where the sphere is; then the robot tilts the tool in the "
        "air, and stops near one side each time; you do the rest. The tool must be defined "
        "already, to a millimetre or two. Where the sphere is and its true radius are found. A "
        "robot whose tool only turns about Z cannot do this.\n\n"
        "With poses that exist already nothing moves."
    ),
    parameters=SphereTouchParameters,
    measures=("x_mm", "y_mm", "z_mm"),
    needs=Needs(station=StationKind.TOUCH, named=False, tilt=True),
    source=_source,
    from_poses=_from_poses,
    pose_help=PoseHelp(
        points=declared(
            "Eight points or more taught on the pendant from several sides, the tool tilted."
        ),
        typed=declared("A pose X,Y,Z,U,V,W in mm and degrees; give it eight times or more."),
        path=declared("A file of poses that state X to W."),
    ),
    proof=_proof,
)
