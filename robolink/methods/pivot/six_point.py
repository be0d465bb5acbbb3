"""six-point: a pin touched in tilted orientations, and two ways along the tool's axes."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from annotated_types import Ge, Le

from robolink.calibration import CalibrationResult
from robolink.errors import CalibrationError
from robolink.messages import declared, tr
from robolink.methods.method import MM, Help, Method, Needs, Option, PoseHelp, Site
from robolink.methods.pivot import PivotParameters, PivotSource, require_known_tip
from robolink.model import Pose, ToolOffset
from robolink.runner import Procedure, TouchedAt
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.methods.pivot.six_point_procedure import AxisTeachPlan
    from robolink.procedures import PoseMethod, TipSource


@dataclass(frozen=True, kw_only=True)
class SixPointParameters(PivotParameters):
    """How one pin is touched, and how the axes of the tool are shown."""

    way_mm: Annotated[
        float,
        Ge(10),
        Le(200),
        MM,
        Option(metavar="MM"),
        Help(declared("Least length of each of the two moves; the longer, the surer the axes.")),
    ] = 50.0
    second_is: Annotated[
        Literal["z", "xz"],
        Option(moves=False),
        Help(
            declared(
                "What the second move shows: the tool's +Z, or its XZ plane on the side of +Z."
            )
        ),
    ] = "z"

    def height_mm(self) -> float:
        """Return how much higher than the box the flange goes: a way up."""
        return self.way_mm


LEAST_OF_SIX_POINTS = 5


@dataclass(frozen=True, slots=True)
class SixPointSource(PivotSource):
    """Measures as a pivot does, and by ways along the axes of the tool.

    Attributes:
        ways: How the person shows the axes.
    """

    ways: "AxisTeachPlan" = field(kw_only=True)

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        shown = tr(
            "two moves of {length:g} mm and more along the tool's own axes",
            length=self.ways.length_mm,
        )
        return f"{self._touched}; {shown}"

    def further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[CalibrationResult]:
        """Return the steps that make one touch again."""
        from robolink.methods.pivot.six_point_procedure import (
            retake_six_point,  # numpy, as in the pivot
        )

        return retake_six_point(
            self.touch,
            self.ways,
            here=here,
            taken=taken,
            again=again,
            tilts=self.tilts,
            stored=require_known_tip(stored),
            sigma_mm=self.sigma_mm,
        )

    def steps(self, stored: ToolOffset | None) -> Procedure[CalibrationResult]:
        """Return the steps of the measurement."""
        from robolink.methods.pivot.six_point_procedure import (
            measure_six_point,  # numpy, as in the pivot
        )

        return measure_six_point(
            self.touch,
            self.ways,
            tilts=self.tilts,
            stored=require_known_tip(stored),
            sigma_mm=self.sigma_mm,
            sampling=self.sampling,
        )


@dataclass(frozen=True, slots=True)
class SixPoints:
    """Touches of one pin, then a way along the tool's X and one along its Z, or in its XZ plane.

    Attributes:
        second_is: What the last pose shows: ``z`` the tool's +Z, ``xz`` its XZ plane.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = False
    needs: ClassVar[tuple[str, ...]] = ("z_mm", "v_deg", "w_deg")

    second_is: Literal["z", "xz"] = "z"
    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve five poses and more, the last two away from the pin.

        See :class:`~robolink.procedures.PoseMethod`.
        """
        from robolink.calibration import solve_six_point  # numpy, which a look does without

        if len(flange) < LEAST_OF_SIX_POINTS:
            raise CalibrationError(
                "too_few_poses",
                tr("{count} poses were given; the method needs five.", count=len(flange)),
                remedy=tr(
                    "Give three or more on the pin, better four and more, then one along X and one "
                    "along Z."
                ),
            )
        *pivot, along_x, second = flange
        return solve_six_point(
            pivot,
            along_x,
            second,
            second_is=self.second_is,
            stored=stored,
            sigma_mm=self.sigma_mm,
        )


def _source(parameters: SixPointParameters, site: Site) -> "TipSource":
    from robolink.methods.pivot import require_tilting
    from robolink.methods.pivot.six_point_procedure import AxisTeachPlan
    from robolink.methods.pivot.tilts import informative_tilts  # numpy, for this robot alone

    require_tilting(site.controller, METHOD.name)
    return SixPointSource(
        informative_tilts(parameters.count - 1, parameters.tilt_deg),
        parameters.touch,
        sigma_mm=site.sigma_mm,
        sampling=parameters.sampling,
        ways=AxisTeachPlan(parameters.way_mm, parameters.second_is),
    )


def _from_poses(parameters: SixPointParameters, site: Site) -> "PoseMethod":
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
