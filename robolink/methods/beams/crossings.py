"""Crossings of two beams, each told about as it is made, and the worst of them made again."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from robolink.calibration import BeamsResult, Crossing, crossing_sigma_gain
from robolink.messages import tr
from robolink.methods.beams.drive import BeamDrive, BeamScan, BeamTravel
from robolink.methods.beams.solving import CrossingSolver, require_straight
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
        step_mm: How finely the place of an edge is told, where it is known.
        shaft: The crossings of the shaft.
    """

    travel: BeamTravel
    first: BeamDrive
    turned: BeamDrive | None
    stored: ToolOffset | None
    sigma_mm: float | None
    step_mm: float | None = None
    shaft: list[Crossing] = field(default_factory=list)

    @property
    def scans(self) -> list[BeamScan]:
        """All that are planned for the tip, in their order."""
        return self.first.rounds() + (self.turned.rounds() if self.turned else [])

    @property
    def known(self) -> str:
        """Which lengths become known."""
        return tr("X and Y")

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
        plan, solver = self.first.plan, self._solver
        known = self.turned is None or len(crossings) > len(at_first)
        result = solver.solved(
            crossings,
            self.shaft,
            deeper_mm=plan.shaft_mm,
            moved=self.turned is not None and known,
        )
        require_straight(result, plan.max_lean_deg)
        if not known:
            # Where the beams are is not relied on, so nothing tells yet how sure the tip is.
            return replace(result, half_width95=(), region95_radius_mm=None)
        return result if self.shaft or not plan.shaft_mm else self._widened(result, crossings)

    def _widened(self, result: BeamsResult, crossings: Sequence[Crossing]) -> BeamsResult:
        """Return a result as sure as it will be once the shaft has been looked at."""
        times = self.gain(crossings) / result.sigma_gain
        region_mm = result.region95_radius_mm
        return replace(
            result,
            half_width95=tuple(times * half for half in result.half_width95),
            region95_radius_mm=None if region_mm is None else times * region_mm,
        )

    def foreseen(self, place: BeamScan) -> Crossing:
        """Return what would be taken there."""
        return Crossing(place.beam, place.start, place.end)

    def gain(self, crossings: Sequence[Crossing]) -> float:
        """Return the standard deviation as a multiple of a single one's."""
        plan, shaft = self.first.plan, None
        if plan.shaft_mm:
            scans = self.first.round()
            shaft = self._solver.foreseen_shaft(
                [self.foreseen(scan) for scan in scans], plan.shaft_mm
            )
        return crossing_sigma_gain(
            crossings,
            self.first.station.beams,
            beams_may_have_moved=self.turned is not None,
            shaft=shaft,
        )

    def named(self, crossing: Crossing) -> str:
        """Say where it was taken."""
        if self.turned is None:
            return tr("beam {beam}", beam=crossing.beam + 1)
        return tr("beam {beam} and U {u:.1f}", beam=crossing.beam + 1, u=crossing.entry.u_deg)

    def which(self, number: int, crossing: Crossing) -> str:
        """Say which one it is."""
        return tr("Crossing {number} at {where}", number=number, where=self.named(crossing))

    @property
    def _solver(self) -> CrossingSolver:
        first = self.first
        return CrossingSolver(
            first.station.beams,
            first.frame,
            first.plan.dip_mm,
            self.stored,
            self.sigma_mm,
            self.step_mm,
        )
