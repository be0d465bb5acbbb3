"""The parameters of plane-touch."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Le

from robolink.calibration import HIGHEST_MM
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.declaration.method import MM, Check, Help, Option
from robolink.methods.declaration.surface_parameters import SurfaceParameters
from robolink.methods.plane_touch.survey import LEAST_COUNT, PlaneSurvey


@dataclass(frozen=True, kw_only=True)
class PlaneTouchParameters(SurfaceParameters):
    """How a plane is touched with the tool upright and tilted."""

    count: Annotated[
        int,
        Ge(LEAST_COUNT),
        Le(24),
        Help(
            declared(
                "Number of touches; the first three in the orientation in which the tool stands."
            )
        ),
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
