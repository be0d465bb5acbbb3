"""The parameters of one-touch."""

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Ge, Le

from robolink.messages import declared, tr
from robolink.methods.declaration.method import MM, Help, Option
from robolink.methods.declaration.pin_parameters import PinParameters


@dataclass(frozen=True, kw_only=True)
class OneTouchParameters(PinParameters):
    """How a known pin is touched once."""

    basis: Annotated[
        Literal["difference", "absolute"],
        Option(flag="--absolute", chooses="absolute", moves=False, from_recipe="basis"),
        Help(declared("Trust the place of the pin, not the last touch of this tool on it.")),
    ] = "difference"
    max_changes: Annotated[
        int,
        Ge(1),
        Le(1000),
        Option(moves=False),
        Help(
            declared(
                "Number of changes by difference after which a full calibration is due in any case."
            )
        ),
    ] = 20
    lift_mm: Annotated[
        float,
        Ge(1),
        Le(100),
        MM,
        Help(declared("How far above the pin the tip arrives, leaves and turns.")),
    ] = 10.0
    clearance_mm: Annotated[
        float,
        Ge(0.5),
        Le(50),
        MM,
        Help(
            declared(
                "How far above the pin the old tip would stop; give more than the new one can be"
                " longer."
            )
        ),
    ] = 5.0

    def room_mm(self) -> float:
        """Return how high the box has to be."""
        return self.lift_mm

    def no_residual(self) -> str:
        """Return why residuals cannot be judged."""
        return tr("cannot be judged: one touch cannot be checked; limit the interval")
