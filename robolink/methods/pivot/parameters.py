"""The parameters of pivot."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Le

from robolink.messages import declared
from robolink.methods.declaration.method import DEGREES, MM, Help, Length, Option
from robolink.methods.declaration.pin_parameters import PinParameters, Retake
from robolink.procedures import SamplingPolicy


@dataclass(frozen=True, kw_only=True)
class PivotParameters(PinParameters):
    """How one pin is touched with the tool tilted and turned."""

    count: Annotated[
        int,
        Ge(4),
        Le(12),
        Help(
            declared(
                "Number of touches, the first one in the orientation in which the tool stands."
            )
        ),
    ] = 6
    tilt_deg: Annotated[
        float,
        Ge(5),
        Le(45),
        DEGREES,
        Option(metavar="DEG"),
        Help(declared("How far the tool leans in the other touches, relative to the first one.")),
    ] = 20.0
    lift_mm: Annotated[
        float,
        Ge(1),
        Le(100),
        MM,
        Help(declared("How far the tip is lifted before it tilts and turns.")),
    ] = 10.0
    until_mm: Annotated[
        Length | None,
        Option(metavar="MM"),
        Help(declared("End early when X, Y and Z are repeatable to this in 95 %.")),
    ] = None
    retake: Retake = False

    @property
    def sampling(self) -> SamplingPolicy:
        """When it ends, and whether a pose is offered to be taken again."""
        return SamplingPolicy(self.until_mm, retake=self.retake)
