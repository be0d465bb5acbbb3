"""The parameters of six-point."""

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Ge, Le

from robolink.messages import declared
from robolink.methods.declaration.method import MM, Help, Option
from robolink.methods.pivot.parameters import PivotParameters


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
