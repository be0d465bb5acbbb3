"""Sensors that stand in the cell, and how the tip is brought to them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from robolink.calibration._taking import may_end_early
from robolink.model import InputEdge

if TYPE_CHECKING:
    from robolink.calibration._beams import Beam  # numpy, not for --help


@dataclass(frozen=True, slots=True)
class BeamStation:
    """Two crossed light beams.

    Attributes:
        beams: Where they are, from the reference record (:func:`find_beams`).
        z_mm: Their height in the base, where they cross.
        inputs: The input that each of them switches; the same one twice where both act on it.
        off_when_broken: Whether an input goes off, not on, while its beam is broken.
    """

    beams: "tuple[Beam, Beam]"
    z_mm: float
    inputs: tuple[int, int]
    off_when_broken: bool = False

    def edge(self, beam: int, *, broken: bool) -> InputEdge:
        """Return what the input of a beam does when the tip breaks it, or frees it."""
        return InputEdge(self.inputs[beam], falling=broken is self.off_when_broken)


@dataclass(frozen=True, slots=True)
class CrossingPlan:
    """How a tip is driven through the beams.

    Attributes:
        search_mm: How far on either side of where it is expected the tip starts; a new tip may
            be off by less than this.
        aside_mm: How far from where the beams cross each of them is crossed, so that the tip
            breaks one at a time.
        dip_mm: How far below the beams the end of the tip is, as far as its length is known.
        lift_mm: How far above them it comes and goes, and turns.
        speed_mm_s: How fast it crosses. The faster, the later it stops past an edge.
        repeats: How often each beam is crossed both ways. Once leaves no residual, so nothing would
            tell how well the crossings agree.
        shaft_mm: How much deeper the shaft is measured too, to tell a bent needle; 0 for not.
        max_lean_deg: Largest angle at which the shaft may lean.
    """

    search_mm: float = 2.0
    aside_mm: float = 5.0
    dip_mm: float = 1.5
    lift_mm: float = 10.0
    speed_mm_s: float = 5.0
    repeats: int = 2
    shaft_mm: float = 3.0
    max_lean_deg: float = 2.0

    def may_end_early(self, *, turned: bool, sigma_stated: bool) -> bool:
        """Tell whether the tip can be known well enough before the last crossing.

        Args:
            turned: Whether the beams are crossed at a second angle of U too.
            sigma_stated: Whether somebody stated the standard deviation of a crossing.
        """
        # X, Y and a lag for each beam; turned, by how far each beam was moved as well.
        count, unknowns = (8, 6) if turned else (4, 4)
        return may_end_early(count * self.repeats, unknowns=unknowns, sigma_stated=sigma_stated)


@dataclass(frozen=True, slots=True)
class TouchStation:
    """A level surface that switches an input when a tip touches it.

    Attributes:
        x_mm, y_mm: Where it is touched, base.
        z_mm: Its height in the base.
        input: The input that it switches.
        off_when_touched: Whether that goes off, not on.
    """

    x_mm: float
    y_mm: float
    z_mm: float
    input: int
    off_when_touched: bool = False

    @property
    def edge(self) -> InputEdge:
        """What the input does at a touch."""
        return InputEdge(self.input, falling=self.off_when_touched)


@dataclass(frozen=True, slots=True)
class ProbePlan:
    """How a tip is brought down on a surface.

    Attributes:
        clearance_mm: How far above the expected touch the tip begins to seek it.
        beyond_mm: How far below it the search ends; a new tip may be shorter by less than this.
        back_off_mm: How far the tip is lifted after each touch.
        lift_mm: How far above the surface it comes and goes, and turns.
        speeds_mm_s: Speed of each touch; two of them tell the latency of the trigger.
    """

    clearance_mm: float = 3.0
    beyond_mm: float = 2.0
    back_off_mm: float = 1.0
    lift_mm: float = 10.0
    speeds_mm_s: tuple[float, ...] = (2.0, 1.0, 2.0, 1.0)

    def may_end_early(self, *, sigma_stated: bool) -> bool:
        """Tell whether the tip can be known well enough before the last touch.

        Args:
            sigma_stated: Whether somebody stated the standard deviation of a touch.
        """
        # Z and the latency.
        return may_end_early(len(self.speeds_mm_s), unknowns=2, sigma_stated=sigma_stated)
