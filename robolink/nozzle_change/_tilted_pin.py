"""A pin in the cell, a person who brings the tip onto it, and a robot that can tilt its tool."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from robolink.calibration import CalibrationResult, Course, Procedure, TouchPlan, VerifyResult
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import ToolOffset
from robolink.nozzle_change._flange import tilted_from
from robolink.nozzle_change._source import Bench
from robolink.nozzle_change._touched_pin import TouchedPin

if TYPE_CHECKING:
    from robolink.calibration import Tilt, WayPlan


@dataclass(frozen=True, slots=True)
class TiltedPin(TouchedPin):
    """Measures by touching one pin with the tool tilted and turned, and by ways along its axes.

    Attributes:
        tilts: Orientations of the touches after the first; see
            :func:`~robolink.calibration.telling_tilts`.
        touch: Lift and clearance.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.
        course: When a measurement ends, and whether a pose is offered again.
        ways: How the person shows the axes of the tool; ``None`` to measure its lengths alone.
    """

    tilts: "tuple[Tilt, ...]"
    touch: TouchPlan = field(default_factory=TouchPlan)
    sigma_mm: float | None = None
    course: Course = field(default_factory=Course)
    ways: "WayPlan | None" = None

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        touched = tr(
            "measured on the robot: one pin touched in {count} orientations, tilted by {tilt:g} "
            "degrees",
            count=len(self.tilts) + 1,
            tilt=self._tilt_deg,
        )
        if self.ways is None:
            return touched
        shown = tr(
            "two ways of {length:g} mm and more along the tool's own axes",
            length=self.ways.length_mm,
        )
        return f"{touched}; {shown}"

    def verify(
        self,
        bench: Bench,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> VerifyResult:
        """Tilt about the new tip; see :class:`~robolink.nozzle_change.MovingSource`."""
        from robolink.calibration import OverPin, proving_tilts, verify_by_tilting  # numpy

        bench.controller.tools.select(tool)
        x_mm, y_mm, z_mm = result.reference_point_mm
        over = OverPin(
            bench.controller.groups[0].pose(),
            (x_mm, y_mm, z_mm),
            tip=tilted_from(result.offset, tip),
            frame=result.offset,
        )
        procedure = verify_by_tilting(
            self.touch, over=over, tilts=proving_tilts(self._tilt_deg), tolerance_mm=tolerance_mm
        )
        return bench.run(procedure, tip=result.offset)

    @property
    def _tilt_deg(self) -> float:
        return max(abs(tilt.lean_deg) for tilt in self.tilts)

    def _steps(self, stored: ToolOffset | None, course: Course) -> Procedure[CalibrationResult]:
        """Return the steps.

        Raises:
            ConfigError: Nobody knows about where the tip is, so it cannot be kept off the pin.
        """
        from robolink.calibration import pivot, six_point  # numpy, which a look does without

        if stored is None:
            raise ConfigError(
                tr("The tool is not defined, so a tilt would swing its tip nobody knows where to."),
                remedy=tr(
                    "Write about where the tip is with 'tool set', to a millimetre or two, and "
                    "measure then."
                ),
            )
        if self.ways is None:
            return pivot(
                self.touch, tilts=self.tilts, stored=stored, sigma_mm=self.sigma_mm, course=course
            )
        return six_point(
            self.touch,
            self.ways,
            tilts=self.tilts,
            stored=stored,
            sigma_mm=self.sigma_mm,
            course=course,
        )
