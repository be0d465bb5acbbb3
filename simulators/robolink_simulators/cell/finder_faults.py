"""What a camera's finder takes for the tip although it is none, and how wide it finds a spot.

A fleck on the window, a lamp's reflection or a wrong circle stands still wherever the robot goes
(docs/camera-and-board.md, "A spot that stands still"). That a finder answers with one of these in
place of the tip was seen at real cells by others; how often is assumed.
"""

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass

from robolink_simulators.cell.places import Pixel


@dataclass(frozen=True, slots=True)
class FinderFaults:
    """A spot that stands still, and the radius of spots.

    Attributes:
        still_share: Share of the pictures in which the finder answers with a spot that stands
            still, and with nothing else; 1 is every one.
        still_from_picture: The first picture to which that share applies, counted from when the
            world was last set up.
        still_unseen: The still spot is found only where the picture shows no mark, in that share.
        still_beside_px, still_toward_deg: How far from the middle of the image it stands, and in
            which direction, from right to down.
        spot_radius_px: Half the width of a spot that is found; 0 for a finder that tells none.
        spot_swells_by: Share by which the radius grows.
        spot_swells_from_picture: From which picture on.
    """

    still_share: float = 0.0
    still_from_picture: int = 1
    still_unseen: bool = False
    still_beside_px: float = 0.0
    still_toward_deg: float = 0.0
    spot_radius_px: float = 0.0
    spot_swells_by: float = 0.0
    spot_swells_from_picture: int = 1


class Finder:
    """What the finder of one camera answers, picture by picture.

    Args:
        rng: Source of its errors; nothing is drawn while there are none.
    """

    def __init__(self, rng: random.Random) -> None:
        self._rng = rng
        self.faults = FinderFaults()
        self.pictures = 0

    def set_up(self, faults: FinderFaults) -> None:
        """Give it other faults; pictures count from now on."""
        self.faults, self.pictures = faults, 0

    def answers(
        self,
        found: Sequence[Pixel | None],
        *,
        size_px: tuple[int, int],
        noise_px: float,
        exposes: bool = True,
    ) -> tuple[Pixel | None, ...]:
        """Return what it answers in place of what it found of each mark.

        Args:
            found: Where each mark is, ``None`` for one that is not in the picture.
            size_px: Width and height of the image.
            noise_px: Standard deviation of a found place, per axis.
            exposes: Whether that is a new picture; not for a second search in the same.
        """
        faults = self.faults
        self.pictures += exposes
        if not self._stands_still(found):
            return tuple(found)
        toward, beside_px = math.radians(faults.still_toward_deg), faults.still_beside_px
        place = (
            size_px[0] / 2 + beside_px * math.cos(toward),
            size_px[1] / 2 + beside_px * math.sin(toward),
        )
        x, y = (self._rng.gauss(at, noise_px) for at in place)
        return ((x, y), *(None for _ in found[1:]))

    def radius_px(self) -> float | None:
        """Return how wide a spot is found in the last picture, ``None`` where it is not told."""
        faults = self.faults
        if not faults.spot_radius_px:
            return None
        swollen = self.pictures >= faults.spot_swells_from_picture
        grown = 1 + faults.spot_swells_by if swollen else 1.0
        return faults.spot_radius_px * grown + self._rng.gauss(0.0, _RADIUS_NOISE_PX)

    def _stands_still(self, found: Sequence[Pixel | None]) -> bool:
        faults = self.faults
        if not faults.still_share or self.pictures < faults.still_from_picture:
            return False
        if faults.still_unseen and any(pixel is not None for pixel in found):
            return False
        return faults.still_share >= 1 or self._rng.random() < faults.still_share


_RADIUS_NOISE_PX = 0.05
"""Standard deviation of a found radius (assumed)."""
