"""Sources of a measurement: what each of them offers to a nozzle change."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeVar, cast, runtime_checkable

from robolink.calibration import CalibrationResult, VerifyResult
from robolink.deprecation import warn_of_old_name
from robolink.model import (
    AnsweredBy,
    Controller,
    ControllerSensor,
    KeepsPictures,
    MotionGroup,
    Pose,
    TipSensor,
    ToolOffset,
    answer_entry,
)
from robolink.runner import EndingWatch, Operator, Procedure, Runner, RunSettings, StepDone
from robolink.stations import Found


class PoseMethod(Protocol):
    """Solves flange poses that touch a pin.

    Attributes:
        upright: Whether the tool stands upright in all of them, so that only X and Y follow.
        needs: Coordinates that a pose must state besides x_mm, y_mm and u_deg.
    """

    upright: ClassVar[bool]
    needs: ClassVar[tuple[str, ...]]

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Return the offset; what is not measured is kept from ``stored``.

        Raises:
            CalibrationError: The poses give no trustworthy result; its code says why.
            ConfigError: Too many poses for the method.
        """


T = TypeVar("T")


class MeasurementContext:
    """What a source works with.

    Attributes:
        controller: The controller, connected.
        operator: The person at the cell.
        start: Flange pose at the start of the change; limits lie about it.
        stands: Where the frame then in force was after the last step; ``None`` before any.

    Args:
        controller: The controller, connected.
        operator: The person at the cell.
        start: Flange pose at the start of the change; limits lie about it.
        settings: Limits and speeds for a tip at an offset from the flange.
        offers: Whether the person is asked about what a procedure offers.
        types: Whether the pose of a touch may be typed: a turn test by touches follows.
        attended: Whether a person may be asked what a measurement leaves open.

    Example:
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.calibration_run import Limits
        >>> from robolink.procedures import MeasurementContext
        >>> from robolink.controllers import SimpleController
        >>> class Nobody:  # implements robolink.Operator
        ...     def tell(self, text): ...
        >>> with SimpleController() as controller:
        ...     start = controller.groups[0].pose()
        ...     settings = Limits(speed_mm_s=10).settings
        ...     context = MeasurementContext(controller, Nobody(), start=start, settings=settings)
        ...     context.measure(lambda here: (yield from ()))  # a procedure of no step
    """

    def __init__(
        self,
        controller: Controller,
        operator: Operator,
        *,
        start: Pose | None,
        settings: Callable[[Pose, ToolOffset | None], RunSettings],
        offers: bool = True,
        types: bool = False,
        attended: bool = False,
    ) -> None:
        self._types = types
        self._attended = attended
        self._asked: dict[str, bool] = {}
        self.controller = controller
        self.operator = operator
        self.start = start
        self.stands: Pose | None = None
        self._settings = settings
        self._offers = offers
        self._on_step: Callable[[StepDone], None] | None = None
        self._ending = EndingWatch()
        self._tool: int | None = None

    @contextmanager
    def telling(
        self, on_step: Callable[[StepDone], None], *, tool: int | None = None
    ) -> Iterator[None]:
        """Report every step of the block to ``on_step``.

        Args:
            on_step: Told of each.
            tool: The tool that answers inside the block are about, for the record.
        """
        self._on_step, self._tool = on_step, tool
        try:
            yield
        finally:
            self._on_step = self._tool = None

    def ask_once(self, question: str, *, given: AnsweredBy | None = None) -> bool | None:
        """Ask a question for the whole change, once however many tools need it.

        Args:
            question: What a yes agrees to.
            given: How a yes was given in advance, ``None`` where it was not.

        Returns:
            The answer, which is on record then; ``None`` where nobody is to be asked.

        Example:
            >>> from robolink.model import AnsweredBy
            >>> from robolink.calibration_run import Limits
            >>> from robolink.procedures import MeasurementContext
            >>> from robolink.controllers import SimpleController
            >>> with SimpleController() as controller:
            ...     settings = Limits().settings
            ...     context = MeasurementContext(controller, None, start=None, settings=settings)
            ...     context.ask_once("Were all axes held?", given=AnsweredBy.OPTION)
            True
        """
        if question not in self._asked:
            if given is not None:
                self.controller.outcomes.append(answer_entry(question, True, given))
                self._asked[question] = True
            elif self._attended:
                self._asked[question] = self.runner().confirm(question)
        return self._asked.get(question)

    def run(
        self,
        procedure: Procedure[T],
        *,
        tip: ToolOffset | None = None,
        camera: TipSensor | None = None,
    ) -> T:
        """Take the steps of a procedure; see :meth:`robolink.runner.Runner.run`.

        Args:
            procedure: What is to be done.
            tip: Offset of the tip in whose frame it moves, ``None`` for the flange.
            camera: What looks are taken with.

        Example:
            >>> from robolink.calibration_run import Limits
            >>> from robolink.procedures import MeasurementContext, approach_path, offset_z
            >>> from robolink.controllers import SimpleController
            >>> class Nobody:  # implements robolink.Operator
            ...     def tell(self, text): ...
            >>> with SimpleController() as controller:
            ...     here = controller.groups[0].pose()
            ...     limits = Limits()
            ...     context = MeasurementContext(
            ...         controller, Nobody(), start=here, settings=limits.settings
            ...     )
            ...     context.run(approach_path(offset_z(here, 10), here=here, purpose="Lifting."))
            ...     controller.groups[0].pose().z_mm - here.z_mm
            10.0
        """
        return self.runner(tip, camera).run(procedure)

    def measure(
        self, steps: Callable[[Pose], Procedure[T]], *, camera: TipSensor | None = None
    ) -> T:
        """Take the steps of a measurement, in Tool 0: the flange moves.

        Args:
            steps: Returns them, given where the flange is.
            camera: What looks are taken with.
        """
        self.controller.tools.select(0)
        return self.run(steps(self.controller.groups[0].pose()), camera=camera)

    def runner(
        self,
        tip: ToolOffset | None = None,
        camera: TipSensor | None = None,
        *,
        tool: int | None = None,
    ) -> Runner:
        """Return a runner for the flange, or for a tip at an offset from it.

        Args:
            tip: That offset, ``None`` for the flange.
            camera: What looks are taken with.
            tool: The tool that answers are about, ``None`` for the one that is being measured.

        Example:
            >>> from robolink.calibration_run import Limits
            >>> from robolink.procedures import MeasurementContext
            >>> from robolink.controllers import SimpleController
            >>> class Person:  # implements robolink.Operator
            ...     def ask(self, question, kind): ...
            ...     def poll(self, wait_s):
            ...         return "y"
            >>> with SimpleController(identity="answer-example") as controller:
            ...     settings = Limits().settings
            ...     context = MeasurementContext(
            ...         controller, Person(), start=None, settings=settings
            ...     )
            ...     context.runner(tool=1).confirm("Is the new tip exactly as long?")
            ...     [answer] = controller.outcomes.recorded(tool=1)
            True
            >>> answer.details["answer"]
            'yes'
        """
        group = self.controller.groups[0]
        if camera is not None and isinstance(camera, ControllerSensor):
            camera = camera.beside(self.controller)
        if camera is not None and isinstance(camera, KeepsPictures):
            camera.of_change(self.controller.outcomes.change)
        # If nothing moves, there is nothing to limit, and perhaps no pose to read.
        start = Pose(0.0, 0.0, 0.0, 0.0) if self.start is None else self.start
        return Runner(
            self.controller,
            group,
            self.operator,
            self._settings(start, tip),
            on_step=self._stepped,
            camera=camera,
            offers=self._offers,
            # With a new tip nothing is repeated: its value is written but not yet confirmed.
            repeats=tip is None,
            types=self._types and tip is None,
            ending=self._ending,
            tool=self._tool if tool is None else tool,
        )

    def _stepped(self, done: StepDone) -> None:
        self.stands = done.pose or self.stands
        if self._on_step is not None:
            self._on_step(done)


