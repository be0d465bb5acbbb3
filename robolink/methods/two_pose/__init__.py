"""two-pose: one pin touched at two angles of U."""

from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.declaration.method import Former, Method, Needs, PoseHelp
from robolink.methods.declaration.site import Site
from robolink.methods.two_pose.parameters import TwoPoseParameters
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import KeptProof, PoseMethod, TipSource


def _source(parameters: TwoPoseParameters, site: Site) -> "TipSource":
    from robolink.methods.two_pose.source import TwoPoseSource

    return TwoPoseSource(parameters.touch, sigma_mm=site.sigma_mm)


def _from_poses(_parameters: TwoPoseParameters, site: Site) -> "PoseMethod":
    from robolink.methods.two_pose.source import TwoTouches

    return TwoTouches(site.sigma_mm)


def _proof() -> "type[KeptProof]":
    from robolink.procedures import TurnTest

    return TurnTest


METHOD = Method(
    name="two-pose",
    summary=declared("Touch one pin at two angles of U, half a turn apart."),
    description=declared(
        "Touch one pin at two angles of U, half a turn apart.\n\n"
        "Put the tip some millimetres above a fixed pin first. The robot moves in Power Low only: "
        "it lifts before it turns and comes down to a clearance; you do the rest by typing "
        "steps.\n\n"
        "With two poses that exist already nothing moves, no tool is selected, and nothing is "
        "proved by turning about the new tip."
    ),
    parameters=TwoPoseParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.PIN, named=False, finds_pin=True),
    source=_source,
    from_poses=_from_poses,
    pose_help=PoseHelp(
        points=declared("Two points taught on the pendant, for example 901,902. Nothing moves."),
        typed=declared("A pose in mm and degrees, for example 287.5,103.25,180; give it twice."),
        path=declared("A file with the two poses."),
    ),
    tells_height=True,
    formerly=(Former(kind="operator", method="two_pose", usual=True),),
    proof=_proof,
)
