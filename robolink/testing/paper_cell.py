"""A cell on paper: takes the steps of a procedure at once and exactly, to try a method in a test.

It is no simulator: there is no arm, no controller, no time and no error. What it answers follows
from where the tip is, which the caller says and the procedure does not know.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final, TypeVar

from robolink.calibration import carrying, rotation_of
from robolink.errors import CalibrationError, NotReadyError
from robolink.messages import tr
from robolink.model import TIP, Pose, Spot, SpotUnit, ToolOffset
from robolink.runner import (
    Ask,
    Confirm,
    Consider,
    Look,
    Move,
    Notify,
    Procedure,
    Seek,
    SeenAt,
    Step,
    TeachPrompt,
    TouchedAt,
)

XyzMm = tuple[float, float, float]
"""A position in the base: X, Y and Z."""

T = TypeVar("T")

_ANSWERED_AFTER_S: Final = 4.0
"""Time in s that a person takes to answer: longer than for an answer that was typed ahead."""

_WAY_MM: Final = 60.0
"""Distance that a person jogs along an axis of the tool, in mm."""

_STEP_MM: Final = 0.1
"""Shortest distance over which a switch must be on to be found, in mm."""

_HALVINGS: Final = 40


class PaperCell:
    """Takes the steps of a procedure: moves where it says, touches, seeks and sees exactly.

    A person who is offered something declines, as where nobody is asked. Where the place that a
    person touches is not said, the frame stays where it is; a switch that is not said never goes
    on, and a mark that is not said is not seen.

    Attributes:
        here: Where the selected frame is.
        steps: The steps that were answered, in order.
        told: What a person was told.

    Args:
        here: Where the selected frame is before.
        tip: Where the tip really is, seen from that frame; its axes are those that a person shows.
        touched: Where the tip is in contact: a point, base, or the point of a surface to which a
            person brings it from a place.
        switches: Whether an input is on with the tip at a place, by its number.
        marks: What the camera sees, seen from the frame, by number; the tip by default.
        mm_per_px: How long a pixel of the camera is, ``None`` for one that answers in mm.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.methods import measure_two_pose
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> cell = PaperCell(Pose(300, 100, 20, 0), ToolOffset(12, -4, -20), (310, 95, -40))
        >>> found = cell.run(measure_two_pose(TouchPlan(), stored=ToolOffset(12.3, -3.9, -20)))
        >>> round(found.offset.x_mm, 6), round(found.offset.y_mm, 6)
        (12.0, -4.0)
    """

    def __init__(
        self,
        here: Pose,
        tip: ToolOffset,
        touched: XyzMm | Callable[[XyzMm], XyzMm] | None = None,
        *,
        switches: Mapping[int, Callable[[XyzMm], bool]] | None = None,
        marks: Mapping[int, ToolOffset] | None = None,
        mm_per_px: float | None = None,
    ) -> None:
        self.here = here
        self.steps: list[Step] = []
        self.told: list[str] = []
        self._tip = tip
        self._touched = touched
        self._switches = switches or {}
        self._marks = {TIP: tip} if marks is None else marks
        self._mm_per_px = mm_per_px

    def run(self, procedure: Procedure[T]) -> T:
        """Take the steps of a procedure and return its result.

        Raises:
            CalibrationError: The procedure refuses what it found; ``no_edge``, ``edge_passed`` and
                ``tip_not_seen`` are thrown into it first.
        """
        try:
            step = next(procedure)
            while True:
                self.steps.append(step)
                try:
                    answer = self._answer(step)
                except CalibrationError as error:
                    step = procedure.throw(error)
                    continue
                step = procedure.send(answer)
        except StopIteration as finished:
            result: T = finished.value
            return result

    def _answer(self, step: Step) -> object:
        match step:
            case Consider():
                return ("",) * len(step.moves)
            case Notify():
                self.told.append(step.text)
                return None
            case Confirm():
                return False
            case Look(repeated=True):
                return None
            case Look():
                return self._seen(step)
            case Move():
                self.here = step.target
            case Seek():
                self.here = self._sought(step)
            case Ask():
                self.here = self._shown(step)
                contact = None if step.contact is None else self._touched is not None
                return TouchedAt.of(self.here, seconds=_ANSWERED_AFTER_S, contact=contact)
        return self.here

    def _place(self, offset: ToolOffset) -> XyzMm:
        dx, dy, dz = (rotation_of(self.here) @ offset.components()[:3]).tolist()
        return self.here.x_mm + dx, self.here.y_mm + dy, self.here.z_mm + dz

    def _shown(self, step: Ask) -> Pose:
        if step.shown in (TeachPrompt.ALONG_X, TeachPrompt.ALONG_Z):
            return self._along(0 if step.shown is TeachPrompt.ALONG_X else 2)
        if self._touched is None or step.shown is not TeachPrompt.PIN:
            return self.here
        place_mm = self._touched
        if callable(place_mm):
            place_mm = place_mm(self._place(self._tip))
        return carrying(self.here, self._tip, place_mm)

    def _along(self, axis: int) -> Pose:
        own = rotation_of(self.here) @ rotation_of(Pose(*self._tip.components()))
        dx, dy, dz = (_WAY_MM * own[:, axis]).tolist()
        here = self.here
        return replace(here, x_mm=here.x_mm + dx, y_mm=here.y_mm + dy, z_mm=here.z_mm + dz)

    def _sought(self, step: Seek) -> Pose:
        start_mm, here = self._place(self._tip), self.here
        switch = self._switches.get(step.edge.number)
        way = [b - a for a, b in zip(here.coordinates(), step.target.coordinates(), strict=True)]

        def switched(share: float) -> bool:
            x, y, z = (at + share * along for at, along in zip(start_mm, way[:3], strict=True))
            return step.edge.awaited(switch is not None and switch((x, y, z)))

        if switched(0.0):
            self._refuse_passed(step)
        count = max(1, round(sum(map(abs, way[:3])) / _STEP_MM))
        reached = next((n for n in range(1, count + 1) if switched(n / count)), None)
        if reached is None:
            self.here = step.target
            told = tr("Input {number} did not switch on the way.", number=step.edge.number)
            raise CalibrationError("no_edge", told)
        low, high = (reached - 1) / count, reached / count
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            low, high = (low, middle) if switched(middle) else (middle, high)
        x, y, z = (at + high * along for at, along in zip(_xyz(here), way[:3], strict=True))
        return replace(here, x_mm=x, y_mm=y, z_mm=z)

    def _refuse_passed(self, step: Seek) -> None:
        try:
            on = not step.edge.falling
            step.edge.require_ahead(on, controller="", request=step.purpose)
        except NotReadyError as error:
            raise CalibrationError("edge_passed", error.what, remedy=error.remedy) from error

    def _seen(self, step: Look) -> SeenAt:
        if step.mark not in self._marks:
            raise CalibrationError("tip_not_seen", tr("The camera did not see the tip."))
        x, y, _ = self._place(self._marks[step.mark])
        if self._mm_per_px is None:
            return SeenAt.of(self.here, Spot(x, y), SpotUnit.BASE_MM)
        return SeenAt.of(self.here, Spot(x / self._mm_per_px, y / self._mm_per_px), SpotUnit.PIXEL)


def _xyz(pose: Pose) -> XyzMm:
    return pose.x_mm, pose.y_mm, pose.z_mm
