"""points: poses that exist already, taught on the pendant; nothing moves.

Typed poses and those of a file are given to the method that solves them, such as two-pose.
"""

from typing import TYPE_CHECKING

from robolink.errors import ConfigError
from robolink.messages import declared, tr
from robolink.methods.declaration.method import Method, Needs, PoseHelp
from robolink.methods.declaration.site import Site
from robolink.methods.points.parameters import PointsParameters
from robolink.model import Pose
from robolink.stations import StationKind

if TYPE_CHECKING:
    from pathlib import Path

    from robolink.pose_tables import ReadingChoices
    from robolink.procedures import PoseMethod, TipSource


def _solver(parameters: PointsParameters, site: Site) -> "PoseMethod":
    from robolink.methods.n_angle import ManyTouches
    from robolink.methods.two_pose import TwoTouches

    many = parameters.method == "n-angle"
    return ManyTouches(site.sigma_mm) if many else TwoTouches(site.sigma_mm)


def _source(parameters: PointsParameters, site: Site) -> "TipSource":
    """Return what reads the points.

    Raises:
        ConfigError: This kind of controller has none.
    """
    from robolink.methods.points.source import PointsSource, taught_poses

    if site.pose_file is not None:
        return _from_file(parameters, site, *site.pose_file)
    points = site.controller.points
    if points is None:
        raise ConfigError(
            tr("{controller} has no taught points.", controller=site.controller.identity),
            remedy=tr('Use a recipe with source.kind = "two-pose" or "n-angle".'),
        )

    def read() -> tuple[Pose, ...]:
        return taught_poses(points, site.points)

    return PointsSource(
        read,
        _solver(parameters, site),
        taught_tool=parameters.taught_tool,
        axes_held=parameters.axes_held,
        plausible_mm=site.max_change_mm,
        sentence=tr(
            "points {names} taught on the pendant with tool {tool}",
            names=", ".join(f"P{number}" for number in site.points),
            tool=parameters.taught_tool or 0,
        ),
        in_mm=True,
    )


def _from_file(
    parameters: PointsParameters, site: Site, path: "Path", choices: "ReadingChoices"
) -> "TipSource":
    """Return what reads the poses of a file."""
    from robolink.methods.points.source import PointsSource
    from robolink.pose_tables import read_poses

    return PointsSource(
        lambda: read_poses(path, choices).poses,
        _solver(parameters, site),
        taught_tool=parameters.taught_tool,
        axes_held=parameters.axes_held,
        plausible_mm=site.max_change_mm,
        sentence=tr(
            "poses of the file {path}, taught with tool {tool}",
            path=path,
            tool=parameters.taught_tool or 0,
        ),
    )


METHOD = Method(
    name="points",
    summary=declared("Take points that were taught on the pendant: X and Y; nothing moves."),
    description=declared(
        "Take points that were taught on the pendant: X and Y; nothing moves.\n\n"
        "The points touch one pin. They are read from the controller, and solved as two-pose or "
        "n-angle would. No tool is selected, and nothing is proved by turning about the new tip."
    ),
    parameters=PointsParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.PIN, named=False, finds_pin=True, motion=False),
    source=_source,
    from_poses=_solver,
    pose_help=PoseHelp(
        points=declared(
            "Numbers of the points that touch the pin, for example 901,902 or 901-904."
        ),
        typed="",
        path="",
    ),
    unmeasured_z=declared('cannot be "measured" from taught points; write "typed" or "kept"'),
)
