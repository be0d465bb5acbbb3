"""Crossings of two beams: how they are solved, how each is reported, and the worst repeated.

They are solved at the height at which the beams see the needle.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from robolink.calibration import (
    BeamsResult,
    Crossing,
    ErrorSource,
    FlangePlane,
    ShaftSeen,
    TipHeight,
    crossing_sigma_gain,
    solve_crossed_beams,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.beams.drive import BeamDrive
from robolink.methods.beams.loop import BeamLoop, LoopScan, loop
from robolink.model import Pose, ToolOffset
from robolink.procedures import NO_OFFSET
from robolink.runner import Procedure

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
            # The shaft was not seen, so the place of the end below it is uncertain.
            unseen = ErrorSource.of_lengths("bend_deg", 2, gain=self.dip_mm * _SLOPE_A_DEGREE)
            found = replace(found, sources=(*(found.sources or ()), unseen))
        return replace(found, seen_above_mm=self.dip_mm)

    def foreseen_shaft(self, crossings: Sequence[Crossing], deeper_mm: float) -> ShaftSeen:
        """Return what will be seen of the shaft, as far as it affects the uncertainty of the tip.

        Args:
            crossings: Those that are planned for it.
            deeper_mm: How much deeper than ``dip_mm`` the tip will be.
        """
        up = abs(self._r33)
        return ShaftSeen(crossings, self.dip_mm / up, deeper_mm / up)

    def seen_mm(self, tip: ToolOffset, lean: "Lean") -> tuple[float, float]:
        """Return X and Y of the place where the beams see a leaning needle, flange.

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
    """Refuse a needle that leans so far that the place of its end is unknown.

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

    travel: BeamLoop
    first: BeamDrive
    turned: BeamDrive | None
    stored: ToolOffset | None
    sigma_mm: float | None
    step_mm: float | None = None
    shaft: list[Crossing] = field(default_factory=list)

    @property
    def scans(self) -> list[LoopScan]:
        """All that are planned for the tip, in their order."""
        drives = [self.first] if self.turned is None else [self.first, self.turned]
        return [scan for drive in drives for scan in loop(drive) * drive.plan.repeats]

    @property
    def known(self) -> str:
        """Which lengths become known."""
        return tr("X and Y")

    def counted(self, count: int) -> str:
        """Say how many were taken."""
        return tr("{count} crossings", count=count)

    def take(self, place: LoopScan) -> Procedure[Crossing]:
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
            self.shaft = yield from self.travel.through(loop(deep, after=last))
        yield from self.travel.lifted()

    def solve(self, crossings: Sequence[Crossing]) -> BeamsResult:
        """Solve what was taken."""
        plan, solver = self.first.plan, self._solver
        known = self.turned is None or len(crossings) > len(loop(self.first)) * plan.repeats
        result = solver.solved(
            crossings,
            self.shaft,
            deeper_mm=plan.shaft_mm,
            moved=self.turned is not None and known,
        )
        require_straight(result, plan.max_lean_deg)
        if not known:
            # The place of the beams is not relied on, so the accuracy of the tip is still unknown.
            return replace(result, half_width95=(), region95_radius_mm=None)
        return result if self.shaft or not plan.shaft_mm else self._widened(result, crossings)

    def _widened(self, result: BeamsResult, crossings: Sequence[Crossing]) -> BeamsResult:
        """Return a result with the uncertainty that it will have once the shaft was crossed."""
        times = self.gain(crossings) / result.sigma_gain
        region_mm = result.region95_radius_mm
        return replace(
            result,
            half_width95=tuple(times * half for half in result.half_width95),
            region95_radius_mm=None if region_mm is None else times * region_mm,
        )

    def foreseen(self, place: LoopScan) -> Crossing:
        """Return what would be taken there."""
        return Crossing(place.beam, place.start, place.end)

    def gain(self, crossings: Sequence[Crossing]) -> float:
        """Return the standard deviation as a multiple of a single one's."""
        plan, shaft = self.first.plan, None
        if plan.shaft_mm:
            scans = loop(self.first)
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
