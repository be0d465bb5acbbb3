"""A source that is made when it is first needed, because making it reads from the controller."""

from collections.abc import Callable

from robolink.calibration import CalibrationResult, VerifyResult
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.procedures.proving.kept_proof import KeepsProof, KeptProof
from robolink.procedures.source import MeasurementContext, MovingSource, TouchesFurther
from robolink.runner import Procedure


class LazySource:
    """Stands in for a source until it can be made.

    Args:
        make: Makes it; may read, and refuse.
        sentence: What it does, for a report that is written before.
        clearance_mm: Least height above a pin at which the robot stops, ``None`` where there is no
            pin.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.methods import TwoPoseSource
        >>> from robolink.procedures import LazySource
        >>> from robolink.testing import PaperCell
        >>> made = []
        >>> def make():
        ...     made.append(TwoPoseSource())
        ...     return made[0]
        >>> source = LazySource(make, sentence="A pin is touched at two angles.")
        >>> source.sentence, len(made)  # nothing was made for it
        ('A pin is touched at two angles.', 0)
        >>> cell = PaperCell(Pose(300, 100, 20, 0), ToolOffset(12, -4, -20), (310, 95, -40))
        >>> found = cell.run(source.procedure(ToolOffset(12.3, -3.9, -20), cell.here))
        >>> round(found.offset.x_mm, 6), round(found.offset.y_mm, 6), len(made)
        (12.0, -4.0, 1)
    """

    def __init__(
        self,
        make: Callable[[], MovingSource],
        *,
        sentence: str,
        clearance_mm: float | None = None,
    ) -> None:
        self.clearance_mm = clearance_mm
        self._make = make
        self._sentence = sentence
        self._made: MovingSource | None = None

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return self._made.sentence if self._made else self._sentence

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return self._source.remedy

    def measure(
        self, context: MeasurementContext, tool: int, stored: ToolOffset | None
    ) -> CalibrationResult:
        """Measure; see :class:`~robolink.procedures.MovingSource`."""
        return self._source.measure(context, tool, stored)

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`."""
        return self._source.procedure(stored, here)

    def verify(
        self,
        context: MeasurementContext,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> VerifyResult:
        """Prove the new tip; see :class:`~robolink.procedures.MovingSource`."""
        return self._source.verify(context, tool, result, tip=tip, tolerance_mm=tolerance_mm)

    def proof(
        self,
        context: MeasurementContext,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> KeptProof:
        """Return the proof of what was measured; see :class:`~robolink.procedures.KeepsProof`.

        Raises:
            ConfigError: The source proves in a way that cannot be kept.
        """
        source = self._source
        if not isinstance(source, KeepsProof):
            raise ConfigError(
                tr("This measurement has no turn test that can be made later."),
                remedy=tr("Measure again, and let the turn test follow at once."),
            )
        return source.proof(context, tool, result, tip=tip, tolerance_mm=tolerance_mm)

    @property
    def adds_touch(self) -> bool | None:
        """What the source says; see :class:`~robolink.procedures.TouchesFurther`."""
        source = self._source
        return source.adds_touch if isinstance(source, TouchesFurther) else None

    def further(
        self,
        context: MeasurementContext,
        stored: ToolOffset | None,
        result: CalibrationResult,
        again: int | None,
    ) -> CalibrationResult:
        """Go on; see :class:`~robolink.procedures.TouchesFurther`."""
        source = self._source
        assert isinstance(source, TouchesFurther)  # noqa: S101 - adds_touch said so
        return source.further(context, stored, result, again)

    @property
    def _source(self) -> MovingSource:
        if self._made is None:
            self._made = self._make()
        return self._made
