"""Takes the steps of a procedure on one motion group."""

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from itertools import starmap
from typing import Final, TypeVar

from robolink.checkpoints import Checkpoint, checkpoint
from robolink.errors import (
    CalibrationError,
    ConfigError,
    ControllerFaultError,
    DeclinedError,
    HeartbeatLostError,
    LimitError,
    NotReadyError,
    NotReadyReason,
    StoppedError,
)
from robolink.messages import tr
from robolink.model import (
    Controller,
    ControllerState,
    ControllerStatus,
    LooksAtRest,
    MotionGroup,
    MotionOutcome,
    MotionProfile,
    Path,
    Pose,
    TipSensor,
)
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.runner._dry_run import considered
from robolink.runner._jog_steps import (
    RunSettings,
    jog_target,
    parse_steps,
    typed_pose,
    way_in_words,
)
from robolink.runner._movement_permit import movement_permit
from robolink.runner._place_question import PlaceQuestion
from robolink.runner._prompt_context import (
    POLL_S,
    GuidedOperator,
    JogRange,
    JogSubject,
    MoveSubject,
    OfferedChoice,
    Operator,
    awaited_line,
)
from robolink.runner._robot_time import RobotTime
from robolink.runner._steps import (
    Ask,
    Confirm,
    Consider,
    Look,
    Move,
    Notify,
    Procedure,
    Seek,
    SeenAt,
    StepDone,
    TakenStep,
)
from robolink.runner._yes_no import Asking
from robolink.sensing import PATIENT_S, median_spot, scatter_of, seen_at_place, seen_in


def ended_by(status: ControllerStatus) -> str:
    """Return why a controller cannot continue, empty if it can."""
    if status.serious_fault:
        return tr("The controller reported a serious error.")
    if status.emergency_stop:
        return tr("The emergency stop was pressed.")
    if status.guard_open:
        return tr("The safety guard was opened.")
    if status.fault:
        return tr("The controller reported error {code:04d}.", code=status.code)
    return ""


class EndingWatch:
    """Looks for what ends a procedure while a person is asked.

    A controller that tells of its drives has lost them when they had power before: an emergency
    stop of a PLC shows in nothing else. Where they never had power, a person moves the machine in
    another way.

    Example:
        >>> from robolink.model import ControllerStatus
        >>> from robolink.runner import EndingWatch
        >>> watch = EndingWatch()
        >>> watch.obstacle(ControllerStatus(remote=True, ready=True))
        ''
        >>> watch.obstacle(ControllerStatus(remote=True, unpowered=True))
        'The motors went off.'
    """

    def __init__(self) -> None:
        self._had_power = False

    def obstacle(self, status: ControllerStatus) -> str:
        """Return why nothing can continue, empty if it can."""
        off = status.unpowered or status.disabled
        lost, self._had_power = off and self._had_power, self._had_power or not off
        return ended_by(status) or (tr("The motors went off.") if lost else "")


@contextmanager
def as_measurement() -> Iterator[None]:
    """Let an input that has switched too early count as a bad measurement."""
    try:
        yield
    except NotReadyError as error:
        if error.reason is not NotReadyReason.EDGE_PASSED:
            raise
        raise CalibrationError("edge_passed", error.what, remedy=error.remedy) from error


CONTACT_POLL_S: Final = 0.2
"""The same while watching an input that shows contact, in s."""

_MOST_REPEATS: Final = 2
"""Largest number of repeated steps in one procedure: a computer busier than that needs attention.
"""

T = TypeVar("T")
PoseT = TypeVar("PoseT", bound=Pose)


