"""What sources of one kind share: of touches, of a switched input, of looks."""

from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import median
from typing import TYPE_CHECKING, Any, Generic, Protocol, Self, TypeVar, cast, runtime_checkable

from robolink.calibration import CalibrationResult, VerifyResult, tip_pose, toward_zero
from robolink.deprecation import deprecated, old_hook
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import NamesDoubts, Pose, SpotUnit, StationSensor, TipSensor, ToolOffset
from robolink.procedures.kept_proof import KeepsProof, KeptProof, ProofBasis, ProvesAgain
from robolink.procedures.pin_proof import TurnTest, contact_pose, drift_uncertainty_mm
from robolink.procedures.source import MeasurementContext, MovingSource, touching_further
from robolink.procedures.witnessed_touches import TouchPlan
from robolink.runner import Procedure, SeenAt, TouchedAt
from robolink.sensing import open_sensor
from robolink.stations import CameraStation

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


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
        """Test the new tip; see :class:`~robolink.procedures.MovingSource`."""
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
        """Return the turn test of what was measured; see :class:`~robolink.procedures.KeepsProof`.

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
    def can_add_touch(self) -> bool | None:
        """What the source says; see :class:`~robolink.procedures.TouchesFurther`."""
        source = touching_further(self._source)
        return None if source is None else source.can_add_touch

    @property
    @deprecated("can_add_touch")
    def adds_touch(self) -> bool | None:
        """The old name."""
        return self.can_add_touch

    def further(
        self,
        context: MeasurementContext,
        stored: ToolOffset | None,
        result: CalibrationResult,
        again: int | None,
    ) -> CalibrationResult:
        """Go on; see :class:`~robolink.procedures.TouchesFurther`."""
        source = touching_further(self._source)
        assert source is not None  # noqa: S101 - can_add_touch is true
        return source.further(context, stored, result, again)

    @property
    def _source(self) -> MovingSource:
        if self._made is None:
            self._made = self._make()
        return self._made


PlanT = TypeVar("PlanT", bound="DataclassInstance")


class InputSource(ProvesAgain, Generic[PlanT]):
    """Measures from wherever the flange is; nobody touches anything.

    Attributes:
        plan: How it goes, with ``until_mm`` and ``retake``.
    """

    __slots__ = ()

    plan: PlanT

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        old_hook(cls, "_steps", "steps", lambda self, *a: self._steps(*a, self.plan))

    def measure(
        self,
        context: MeasurementContext,
        tool: int,  # noqa: ARG002 - the flange is what moves
        stored: ToolOffset | None,
    ) -> CalibrationResult:
        """Drive and solve; see :class:`~robolink.procedures.MovingSource`."""
        source = self.told_by(context)
        return context.measure(lambda here: source.steps(stored, here))

    def told_by(self, context: MeasurementContext) -> Self:  # noqa: ARG002 - for overriding
        """Return the source with what the controller reports of its movements; it is asked now.

        Args:
            context: What to work with.
        """
        return self

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`.

        All of them: when it ends early depends on what nobody has measured yet.
        """
        return self.foreseen().steps(stored, here)

    def foreseen(self) -> Self:
        """Return the source for a preview of its steps."""
        plan = replace(self.plan, until_mm=None, retake=False)
        return cast(Self, replace(cast(Any, self), plan=plan))

    @abstractmethod
    def steps(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of the measurement. They run in Tool 0.

        Args:
            stored: The offset stored now.
            here: Where the flange is.
        """


@runtime_checkable
class TouchesPin(Protocol):
    """A source in which a person touches a pin, or a surface, in measurement and turn test."""

    @property
    def touch(self) -> TouchPlan:
        """How the tip is lifted off what it touches, and returned."""

    def with_touch(self, plan: TouchPlan) -> Self:
        """Return the same source with another plan of its touches."""


class TouchSource(ProvesAgain):
    """Measures by touches that a person makes.

    Attributes:
        touch: How the tip is taken off what it touches, and brought back.
    """

    __slots__ = ()

    touch: TouchPlan

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        old_hook(
            cls, "_steps", "steps", lambda self, *a: self._steps(*a, live=not self.touch.nominal)
        )
        old_hook(cls, "_further_steps", "further_steps", lambda self, *a: self._further_steps(*a))
        old_hook(cls, "adds_touch", "can_add_touch", property(lambda self: self.adds_touch))

    def with_touch(self, plan: TouchPlan) -> Self:
        """Return the same source with another plan of its touches."""
        # Each source is a dataclass; this common base cannot be one.
        return cast(Self, replace(cast(Any, self), touch=plan))

    @property
    def clearance_mm(self) -> float:
        """Least distance from contact at which the robot stops."""
        return self.touch.clearance_mm

    def measure(
        self,
        context: MeasurementContext,
        tool: int,  # noqa: ARG002 - the flange is what moves
        stored: ToolOffset | None,
    ) -> CalibrationResult:
        """Touch and solve; see :class:`~robolink.procedures.MovingSource`."""
        context.controller.tools.select(0)
        return context.run(self.steps(stored))

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:  # noqa: ARG002 - the person brings the tip to the pin
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`.

        All of them: when it ends early depends on touches that nobody has made yet. Where the tip
        stops is foreseen at its highest; sideways it is drawn in the run.
        """
        return self.foreseen().steps(stored)

    def foreseen(self) -> Self:
        """Return the source for a preview: all steps, each stop at its highest."""
        return self.with_touch(replace(self.touch, nominal=True))

    @property
    @abstractmethod
    def can_add_touch(self) -> bool:
        """Whether one more can be made than planned, when all are made."""

    @property
    @deprecated("can_add_touch")
    def adds_touch(self) -> bool:
        """The old name."""
        return self.can_add_touch

    def further(
        self,
        context: MeasurementContext,
        stored: ToolOffset | None,
        result: CalibrationResult,
        again: int | None,
    ) -> CalibrationResult:
        """Go on; see :class:`~robolink.procedures.TouchesFurther`."""
        taken = touches_of(result)
        return context.measure(lambda here: self.further_steps(here, taken, again, stored))

    @deprecated("touch")
    def _touching(self, *, live: bool) -> TouchPlan:
        return self.touch if live else replace(self.touch, nominal=True)

    @abstractmethod
    def further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[CalibrationResult]:
        """Return the steps that repeat one touch. They run in Tool 0 and end lifted.

        Args:
            here: Where the flange is.
            taken: The touches of the measurement.
            again: Index of the one that is made again; ``None`` for one more, and for the last one
                where no more can be made than planned.
            stored: The offset stored now.

        Example:
            >>> from robolink.methods import TwoPoseSource
            >>> from robolink.model import Pose, ToolOffset
            >>> from robolink.testing import PaperCell
            >>> source, stored = TwoPoseSource(), ToolOffset(12, -4, -20)
            >>> cell = PaperCell(Pose(300, 100, 20, 0), ToolOffset(12.3, -3.9, -20), (310, 95, -40))
            >>> taken = cell.run(source.steps(stored)).inputs
            >>> again = cell.run(source.further_steps(cell.here, taken, 1, stored))
            >>> round(again.offset.x_mm, 3), round(again.offset.y_mm, 3)
            (12.3, -3.9)
        """

    @abstractmethod
    def steps(self, stored: ToolOffset | None) -> Procedure[CalibrationResult]:
        """Return the steps of the measurement. They run in Tool 0 and end lifted.

        Args:
            stored: The offset stored now.
        """


class PinSource(TouchSource):
    """Measures by touching one pin."""

    __slots__ = ()

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Check that all poses touched the same point.")


class ManualPinSource(PinSource):
    """Measures by touching one pin at angles of U, and tests by turning about the new tip."""

    __slots__ = ()

    def proof_of(self, basis: ProofBasis) -> TurnTest:
        """Return the turn test; see :meth:`~robolink.procedures.ProvesAgain.proof_of`."""
        angles = basis.measured_deg
        return TurnTest(
            **basis.common,
            touch=self.touch,
            contact=contact_pose(basis.result, tool=basis.tool),
            angles_deg=(middles_of_gaps(angles)[0], angles[0]),
            u_mm=drift_uncertainty_mm(basis.result),
        )


def middles_of_gaps(angles_deg: Sequence[float]) -> list[float]:
    """Return the angles midway between the measured ones, the one farthest from any first."""
    gaps = sorted(pairwise(sorted(angles_deg)), key=lambda gap: gap[0] - gap[1])
    return [(low + high) / 2 for low, high in gaps]


def touches_of(result: CalibrationResult) -> list[TouchedAt]:
    """Return the touches behind a measurement; none if it rests on other poses too."""
    touches = [pose for pose in result.inputs if isinstance(pose, TouchedAt)]
    return touches if len(touches) == len(result.inputs) else []


_HALF_A_TURN_DEG = 180.0


def angles_between(measured_deg: Sequence[float]) -> tuple[float, ...]:
    """Return angles for a turn test, inside the measured arc and different from each of them.

    Half a turn on from a single one, where an error shows twofold.
    """
    low, high = min(measured_deg), max(measured_deg)
    if low == high:
        return (toward_zero(low, _HALF_A_TURN_DEG),)
    return low + (high - low) / 6, high - (high - low) / 6


def proof_angles(result: CalibrationResult, tool: int) -> tuple[float, ...]:
    """Return U of a new tool for the test of measured looks; see :func:`angles_between`."""
    return angles_between(
        [tip_pose(pose, result.offset, tool=tool).u_deg for pose in result.inputs]
    )


def camera_error_of(result: CalibrationResult) -> tuple[float, float]:
    """Return the camera error that a measurement found, base X and Y in mm."""
    from robolink.calibration import CameraRound  # numpy, imported only when used

    error_mm = result.camera_error_mm if isinstance(result, CameraRound) else None
    return error_mm or (0.0, 0.0)


def radius_of(result: CalibrationResult) -> float | None:
    """Return the spot width in the looks of a measurement, ``None`` if not reported."""
    looks = [pose for pose in result.inputs if isinstance(pose, SeenAt)]
    told = [look.spot.radius_px for look in looks if look.spot.radius_px is not None]
    return median(told) if told else None


@contextmanager
def calibrated_camera(sensor: str | TipSensor, station: CameraStation) -> Iterator[TipSensor]:
    """Open a camera whose pixels are calibrated, or that answers in millimetres.

    Raises:
        CalibrationError: ``sensor_not_found`` or ``camera_not_calibrated``; and as
            :meth:`robolink.model.StationSensor.at_station`.
        ConfigError, ConnectError: As :func:`robolink.sensing.open_sensor`.
    """
    with open_sensor(sensor) as camera:
        if camera.unit is SpotUnit.PIXEL:
            station.require_model()
        yield _at_station(camera, station)


@contextmanager
def pixel_camera(
    sensor: str | TipSensor, station: CameraStation | None = None
) -> Iterator[TipSensor]:
    """Open a camera that answers in pixels.

    Args:
        sensor: URL or name of the camera, or the camera.
        station: Where it stands; ``None`` where nothing is stated of it.

    Raises:
        ConfigError: It answers in millimetres; and as :func:`robolink.sensing.open_sensor`.
        CalibrationError: ``sensor_not_found``; and as
            :meth:`robolink.model.StationSensor.at_station`.
        ConnectError: It is not there.
    """
    with open_sensor(sensor) as camera:
        if camera.unit is not SpotUnit.PIXEL:
            raise ConfigError(
                tr("{camera} answers in millimetres already.", camera=camera.identity),
                remedy=tr("Use it as a calibrated camera: robolink calibrate camera."),
            )
        yield camera if station is None else _at_station(camera, station)


def _at_station(camera: TipSensor, station: CameraStation) -> TipSensor:
    if isinstance(camera, StationSensor):
        return camera.at_station(station.details, station.mm_per_px)
    return camera


@dataclass(frozen=True, slots=True)
class LookSource(ProvesAgain):
    """Measures by looks of a camera.

    Attributes:
        sensor: URL or name of the camera (:func:`robolink.sensing.open_sensor`), or the camera.
        station: Where it is, and what its pixels mean.
    """

    sensor: str | TipSensor
    station: CameraStation

    def opened(self) -> AbstractContextManager[TipSensor]:
        """Open the camera; it has to be a calibrated one, see :func:`calibrated_camera`."""
        return calibrated_camera(self.sensor, self.station)

    def require_ready(self) -> None:
        """Check that the camera is there; see :class:`RequiresSensor`."""
        with self.opened():
            pass

    def measure(
        self,
        context: MeasurementContext,
        tool: int,  # noqa: ARG002 - the flange is what moves
        stored: ToolOffset | None,
    ) -> CalibrationResult:
        """Look and solve; see :class:`~robolink.procedures.MovingSource`."""
        with self.opened() as camera:
            result = context.measure(lambda here: self.procedure(stored, here), camera=camera)
            doubts = camera.doubts() if isinstance(camera, NamesDoubts) else ()
        return replace(result, warnings=(*result.warnings, *doubts)) if doubts else result

    @abstractmethod
    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`."""
