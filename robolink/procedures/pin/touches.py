"""Touches of a pin that a person makes, each but the first from a standoff.

Nothing ever turns in contact: the tip is lifted, turned in the air, brought down beside and above
the pin, and the last bit is done by the person, who sees it. How far beside and above is drawn, so
that a touch that was not made shows (docs/reference/evidence.md 1).
"""

import math
import secrets
from collections.abc import Hashable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from robolink.calibration import (
    FARTHEST_MM,
    HIGHEST_MM,
    PERSON_SIGMA_Z_MM,
    PERSON_U_DRIFT_MM,
    PROBE_SIGMA_Z_MM,
    PROBE_U_DRIFT_MM,
    FlangePlane,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import InputEdge, Path, Pose, ToolOffset
from robolink.procedures.approach import offset_z
from robolink.procedures.pin.judging import require_touches, was_jogged
from robolink.runner import Ask, Move, Notify, Procedure, TouchedAt

if TYPE_CHECKING:
    from robolink.calibration import StandoffSeries  # numpy, which a look does without

MOST_ASKED: Final = 3
"""How often a person is asked for a touch before the refusal ends the measurement."""

_SEED_BITS: Final = 48


@dataclass(frozen=True, slots=True)
class TouchPlan:
    """How a tip is taken off the pin and brought back.

    Attributes:
        lift_mm: How far the tip is lifted before anything turns.
        clearance_mm: Least height above the expected contact to which it comes down again; up to
            :data:`HIGHEST_MM` more is drawn.
        turn_deg: By how much U differs between the two poses.
        contact: The input that shows contact, ``None`` where a person's eye does.
        sigma_z_mm: Standard deviation of a touch in height, ``None`` for what is usual.
        seed: From which the standoffs are drawn, ``None`` for a new one in each run.
        nominal: Whether it is only looked at: the highest standoffs, nothing drawn or judged.
    """

    lift_mm: float = 10.0
    clearance_mm: float = 2.0
    turn_deg: float = 180.0
    contact: InputEdge | None = None
    sigma_z_mm: float | None = None
    seed: int | None = None
    nominal: bool = False

    @property
    def sigma_in_height_mm(self) -> float:
        """Standard deviation of a touch in height, stated or usual."""
        usual_mm = PERSON_SIGMA_Z_MM if self.contact is None else PROBE_SIGMA_Z_MM
        return self.sigma_z_mm or usual_mm

    @property
    def u_drift_mm(self) -> float:
        """Usual standard uncertainty of a drift that one touch shows."""
        return PERSON_U_DRIFT_MM if self.contact is None else PROBE_U_DRIFT_MM


class PinTouches:
    """The touches of one pin in one measurement or one proof.

    Args:
        plan: Lift, clearance, contact input.
        planar: Whether the tool stands upright in all of them.
        comes_down: Whether the tip is known well enough to come down to the clearance; else it
            stops at the lift, and the person jogs the whole approach.
    """

    def __init__(self, plan: TouchPlan, *, planar: bool = True, comes_down: bool = True) -> None:
        self._plan = plan
        self._planar = planar
        self._low_mm = plan.clearance_mm if comes_down else plan.lift_mm
        self._comes_down = comes_down
        self._taken: dict[Hashable, TouchedAt] = {}
        self._count = 0
        self._drawing: StandoffSeries | None = None

    def first(self, key: Hashable = None) -> Procedure[TouchedAt]:
        """Let the person bring the tip onto the pin from wherever it is, and lift off.

        Args:
            key: By which a later touch takes the place of this one; ``None`` for its U.
        """
        self._count += 1
        answer: Pose = yield Ask(tr("Bring the tip onto the pin."), contact=self._plan.contact)
        touch = TouchedAt.of(answer)
        yield lift_off(self._plan, touch)
        self._taken[touch.u_deg if key is None else key] = touch
        return touch

    def again(
        self, expected: Pose, *, key: Hashable, turning: str, instruction: str
    ) -> Procedure[TouchedAt]:
        """Stop beside and above the pin, let the person touch it, and lift off.

        The tip starts lifted and over the pin.

        Args:
            expected: Pose of the frame in force with the tip on the pin, as far as it is known.
            key: By which a later touch takes the place of this one.
            turning: What the way over the pin is for.
            instruction: What the person is to do.

        Raises:
            CalibrationError: ``not_touched`` or ``typed_ahead``, with the tip drawn back.
        """
        self._taken.pop(key, None)
        expected = plain_pose(expected)
        x_mm, y_mm, z_mm = self._standoff(expected)
        beside = replace(expected, x_mm=expected.x_mm + x_mm, y_mm=expected.y_mm + y_mm)
        above_mm = self._plan.lift_mm if self._comes_down else z_mm
        arrival: Pose = yield self._move(offset_z(beside, above_mm), Path.JOINT, turning)
        if self._comes_down:
            arrival = yield from self.come_down(offset_z(beside, z_mm))
        touch = yield from self.touched(
            expected, arrival, (x_mm, y_mm, z_mm), key=key, instruction=instruction
        )
        yield lift_off(self._plan, touch)
        return touch

    def come_down(self, target: Pose) -> Procedure[Pose]:
        """Go straight down to a standoff; returns the pose on arrival."""
        arrival: Pose = yield self._move(
            target, Path.STRAIGHT, tr("come down beside the pin, to the clearance")
        )
        return arrival

    def touched(
        self,
        expected: Pose,
        arrival: Pose,
        standoff_mm: tuple[float, float, float],
        *,
        key: Hashable,
        instruction: str,
    ) -> Procedure[TouchedAt]:
        """Let the person touch the pin from where the robot stopped; nothing is lifted yet.

        Args:
            expected: Pose with the tip on the pin, as far as it is known.
            arrival: Where the robot stopped.
            standoff_mm: How far from there that is.
            key: As in :meth:`again`.
            instruction: What the person is to do.

        Raises:
            CalibrationError: ``not_touched`` or ``typed_ahead``, with the tip drawn back.
        """
        self._count += 1
        ask = Ask(instruction, foreseen=expected, contact=self._plan.contact)
        for left in reversed(range(MOST_ASKED)):
            touch = yield from self._answered(ask, arrival, standoff_mm)
            if self._plan.nominal or self._made(touch):
                self._taken[key] = touch
                return touch
            told = self._not_made(touch)
            if left:
                yield Notify(told)
        yield lift_off(self._plan, touch)
        raise CalibrationError(
            "not_touched",
            told,
            remedy=tr("The robot never stops on the pin: jog until the tip is on it, then answer."),
        )

    def require_made(self) -> None:
        """Refuse touches that were not made, whatever each of them looked like.

        Raises:
            CalibrationError: ``touch_heights_differ``, ``touch_not_proven`` or ``large_residual``.
        """
        if not self._plan.nominal:
            require_touches(tuple(self._taken.values()), sigma_z_mm=self._plan.sigma_in_height_mm)

    def _standoff(self, expected: Pose) -> tuple[float, float, float]:
        if self._plan.nominal:
            return 0.0, 0.0, self._low_mm + HIGHEST_MM
        from robolink.calibration import Standoff, StandoffSeries  # numpy

        if self._drawing is None:
            seed = self._plan.seed
            self._drawing = StandoffSeries(
                fresh_seed() if seed is None else seed,
                self._low_mm,
                sideways=self._plan.contact is None,
                planar=self._planar,
            )
        taken = [(touch, Standoff(*touch.standoff_mm)) for touch in self._taken.values()]
        one = self._drawing.next(taken, expected)
        return one.x_mm, one.y_mm, one.z_mm

    def _move(self, target: Pose, path: Path, purpose: str) -> Move:
        sideways = self._plan.nominal and self._plan.contact is None
        return Move(target, path, purpose, FARTHEST_MM if sideways else 0.0)

    def _answered(
        self, ask: Ask, arrival: Pose, standoff_mm: tuple[float, float, float]
    ) -> Procedure[TouchedAt]:
        try:
            answer: Pose = yield ask
        except CalibrationError:
            yield lift_off(self._plan, arrival)
            raise
        seed = self._drawing.seed if self._drawing else None
        return replace(TouchedAt.of(answer), arrival=arrival, standoff_mm=standoff_mm, seed=seed)

    def _made(self, touch: TouchedAt) -> bool:
        if self._plan.contact is not None:
            return touch.contact is True
        return was_jogged(touch)

    def _not_made(self, touch: TouchedAt) -> str:
        if self._plan.contact is not None:
            return tr(
                "Touch {number} was not made: input {input} did not go over to contact since the "
                "robot stopped. Jog until it does; if it shows contact all the time, look at its "
                "wiring.",
                number=self._count,
                input=self._plan.contact.number,
            )
        return tr(
            "Touch {number} was not made: the robot is where it stopped, {away:.1f} mm from the "
            "pin. Jog onto it.",
            number=self._count,
            away=math.hypot(*touch.standoff_mm),
        )


def fresh_seed() -> int:
    """Return the seed of a run: nobody can know the standoffs of a run before it."""
    return secrets.randbits(_SEED_BITS)


def lift_off(plan: TouchPlan, touch: Pose) -> Move:
    """Return the step that takes the tip off the pin, after which it may turn."""
    return Move(offset_z(plain_pose(touch), plan.lift_mm), Path.STRAIGHT, tr("lift off the pin"))


def touch_again(
    touches: PinTouches, last: Pose, u_deg: float, guess: ToolOffset
) -> Procedure[TouchedAt]:
    """Turn to ``u_deg``, come down beside the pin, let the person touch it, and lift off.

    Args:
        touches: Those of the measurement.
        last: The touch from which the tip was lifted off.
        u_deg: U of the next touch.
        guess: About where the tip is.

    Raises:
        CalibrationError: ``not_touched`` or ``typed_ahead``, with the tip drawn back.
    """
    return (
        yield from touches.again(
            _turned(last, u_deg, guess),
            key=u_deg,
            turning=tr("turn in the air"),
            instruction=tr("Bring the tip onto the pin again, with the tool turned."),
        )
    )


def _turned(contact: Pose, u_deg: float, guess: ToolOffset) -> Pose:
    """Return the flange pose at ``u_deg`` that brings the tip, by ``guess``, to the same point."""
    turned = replace(plain_pose(contact), u_deg=u_deg)
    tip = guess.components()[:3]
    before_x, before_y = FlangePlane.of(contact).in_base(*tip)
    after_x, after_y = FlangePlane.of(turned).in_base(*tip)
    return replace(
        turned, x_mm=contact.x_mm + before_x - after_x, y_mm=contact.y_mm + before_y - after_y
    )


def plain_pose(pose: Pose) -> Pose:
    """Return a pose without how it was taken."""
    kept = Pose(*pose.coordinates(), hand=pose.hand, local=pose.local, tool=pose.tool)
    return replace(kept, posture=pose.posture)
