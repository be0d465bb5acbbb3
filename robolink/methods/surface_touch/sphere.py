"""sphere-touch: a sphere touched from several sides, on robots that tilt their tool."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from annotated_types import Ge, Le

from robolink.calibration import HIGHEST_MM, CalibrationResult
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.method import MM, Check, Help, Method, Needs, Option, PoseHelp, Site
from robolink.methods.pivot import TiltedTouches
from robolink.methods.surface_touch import SurfaceParameters, SurfaceTouchSource, told_at
from robolink.methods.surface_touch.survey import SphereSurvey
from robolink.model import Pose, ToolOffset, checks_arguments
from robolink.procedures import (
    TAKE_ALL,
    ProofBasis,
    SamplingPolicy,
    TouchPlan,
    drift_uncertainty_mm,
)
from robolink.runner import Procedure
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.calibration import SphereTouchResult
    from robolink.methods.surface_touch.drive import SurfaceKind
    from robolink.methods.surface_touch.sphere_procedure import SphereTest
    from robolink.procedures import KeptProof, TipSource


_USUAL_MM = 10.0


@dataclass(frozen=True, kw_only=True)
class SphereTouchParameters(SurfaceParameters):
    """How a sphere is touched from several sides, with the tool upright and tilted."""

    count: Annotated[
        int,
        Ge(SphereSurvey.least_count),
        Le(24),
        Help(declared("Number of touches; the first four in the tool's present orientation.")),
    ] = 12
    radius_mm: Annotated[
        float,
        Ge(2),
        Le(50),
        MM,
        Option(metavar="MM"),
        Help(
            declared(
                "Approximate radius of the sphere. It guides the robot; the true radius is "
                "measured."
            )
        ),
    ] = _USUAL_MM

    @property
    def survey(self) -> SphereSurvey:
        """How many touches there are, and from which sides."""
        return SphereSurvey(self.radius_mm, self.count, self.tilt_deg)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the tip passes over the sphere, and stops on its way down to it."""
        yield from super().problems(check)
        survey = self.survey
        least_mm = self.clearance_mm + HIGHEST_MM + survey.drop_mm + survey.aside_mm
        if least_mm >= self.lift_mm:
            yield Problem(
                "lift_mm",
                tr(
                    "must be more than {least:.1f}, so that the tip passes over a sphere of "
                    "{radius:g} mm",
                    least=least_mm,
                    radius=self.radius_mm,
                ),
            )


@dataclass(frozen=True, slots=True)
class SphereTouchSource(SurfaceTouchSource[SphereSurvey, "SphereTouchResult"]):
    """Measures by touching one sphere from several sides, the tool upright and tilted."""

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: one sphere touched {count} times from several sides, the tool "
            "upright and tilted by {tilt:g} degrees",
            count=self.survey.count,
            tilt=self.survey.tilt_deg,
        )

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Were all touches on the same sphere, and is it fixed?")

    def proof_of(self, basis: ProofBasis) -> "SphereTest":
        """Return the test in other tilts; see :meth:`~robolink.procedures.ProvesAgain.proof_of`.

        Raises:
            TypeError: The result is not that of a sphere.
        """
        from robolink.calibration import SphereTouchResult
        from robolink.methods.surface_touch.sphere_procedure import (  # numpy
            SphereTest,
            TouchedSphere,
        )
        from robolink.procedures.tilt_proof import upright_of

        if not isinstance(basis.result, SphereTouchResult):
            raise TypeError("the sphere that was touched is a part of the result")
        x_mm, y_mm, z_mm = basis.result.reference_point_mm
        return SphereTest(
            **basis.common,
            touch=self.touch,
            survey=self.survey,
            sphere=TouchedSphere((x_mm, y_mm, z_mm), basis.result.radius_mm),
            axes=self.axes,
            u_mm=drift_uncertainty_mm(basis.result),
            upright=upright_of(basis.result, basis.result.offset, basis.tool),
        )

    def _kind(self) -> "SurfaceKind[SphereSurvey, SphereTouchResult]":
        from robolink.methods.surface_touch.sphere_procedure import SPHERE  # numpy

        return SPHERE


