"""What the drawn pictures of a camera are like, and what goes wrong with them.

The same whether they are served by HTTP, as files or as a GigE camera; see
:mod:`robolink_simulators.pictures`. All of it is assumed (docs/reference/simulated-cell.md 4).
"""

from dataclasses import dataclass
from typing import Literal

FleckShape = Literal["none", "disc", "ring", "lamps", "tip"]
"""What stands still in the pictures: a speck on the window, a circle, a ring of lamps, or the
reflection of a tip, with a bore.
"""

Stuck = Literal["no", "same", "noisy"]
"""Whether pictures repeat an old one: byte for byte, or with new noise."""

MarkShape = Literal["round", "cross", "aruco"]
"""The fiducials of a board: round pads, crosses, or ArUco markers of the dictionary 4x4_50."""


@dataclass(frozen=True, slots=True)
class PictureFaults:
    """What is wrong with some of the pictures.

    Attributes:
        exposure: How bright they are: 1 as they should be, 0.03 dark, 30 overexposed.
        defocus_mm: By how much more everything is out of focus than its height says.
        stuck: Whether they repeat the last one before.
        late: How many pictures old each one is.
        late_s: How many simulated seconds old each one is.
        fleck: What stands still in them.
        fleck_radius_px: Half its width.
        fleck_beside_px, fleck_toward_deg: How far from the middle of the image it is, and in which
            direction, from right to down.
        tip_hidden: Whether the tip is not to be seen in them.
        halved: Whether only the first half of each picture is delivered.
        gone: Whether the camera answers nothing.
        slow_s: How many real seconds it takes to answer.
        from_picture: The first picture to which this applies, counted from when the world was last
            set up.
        count: To how many pictures it applies; 0 for all that follow.
    """

    exposure: float = 1.0
    defocus_mm: float = 0.0
    stuck: Stuck = "no"
    late: int = 0
    late_s: float = 0.0
    fleck: FleckShape = "none"
    fleck_radius_px: float = 25.0
    fleck_beside_px: float = 0.0
    fleck_toward_deg: float = 0.0
    tip_hidden: bool = False
    halved: bool = False
    gone: bool = False
    slow_s: float = 0.0
    from_picture: int = 1
    count: int = 0

    def at(self, number: int) -> "PictureFaults":
        """Return what is wrong with the picture of a number, counted from 1."""
        over = self.count and number >= self.from_picture + self.count
        return NO_FAULTS if number < self.from_picture or over else self


NO_FAULTS = PictureFaults()
"""Nothing."""


@dataclass(frozen=True, slots=True)
class PictureLook:
    """What is the same in all pictures of a camera.

    Attributes:
        blur_px: Standard deviation of the blur of the lens in focus.
        aperture_mm: Width of the lens's opening, which blurs what is out of focus.
        noise_grey: Standard deviation of the noise, in grey levels.
        clutter: How many blurred things are in the background.
        glare: How bright the reflections of the lamps on the face are, as a share of it.
    """

    blur_px: float = 0.7
    aperture_mm: float = 20.0
    noise_grey: float = 2.0
    clutter: int = 3
    glare: float = 0.2
