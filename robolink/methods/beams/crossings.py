"""Crossings of two beams, each told about as it is made, and the worst of them made again."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

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
from robolink.runner import Procedure


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
        beams = self.first.station.beams
        at_first = crossings[: len(self.first.rounds())]
        if self.shaft:
            self._require_straight(at_first)
        if self.turned is None or len(crossings) > len(at_first):
            return solve_crossed_beams(
                crossings,
                beams,
                stored=self.stored,
                height=self._height(),
                sigma_mm=self.sigma_mm,
                beams_may_have_moved=self.turned is not None,
            )
        found = solve_crossed_beams(
            crossings, beams, stored=self.stored, height=self._height(), sigma_mm=self.sigma_mm
        )
        # Where the beams are is not relied on, so nothing tells yet how sure the tip is.
        return replace(found, half_width95=(), region95_radius_mm=None)

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

    def _height(self, deeper_mm: float = 0.0) -> TipHeight:
        """Return the height at which the beams see the needle, in the flange's axes.

        The tip dips below the beams, so they see the shaft above it, along the flange's axis.
        """
        first, tip_z_mm = self.first, 0.0 if self.stored is None else self.stored.z_mm
        above_mm = first.plan.dip_mm + deeper_mm
        return TipHeight(tip_z_mm + above_mm / FlangePlane.of(first.frame).r33)

    def _require_straight(self, crossings: Sequence[Crossing]) -> None:
        """Refuse a needle whose shaft is not above its tip."""
        plan, beams = self.first.plan, self.first.station.beams
        tip, shaft = (
            solve_crossed_beams(seen, beams, height=self._height(deeper_mm)).offset
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
