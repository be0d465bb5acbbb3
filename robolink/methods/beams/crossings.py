"""Crossings of two beams, each told about as it is made, and the worst of them made again."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from robolink.calibration import (
    BeamsResult,
    Crossing,
    FlangePlane,
    TipHeight,
    crossing_sigma_gain,
    solve_crossed_beams,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.beams.drive import BeamDrive, BeamScan, BeamTravel
from robolink.model import ToolOffset
from robolink.procedures import NO_OFFSET
from robolink.runner import Procedure

_PASSES: Final = 4
_STILL_MM: Final = 1e-7


@dataclass(slots=True)
class CrossingSampler:
    """Crossings at one angle of U, or at two; implements ``SequentialSampler``.

    Attributes:
        travel: Takes the frame from one to the next.
        first: The drive at the first angle. Its shaft is measured there, where that is planned,
            before the tip leaves it.
        turned: The drive at the second angle, ``None`` for measuring at one; with it only the
            directions of the beams are relied on.
        stored: The offset stored now.
        sigma_mm: Standard deviation of one crossing's middle, where it is known.
        shaft: The crossings of the shaft.
    """

    travel: BeamTravel
    first: BeamDrive
    turned: BeamDrive | None
    stored: ToolOffset | None
    sigma_mm: float | None
    shaft: list[Crossing] = field(default_factory=list)

    @property
    def scans(self) -> list[BeamScan]:
        """All that are planned for the tip, in their order."""
        return self.first.rounds() + (self.turned.rounds() if self.turned else [])

    @property
    def known(self) -> str:
        """Which lengths become known."""
        return tr("X and Y are known")

    def counted(self, count: int) -> str:
        """Say how many were taken."""
        return tr("{count} crossings", count=count)

    def take(self, place: BeamScan) -> Procedure[Crossing]:
        """Take one; see :class:`~robolink.procedures.Sampler`."""
        last = self.travel.last
        if last is not None and last.drive is not place.drive:
            yield from self.away()
        (crossing,) = yield from self.travel.through([place])
        return crossing

    def away(self) -> Procedure[None]:
        """Lift the tip; see :class:`~robolink.procedures.Sampler`."""
        last, plan = self.travel.last, self.first.plan
        if last is not None and plan.shaft_mm and not self.shaft:
            deep = replace(last.drive, deeper_mm=plan.shaft_mm)
            self.shaft = yield from self.travel.through(deep.round(last.beam))
        yield from self.travel.lifted()

    def solve(self, crossings: Sequence[Crossing]) -> BeamsResult:
        """Solve what was taken."""
        at_first = crossings[: len(self.first.rounds())]
        if self.shaft:
            self._require_straight(at_first)
        if self.turned is None or len(crossings) > len(at_first):
            return self._solved(crossings, moved=self.turned is not None)
        # Where the beams are is not relied on, so nothing tells yet how sure the tip is.
        return replace(self._solved(crossings), half_width95=(), region95_radius_mm=None)

    def foreseen(self, place: BeamScan) -> Crossing:
        """Return what would be taken there."""
        return Crossing(place.beam, place.start, place.end)

    def gain(self, crossings: Sequence[Crossing]) -> float:
        """Return the standard deviation as a multiple of a single one's."""
        return crossing_sigma_gain(
            crossings, self.first.station.beams, beams_may_have_moved=self.turned is not None
        )

    def named(self, crossing: Crossing) -> str:
        """Say where it was taken."""
        if self.turned is None:
            return tr("beam {beam}", beam=crossing.beam + 1)
        return tr("beam {beam} and U {u:.1f}", beam=crossing.beam + 1, u=crossing.entry.u_deg)

    def which(self, number: int, crossing: Crossing) -> str:
        """Say which one it is."""
        return tr("Crossing {number}, at {where}", number=number, where=self.named(crossing))

    def _solved(
        self, crossings: Sequence[Crossing], *, deeper_mm: float = 0.0, moved: bool = False
    ) -> BeamsResult:
        """Solve crossings, at the height of the tip that is found.

        A flange that leans carries a tip that is d beside the expected one by d sin(lean) higher or
        lower, so the beams see another place of its shaft: X and Y would be wrong by d sin(lean)^2,
        which no residual shows; 4 um at 0.5 mm and 5 degrees. Each pass leaves sin(lean)^2 of it.
        """
        tip = expected = self.stored or NO_OFFSET
        for _ in range(_PASSES):
            before = tip
            found = solve_crossed_beams(
                crossings,
                self.first.station.beams,
                stored=self.stored,
                height=self._height(tip, deeper_mm),
                sigma_mm=self.sigma_mm,
                beams_may_have_moved=moved,
            )
            tip = replace(expected, x_mm=found.offset.x_mm, y_mm=found.offset.y_mm)
            if math.dist((tip.x_mm, tip.y_mm), (before.x_mm, before.y_mm)) < _STILL_MM:
                break
        return found

    def _height(self, tip: ToolOffset, deeper_mm: float) -> TipHeight:
        """Return the height at which the beams see the needle, in the flange's axes.

        The tip dips below the beams, so they see the shaft above it, along the flange's axis.
        """
        first, expected = self.first, self.stored or NO_OFFSET
        plane = FlangePlane.of(first.frame)
        above_mm = first.plan.dip_mm + deeper_mm + plane.rise_mm(expected) - plane.rise_mm(tip)
        return TipHeight(tip.z_mm + above_mm / plane.r33)

    def _require_straight(self, crossings: Sequence[Crossing]) -> None:
        """Refuse a needle whose shaft is not above its tip."""
        plan = self.first.plan
        tip, shaft = (
            self._solved(seen, deeper_mm=deeper_mm).offset
            for seen, deeper_mm in ((crossings, 0.0), (self.shaft, plan.shaft_mm))
        )
        beside_mm = math.hypot(shaft.x_mm - tip.x_mm, shaft.y_mm - tip.y_mm)
        lean_deg = math.degrees(math.atan2(beside_mm, plan.shaft_mm))
        if lean_deg > plan.max_lean_deg:
            raise CalibrationError(
                "bent_needle",
                tr(
                    "The needle leans by {lean:.1f} degrees; {limit:.1f} are allowed.",
                    lean=lean_deg,
                    limit=plan.max_lean_deg,
                ),
                remedy=tr("Change it, and look whether it is seated straight."),
            )
