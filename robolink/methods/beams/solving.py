"""Crossings of two beams, solved at the height at which the beams see the needle."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from robolink.calibration import (
    BeamsResult,
    Crossing,
    FlangePlane,
    TipHeight,
    solve_crossed_beams,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.procedures import NO_OFFSET

if TYPE_CHECKING:
    from robolink.calibration import Beam

_PASSES: Final = 4
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
    """

    beams: "tuple[Beam, Beam]"
    frame: Pose
    dip_mm: float
    stored: ToolOffset | None
    sigma_mm: float | None = None

    def solved(
        self, crossings: Sequence[Crossing], *, deeper_mm: float = 0.0, moved: bool = False
    ) -> BeamsResult:
        """Solve crossings, at the height of the tip that is found.

        Args:
            crossings: They, all made with the tip equally deep.
            deeper_mm: How much deeper than ``dip_mm`` the tip was.
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
            found = solve_crossed_beams(
                crossings,
                self.beams,
                stored=self.stored,
                height=self._height(tip, deeper_mm),
                sigma_mm=self.sigma_mm,
                beams_may_have_moved=moved,
            )
            tip = replace(expected, x_mm=found.offset.x_mm, y_mm=found.offset.y_mm)
            if math.dist((tip.x_mm, tip.y_mm), (before.x_mm, before.y_mm)) < _STILL_MM:
                break
        return found

    def require_straight(
        self,
        crossings: Sequence[Crossing],
        shaft: Sequence[Crossing],
        *,
        shaft_mm: float,
        max_lean_deg: float,
    ) -> None:
        """Refuse a needle whose shaft is not above its tip.

        Args:
            crossings: Those of the tip, at one angle of U.
            shaft: Those of the shaft, at the same angle.
            shaft_mm: How much deeper the tip was for these.
            max_lean_deg: Largest angle at which the shaft may lean.

        Raises:
            CalibrationError: ``bent_needle``, and those of :meth:`solved`.
        """
        tip, above = (
            self.solved(seen, deeper_mm=deeper_mm).offset
            for seen, deeper_mm in ((crossings, 0.0), (shaft, shaft_mm))
        )
        beside_mm = math.hypot(above.x_mm - tip.x_mm, above.y_mm - tip.y_mm)
        lean_deg = math.degrees(math.atan2(beside_mm, shaft_mm))
        if lean_deg > max_lean_deg:
            raise CalibrationError(
                "bent_needle",
                tr(
                    "The needle leans by {lean:.1f} degrees, limit {limit:.1f}.",
                    lean=lean_deg,
                    limit=max_lean_deg,
                ),
                remedy=tr("Change it, and check that the new one is straight and tight."),
            )

    def _height(self, tip: ToolOffset, deeper_mm: float) -> TipHeight:
        """Return the height at which the beams see the needle, in the flange's axes.

        The tip dips below the beams, so they see the shaft above it, along the flange's axis.
        """
        expected, plane = self.stored or NO_OFFSET, FlangePlane.of(self.frame)
        above_mm = self.dip_mm + deeper_mm + plane.rise_mm(expected) - plane.rise_mm(tip)
        return TipHeight(tip.z_mm + above_mm / plane.r33)
