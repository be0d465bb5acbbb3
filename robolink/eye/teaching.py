"""What a camera learns from one picture that a person confirms, and from one known movement."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.errors import CalibrationError
from robolink.eye.candidate import Candidate
from robolink.eye.picture import CameraPicture
from robolink.eye.source import PictureSource
from robolink.messages import tr
from robolink.timing import NS_PER_S, Clock

__all__ = ["LagSeen", "MovedSpot", "PictureLag", "exposed_well", "lag_after", "nearest_to"]

BRIGHTEST: Final = 215.0
"""Grey level to which the brightest part of a picture is brought; 255 is saturated."""

_ENOUGH: Final = (160.0, 240.0)
_BRIGHT_SHARE: Final = 99.0
"""Percentile that stands for the brightest part: a glint is smaller than a hundredth."""

_MOST_EXPOSURES: Final = 6
_LARGEST_STEP: Final = 8.0

_AGREE_PX: Final = 1.0
_LEAST_MOVE_PX: Final = 4.0
"""Least movement of a spot that is no scatter of the finder, in pixels."""

_MOST_LATE: Final = 200
_LAG_MARGIN_S: Final = 0.05

_BACK_SHARE: Final = 0.10
_DIAMETER_SHARE: Final = 0.20


def exposed_well(source: PictureSource) -> CameraPicture:
    """Take pictures until the exposure is right, and return the last of them.

    The brightest hundredth of a picture is brought to 215 of 255 grey levels, in at most six
    pictures. A source whose exposure nobody can read stays as it is.

    Args:
        source: The camera.

    Raises:
        CalibrationError: As :meth:`~robolink.eye.source.PictureSource.take`.
    """
    picture = source.take()
    for _ in range(_MOST_EXPOSURES - 1):
        exposure_us, bright = source.exposure_us, _brightness(picture)
        if exposure_us is None or _ENOUGH[0] <= bright <= _ENOUGH[1]:
            break
        # A saturated picture does not tell by how much.
        by = 0.25 if bright >= _ENOUGH[1] else BRIGHTEST / max(bright, 1.0)
        by = min(max(by, 1 / _LARGEST_STEP), _LARGEST_STEP)
        source.expose(exposure_us * by)
        if source.exposure_us == exposure_us:  # it is at its end, or takes no orders
            break
        picture = source.take()
    return picture


def _brightness(picture: CameraPicture) -> float:
    import numpy as np

    return float(np.percentile(picture.grey, _BRIGHT_SHARE))


def nearest_to(
    x_px: float, y_px: float, candidates: Sequence[Candidate], *, within_px: float
) -> Candidate | None:
    """Return the accepted candidate that is nearest to a place; ``None`` for none near enough."""

    def apart(one: Candidate) -> float:
        return math.hypot(one.x_px - x_px, one.y_px - y_px)

    near = [one for one in candidates if one.accepted and apart(one) <= within_px]
    return min(near, key=apart, default=None)


@dataclass(frozen=True, slots=True)
class LagSeen:
    """How late a camera showed a movement.

    Attributes:
        lag_s: From the end of the movement until the question that was answered with the first
            picture of the new place.
        pictures: How many pictures before that one still showed another place.
        spot: The tip at the new place.
    """

    lag_s: float
    pictures: int
    spot: Candidate


def lag_after(
    look: Callable[[], Sequence[Candidate]],
    before: Candidate,
    *,
    clock: Clock,
    stopped_ns: int,
    patience_s: float = 10.0,
) -> LagSeen:
    """Take pictures until two in a row show the tip at a new place, and return how late that was.

    One picture is not enough: it may have been exposed while the robot still moved.

    Args:
        look: Takes a picture and returns all that may be a tip in it.
        before: The tip where it was before the movement.
        clock: What the time is read on.
        stopped_ns: When the movement had ended.
        patience_s: How long pictures of the old place are taken.

    Raises:
        CalibrationError: ``tip_did_not_move``: what was confirmed stays where it was;
            ``tip_not_seen``: nothing is found after the movement; and those of ``look``.
    """
    earlier: tuple[Candidate, float, int] | None = None
    seen, taken = False, 0
    while taken < _MOST_LATE:
        asked_s = (clock.now_ns() - stopped_ns) / NS_PER_S
        if taken and asked_s > patience_s:
            break
        accepted = [one for one in look() if one.accepted]
        spot = accepted[0] if len(accepted) == 1 else None
        seen = seen or spot is not None
        if spot is None or _apart_px(spot, before) < _LEAST_MOVE_PX:
            earlier = None
        elif earlier is not None and _apart_px(spot, earlier[0]) <= _AGREE_PX:
            return LagSeen(earlier[1], earlier[2], spot)
        else:
            earlier = spot, asked_s, taken
        taken += 1
    if not seen:
        raise CalibrationError(
            "tip_not_seen",
            tr("After the small movement the camera does not see the tip any more."),
            remedy=tr("Jog the tip to the middle of the picture and begin again."),
        )
    raise CalibrationError(
        "tip_did_not_move",
        tr(
            "What was confirmed does not move with the robot: after {seconds:.1f} s and {count} "
            "pictures it is still in the same place.",
            seconds=(clock.now_ns() - stopped_ns) / NS_PER_S,
            count=taken,
        ),
        remedy=tr(
            "Look at the picture: a fleck on the window, a reflection, a wrong circle. If the "
            "picture is of before the movement, restart the camera's program."
        ),
    )


@dataclass(frozen=True, slots=True)
class PictureLag:
    """How old a picture of a camera may be.

    Attributes:
        seconds: How long after a movement a picture may still be of before; waited before a look.
        pictures: How many pictures after a movement are still of before, however long it waited:
            a server that hands out what it had.
    """

    seconds: float
    pictures: int

    @classmethod
    def of(cls, at_once: LagSeen, waited: LagSeen) -> "PictureLag":
        """Return what two movements tell.

        Args:
            at_once: After the one, pictures were taken at once.
            waited: After the other they were taken when as much time had passed as the first
                needed. Pictures that are late in time are all of the new place then; those that
                are late by their number are as late as before.
        """
        if waited.pictures and waited.pictures >= at_once.pictures:
            return cls(0.0, waited.pictures)
        seconds = at_once.lag_s + _LAG_MARGIN_S if at_once.pictures else 0.0
        return cls(math.ceil(seconds * 1000) / 1000, waited.pictures)


def _apart_px(one: Candidate, other: Candidate) -> float:
    return math.hypot(one.x_px - other.x_px, one.y_px - other.y_px)


@dataclass(frozen=True, slots=True)
class MovedSpot:
    """What a movement there and back showed.

    Attributes:
        before, there, back: The tip at the three places.
        moved_mm: How far the robot moved.
    """

    before: Candidate
    there: Candidate
    back: Candidate
    moved_mm: float

    @property
    def mm_per_px(self) -> float:
        """Length of a pixel, along the movement."""
        return self.moved_mm / _apart_px(self.before, self.there)

    @property
    def diameter_mm(self) -> float:
        """What the confirmed circle is wide."""
        return 2 * self.before.radius_px * self.mm_per_px

    def require_consistent(self, diameter_mm: float | None) -> None:
        """Check that the tip came back, and that it is as wide as it is said to be.

        Args:
            diameter_mm: What the cell file states; ``None`` for nothing.

        Raises:
            CalibrationError: ``tip_did_not_move``: what was confirmed did not come back;
                ``spot_changed``: it has another diameter than the cell file states.
        """
        way_px, off_px = _apart_px(self.before, self.there), _apart_px(self.before, self.back)
        if off_px > max(_AGREE_PX, _BACK_SHARE * way_px):
            raise CalibrationError(
                "tip_did_not_move",
                tr(
                    "The robot went back, and what was confirmed is {off:.1f} px from where it "
                    "was; it had moved by {way:.1f} px.",
                    off=off_px,
                    way=way_px,
                ),
                remedy=tr("Look at the picture; check that nothing else moves or is loose."),
            )
        found_mm = self.diameter_mm
        if diameter_mm is not None and abs(found_mm / diameter_mm - 1) > _DIAMETER_SHARE:
            raise CalibrationError(
                "spot_changed",
                tr(
                    "The confirmed circle is {found:.2f} mm wide; the cell file says "
                    "diameter_mm = {stated:g}.",
                    found=found_mm,
                    stated=diameter_mm,
                ),
                remedy=tr("Confirm the rim of the face, not another edge; or correct diameter_mm."),
            )
