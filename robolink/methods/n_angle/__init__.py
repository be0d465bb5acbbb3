"""n-angle: one pin touched at several angles of U, each checked by the others."""

from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.declaration.method import Former, Method, Needs, PoseHelp
from robolink.methods.declaration.site import Site
from robolink.methods.n_angle.parameters import NAngleParameters
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import PoseMethod, TipSource


def _source(parameters: NAngleParameters, site: Site) -> "TipSource":
    from robolink.methods.n_angle.source import NAngleSource

    return NAngleSource(
        parameters.turns_deg,
        parameters.touch,
        sigma_mm=site.sigma_mm,
        sampling=parameters.sampling,
    )


def _from_poses(_parameters: NAngleParameters, site: Site) -> "PoseMethod":
    from robolink.methods.n_angle.source import ManyTouches

    return ManyTouches(site.sigma_mm)


METHOD = Method(
    name="n-angle",
    summary=declared("Touch one pin at several angles of U; the touches check each other."),
    description=declared(
        "Touch one pin at several angles of U; the touches check each other.\n\n"
        "After each touch from the third on it says how well they agree and what X "
        "and Y are repeatable to. At the end the touch that fits worst is named and may be made "
        "again.\n\n"
        "With poses that exist already nothing moves."
    ),
    parameters=NAngleParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.PIN, named=False, finds_pin=True),
    source=_source,
    from_poses=_from_poses,
    pose_help=PoseHelp(
        points=declared("Three points or more taught on the pendant, for example 901-904."),
        typed=declared(
            "A pose in mm and degrees, for example 287.5,103.25,180; give three or more."
        ),
        path=declared("A file with three poses or more."),
    ),
    tells_height=True,
    formerly=(Former(kind="operator", method="n_angle"),),
)
