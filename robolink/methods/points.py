"""points: poses that exist already, taught on the pendant; nothing moves.

Typed poses and those of a file are given to the method that solves them, such as two-pose.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from annotated_types import Ge, Le

from robolink.errors import ConfigError
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.method import (
    Check,
    Help,
    Method,
    MethodParameters,
    Needs,
    Option,
    PoseHelp,
    Site,
)
from robolink.methods.shared_parameters import two_poses_agree
from robolink.model import Pose
from robolink.stations import StationKind

if TYPE_CHECKING:
    from pathlib import Path

    from robolink.pose_tables import ReadingChoices
    from robolink.procedures import PoseMethod, TipSource


@dataclass(frozen=True, kw_only=True)
class PointsParameters(MethodParameters):
    """Which tool was selected when the points were taught, and how to solve them."""

    method: Annotated[
        Literal["two-pose", "n-angle"],
        Option(moves=False),
        Help(declared("Two points for each tool, or three and more that check each other.")),
    ] = "two-pose"
    taught_tool: Annotated[
        int | None,
        Ge(0),
        Le(15),
        Option(metavar="N", moves=False),
        Help(
            declared(
                "Number of the tool that was selected when the points were taught; 0 is the flange."
            )
        ),
    ] = None
    axes_held: Annotated[
        bool,
        Option(moves=False),
        Help(
            declared(
                "All axes were held by their motors, none released (SFREE), when the points "
                "were taught; without it robolink asks you."
            )
        ),
    ] = False

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that there are as many points as the solver needs."""
        if check.points is not None and (why := self.wrong_count(check.points)):
            yield Problem("points", why)

    def wrong_count(self, points: int) -> str:
        """Return why that number of points cannot be solved, empty if it can."""
        if self.method == "two-pose" and points != 2:
            return tr('must hold two points; more are for "n-angle"')
        if self.method == "n-angle" and points < 3:
            return tr('must hold three points or more for "n-angle"')
        return ""

    def no_residual(self) -> str:
        """Return why residuals cannot be judged, empty if they can."""
        return two_poses_agree() if self.method == "two-pose" else ""


def _solver(parameters: PointsParameters, site: Site) -> "PoseMethod":
    from robolink.methods.n_angle import ManyTouches
    from robolink.methods.two_pose import TwoTouches

    many = parameters.method == "n-angle"
    return ManyTouches(site.sigma_mm) if many else TwoTouches(site.sigma_mm)


def _source(parameters: PointsParameters, site: Site) -> "TipSource":
    """Return the source that reads the points.

    Raises:
        ConfigError: This kind of controller has none.
    """
    from robolink.methods.given_poses import PointsSource, taught_poses

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
    """Return the source that reads the poses of a file."""
    from robolink.methods.given_poses import PointsSource
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
    summary=declared("Use points taught on the pendant: X and Y; nothing moves."),
    description=declared(
        "Use points taught on the pendant: X and Y; nothing moves.\n\n"
        "The points touch one pin. robolink reads them from the controller and solves them "
        "like two-pose or n-angle. It selects no tool, and there is no turn test."
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