@checks_arguments
def measure_sphere_touch(
    plan: TouchPlan,
    survey: SphereSurvey,
    *,
    stored: ToolOffset,
    axes: int = 0,
    sigma_mm: float | None = None,
    sampling: SamplingPolicy = TAKE_ALL,
) -> "Procedure[SphereTouchResult]":
    """Measure a tip on a sphere. Runs in Tool 0.

    It ends lifted, over the place that was touched last, in the orientation in which it began.

    Args:
        plan: Lift, clearance, contact input.
        survey: How many touches, and from which sides.
        stored: The offset stored now; the approaches use it. Where it is wrong by e, the tip comes
            down nearer to the sphere by up to 2 e sin(tilt / 2).
        axes: How many axes the robot has, 0 where nobody knows.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.
        sampling: Whether a touch may be made again when all are made.

    Raises:
        CalibrationError: ``off_top``, ``radius_contradicted``, ``not_tilted``; ``not_touched``,
            ``typed_ahead``, ``touch_not_proven``, ``large_residual``; and as
            :func:`~robolink.calibration.solve_sphere_touch`.

    Example:
        >>> import math
        >>> from robolink.methods import SphereSurvey, measure_sphere_touch
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> def onto_the_ball(at, centre=(310, 95, -60), radius_mm=10):
        ...     share = radius_mm / math.dist(at, centre)
        ...     return tuple(c + share * (x - c) for x, c in zip(at, centre))
        >>> cell = PaperCell(Pose(298, 99, 20, 0), ToolOffset(12.3, -3.9, -20.6), onto_the_ball)
        >>> course = measure_sphere_touch(
        ...     TouchPlan(), SphereSurvey(radius_mm=10), stored=ToolOffset(12, -4, -20), axes=6
        ... )
        >>> [round(length, 3) for length in cell.run(course).offset.components()[:3]]
        [12.3, -3.9, -20.6]
    """
    source = SphereTouchSource(plan, survey, axes, sigma_mm, sampling)
    return source.steps(stored)


@dataclass(frozen=True, slots=True)
class SphereTouches(TiltedTouches):
    """Touches of one sphere from several sides, the tool upright, turned and tilted."""

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve eight poses and more; see :class:`~robolink.procedures.PoseMethod`."""
        from robolink.calibration import solve_sphere_touch  # numpy, imported only when used

        return solve_sphere_touch(flange, stored=stored, sigma_mm=self.sigma_mm)


def _source(parameters: SphereTouchParameters, site: Site) -> "TipSource":
    return SphereTouchSource(
        parameters.touch, parameters.survey, **told_at(METHOD, parameters, site)
    )


def _proof() -> "type[KeptProof]":
    from robolink.methods.surface_touch.sphere_procedure import SphereTest

    return SphereTest


METHOD = Method(
    name="sphere-touch",
    summary=declared("Touch a sphere from several sides, the tool upright and tilted: X, Y and Z."),
    description=declared(
        "Touch a sphere from several sides, the tool upright and tilted: X, Y and Z. The ball "
        "of a bearing or of a gauge is enough; nobody has to hit a point.\n\nFirst put the tip "
        "some millimetres above the top of the sphere, with the tool oriented as in "
        "production. Four touches show where the sphere is. Then the robot tilts the tool in "
        "the air and stops near one side each time; you jog the rest. The tool must be defined "
        "already, to a millimetre or two. The result includes the place of the sphere and its "
        "true radius. A robot whose tool only turns about Z cannot do this.\n\nWith existing "
        "poses nothing moves."
    ),
    parameters=SphereTouchParameters,
    measures=("x_mm", "y_mm", "z_mm"),
    needs=Needs(station=StationKind.TOUCH, named=False, tilt=True),
    source=_source,
    from_poses=lambda _parameters, site: SphereTouches(site.sigma_mm),
    pose_help=PoseHelp(
        points=declared(
            "Eight points or more taught on the pendant from several sides, the tool tilted."
        ),
        typed=declared("A pose X,Y,Z,U,V,W in mm and degrees; give it eight times or more."),
        path=declared("A file of poses that state X to W."),
    ),
    proof=_proof,
)
