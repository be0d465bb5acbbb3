"""The parameters of sphere-touch."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Le

from robolink.calibration import HIGHEST_MM
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.declaration.method import MM, Check, Help, Option
from robolink.methods.declaration.surface_parameters import SurfaceParameters
from robolink.methods.sphere_touch.survey import LEAST_COUNT, SphereSurvey

_USUAL_MM = 10.0


@dataclass(frozen=True, kw_only=True)
class SphereTouchParameters(SurfaceParameters):
    """How a sphere is touched from several sides, with the tool upright and tilted."""

    count: Annotated[
        int,
        Ge(LEAST_COUNT),
        Le(24),
        Help(
            declared(
                "Number of touches; the first four in the orientation in which the tool stands."
            )
        ),
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
