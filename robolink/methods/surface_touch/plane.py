"""plane-touch: a plane touched upright and tilted, on robots that tilt their tool."""

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
from robolink.methods.surface_touch.survey import PlaneSurvey
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
    from robolink.calibration import PlaneTouchResult
    from robolink.methods.surface_touch.drive import SurfaceKind
    from robolink.methods.surface_touch.plane_procedure import PlaneTest
    from robolink.procedures import KeptProof, TipSource


@dataclass(frozen=True, kw_only=True)
class PlaneTouchParameters(SurfaceParameters):
    """How a plane is touched with the tool upright and tilted."""

    count: Annotated[
        int,
        Ge(PlaneSurvey.least_count),
        Le(24),
        Help(declared("Number of touches; the first three in the tool's present orientation.")),
    ] = 10
    spread_mm: Annotated[
        float,
        Ge(2),
        Le(100),
        MM,
        Option(metavar="MM"),
        Help(declared("How far from the first touch the others are; the plane must reach as far.")),
    ] = 10.0

    @property
    def survey(self) -> PlaneSurvey:
        """How many touches there are, and where."""
        return PlaneSurvey(self.count, self.tilt_deg, self.spread_mm)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the tip stops on its way down to a plane that may lean."""
        yield from super().problems(check)
        least_mm = self.clearance_mm + HIGHEST_MM + self.survey.rise_mm
        if least_mm >= self.lift_mm:
            yield Problem(
                "lift_mm",
                tr(
                    "must be more than {least:.1f}: a plane may lean by {lean:g} degrees, so that "
                    "{spread:g} mm from the first touch it may be {rise:.1f} mm higher",
                    least=least_mm,
                    lean=self.survey.most_lean_deg,
                    spread=self.spread_mm,
                    rise=self.survey.rise_mm,
                ),
            )


@dataclass(frozen=True, slots=True)
class PlaneTouchSource(SurfaceTouchSource[PlaneSurvey, "PlaneTouchResult"]):
    """Measures by touching one plane with the tool upright and tilted."""

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: one plane touched {count} times, the tool upright and tilted "
            "by {tilt:g} degrees",
            count=self.survey.count,
            tilt=self.survey.tilt_deg,
        )

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Were all touches on the same flat surface, and is it fixed?")

    def proof_of(self, basis: ProofBasis) -> "PlaneTest":
        """Return the test in other tilts; see :meth:`~robolink.procedures.ProvesAgain.proof_of`.

        Raises:
            TypeError: The result is not that of a plane.
        """
        from robolink.calibration import PlaneTouchResult
        from robolink.methods.surface_touch.plane_procedure import PlaneTest  # numpy
        from robolink.procedures.tilt_proof import upright_of

        if not isinstance(basis.result, PlaneTouchResult):
            raise TypeError("the plane that was touched is a part of the result")
        return PlaneTest(
            **basis.common,
            touch=self.touch,
            plane=basis.result.plane,
            tilt_deg=self.survey.tilt_deg,
            axes=self.axes,
            u_mm=drift_uncertainty_mm(basis.result),
            upright=upright_of(basis.result, basis.result.offset, basis.tool),
        )

    def _kind(self) -> "SurfaceKind[PlaneSurvey, PlaneTouchResult]":
        from robolink.methods.surface_touch.plane_procedure import PLANE  # numpy

        return PLANE


@checks_arguments
def measure_plane_touch(
    plan: TouchPlan,
    survey: PlaneSurvey,
    *,
    stored: ToolOffset,
    axes: int = 0,
    sigma_mm: float | None = None,
    sampling: SamplingPolicy = TAKE_ALL,
) -> "Procedure[PlaneTouchResult]":
    """Measure a tip on a plane. Runs in Tool 0.

    It ends lifted, over the place that was touched last, in the orientation in which it began.

    Args:
        plan: Lift, clearance, contact input.
        survey: How many touches, and where.
        stored: The offset stored now; the approaches use it. Where it is wrong by e, the tip comes
            down nearer to the plane by up to 2 e sin(tilt / 2).
        axes: How many axes the robot has, 0 where nobody knows.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.
        sampling: Whether a touch may be made again when all are made.

    Raises:
        CalibrationError: ``surface_leans``, ``not_tilted``; ``not_touched``, ``typed_ahead``,
            ``touch_not_proven``, ``large_residual``; and as
            :func:`~robolink.calibration.solve_plane_touch`.

    Example:
        >>> from robolink.methods import PlaneSurvey, measure_plane_touch
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> cell = PaperCell(
        ...     Pose(300, 100, 20, 0), ToolOffset(12.3, -3.9, -20.6), lambda at: (at[0], at[1], -40)
        ... )
        >>> stored, survey = ToolOffset(12, -4, -20), PlaneSurvey(count=8)
        >>> found = cell.run(measure_plane_touch(TouchPlan(), survey, stored=stored, axes=6))
        >>> [round(length, 3) for length in found.offset.components()[:3]]
        [12.3, -3.9, -20.6]
    """
    source = PlaneTouchSource(plan, survey, axes, sigma_mm, sampling)
    return source.steps(stored)


@dataclass(frozen=True, slots=True)
class PlaneTouches(TiltedTouches):
    """Touches of one plane, the tool upright, turned and tilted."""

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve seven poses and more; see :class:`~robolink.procedures.PoseMethod`."""
        from robolink.calibration import solve_plane_touch  # numpy, imported only when used

        return solve_plane_touch(flange, stored=stored, sigma_mm=self.sigma_mm)


def _source(parameters: PlaneTouchParameters, site: Site) -> "TipSource":
    return PlaneTouchSource(
        parameters.touch, parameters.survey, **told_at(METHOD, parameters, site)
    )


def _proof() -> "type[KeptProof]":
    from robolink.methods.surface_touch.plane_procedure import PlaneTest

    return PlaneTest


METHOD = Method(
    name="plane-touch",
    summary=declared("Touch a flat surface with the tool upright and tilted: X, Y and Z."),
    description=declared(
        "Touch a flat surface with the tool upright and tilted: X, Y and Z. No pin is needed, "
        "and nobody has to hit a point.\n\nFirst put the tip some millimetres above the "
        "surface, with the tool oriented as in production. Three touches show how the surface "
        "lies. Then the robot tilts the tool in the air and stops near the surface each time; "
        "you jog the rest. The tool must be defined already, to a millimetre or two. A "
        "five-axis robot needs a surface at an angle of 15 to 30 degrees; for a six-axis robot "
        "it may be level. Z is less accurate than X and Y.\n\nWith existing poses nothing "
        "moves."
    ),
    parameters=PlaneTouchParameters,
    measures=("x_mm", "y_mm", "z_mm"),
    needs=Needs(station=StationKind.TOUCH, named=False, tilt=True),
    source=_source,
    from_poses=lambda _parameters, site: PlaneTouches(site.sigma_mm),
    pose_help=PoseHelp(
        points=declared("Seven points or more taught on the pendant, the tool upright and tilted."),
        typed=declared("A pose X,Y,Z,U,V,W in mm and degrees; give it seven times or more."),
        path=declared("A file of poses that state X to W."),
    ),
    proof=_proof,
)