class TipSource(Protocol):
    """Measures one tip."""

    @property
    def sentence(self) -> str:
        """What it does, for a report."""

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump, one line: the nozzle is asked about."""

    def measure(
        self, context: MeasurementContext, tool: int, stored: ToolOffset | None
    ) -> CalibrationResult:
        """Measure the tip of ``tool``, whose stored offset is given.

        Args:
            context: What to work with.
            tool: Number of the tool.
            stored: The offset stored now, ``None`` where the tool is not defined.

        Raises:
            CalibrationError: No trustworthy result; its code says why.
            RobolinkError: Anything else that ended it.

        Example:
            >>> from robolink.methods import PointsSource
            >>> from robolink.model import Pose, ToolOffset
            >>> from robolink.calibration_run import Limits
            >>> from robolink.procedures import MeasurementContext
            >>> from robolink.controllers import SimpleController
            >>> source = PointsSource(lambda: [Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)])
            >>> limits = Limits()
            >>> context = MeasurementContext(
            ...     SimpleController(), None, start=None, settings=limits.settings
            ... )
            >>> source.measure(context, tool=1, stored=ToolOffset(12, -3.5, -20)).measured
            ('x_mm', 'y_mm')
        """


@runtime_checkable
class MovingSource(TipSource, Protocol):
    """Measures a tip by moving the robot, and can therefore turn about the new tip."""

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement, for a preview before anything moves.

        Args:
            stored: The offset stored now.
            here: Where the flange is at its start.
        """

    def verify(
        self,
        context: MeasurementContext,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> VerifyResult:
        """Turn about the new tip and report the drift.

        Args:
            context: What to work with.
            tool: The tool, written already.
            result: What was measured, with the offset that was written.
            tip: Where the tip was found, which differs from it where a difference was written.
            tolerance_mm: Largest drift that passes.

        Example:
            >>> from robolink.methods import CameraSource
            >>> from robolink.model import Spot, SpotUnit, ToolOffset
            >>> from robolink.calibration_run import Limits
            >>> from robolink.procedures import MeasurementContext
            >>> from robolink.stations import CameraStation
            >>> from robolink.controllers import SimpleController, SimpleMachine
            >>> machine = SimpleMachine({1: ToolOffset(12, -4, -20)})
            >>> class Camera:  # implements robolink.TipSensor; tool 1 is 0.3 mm off
            ...     identity, unit, resolution_px, settle_s = "camera", SpotUnit.BASE_MM, None, 0
            ...     def see(self, mark=0):
            ...         return [Spot(*machine.tip(ToolOffset(12.3, -4, -20)).coordinates()[:2])]
            >>> class Nobody:  # implements robolink.Operator
            ...     def tell(self, text): ...
            >>> source = CameraSource(Camera(), CameraStation(300, 0, 80))
            >>> controller = SimpleController(machine)
            >>> start, settings = controller.groups[0].pose(), Limits().settings
            >>> context = MeasurementContext(controller, Nobody(), start=start, settings=settings)
            >>> found = source.measure(context, 1, controller.tools.read(1))
            >>> machine.store(1, found.offset)
            >>> source.verify(context, 1, found, tip=found.offset, tolerance_mm=0.1).passed
            True
        """


@runtime_checkable
class TouchesFurther(Protocol):
    """A source in which a person may return to the touches of a measurement."""

    @property
    def can_add_touch(self) -> bool | None:
        """Whether one more can be made than planned; ``None`` if none can be repeated."""

    def further(
        self,
        context: MeasurementContext,
        stored: ToolOffset | None,
        result: CalibrationResult,
        again: int | None,
    ) -> CalibrationResult:
        """Continue a measurement that has ended, in Tool 0; ends lifted.

        Args:
            context: What to work with.
            stored: The offset stored now.
            result: What was measured, with the touches that were made.
            again: Index of the touch that is made again, ``None`` for one more.

        Raises:
            CalibrationError: As the measurement.

        Example:
            >>> from robolink.methods import TwoPoseSource, measure_two_pose
            >>> from robolink.model import Pose, ToolOffset
            >>> from robolink.testing import PaperCell
            >>> source, stored = TwoPoseSource(), ToolOffset(12, -4, -20)
            >>> cell = PaperCell(Pose(300, 100, 20, 0), ToolOffset(12.3, -3.9, -20), (310, 95, -40))
            >>> result = cell.run(measure_two_pose(source.touch, stored=stored))
            >>> class OnPaper:  # in place of a MeasurementContext
            ...     def measure(self, steps):
            ...         return cell.run(steps(cell.here))
            >>> again = source.further(OnPaper(), stored, result, again=1)
            >>> round(again.offset.x_mm, 3), round(again.offset.y_mm, 3)
            (12.3, -3.9)
        """


@dataclass(frozen=True, slots=True)
class _AddsTouch:
    """A source with the former name ``adds_touch`` that derives from none of robolink's bases."""

    source: Any

    @property
    def can_add_touch(self) -> bool | None:
        return cast("bool | None", self.source.adds_touch)

    def further(
        self,
        context: MeasurementContext,
        stored: ToolOffset | None,
        result: CalibrationResult,
        again: int | None,
    ) -> CalibrationResult:
        return cast(CalibrationResult, self.source.further(context, stored, result, again))


def touching_further(source: object) -> TouchesFurther | None:
    """Return a source that lets a person return to the touches; ``None`` for another."""
    if isinstance(source, TouchesFurther):
        return source
    if not hasattr(source, "adds_touch") or not hasattr(source, "further"):
        return None
    warn_of_old_name(f"{type(source).__qualname__}.adds_touch", "can_add_touch", 2)
    return _AddsTouch(source)


@runtime_checkable
class StopsAbovePin(Protocol):
    """A source that moves the tip near a pin, and leaves the rest to the person."""

    @property
    def clearance_mm(self) -> float | None:
        """Least height above the expected contact at which the robot stops; ``None`` for none."""


@runtime_checkable
class FindsStation(Protocol):
    """A source whose measurement shows where a station is, besides the tip."""

    def found_station(self, result: CalibrationResult, tool: int) -> Found | None:
        """Return what a kept measurement shows about the station, ``None`` for nothing."""


@runtime_checkable
class RequiresMotion(Protocol):
    """A source whose measurement is valid only if the robot can move as it assumes."""

    def require_able(self, group: MotionGroup, change_mm: float) -> None:
        """Check that it can, before anything moves; only reads.

        Args:
            group: What moves the tip.
            change_mm: The largest change of the tip that is believed.

        Raises:
            CalibrationError: It cannot; its remedy says what to change in the plan.
        """


@runtime_checkable
class RequiresSensor(Protocol):
    """A source that needs equipment besides the robot."""

    def require_ready(self) -> None:
        """Check that the equipment is there and usable, before anything moves.

        Raises:
            CalibrationError: ``sensor_not_found``, ``camera_not_calibrated``.
            ConfigError: It cannot be used in this way.
            ConnectError: It does not answer.
        """
