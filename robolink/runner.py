"""Executes a procedure on a motion group, with a person at the reference point.

The runner owns what a procedure must not know: limits, deadlines, the clock, and the watch
over the controller while a person is asked. Remote control cuts an idle client off after the
remote time-out (60 s by default, epson.md 1.1), and a person may take half an hour; so the
prompt is polled, and the status is read between polls. That also shows an emergency stop or
an open guard at once.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Protocol, TypeVar

from robolink.calibration import Ask, Move, Procedure, Step
from robolink.errors import (
    ConfigError,
    ControllerFaultError,
    DeclinedError,
    LimitError,
)
from robolink.messages import tr
from robolink.model import (
    Controller,
    ControllerStatus,
    MotionGroup,
    MotionOutcome,
    MotionProfile,
    Path,
    Pose,
    WorkBox,
)

POLL_S = 1.0
"""Longest time between two status reads while a person is asked (design: at most 5 s)."""

T = TypeVar("T")

_STEP = re.compile(r"([xyzu])([+-][0-9]{1,4}(?:\.[0-9]{1,3})?)", re.ASCII)

_DECIMAL = re.compile(r"[+-]?[0-9]{1,5}(?:\.[0-9]{1,6})?", re.ASCII)


class Question(Enum):
    """What kind of answer is wanted."""

    PLACE = "place"
    """Jog steps until the tip is on the reference point, then an empty line."""

    YES_NO = "yes/no"

    TEXT = "text"
    """A line of text that is not empty; ``q`` alone ends."""


class Operator(Protocol):
    """The person at the cell, or whoever stands in for one."""

    def tell(self, text: str) -> None:
        """Show something that needs no answer."""

    def ask(self, question: str, kind: Question) -> None:
        """Show what is to be done or decided; :meth:`poll` fetches the answer."""

    def poll(self, wait_s: float) -> str | None:
        """Return the next line of the answer, ``None`` if none came within ``wait_s``."""


@dataclass(frozen=True, slots=True)
class RunSettings:
    """Limits of a run.

    Attributes:
        box: Where targets may lie, in coordinates of the frame that moves.
        speed_percent: For joint moves, in low power.
        speed_mm_s: For straight moves, in low power.
        max_jog_mm: Largest single step that a person may type.
        max_jog_deg: The same for U.
        motion_timeout_s: Longest duration of one movement before it is aborted.
    """

    box: WorkBox
    speed_percent: int = 5
    speed_mm_s: float = 20.0
    max_jog_mm: float = 5.0
    max_jog_deg: float = 5.0
    motion_timeout_s: float = 120.0


@dataclass(frozen=True, slots=True)
class StepDone:
    """A step that was taken and the pose after it."""

    step: Step
    pose: Pose


class Runner:
    """Runs procedures and jogs on one group.

    Args:
        controller: For the status and the clock.
        group: What moves.
        operator: Who is asked.
        settings: Limits and speeds.
        on_step: Told of every step taken.
    """

    def __init__(
        self,
        controller: Controller,
        group: MotionGroup,
        operator: Operator,
        settings: RunSettings,
        *,
        on_step: Callable[[StepDone], None] | None = None,
    ) -> None:
        self._controller = controller
        self._group = group
        self._operator = operator
        self._settings = settings
        self._on_step = on_step

    def run(self, procedure: Procedure[T]) -> T:
        """Take the procedure's steps until it returns; its result is a proposal.

        Raises:
            DeclinedError: The person ended it.
            CalibrationError: The procedure refuses its measurements.
            ControllerFaultError, NotReadyError, OutcomeUnknownError: From the controller.
        """
        try:
            step = next(procedure)
            while True:
                pose = self._take(step)
                if self._on_step is not None:
                    self._on_step(StepDone(step, pose))
                step = procedure.send(pose)
        except StopIteration as finished:
            result: T = finished.value
            return result
        finally:
            procedure.close()

    def move(self, target: Pose, path: Path) -> Pose:
        """Move once and return where the frame is then.

        Raises:
            ControllerFaultError: It was stopped before it arrived.
        """
        profile = MotionProfile(path, self._settings.speed_percent, self._settings.speed_mm_s)
        motion = self._group.move_to(target, profile, box=self._settings.box)
        outcome = motion.wait(timeout_s=self._settings.motion_timeout_s)
        if outcome is not MotionOutcome.ARRIVED:
            raise ControllerFaultError(
                tr("The movement was stopped before it arrived."),
                remedy=tr("Nothing goes on by itself; start again when the cell is clear."),
                controller=self._controller.identity,
            )
        return self._group.pose()

    def jog(self, steps: str) -> Pose:
        """Move by typed steps, for example ``x+0.1 z-0.5``, in one straight move.

        Raises:
            ConfigError: The text is not a list of steps.
            LimitError: A step is too large, or its target lies outside the box.
        """
        target, path = jog_target(self._group.pose(), steps, self._settings)
        return self.move(target, path)

    def _take(self, step: Step) -> Pose:
        if isinstance(step, Move):
            self._operator.tell(step.purpose)
            return self.move(step.target, step.path)
        return self._ask(step)

    def _ask(self, step: Ask) -> Pose:
        self._operator.ask(step.instruction, Question.PLACE)
        while True:
            word = self._answer()
            if word in ("", "done"):
                return self._group.pose()
            if word in ("q", "quit", "abort"):
                raise DeclinedError(
                    tr("The procedure was ended by the operator."),
                    remedy=tr("Nothing was written."),
                )
            try:
                self.jog(word)
            except ConfigError as error:
                # A typing mistake ends nothing; the limits held and nothing was sent.
                self._operator.tell(str(error))

    def confirm(self, question: str) -> bool:
        """Ask a yes-or-no question under the same watch; anything but a yes is a no."""
        self._operator.ask(question, Question.YES_NO)
        return self._answer() in ("y", "yes")

    def ask_text(self, question: str) -> str:
        """Ask for a line of text under the same watch, until there is one.

        Raises:
            DeclinedError: The person ended it with ``q``.
        """
        while True:
            self._operator.ask(question, Question.TEXT)
            text = self._line().strip()
            if text == "q":
                raise DeclinedError(
                    tr("The procedure was ended by the operator."),
                    remedy=tr("Nothing was written."),
                )
            if text:
                return text

    def _answer(self) -> str:
        return self._line().strip().lower()

    def _line(self) -> str:
        """Return the next line typed, reading the status at least once a second meanwhile."""
        while True:
            line = self._operator.poll(POLL_S)
            self._watch()
            if line is not None:
                return line

    def _watch(self) -> None:
        obstacle = _ended_by(self._controller.status())
        if obstacle:
            raise ControllerFaultError(
                tr("{obstacle} while the operator was asked.", obstacle=obstacle),
                remedy=tr("Clear the cause and start again; nothing goes on by itself."),
                controller=self._controller.identity,
            )


def ask_for_pose(instruction: str) -> Procedure[Pose]:
    """Let a person bring the tool somewhere; returns the pose there."""
    return (yield Ask(instruction))


def jog_target(here: Pose, steps: str, settings: RunSettings) -> tuple[Pose, Path]:
    """Return where typed ``steps`` lead from ``here``, and how to go there.

    Raises:
        ConfigError: The text is not a list of steps.
        LimitError: A step is too large.
    """
    deltas = parse_steps(steps)
    for axis, delta in deltas.items():
        limit = settings.max_jog_deg if axis == "u" else settings.max_jog_mm
        if abs(delta) > limit:
            raise LimitError(
                tr("{axis}{delta:+g} is too large for one step.", axis=axis, delta=delta),
                remedy=tr("Steps of up to {limit:g} are allowed; take several.", limit=limit),
            )
    target = replace(
        here,
        x_mm=here.x_mm + deltas.get("x", 0.0),
        y_mm=here.y_mm + deltas.get("y", 0.0),
        z_mm=here.z_mm + deltas.get("z", 0.0),
        u_deg=here.u_deg + deltas.get("u", 0.0),
    )
    # A straight move that only turns is an error in SPEL+ without ROT (spel.md 7.1).
    return target, Path.JOINT if "u" in deltas else Path.STRAIGHT


def parse_decimal(text: str) -> float:
    """Read a decimal number that a person typed: ``-120.35``.

    Raises:
        ConfigError: It is anything else.
    """
    if not _DECIMAL.fullmatch(text.strip()):
        raise ConfigError(
            tr("{text!r} is not a decimal number.", text=text),
            remedy=tr("Type for example -120.35."),
        )
    return float(text)


def parse_steps(text: str) -> dict[str, float]:
    """Read jog steps like ``x+0.1 y-0.05 u+5``: axis, sign, decimal number.

    Raises:
        ConfigError: Anything else, or an axis twice.
    """
    deltas: dict[str, float] = {}
    for word in text.lower().split():
        match = _STEP.fullmatch(word)
        if match is None or match[1] in deltas:
            raise ConfigError(
                tr("{word!r} is not a jog step.", word=word),
                remedy=tr(
                    "Type an axis x, y, z or u, a sign and a number, for example x+0.1 z-0.5; "
                    "ENTER when the tip is on the pin, q to end."
                ),
            )
        deltas[match[1]] = float(match[2])
    if not deltas:
        raise ConfigError(tr("No jog step was given."), remedy=tr("For example: x+0.1 z-0.5"))
    return deltas


def _ended_by(status: ControllerStatus) -> str:
    if status.serious_fault:
        return tr("The controller reported a serious error")
    if status.emergency_stop:
        return tr("The emergency stop was pressed")
    if status.guard_open:
        return tr("The safety guard was opened")
    if status.fault:
        return tr("The controller went into error {code:04d}", code=status.code)
    return ""
