"""Tilting a tool from touch to touch of a surface, and the proof of a new tip on it."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from robolink.calibration import VerifyResult, rotation_of
from robolink.messages import tr
from robolink.methods.pivot.tilts import UPRIGHT, OverPin, Tilt, tilt_in_air
from robolink.model import Pose, ToolOffset
from robolink.procedures import MOST_MORE, SurfaceProof, SurfaceTouches, TouchPlan
from robolink.runner import Notify, Procedure, TakenAgainError, TouchedAt

if TYPE_CHECKING:
    from robolink.calibration import Floats

Vector = tuple[float, float, float]

PROVING_TOUCHES: Final = 4
"""Three components, and one touch that may contradict."""

_LEFT: Final = 0.5
"""Of the clearance, where a tip is wrong by as much as that."""

_FAINT: Final = 1e-6
"""Makes two plans comparable before any combination of their touches shows everything."""


@dataclass(frozen=True, slots=True)
class SurfaceSpot:
    """A place of a surface, and how the tool stands to touch it.

    Attributes:
        tilt: How the tool stands, against its first orientation.
        place_mm: Where the surface is touched, base, as far as it is known.
        normal: Its unit normal there, away from it.
    """

    tilt: Tilt
    place_mm: Vector
    normal: Vector


class SurfaceDrive:
    """Takes a lifted tip from spot to spot of a surface.

    Args:
        plan: Lift and clearance.
        over: The place over which the tip is, lifted and upright.
        touches: How the surface is touched.
    """

    def __init__(self, plan: TouchPlan, over: OverPin, touches: SurfaceTouches) -> None:
        self._plan = plan
        self._over = over
        self._touches = touches
        self._stands = UPRIGHT

    def pose(self, spot: SurfaceSpot) -> Pose:
        """Return the pose of the frame with the tip on a spot."""
        return replace(self._over, pin_mm=spot.place_mm).pose(spot.tilt, 0.0)

    def to(self, goal: Tilt) -> Procedure[None]:
        """Tilt in the air, over the place that was touched last.

        Raises:
            CalibrationError: ``not_tilted``.
        """
        yield from tilt_in_air(self._over, self._stands, goal, self._plan.lift_mm)
        self._stands = goal

    def touch(
        self,
        spot: SurfaceSpot,
        *,
        key: Hashable,
        columns: "Floats | None" = None,
        further_mm: float = 0.0,
        instruction: str = "",
    ) -> Procedure[TouchedAt]:
        """Tilt in the air, go to a spot, and have it touched; see :class:`SurfaceTouches`.

        Raises:
            CalibrationError: ``not_tilted``, ``not_touched`` or ``typed_ahead``, with the tip
                drawn back.
        """
        yield from self.to(spot.tilt)
        try:
            found = yield from self._touches.again(
                self.pose(spot),
                spot.normal,
                key=key,
                columns=columns,
                further_mm=max(further_mm, self._swing_mm(spot)),
                instruction=instruction,
            )
        except TakenAgainError:
            # The tip was drawn back over this spot, and is tilted from there.
            self._over = replace(self._over, pin_mm=spot.place_mm)
            raise
        self._over = self._over.moved_to(found)
        return found

    def _swing_mm(self, spot: SurfaceSpot) -> float:
        """Return how much more than the clearance keeps a tip off that is believed elsewhere.

        A tip that is wrong by e is nearer by up to e |R'n - R0'n|: its place on the surface was
        found in the first orientation. No e is larger than the clearance, which is refused below
        the largest change that is believed; half of that is left.
        """
        upright = rotation_of(self.pose(replace(spot, tilt=UPRIGHT)))
        turned = rotation_of(self.pose(spot)) - upright
        nearer = float(np.linalg.norm(np.array(spot.normal) @ turned))
        return self._plan.clearance_mm * max(0.0, nearer - _LEFT)


def places_of(touches: Sequence[Pose], tip: ToolOffset) -> list[Vector]:
    """Return where a tip was at touches, base."""
    places = []
    for touch in touches:
        x, y, z = (
            np.array(touch.coordinates()[:3]) + rotation_of(touch) @ tip.components()[:3]
        ).tolist()
        places.append((x, y, z))
    return places


def proving_spots(over: OverPin, possible: Sequence[SurfaceSpot]) -> tuple[SurfaceSpot, ...]:
    """Return four of the possible spots, whose touches together show all of a drift best."""
    rows = [np.array(spot.normal) @ rotation_of(over.pose(spot.tilt, 0.0)) for spot in possible]
    chosen: list[int] = []

    def doubt(index: int) -> float:
        seen = np.array([rows[one] for one in (*chosen, index)])
        return float(np.trace(np.linalg.inv(seen.T @ seen + _FAINT * np.eye(3))))

    for _ in range(PROVING_TOUCHES):
        chosen.append(min((i for i in range(len(rows)) if i not in chosen), key=doubt))
    return tuple(possible[index] for index in sorted(chosen))


def verify_on_surface(
    plan: TouchPlan,
    *,
    over: OverPin,
    spots: Sequence[SurfaceSpot],
    tolerance_mm: float,
    u_mm: float,
) -> Procedure[VerifyResult]:
    """Have a known surface touched in tilts that were not measured in. Runs in the new tool.

    The tip starts lifted and upright. How far the person jogs beyond the place where the surface
    should have been shows, from all touches together, where the tip is beside where it was
    written to be. A drift too near to the tolerance is touched again at all spots, at most twice.
    It ends as it started.

    Args:
        plan: Lift, clearance, contact input.
        over: Where the tip is, lifted, in the frame in force.
        spots: What is touched.
        tolerance_mm: Largest drift that passes with its guard band, all directions together.
        u_mm: Standard uncertainty of what one touch shows.

    Raises:
        CalibrationError: ``not_tilted``, and ``not_touched`` or ``typed_ahead`` with the tip drawn
            back.
    """
    drive = SurfaceDrive(plan, over, SurfaceTouches(plan, limit_mm=tolerance_mm))
    proof = SurfaceProof(over.pose(UPRIGHT, 0.0), tolerance_mm, u_mm)
    said = tr("Jog the tip onto the surface again. We measure how far it was off.")
    for left in reversed(range(1 + MOST_MORE)):
        for spot in spots:
            found = yield from drive.touch(spot, key=len(proof.touches), instruction=said)
            proof.add(drive.pose(spot), found, spot.normal)
        if not left or not proof.undecided():
            break
        yield Notify(
            tr(
                "The tip is {drift:.3f} mm off, too near to the limit of {limit:.3f} mm. The "
                "surface is touched once more at every place; the mean counts.",
                drift=proof.drift().distance_mm,
                limit=tolerance_mm,
            )
        )
    yield from drive.to(UPRIGHT)
    return proof.result()
