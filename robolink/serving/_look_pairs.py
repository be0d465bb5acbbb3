"""Looks of a program beside its places and at them: does the spot move as the robot does?"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from robolink.errors import CalibrationError
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.calibration import SeenMovement, Sighting

LEAST_WAY_MM: Final = 0.2
"""A look nearer to its place than this does not show whether the spot moves with the tip."""

_SAME_DEG: Final = 0.05
"""Orientations that differ by less are one."""

_PLAY_MM: Final = 0.02
"""What play in the joints may make of a way: a program cannot be asked for a closer look."""

_FOLLOWS_WITHIN: Final = 0.1


@dataclass(frozen=True, slots=True)
class LookPair:
    """What was seen in one orientation.

    Attributes:
        beside: The look farthest from the place.
        at: The look at the place, the last of them.
    """

    beside: "Sighting"
    at: "Sighting"

    @property
    def way_mm(self) -> float:
        """How far the robot went between them."""
        one, other = self.beside.flange, self.at.flange
        return math.dist((one.x_mm, one.y_mm), (other.x_mm, other.y_mm))

    def movement(self) -> "SeenMovement":
        """Return what the robot did between them, and what was seen of it."""
        from robolink.calibration import SeenMovement, mm_camera_noise

        start, end = self.beside.flange, self.at.flange
        return SeenMovement(
            (end.x_mm - start.x_mm, end.y_mm - start.y_mm),
            (self.at.x_mm - self.beside.x_mm, self.at.y_mm - self.beside.y_mm),
            mm_camera_noise(),
        )


def look_pairs(looks: "Sequence[Sighting]") -> list[LookPair]:
    """Return the looks of each orientation, in the order in which they were taken.

    Raises:
        CalibrationError: ``no_look_beside``: in one of them nothing shows that the spot moves.
    """
    groups: list[list[Sighting]] = []
    for look in looks:
        if groups and _same_orientation(groups[-1][0], look):
            groups[-1].append(look)
        else:
            groups.append([look])
    pairs = [
        max((LookPair(look, group[-1]) for look in group), key=lambda pair: pair.way_mm)
        for group in groups
    ]
    if any(pair.way_mm < LEAST_WAY_MM for pair in pairs):
        raise CalibrationError(
            "no_look_beside",
            tr("Each place has to be looked at from beside it first, with the tool turned alike."),
        )
    return pairs


def require_moving(pairs: Sequence[LookPair]) -> None:
    """Refuse a spot that does not move as the robot does, and a camera that changed.

    Raises:
        CalibrationError: ``tip_did_not_move`` or ``camera_changed``.
    """
    from robolink.calibration import (
        CameraChangeRows,
        MovementVerdict,
        camera_changed,
        tip_did_not_move,
    )

    movements = [pair.movement() for pair in pairs]
    wrong = [
        movement
        for movement in movements
        if movement.judged(CameraChangeRows(), play_mm=_PLAY_MM) is not MovementVerdict.AS_KNOWN
    ]
    # A camera that changed shows every way in one wrong manner; that play makes one of them seem
    # wrong is no reason to refuse the others.
    for movement in wrong:
        steady = all(movement.like(one, within=_FOLLOWS_WITHIN) for one in movements)
        if not steady and math.dist(movement.seen, movement.known_mm) > (
            _FOLLOWS_WITHIN * movement.known_length_mm + 3 * movement.noise
        ):
            raise tip_did_not_move(movement, in_mm=True)
    if len(wrong) == len(movements):
        still = wrong[0].judged(CameraChangeRows(), play_mm=0.0) is MovementVerdict.NONE
        raise tip_did_not_move(wrong[0], in_mm=True) if still else camera_changed(wrong[0])


def _same_orientation(one: "Sighting", other: "Sighting") -> bool:
    a, b = one.flange, other.flange
    turns = ((a.u_deg, b.u_deg), (a.v_deg, b.v_deg), (a.w_deg, b.w_deg))
    return all(abs(math.remainder(x - y, 360.0)) < _SAME_DEG for x, y in turns)
