"""Touches of a pin that a person makes, each but the first from a standoff.

Nothing ever turns in contact: the tip is lifted, turned in the air, brought down beside and above
the pin, and the last bit is done by the person, who sees it. How far beside and above is drawn, so
that a touch that was not made shows (docs/reference/evidence.md 1).
"""

from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from robolink.calibration import FARTHEST_MM, HIGHEST_MM, FlangePlane
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset, angle_difference_deg
from robolink.procedures.approach import offset_z
from robolink.procedures.witnessed_touches import (
    TouchPlan,
    WitnessedTouches,
    heights_agree,
    plain_pose,
    require_touches,
    you_touch,
)
from robolink.runner import Move, NotYet, Procedure, TouchedAt

if TYPE_CHECKING:
    from robolink.calibration import StandoffSeries


LEAST_TURN_DEG: Final = 10.0
"""Smallest turn between two touches if their planned angles are more than twice as far apart,
degrees."""


class PinTouches(WitnessedTouches):
    """The touches of one pin in one measurement or one turn test.

    Args:
        plan: Lift, clearance, contact input.
        planar: Whether the tool stands upright in all of them.
        comes_down: Whether the tip is known well enough to come down to the clearance; else it
            stops at the lift, and the person jogs the whole approach.
        total: How many touches are planned, ``None`` where nobody knows.
        limit_mm: Largest drift that passes where they are those of a proof, else ``None``.
        retakes: Whether whoever makes them hears of one that is to be made again, alone.

    Example:
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import PinTouches, TouchPlan
        >>> from robolink.testing import PaperCell
        >>> touches = PinTouches(TouchPlan(lift_mm=10), total=2)
        >>> cell = PaperCell(Pose(300, 100, 20, 0), ToolOffset(12, -4, -20), (310, 95, -40))
        >>> touch = cell.run(touches.first())
        >>> touch.z_mm, cell.here.z_mm  # lifted off again
        (-20.0, -10.0)
    """

    def __init__(
        self,
        plan: TouchPlan,
        *,
        planar: bool = True,
        comes_down: bool = True,
        total: int | None = None,
        limit_mm: float | None = None,
        retakes: bool = False,
    ) -> None:
        super().__init__(plan, total=total, limit_mm=limit_mm, retakes=retakes)
        self._planar = planar
        self._low_mm = plan.clearance_mm if comes_down else plan.lift_mm
        self._comes_down = comes_down
        self._drawing: StandoffSeries | None = None

    def first(self, key: Hashable = None) -> Procedure[TouchedAt]:
        """Let the person move the tip onto the pin from wherever it is, and lift off.

        Args:
            key: By which a later touch takes the place of this one; ``None`` for its U.
        """
        return (yield from self.shown(tr("Jog the tip onto the pin."), key=key))

    def again(
        self, expected: Pose, *, key: Hashable, turning: str, instruction: str
    ) -> Procedure[TouchedAt]:
        """Stop beside and above the pin, let the person touch it, and lift off.

        The tip starts lifted and over the pin.

        Args:
            expected: Pose of the selected frame with the tip on the pin, as far as it is known.
            key: By which a later touch takes the place of this one.
            turning: What the way over the pin is for.
            instruction: What the person is to do.

        Raises:
            CalibrationError: ``not_touched`` or ``typed_ahead``, with the tip drawn back.

        Example:
            >>> from robolink.model import Pose, ToolOffset
            >>> from robolink.procedures import PinTouches, TouchPlan
            >>> from robolink.testing import PaperCell
            >>> touches, expected = PinTouches(TouchPlan()), Pose(298, 99, -20, 0)
            >>> cell = PaperCell(Pose(298, 99, 0, 0), ToolOffset(12.1, -4, -20), (310, 95, -40))
            >>> course = touches.again(expected, key=1, turning="Going.", instruction="Touch.")
            >>> touch = cell.run(course)
            >>> round(touch.x_mm, 3), touch.arrival.z_mm > touch.z_mm
            (297.9, True)
        """
        self._taken.pop(key, None)
        expected = plain_pose(expected)
        x_mm, y_mm, z_mm = self._standoff(expected)
        beside = replace(expected, x_mm=expected.x_mm + x_mm, y_mm=expected.y_mm + y_mm)
        above_mm = self._plan.lift_mm if self._comes_down else z_mm
        then = lowering() if self._comes_down else you_touch()
        over = self._move(offset_z(beside, above_mm), Path.JOINT, turning, then=then)
        arrival: Pose = yield over
        if self._comes_down:
            arrival = yield from self.come_down(offset_z(beside, z_mm))
        touch = yield from self.touched(
            expected, arrival, (x_mm, y_mm, z_mm), key=key, instruction=instruction
        )
        yield lift_off(self._plan, touch)
        return touch

    def come_down(self, target: Pose) -> Procedure[Pose]:
        """Go straight down to a standoff; returns the pose on arrival."""
        arrival: Pose = yield self._move(target, Path.STRAIGHT, lowering(), then=you_touch())
        return arrival

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
            self._drawing = StandoffSeries(
                self._drawn_from(),
                self._low_mm,
                sideways=self._plan.contact is None,
                planar=self._planar,
            )
        taken = [(touch, Standoff(*touch.standoff_mm)) for touch in self._taken.values()]
        one = self._drawing.next(taken, expected)
        return one.x_mm, one.y_mm, one.z_mm

    def _move(self, target: Pose, path: Path, purpose: str, *, then: str = "") -> Move:
        sideways = self._plan.nominal and self._plan.contact is None
        return Move(target, path, purpose, FARTHEST_MM if sideways else 0.0, then)

    def off(self, touch: Pose) -> Move:
        """Return the step that lifts the tip off the pin."""
        return lift_off(self._plan, touch)

    @property
    def _may_be_typed(self) -> bool:
        return self._limit_mm is None

    @property
    def _compares_heights(self) -> bool:
        return self._planar

    def _not_yet(self, touch: TouchedAt, arrival: Pose) -> NotYet | None:
        made = replace(touch, arrival=arrival)
        if not (touch.typed or self._made(made)):
            return None  # reported by the caller that asks for it again
        return super()._not_yet(touch, arrival) or self._in_the_air(touch) or self._unturned(made)

    def _in_the_air(self, touch: Pose) -> NotYet | None:
        others = self._by_number
        if not (self._planar and others):
            return None
        heights = [one.z_mm for one in others.values()]
        if heights_agree([*heights, touch.z_mm], self._plan.sigma_in_height_mm):
            return None
        number, apart_mm = next(iter(others)), touch.z_mm - heights[0]
        told = {"mm": f"{abs(apart_mm):.2f}", "k": number}
        return NotYet(
            "touch_heights_differ",
            tr("{mm} mm higher than touch {k}. Is the tip really on the pin?", **told)
            if apart_mm > 0.0
            else tr("{mm} mm lower than touch {k}. Was touch {k} on the pin?", **told),
        )

    def _unturned(self, touch: TouchedAt) -> NotYet | None:
        """Refuse a touch whose U was jogged back to that of another one."""
        arrival = touch.arrival
        if not self._planar or arrival is None:
            return None
        for number, other in self._by_number.items():
            planned_deg = abs(angle_difference_deg(arrival.u_deg, other.u_deg))
            least_deg = min(LEAST_TURN_DEG, planned_deg / 2)
            found_deg = abs(angle_difference_deg(touch.u_deg, other.u_deg))
            if found_deg < least_deg:
                return NotYet(
                    "turned_too_little",
                    tr(
                        "U differs by only {deg} deg from touch {k}; {min} deg are needed.",
                        deg=f"{found_deg:.1f}",
                        k=number,
                        min=f"{least_deg:.0f}",
                    ),
                )
        return None

    def _not_jogged(self, away_mm: float) -> str:
        return tr(
            "Touch {number} was not made: the robot is where it stopped, {away:.1f} mm from the "
            "pin. Jog onto it.",
            number=self._number,
            away=away_mm,
        )

    def _how_to_make(self) -> str:
        return tr("The robot never stops on the pin: jog until the tip is on it, then answer.")