class Runner:
    """Runs procedures and jogs on one group.

    Args:
        controller: For the status and the clock.
        group: What moves.
        operator: Who is asked.
        settings: Limits and speeds.
        on_step: Told of every step taken.
        camera: What looks are taken with, ``None`` where there are none.
        offers: Whether the person is asked about offers; else each is declined unasked.
        repeats: Whether the person is also asked to repeat a step that ended because this
            computer fell silent. It is for measuring, where nothing was written yet.
        types: Whether a pose may be typed where its touch says so; touches have to prove it.
        ending: Looks for what ends it, ``None`` for one of its own.
        tool: Number of the tool that it is about, for the record of what is answered; ``None``
            where it is about none or several.

    Attributes:
        robot_time: Counts how long the robot takes; whoever has several runners gives them one.

    Every answer is recorded here, and not by whoever asks; see :class:`Asking`.

    Example:
        >>> from robolink.model import Path, Pose, WorkBox
        >>> from robolink.runner import Runner, RunSettings
        >>> from robolink.controllers import SimpleController
        >>> controller, settings = SimpleController(), RunSettings(WorkBox(z_max_mm=200))
        >>> runner = Runner(controller, controller.groups[0], operator=None, settings=settings)
        >>> runner.move(Pose(300, 0, 90, 30, tool=0), Path.STRAIGHT).u_deg
        30.0
    """

    def __init__(
        self,
        controller: Controller,
        group: MotionGroup,
        operator: Operator,
        settings: RunSettings,
        *,
        on_step: Callable[[StepDone], None] | None = None,
        camera: TipSensor | None = None,
        offers: bool = True,
        repeats: bool = False,
        types: bool = False,
        ending: EndingWatch | None = None,
        tool: int | None = None,
    ) -> None:
        self._controller = controller
        self._tool = tool
        self._group = group
        self._operator = operator
        self._guided = operator if isinstance(operator, GuidedOperator) else None
        self._settings = settings
        self.robot_time = RobotTime(controller)
        self._on_step = on_step
        self._camera = camera
        self._offers = offers
        self._types = types
        self._runs, self._ending = False, ending or EndingWatch()
        self._repeats_left = _MOST_REPEATS if offers and repeats else 0

    def run(self, procedure: Procedure[T]) -> T:
        """Take the procedure's steps until it returns; its result is a proposal.

        Raises:
            StoppedError: A stop came, at whatever step.
            DeclinedError: The person ended it.
            CalibrationError: The procedure refuses its measurements.
            ControllerFaultError, NotReadyError, OutcomeUnknownError: From the controller.
        """
        try:
            step = next(procedure)
            while True:
                checkpoint(Checkpoint.STEP, type(step).__name__)
                self._require_going()
                if isinstance(step, Consider):
                    step = procedure.send(tuple(starmap(self._obstacle, considered(step))))
                    continue
                try:
                    done = self._take(step)
                except CalibrationError as error:
                    self.robot_time.unusual()
                    # The procedure may draw the tip back before it ends.
                    step = procedure.throw(error)
                    continue
                if self._on_step is not None:
                    self._on_step(done)
                step = procedure.send(done.answer)
        except StopIteration as finished:
            result: T = finished.value
            self._require_going()
            return result
        finally:
            procedure.close()

    def move(self, target: Pose, path: Path) -> Pose:
        """Move once and return where the frame is then.

        Raises:
            StoppedError: It was stopped before it arrived.
        """
        return self._move(target, path, by_hand=False)

    def _move(self, target: Pose, path: Path, *, by_hand: bool) -> Pose:
        profile = MotionProfile(path, self._settings.speed_percent, self._settings.speed_mm_s)

        def go() -> MotionOutcome:
            motion = self._group.move_to(target, profile, box=self._settings.box)
            with self.robot_time.awaiting(target, path):
                return motion.wait(timeout_s=self._settings.motion_timeout_s)

        outcome = self._seen_through(go, target, by_hand=by_hand)
        if outcome is not MotionOutcome.ARRIVED:
            raise StoppedError(
                tr("The robot was stopped on its way."),
                remedy=tr("The robot will not move by itself. Start again when the cell is clear."),
                controller=self._controller.identity,
            )
        return self._stood(self._group.pose())

    def jog(self, steps: str) -> Pose:
        """Move by typed steps, for example ``x+0.1 z-0.5``, in one straight move.

        How far it went and where it is then is told to the operator.

        Raises:
            ConfigError: The text is not a list of steps.
            LimitError: A step is too large, or its target lies outside the box.
        """
        before = self._group.pose()
        target, path = jog_target(before, steps, self._settings)
        after = self._move(target, path, by_hand=True)
        if self._guided is not None:
            longest = max(map(abs, parse_steps(steps).values()))
            self._guided.regard(JogSubject(before, after, longest))
        else:
            self._operator.tell(way_in_words(before, after))
        return after

    def _take(self, step: TakenStep) -> StepDone:
        if isinstance(step, (Notify, Confirm)) and self._guided is not None:
            self._guided.regard(step.fit)
        if isinstance(step, Notify):
            self._operator.tell(step.text)
            return StepDone(step)
        if isinstance(step, Confirm):
            if not self._offers:
                return StepDone(step)
            said = self.confirm_or(step.question, also=step.also)
            word = said if isinstance(said, str) else ""
            if said:
                self.robot_time.unusual()
            return StepDone(step, accepted=said is True, word=word)
        if isinstance(step, Look) and step.repeated and not isinstance(self._camera, LooksAtRest):
            return StepDone(step)
        return StepDone(step, self._moved(step))

    def _moved(self, step: Ask | Move | Seek | Look) -> Pose:
        if isinstance(step, Ask):
            return self._ask(step)
        self._operator.tell(step.purpose)
        if isinstance(step, Look):
            return self._look(step)
        if isinstance(step, Seek):
            return self._seek(step)
        if self._guided is not None:
            speed_mm_s = self._settings.speed_mm_s
            going = MoveSubject(step.target, step.path, speed_mm_s, step.purpose, step.then)
            self._guided.regard(going)
        return self.move(step.target, step.path)

    def _obstacle(self, move: Move, start: Pose | None) -> str:
        try:
            self._settings.box.check(move.target)
        except LimitError as error:
            return error.what
        return self._group.obstacle(move.target, move.path, start=start)

    def _look(self, step: Look) -> SeenAt:
        camera = self._camera
        if camera is None:
            raise ConfigError(
                tr("This needs a camera, and none was named."),
                remedy=tr(
                    "Name it with {sensor}, in the recipe, or in the cell file.",
                    sensor=remedy_word(RemedyWord.SENSOR),
                ),
            )
        sleep, settle_s = self._controller.clock.sleep, camera.settle_s
        patient_s = max(settle_s, PATIENT_S)
        sleep(patient_s if step.repeated else settle_s)
        pose = self._group.pose()
        if step.awaited:
            spots = seen_at_place(camera, step.mark, step.pictures, lambda: sleep(patient_s))
        else:
            spots = seen_in(camera, step.mark, pictures=step.pictures)
        return SeenAt.of(pose, median_spot(spots), camera.unit, scatter=scatter_of(spots))

    def _seek(self, step: Seek) -> Pose:
        settings = self._settings

        def go() -> Pose | None:
            with as_measurement():
                motion = self._group.move_until_input(
                    step.target, step.edge, speed_mm_s=step.speed_mm_s, box=settings.box
                )
            with self.robot_time.awaiting():
                return motion.wait(timeout_s=settings.motion_timeout_s)

        found = self._seen_through(go, step.target)
        if found is None:
            raise CalibrationError(
                "no_edge",
                tr("Input {number} did not switch on the way.", number=step.edge.number),
                remedy=tr(
                    "Check the number of the input, that the sensor sees the tip, and that it is "
                    "where the station says."
                ),
            )
        return self._stood(found)

    def _stood(self, pose: PoseT) -> PoseT:
        """Return where the frame is, and note it for the robot time."""
        self.robot_time.stands = pose
        return pose

    def _ask(self, step: Ask) -> Pose:
        question = PlaceQuestion(
            step,
            controller=self._controller,
            group=self._group,
            operator=self._operator,
            jog=self._jogged,
            line=self._line,
            runs=lambda: self._runs,
            typed=self._typed_pose if self._types else None,
            guided=self._guided,
        )
        with self.robot_time.person():
            return self._stood(question.answer())

    def _jogged(self, steps: str) -> bool:
        """Jog, and return whether another question came between."""
        repeats_left = self._repeats_left
        self.jog(steps)
        return self._repeats_left != repeats_left

    def _typed_pose(self, text: str, here: Pose) -> Pose:
        return typed_pose(text, here, self._settings)

    def _seen_through(self, go: Callable[[], T], target: Pose, *, by_hand: bool = False) -> T:
        """Move when all permits are given; if this computer was too busy to, a person decides."""
        while True:
            try:
                with movement_permit(self._controller, by_hand=by_hand):
                    return go()
            except HeartbeatLostError:
                if not self._repeats_left or not self._stands(target) or not self._again():
                    raise
                self._repeats_left -= 1
                self.robot_time.unusual()

    def _stands(self, target: Pose) -> bool:
        """Whether the robot has stopped, is ready, and has the step's tool selected."""
        status = self._controller.status()
        return status.state is ControllerState.READY and self._group.pose().tool == target.tool

    def _again(self) -> bool:
        try:
            return self.confirm(
                tr(
                    "This computer was busy for half a second, so the controller stopped "
                    "the robot. Nothing was written. Repeat this step from here?"
                )
            )
        except DeclinedError:  # there is nobody to ask
            return False

    @property
    def _asking(self) -> Asking:
        return Asking(self._operator, self._line, self._controller.outcomes, self._tool)

    def confirm(self, question: str) -> bool:
        """Ask a yes-or-no question under the same watch; see :meth:`Asking.confirm_or`."""
        return self.confirm_or(question, also=()) is True

    def confirm_or(self, question: str, *, also: Collection[str], decides: str = "") -> bool | str:
        """Ask a question that a further word may answer; see :meth:`Asking.confirm_or`.

        Args:
            question: What a yes agrees to.
            also: The words.
            decides: Under which name the record says besides whether it was a yes.

        Example:
            >>> from robolink.model import WorkBox
            >>> from robolink.runner import Runner, RunSettings
            >>> from robolink.controllers import SimpleController
            >>> class Person:  # implements robolink.Operator
            ...     def ask(self, question, kind):
            ...         print(question)
            ...     def poll(self, wait_s):
            ...         return "more"
            >>> controller, settings = SimpleController(), RunSettings(WorkBox())
            >>> runner = Runner(controller, controller.groups[0], Person(), settings)
            >>> runner.confirm_or("Keep it?", also=("more",))
            Keep it?
            'more'
        """
        with self.robot_time.person():
            return self._asking.confirm_or(question, also=also, decides=decides)

    def choose(self, question: str, offered: OfferedChoice) -> int:
        """Let a person choose one of several rows under this watch; see :meth:`Asking.choose`."""
        with self.robot_time.person():
            return self._asking.choose(question, offered)

    def ask_text(self, question: str) -> str:
        """Ask for a line of text under the same watch; see :meth:`Asking.text`."""
        with self.robot_time.person():
            return self._asking.text(question)

    def _line(self, between: Callable[[], object] | None = None) -> str:
        """Return the next line typed, reading the status at least once a second meanwhile.

        Args:
            between: Called as often as the input is looked at, which is then more often.
        """

        def look(line: str = "") -> None:
            checkpoint(Checkpoint.QUESTION, line)
            self._watch()
            if between is not None:
                between()

        wait_s = POLL_S if between is None else CONTACT_POLL_S
        line = awaited_line(self._operator, look, wait_s=wait_s)
        look(line)
        return line

    def _require_going(self) -> None:
        self._controller.latch.require_open(tr("The procedure"))

    def _watch(self) -> None:
        self._require_going()
        status = self._controller.status()
        self._runs = status.running
        obstacle = self._ending.obstacle(status)
        if obstacle:
            raise ControllerFaultError(
                tr("{obstacle} The job has ended.", obstacle=obstacle),
                remedy=tr("Remove the cause and start again. The robot will not move by itself."),
                controller=self._controller.identity,
            )


def ask_for_pose(instruction: str, jog: JogRange | None = None) -> Procedure[Pose]:
    """Let a person move the tool somewhere, without a measurement; returns the pose there.

    Args:
        instruction: What the person is to do.
        jog: Where it began and where it may go, for a screen.
    """
    pose: Pose = yield Ask(instruction, evidence=False, subject=jog)
    return pose
