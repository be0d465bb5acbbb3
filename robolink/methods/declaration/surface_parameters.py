"""The parameters of all methods in which a person brings the tip onto a surface."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Le

from robolink.messages import declared
from robolink.methods.declaration.method import DEGREES, MM, Help, InputNumber, Option
from robolink.methods.declaration.pin_parameters import PinParameters, Retake
from robolink.procedures import SamplingPolicy


@dataclass(frozen=True, kw_only=True)
class SurfaceParameters(PinParameters):
    """How a tip is taken off a surface and brought back; the surface stands for the pin."""

    lift_mm: Annotated[
        float,
        Ge(1),
        Le(100),
        MM,
        Help(declared("How far the tip is lifted before it tilts and turns.")),
    ] = 12.0
    clearance_mm: Annotated[
        float,
        Ge(0.5),
        Le(50),
        MM,
        Help(
            declared(
                "Least distance from the surface at which the robot stops; a person jogs the rest."
            )
        ),
    ] = 2.0
    contact_input: Annotated[
        InputNumber | None,
        Option(metavar="N"),
        Help(
            declared("Number of the input that shows contact of tip and surface, if there is one.")
        ),
    ] = None
    tilt_deg: Annotated[
        float,
        Ge(10),
        Le(45),
        DEGREES,
        Option(metavar="DEG"),
        Help(declared("How far the tool leans, relative to the first touch.")),
    ] = 30.0

    retake: Retake = False

    @property
    def sampling(self) -> SamplingPolicy:
        """Whether a touch is offered to be made again."""
        return SamplingPolicy(retake=self.retake)

    def states_station(self) -> bool:
        """Tell that nothing need be known about the surface: it is found with the tip."""
        return True