def lowering() -> str:
    """Return the purpose of the move down beside a pin."""
    return tr("Lowering beside the pin.")


def lift_off(plan: TouchPlan, touch: Pose) -> Move:
    """Return the step that lifts the tip off the pin, after which it may turn."""
    return Move(
        offset_z(plain_pose(touch), plan.lift_mm), Path.STRAIGHT, tr("Lifting off the pin.")
    )


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

    Example:
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import PinTouches, TouchPlan, touch_again
        >>> from robolink.testing import PaperCell
        >>> tip = ToolOffset(12, -4, -20)
        >>> touches = PinTouches(TouchPlan())
        >>> cell = PaperCell(Pose(300, 100, 20, 0), tip, (310, 95, -40))
        >>> first = cell.run(touches.first())
        >>> second = cell.run(touch_again(touches, first, 180, tip))
        >>> round(second.x_mm, 3), round(second.y_mm, 3), second.u_deg
        (322.0, 91.0, 180)
    """
    return (
        yield from touches.again(
            _turned(last, u_deg, guess),
            key=u_deg,
            turning=tr("Turning in the air."),
            instruction=tr("Jog the tip onto the pin again; the tool is turned now."),
        )
    )


def turned_touches(
    plan: TouchPlan,
    first: Pose,
    angles_deg: Sequence[float],
    guess: ToolOffset,
    *,
    comes_down: bool = True,
) -> Procedure[None]:
    """Touch at one angle after the other, without a result.

    To be looked at before the first of them is taken: the plan is a nominal one then.

    Args:
        plan: How.
        first: The touch from which the tip was lifted off.
        angles_deg: U of each.
        guess: About where the tip is.
        comes_down: As for :class:`PinTouches`.

    Example:
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan, turned_touches
        >>> from robolink.runner import Ask, foreseen_steps
        >>> first, stored = Pose(298, 99, -20, 0), ToolOffset(12, -4, -20)
        >>> course = turned_touches(TouchPlan(nominal=True), first, (120, 240), stored)
        >>> asked = [one.step for one in foreseen_steps(course, first) if isinstance(one.step, Ask)]
        >>> [step.foreseen.u_deg for step in asked]
        [120, 240]
    """
    touches = PinTouches(plan, comes_down=comes_down)
    last: Pose = first
    for angle_deg in angles_deg:
        last = yield from touch_again(touches, last, angle_deg, guess)


def _turned(contact: Pose, u_deg: float, guess: ToolOffset) -> Pose:
    """Return the flange pose at ``u_deg`` that moves the tip, by ``guess``, to the same point."""
    turned = replace(plain_pose(contact), u_deg=u_deg)
    tip = guess.components()[:3]
    before_x, before_y = FlangePlane.of(contact).in_base(*tip)
    after_x, after_y = FlangePlane.of(turned).in_base(*tip)
    return replace(
        turned, x_mm=contact.x_mm + before_x - after_x, y_mm=contact.y_mm + before_y - after_y
    )
