"""Checks, over the looks of one run, that the spot in the camera moves as the tip does."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Final

from robolink.calibration import USUAL_CAMERA
from robolink.calibration.camera.known_movement import (
    CAMERA_SIGMA_MM,
    FOLLOWS_UNCALIBRATED,
    FOLLOWS_WITHIN,
    LEAST_SHARE,
    PIXEL_SIGMA,
    ROBOT_SIGMA_MM,
    CameraChangeRows,
    MovementVerdict,
    SeenMovement,
    camera_changed,
    same_radius,
    spot_changed,
    tip_did_not_move,
)
from robolink.errors import CalibrationError
from robolink.model import SpotUnit
from robolink.runner import SeenAt
from robolink.stations import CameraStation

_OF_A_MEDIAN: Final = 0.75
"""Scatter of the median of two or more pictures, as a share of that of one picture."""

_BEYOND_NOISE: Final = 5.0
"""Number of standard deviations that a spot must move to count as moving."""

_SHORTEST_MM: Final = 0.1
"""Shortest movement that is judged, in mm: over less, a camera error does no harm and cannot be
distinguished from chance."""


@dataclass(slots=True)
class SpotWatch:
    """Compares the movements of a spot with those of the robot, over the looks of one run.

    Attributes:
        station: Where the camera is, and what its pixels mean.
        calibrated: Whether that is to be believed; not where it is about to be found.
        longest_mm_per_px: The longest that a pixel may be where it is not known.
        pairs: The movements that were taken for good.
    """

    station: CameraStation
    calibrated: bool
    longest_mm_per_px: float = USUAL_CAMERA.most_mm_per_px
    pairs: list[SeenMovement] = field(default_factory=list)
    _scatters: list[float] = field(default_factory=list)
    _radii_px: dict[int, list[float]] = field(default_factory=dict)
    _looks: dict[tuple[int, float], SeenAt] = field(default_factory=dict)
    _play_mm: float = 0.0

    def expect_radius(self, mark: int, radius_px: float | None) -> None:
        """Take over the width of a spot from the measurement that is now tested."""
        if radius_px is not None:
            self._radii_px.setdefault(mark, []).append(radius_px)

    def heard(self, look: SeenAt) -> SeenAt:
        """Remember how much the pictures of a look scatter, and return the look."""
        if look.scatter is not None:
            self._scatters.append(look.scatter)
        return look

    def in_mm(self, look: SeenAt) -> bool:
        """Return whether the place in the base of something seen is known."""
        if look.unit is SpotUnit.BASE_MM:
            return True
        return self.calibrated and self.station.model is not None

    def movement(self, before: SeenAt, after: SeenAt) -> SeenMovement:
        """Return what the robot did between two looks, and what was seen of it."""
        known_mm = (after.x_mm - before.x_mm, after.y_mm - before.y_mm)
        noise = math.hypot(self._noise(before), self._noise(after))
        if self.in_mm(after):
            (x0, y0), (x1, y1) = self.station.base_mm(before), self.station.base_mm(after)
            return SeenMovement(known_mm, (x1 - x0, y1 - y0), math.hypot(noise, ROBOT_SIGMA_MM))
        moved = (after.spot.x - before.spot.x, after.spot.y - before.spot.y)
        return SeenMovement(known_mm, moved, noise)

    def follows(self, mark: int, before: SeenAt, after: SeenAt) -> bool:
        """Return whether a spot moved as the robot did, by all that is known of the camera.

        Args:
            mark: What was looked at.
            before: The look at the first place, in the same orientation.
            after: The look at the second.
        """
        movement = self.movement(before, after)
        if not self._same_thing(mark, before, after):
            return False
        if self.in_mm(after):
            verdict = movement.judged(self._rows(after), play_mm=self._play_mm)
            return verdict is MovementVerdict.AS_KNOWN
        return self._follows_in_pixels(movement)

    def known_before(self, mark: int, u_deg: float, look: SeenAt) -> SeenAt | None:
        """Return an earlier look at the same mark in the same orientation that is informative.

        ``None`` where there is none, where it was taken too near to this one, and where nobody
        knows yet what a pixel is: the fit of all looks compares those.
        """
        earlier = self._looks.get((mark, u_deg))
        if earlier is None or not self.in_mm(look):
            return None
        movement = self.movement(earlier, look)
        return earlier if movement.known_length_mm >= _SHORTEST_MM and movement.tells else None

    def keep(self, mark: int, u_deg: float, before: SeenAt, after: SeenAt) -> None:
        """Take a pair of looks for good.

        Args:
            mark: What was looked at.
            u_deg: U of the frame that was asked for.
            before: The look beside the place.
            after: The look at it.
        """
        self.pairs.append(self.movement(before, after))
        self._looks[mark, u_deg] = after
        for look in (before, after):
            if look.spot.radius_px is not None:
                self._radii_px.setdefault(mark, []).append(look.spot.radius_px)

    def learn_play(self, before: SeenAt, after: SeenAt) -> None:
        """Remember how far off a movement was because its places were approached from two sides."""
        movement = self.movement(before, after)
        off_mm = math.dist(movement.seen, movement.known_mm)
        # A larger difference was a false find, which is no reason to accept the next one.
        if self.in_mm(after) and off_mm <= FOLLOWS_WITHIN * movement.known_length_mm:
            self._play_mm = max(self._play_mm, off_mm)

    def stands_still(self, mark: int, before: SeenAt, after: SeenAt) -> bool:
        """Return whether no further picture is needed to refuse a spot that does not follow.

        Args:
            mark: What was looked at.
            before: The look at the first place, in the same orientation.
            after: The look at the second.
        """
        movement = self.movement(before, after)
        if not self._same_thing(mark, before, after):
            return True
        if self.in_mm(after):
            return movement.judged(self._rows(after), play_mm=0.0) is MovementVerdict.NONE
        return movement.seen_length < self._least_px(movement)

    def nearly_follows(self, before: SeenAt, after: SeenAt) -> bool:
        """Return whether a spot moved as the robot did but for what play of the joints explains."""
        if not self.in_mm(after):
            return False
        movement = self.movement(before, after)
        off_mm = math.dist(movement.seen, movement.known_mm)
        return off_mm <= FOLLOWS_WITHIN * movement.known_length_mm + 3 * movement.noise

    def moved_at_rest(self, look: SeenAt, now: SeenAt, known_mm: float) -> bool:
        """Return whether a spot moved between two looks of a robot that stood still.

        Args:
            look: The first look.
            now: The second.
            known_mm: The movement before the first look; a third of it counts.
        """
        moved = self.movement(look, now)
        if self.in_mm(now):
            least = LEAST_SHARE * known_mm
        else:
            least = LEAST_SHARE * known_mm / self.longest_mm_per_px
        return moved.seen_length >= max(least, _BEYOND_NOISE * moved.noise)

    def came_late(self, mark: int, before: SeenAt, look: SeenAt, now: SeenAt) -> bool:
        """Return whether a spot stood still while the robot moved, and moved likewise later.

        Args:
            mark: What was looked at.
            before: The look before the robot moved.
            look: The look after that.
            now: A later one at the same place.
        """
        return self.stands_still(mark, before, look) and self.follows(mark, before, now)

    def alike(self, one: tuple[SeenAt, SeenAt], other: tuple[SeenAt, SeenAt]) -> bool:
        """Return whether two movements in one direction were seen in the same way."""
        return self.movement(*one).like(self.movement(*other), within=FOLLOWS_WITHIN)

    def refusal(self, mark: int, wrong: Sequence[tuple[SeenAt, SeenAt]]) -> CalibrationError:
        """Return why a spot is not believed.

        Args:
            mark: What was looked at.
            wrong: Pairs of looks between which it did not move as the robot did, the last of them
                with all pictures and both places met from the same side.
        """
        before, after = wrong[-1]
        if not self._same_thing(mark, before, after):
            told = [after.spot.radius_px, before.spot.radius_px]
            usual_px = self._usual_px(mark)
            if usual_px is not None and not self._as_wide(mark, before):
                told.reverse()
            other_px = told[1] if usual_px is None else usual_px
            return spot_changed(told[0] or 0.0, other_px or 0.0)
        movements = [self.movement(*pair) for pair in wrong]
        last = movements[-1]
        if not self.in_mm(after):
            return tip_did_not_move(last, in_mm=False)
        # A camera that changed shows all movements wrong in the same manner, whatever their length;
        # and it cannot have changed by more than a tenth since it saw one rightly in this run. A
        # speck found in place of the tip in one of two pictures fits neither.
        off_mm = math.dist(last.seen, last.known_mm)
        near = off_mm <= FOLLOWS_WITHIN * last.known_length_mm + 3 * last.noise
        steady = (
            len(movements) > 1
            and all(one.like(last, within=FOLLOWS_WITHIN) for one in movements[:-1])
            and last.judged(self._rows(after), play_mm=0.0) is not MovementVerdict.NONE
            and (near or not any(pair.along(last) for pair in self.pairs))
        )
        return camera_changed(last) if steady else tip_did_not_move(last, in_mm=True)

    def require_followed(self, mm_per_px: Sequence[Sequence[float]]) -> None:
        """Refuse a camera that was just found if a spot did not move as it says.

        Args:
            mm_per_px: What a pixel is now known to be.

        Raises:
            CalibrationError: ``tip_did_not_move``.
        """
        (a, b), (c, d) = mm_per_px
        length = math.sqrt(abs(a * d - b * c))
        for pair in self.pairs:
            x, y = pair.seen
            known_mm, length_mm = pair.known_mm, pair.known_length_mm
            off_mm = math.dist((a * x + b * y, c * x + d * y), known_mm)
            chance_mm = 3 * math.hypot(pair.noise * length, ROBOT_SIGMA_MM)
            if off_mm > min(FOLLOWS_UNCALIBRATED * length_mm + chance_mm, length_mm / 2):
                raise tip_did_not_move(pair, in_mm=False)

    def _follows_in_pixels(self, movement: SeenMovement) -> bool:
        if movement.seen_length < self._least_px(movement):
            return False
        if not self.pairs:
            return True
        return movement.like(self.pairs[0], within=FOLLOWS_UNCALIBRATED)

    def _least_px(self, movement: SeenMovement) -> float:
        """Return the least pixels that a movement shows, before any camera is known."""
        least_px = LEAST_SHARE * movement.known_length_mm / self.longest_mm_per_px
        return max(least_px, _BEYOND_NOISE * movement.noise)

    def _same_thing(self, mark: int, *looks: SeenAt) -> bool:
        """Return whether spots are as wide as each other and as those of the run."""
        told = [look.spot.radius_px for look in looks if look.spot.radius_px is not None]
        alike = len(told) < len(looks) or same_radius(told[0], told[-1])
        return alike and all(self._as_wide(mark, look) for look in looks)

    def _rows(self, look: SeenAt) -> CameraChangeRows:
        model = self.station.model if look.unit is SpotUnit.PIXEL else None
        return CameraChangeRows(scale_sigma=0.0 if model is None else model.scale_sigma)

    def _noise(self, look: SeenAt) -> float:
        """Return the standard deviation of one coordinate of a look, mm or pixels."""
        found = median(self._scatters) if self._scatters else 0.0
        share = 1.0 if look.scatter is None else _OF_A_MEDIAN
        if look.unit is SpotUnit.BASE_MM:
            return share * max(found, CAMERA_SIGMA_MM)
        scale = 1.0
        if self.in_mm(look):
            scale = math.sqrt(abs(self.station.require_model().determinant))
        return share * max(found, PIXEL_SIGMA) * scale

    def _as_wide(self, mark: int, look: SeenAt) -> bool:
        usual_px, radius_px = self._usual_px(mark), look.spot.radius_px
        return usual_px is None or radius_px is None or same_radius(radius_px, usual_px)

    def _usual_px(self, mark: int) -> float | None:
        known = self._radii_px.get(mark)
        return median(known) if known else None
