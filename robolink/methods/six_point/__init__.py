"""six-point: position and orientation of a tool, on five axes and six."""

from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.declaration.method import Method, Needs, PoseHelp
from robolink.methods.declaration.site import Site
from robolink.methods.six_point.parameters import SixPointParameters
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import PoseMethod, TipSource


def _source(parameters: SixPointParameters, site: Site) -> "TipSource":
    from robolink.methods.pivot.source import require_tilting
    from robolink.methods.pivot.tilts import informative_tilts  # numpy, for this robot alone
    from robolink.methods.six_point.procedure import AxisTeachPlan
    from robolink.methods.six_point.source import SixPointSource

    require_tilting(site.controller, METHOD.name)
    return SixPointSource(
        informative_tilts(parameters.count - 1, parameters.tilt_deg),
        parameters.touch,
        sigma_mm=site.sigma_mm,
        sampling=parameters.sampling,
        ways=AxisTeachPlan(parameters.way_mm, parameters.second_is),
    )


def _from_poses(parameters: SixPointParameters, site: Site) -> "PoseMethod":
    from robolink.methods.six_point.source import SixPoints

    return SixPoints(parameters.second_is, site.sigma_mm)


METHOD = Method(
    name="six-point",
    summary=declared("A pivot and two moves along the tool's axes: all six components."),
    description=declared(
        "Find all six components: a pivot, then a move along the tool's X and one "
        "along its Z.\n\n"
        "The touches go as in 'calibrate pivot'. Then, in the air and without "
        "turning, you bring the tip to where it has room, and jog it along the tool's "
        "own +X; the robot goes straight back; and along its own +Z. A move that is "
        "too short or has turned is told at once. The work box reaches higher by the "
        "length of a move.\n\n"
        "With poses that exist already nothing moves: three or more on one pin, "
        "tilted and turned; the last two, in this order, after a move along +X and "
        "one along +Z, both from the last pose on the pin."
    ),
    parameters=SixPointParameters,
    measures=("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg"),
    needs=Needs(station=StationKind.PIN, named=False, finds_pin=True, tilt=True),
    source=_source,
    from_poses=_from_poses,
    pose_help=PoseHelp(
        points=declared("The points on the pin, then the one along X and the one along Z."),
        typed=declared("A pose X,Y,Z,U,V,W in mm and degrees; give it five times or more."),
        path=declared("A file of poses that state X to W."),
    ),
)
