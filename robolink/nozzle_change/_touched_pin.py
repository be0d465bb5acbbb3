"""What every measurement has in common in which a person brings a tip onto one pin many times."""

from abc import ABC, abstractmethod

from robolink.calibration import CalibrationResult, Course, Procedure
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.nozzle_change._source import Bench


class TouchedPin(ABC):
    """Measures by touching one pin.

    Attributes:
        course: When a measurement ends, and whether a pose is offered again.
    """

    __slots__ = ()

    course: Course

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Check that all poses touched the same point.")

    def measure(self, bench: Bench, tool: int, stored: ToolOffset | None) -> CalibrationResult:  # noqa: ARG002 - the flange is what moves
        """Touch and solve; see :class:`~robolink.nozzle_change.MovingSource`."""
        bench.controller.tools.select(0)
        return bench.run(self._steps(stored, self.course))

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:  # noqa: ARG002 - the person brings the tip to the pin
        """Return the steps of a measurement; see :class:`~robolink.nozzle_change.MovingSource`.

        All of them: when it ends early depends on touches that nobody has made yet.
        """
        return self._steps(stored, Course())

    @abstractmethod
    def _steps(self, stored: ToolOffset | None, course: Course) -> Procedure[CalibrationResult]:
        """Return the steps."""
