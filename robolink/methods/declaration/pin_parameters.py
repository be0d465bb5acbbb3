"""The parameters of all methods in which a person brings the tip onto a pin."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Le

from robolink.calibration import HIGHEST_MM
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.declaration.method import (
    MM,
    Check,
    Help,
    InputNumber,
    LengthRule,
    MethodParameters,
    Option,
)
from robolink.model import InputEdge
from robolink.procedures import TouchPlan

Retake = Annotated[
    bool,
    Option(flag="--retake/--no-retake", default=True),
    Help(declared("Whether robolink offers to make the touch that fits worst again.")),
]
"""Whether the worst touch is offered again when all are made."""


@dataclass(frozen=True, kw_only=True)
class PinParameters(MethodParameters):
    """How a tip is taken off a pin and brought back."""

    lift_mm: Annotated[
        float, Ge(1), Le(100), MM, Help(declared("How far the tip is lifted before it turns."))
    ] = 10.0
    clearance_mm: Annotated[
        float,
        Ge(0.5),
        Le(50),
        MM,
        Help(
            declared(
                "Least distance above the pin at which the robot stops; a person jogs the rest."
            )
        ),
    ] = 2.0
    contact_input: Annotated[
        InputNumber | None,
        Option(metavar="N"),
        Help(declared("Number of the input that shows contact of tip and pin, if there is one.")),
    ] = None
    off_in_contact: Annotated[
        bool,
        Help(declared("Whether that input goes off, not on, in contact.")),
    ] = False

    @property
    def touch(self) -> TouchPlan:
        """The same for a procedure."""
        contact = None
        if self.contact_input is not None:
            contact = InputEdge(self.contact_input, falling=self.off_in_contact)
        return TouchPlan(lift_mm=self.lift_mm, clearance_mm=self.clearance_mm, contact=contact)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the tip stops on its way down to the pin."""
        yield from standoff_below_lift(self.clearance_mm, self.lift_mm, check)
        if self.off_in_contact and self.contact_input is None:
            yield Problem(
                "off_in_contact", tr("goes with {other}", other=check.spell("contact_input"))
            )

    def room_mm(self) -> float:
        """Return how high the box has to be."""
        return self.lift_mm


@dataclass(frozen=True, kw_only=True)
class UprightPinParameters(PinParameters):
    """How an upright tip is touched that keeps its Z: heights tell whether it may."""

    if_length_changed: Annotated[
        LengthRule,
        Option(moves=False),
        Help(
            declared(
                "What happens when the heights of the touches show a longer or shorter tip: ask "
                "a person, write Z by the difference, or keep Z. If nobody can be asked, ask "
                "writes nothing."
            )
        ),
    ] = "ask"

    def length_rule(self) -> LengthRule:
        """Return what is done where the length changed."""
        return self.if_length_changed


def clearance_below_lift(clearance_mm: float, lift_mm: float, check: Check) -> Iterator[Problem]:
    """Check that something is left to come down."""
    if clearance_mm >= lift_mm:
        yield Problem(
            "clearance_mm",
            tr(
                "must be smaller than {other}, which is {lift:g}",
                other=check.spell("lift_mm"),
                lift=lift_mm,
            ),
        )


def standoff_below_lift(clearance_mm: float, lift_mm: float, check: Check) -> Iterator[Problem]:
    """Check that something is left to come down from the lift to the highest standoff."""
    if clearance_mm + HIGHEST_MM >= lift_mm:
        yield Problem(
            "clearance_mm",
            tr(
                "must be more than {highest:g} below {other}, which is {lift:g}: the robot stops "
                "up to {highest:g} mm above the clearance",
                highest=HIGHEST_MM,
                other=check.spell("lift_mm"),
                lift=lift_mm,
            ),
        )


def two_poses_agree() -> str:
    """Return why the residuals of two poses cannot be judged."""
    return tr(
        "cannot be judged: two poses cannot check each other; use n-angle, or limit "
        "the interval and state the standard deviation"
    )
