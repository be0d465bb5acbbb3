"""Crossings of two beams, solved at the height at which the beams see the needle."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from robolink.calibration import (
    BeamsResult,
    Crossing,
    ErrorSource,
    FlangePlane,
    ShaftSeen,
    TipHeight,
    solve_crossed_beams,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.procedures import NO_OFFSET

if TYPE_CHECKING:
    from robolink.calibration import Beam, Lean

_PASSES: Final = 4
_SLOPE_A_DEGREE: Final = math.tan(math.radians(1.0))
_STILL_MM: Final = 1e-7


@dataclass(frozen=True, slots=True)
class CrossingSolver:
    """Solves crossings of one needle.

    Attributes:
        beams: Where the beams are.
        frame: A pose of the flange at the crossings; its lean counts.
        dip_mm: How far below the beams the end of the expected tip is.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one crossing's middle, where it is known.
        step_mm: How finely the place of an edge is told, where it is known.
    """

    beams: "tuple[Beam, Beam]"
    frame: Pose
    dip_mm: float
    stored: ToolOffset | None
    sigma_mm: float | None = None
    step_mm: float | None = None

    def solved(
        self,
        crossings: Sequence[Crossing],
        shaft: Sequence[Crossing] = (),
        *,
        deeper_mm: float = 0.0,
        moved: bool = False,
    ) -> BeamsResult:
        """Solve crossings, at the height of the tip that is found.

        Args:
            crossings: They, all made with the tip equally deep.
            shaft: Those of the shaft, at the U of the first of them; none where it was not
                looked at.
            deeper_mm: How much deeper than ``dip_mm`` the tip was for those of the shaft.
            moved: Whether only the directions of the beams are relied on.

        A flange that leans carries a tip that is d beside the expected one by d sin(lean) higher or
        lower, so the beams see another place of its shaft: X and Y would be wrong by d sin(lean)^2,
        which no residual shows; 4 um at 0.5 mm and 5 degrees. Each pass leaves sin(lean)^2 of it.

        Raises:
            CalibrationError: As :func:`~robolink.calibration.solve_crossed_beams`.
        """
        tip = expected = self.stored or NO_OFFSET
        for _ in range(_PASSES):
            before = tip
            above_mm = self._above_mm(tip)
            seen = ShaftSeen(shaft, above_mm, deeper_mm / abs(self._r33)) if shaft else None
            found = solve_crossed_beams(
                crossings,
                self.beams,
                stored=self.stored,
                height=self._height(tip, 0.0 if seen else above_mm),
                sigma_mm=self.sigma_mm,
                beams_may_have_moved=moved,
                shaft=seen,
                step_mm=self.step_mm,
            )
            tip = replace(expected, x_mm=found.offset.x_mm, y_mm=found.offset.y_mm)
            if math.dist((tip.x_mm, tip.y_mm), (before.x_mm, before.y_mm)) < _STILL_MM:
                break
        if found.lean is None:
            # Nobody saw the shaft, so nothing tells where the end below it is.
            unseen = ErrorSource.of_lengths("bend_deg", 2, gain=self.dip_mm * _SLOPE_A_DEGREE)
            found = replace(found, sources=(*(found.sources or ()), unseen))
        return replace(found, seen_above_mm=self.dip_mm)

    def foreseen_shaft(self, crossings: Sequence[Crossing], deeper_mm: float) -> ShaftSeen:
        """Return what will be seen of the shaft, as far as it counts for how sure the tip is.

        Args:
            crossings: Those that are planned for it.
            deeper_mm: How much deeper than ``dip_mm`` the tip will be.
        """
        up = abs(self._r33)
        return ShaftSeen(crossings, self.dip_mm / up, deeper_mm / up)

    def seen_mm(self, tip: ToolOffset, lean: "Lean") -> tuple[float, float]:
        """Return X and Y of the place at which the beams see a needle that leans, flange.

        Args:
            tip: Where its end is.
            lean: How it leans.
        """
        above_mm = self._above_mm(tip)
        return tip.x_mm + lean.x * above_mm, tip.y_mm + lean.y * above_mm

    @property
    def _r33(self) -> float:
        return FlangePlane.of(self.frame).r33

    def _above_mm(self, tip: ToolOffset) -> float:
        """Return how far above its end the beams see the needle, along the flange's axis."""
        expected, plane = self.stored or NO_OFFSET, FlangePlane.of(self.frame)
        above_mm = self.dip_mm + plane.rise_mm(expected) - plane.rise_mm(tip)
        return above_mm / abs(plane.r33)

    def _height(self, tip: ToolOffset, above_mm: float) -> TipHeight:
        """Return the height of a place of the needle above its end, in the flange's axes."""
        return TipHeight(tip.z_mm + math.copysign(above_mm, self._r33))


def require_straight(result: BeamsResult, max_lean_deg: float) -> None:
    """Refuse a needle that leans so far that nobody knows where its end is.

    Args:
        result: What was measured, with its shaft.
        max_lean_deg: Largest angle at which the shaft may lean.

    Raises:
        CalibrationError: ``bent_needle``.
    """
    lean = result.lean
    if lean is not None and lean.angle_deg > max_lean_deg:
        raise CalibrationError(
            "bent_needle",
            tr(
                "The needle leans by {lean:.1f} degrees, limit {limit:.1f}.",
                lean=lean.angle_deg,
                limit=max_lean_deg,
            ),
            remedy=tr("Change it, and check that the new one is straight and tight."),
        )
