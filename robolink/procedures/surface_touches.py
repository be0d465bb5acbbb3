"""Touches of a surface by a person, each but the first from a random distance.

Nothing ever tilts in contact: the tip is lifted, tilted in the air, and brought to a distance
along the surface's normal; the last bit is done by the person. How far away it stops is drawn, so
that a touch that was not made shows (docs/reference/evidence.md 1).
"""

import math
from collections.abc import Hashable
from dataclasses import replace
from typing import TYPE_CHECKING

from robolink.calibration import HIGHEST_MM
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Path, Pose
from robolink.procedures.approach import offset_z
from robolink.procedures.witnessed_touches import (
    WitnessedTouches,
    plain_pose,
    you_touch,
)
from robolink.runner import Move, Procedure, TouchedAt, TouchSubject

if TYPE_CHECKING:
    from robolink.calibration import Floats, SurfaceStandoffs  # numpy, imported only when used


class SurfaceTouches(WitnessedTouches):
    """The touches of one surface in one measurement or one turn test.

    Args:
        plan: Lift, clearance, contact input.
        total: How many touches are planned, ``None`` where nobody knows.
        limit_mm: Largest drift that passes where they are those of a proof, else ``None``.
        retakes: Whether whoever makes them hears of one that is to be made again, alone.

    Example:
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import SurfaceTouches, TouchPlan
        >>> from robolink.testing import PaperCell
        >>> touches = SurfaceTouches(TouchPlan(lift_mm=12), total=9)
        >>> cell = PaperCell(
        ...     Pose(300, 100, 20, 0), ToolOffset(12, -4, -20), lambda at: (at[0], at[1], -40)
        ... )
        >>> cell.run(touches.first(0)).z_mm, cell.here.z_mm, len(touches.taken)  # lifted again
        (-20.0, -8.0, 1)
    """

    _drawing: "SurfaceStandoffs | None" = None

    @property
    def taken(self) -> tuple[TouchedAt, ...]:
        """All that count, in the order of the plan: a repeated one keeps its place."""
        return tuple(self._by_number.values())

    def others(self, key: Hashable) -> tuple[TouchedAt, ...]:
        """Return those that count besides the one known by ``key``."""
        number = self._numbers.get(key)
        return tuple(touch for at, touch in self._by_number.items() if at != number)

    def first(self, key: Hashable) -> Procedure[TouchedAt]:
        """Let the person move the tip onto the surface from wherever it is, and lift off."""
        return (yield from self.shown(tr("Jog the tip onto the surface."), key=key))

    def again(
        self,
        expected: Pose,
        normal: tuple[float, float, float],
        *,
        key: Hashable,
        columns: "Floats | None" = None,
        further_mm: float = 0.0,
        instruction: str = "",
    ) -> Procedure[TouchedAt]:
        """Stop at a distance from the surface, let the person touch it, and lift off.

        The tip starts lifted.

        Args:
            expected: Pose of the selected frame with the tip on the surface, as far as it is known.
            normal: The surface's unit normal there, away from it.
            key: By which a later touch takes the place of this one.
            columns: What tip and surface could explain; see ``SurfaceStandoffs.next``.
            further_mm: How much more than the clearance it stops away, for a surface that nobody
                knows yet.
            instruction: What the person is to do, empty for the usual.

        Raises:
            CalibrationError: ``not_touched`` or ``typed_ahead``, with the tip drawn back.

        Example:
            >>> from robolink.model import Pose, ToolOffset
            >>> from robolink.procedures import SurfaceTouches, TouchPlan
            >>> from robolink.testing import PaperCell
            >>> touches, expected = SurfaceTouches(TouchPlan()), Pose(298, 99, -20, 0)
            >>> cell = PaperCell(
            ...     Pose(298, 99, 0, 0), ToolOffset(12, -4, -20.5), lambda at: (at[0], at[1], -40)
            ... )
            >>> cell.run(touches.again(expected, (0, 0, 1), key=0)).z_mm
            -19.5
        """
        self._taken.pop(key, None)
        expected = plain_pose(expected)
        away_mm = self._away_mm(columns, further_mm)
        x_mm, y_mm, z_mm = (away_mm * along for along in normal)
        beside = replace(expected, x_mm=expected.x_mm + x_mm, y_mm=expected.y_mm + y_mm)
        above_mm = self._plan.lift_mm
        down = tr("Lowering to just above the place.")
        over = tr("Moving over the surface.")
        yield Move(offset_z(beside, above_mm), Path.JOINT, over, then=down)
        lower = Move(offset_z(beside, z_mm), Path.STRAIGHT, down, then=you_touch())
        arrival: Pose = yield lower
        touch = yield from self.touched(
            expected,
            arrival,
            (x_mm, y_mm, z_mm),
            key=key,
            instruction=instruction or tr("Jog the tip onto the surface again, where it is."),
        )
        yield self.off(touch)
        return touch

    def off(self, touch: Pose) -> Move:
        """Return the step that lifts the tip off the surface."""
        lifted = offset_z(plain_pose(touch), self._plan.lift_mm)
        return Move(lifted, Path.STRAIGHT, tr("Lifting off the surface."))

    def require_made(self, columns: "Floats", misses_mm: "Floats") -> None:
        """Refuse touches that were not made, whatever each of them looked like.

        Args:
            columns: Derivatives of the distances by tip and surface, one row a touch that counts.
            misses_mm: Distance of each from the surface that was found.

        Raises:
            CalibrationError: ``touch_not_proven`` or ``large_residual``.
        """
        from robolink.calibration import judge_surface_touches  # numpy

        if self._plan.nominal:
            return
        evidence = judge_surface_touches(columns, misses_mm, self._distances_mm())
        if code := evidence.most_telling:
            raise _refusal(code, evidence.max_residual_mm)

    def _away_mm(self, columns: "Floats | None", further_mm: float) -> float:
        if self._plan.nominal:
            return self._plan.clearance_mm + HIGHEST_MM + further_mm
        from robolink.calibration import SurfaceStandoffs  # numpy

        if self._drawing is None:
            self._drawing = SurfaceStandoffs(self._drawn_from(), self._plan.clearance_mm)
        return self._drawing.next(self._distances_mm(), columns, further_mm=further_mm)

    def _distances_mm(self) -> list[float]:
        return [math.hypot(*touch.standoff_mm) for touch in self.taken]

    def _subject(self, arrival: Pose | None) -> TouchSubject:
        return replace(super()._subject(arrival), surface=True)

    def _not_jogged(self, away_mm: float) -> str:
        return tr(
            "Touch {number} was not made: the robot is where it stopped, {away:.1f} mm from the "
            "surface. Jog onto it.",
            number=self._number,
            away=away_mm,
        )

    def _how_to_make(self) -> str:
        return tr("The robot never stops on the surface: jog until the tip is on it, then answer.")


def _refusal(code: str, residual_mm: float) -> CalibrationError:
    whats = {
        "touch_not_proven": tr(
            "At least one touch was not made: the tip stayed where the robot had stopped "
            "above the surface."
        ),
        "large_residual": tr(
            "One touch is {residual:.3f} mm off the others: the tip was not on the surface, "
            "or the surface moved.",
            residual=residual_mm,
        ),
    }
    return CalibrationError(
        code,
        whats[code],
        remedy=tr("Nothing was written. Clean and fasten the surface; touch it each time."),
    )
