"""An up-looking camera as it really is, and what its picture shows.

A pinhole: lengths at the height of focus have the stated scale, and things above it look
smaller. A lens that leans sees the plane askew, and things above or below it beside where they
are. The finder errs by Gaussian noise, now and then by much more, and now and then finds nothing;
or it answers with a fleck on the window, a reflection or a wrong circle, which stands still
wherever the robot goes (docs/reference/cameras.md 3; how often is assumed).
"""

import math
import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from robolink.model import ToolOffset, rotate_xy
from robolink_simulators.cell.frames import Frame, printed_angles, zyx
from robolink_simulators.cell.places import Pixel, XyzMm

LENS_MM: Final = 120.0
"""Distance from the lens to the plane of focus, in mm (assumed)."""

_DEPTH_MM: Final = 2.0
"""Depth of field on each side of the plane of focus, in mm (assumed). Marks outside it are not
found.
"""

_RADIUS_NOISE_PX: Final = 0.05
"""Standard deviation of a measured radius, in pixels (assumed)."""


@dataclass(frozen=True, slots=True)
class CameraOptics:
    """What a camera does to a place.

    Attributes:
        um_per_px_x, um_per_px_y: Length of a pixel along the image's two axes, at focus.
        turn_deg: Direction of the image's first axis in the base.
        shear_deg: By how much the second axis is off a right angle.
        mirrored: Whether the image is mirrored against the base seen from above.
        tilt_deg: By how much the lens leans.
        tilt_toward_deg: Toward which direction of the base.
        noise_px: Standard deviation of a found place, per axis.
        outlier_share: Share of the places that are wrong by ``outlier_px``.
        outlier_px: By how much those are wrong, in any direction.
        miss_share: Share of the pictures in which nothing is found.
        size_px: Width and height of the image.
    """

    um_per_px_x: float = 20.0
    um_per_px_y: float = 20.0
    turn_deg: float = 3.0
    shear_deg: float = 0.0
    mirrored: bool = True
    tilt_deg: float = 0.0
    tilt_toward_deg: float = 0.0
    noise_px: float = 0.1
    outlier_share: float = 0.0
    outlier_px: float = 40.0
    miss_share: float = 0.0
    size_px: tuple[int, int] = (1280, 1024)

    @property
    def mm_per_px(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The matrix from pixels to the base at focus, for a lens that does not lean."""
        first, second = (math.radians(self.turn_deg + at) for at in (0.0, 90.0 + self.shear_deg))
        sx, sy = self.um_per_px_x / 1000, self.um_per_px_y / 1000
        if self.mirrored:
            sy = -sy
        return (
            (sx * math.cos(first), sy * math.cos(second)),
            (sx * math.sin(first), sy * math.sin(second)),
        )

    def pixel(self, dx: float, dy: float, dz: float) -> Pixel | None:
        """Return where a place shows, seen from the middle of the focus, mm; ``None`` if nowhere.

        Args:
            dx: From the point of the base that the middle of the image looks at, along X.
            dy: Along Y.
            dz: Above it.
        """
        if abs(dz) > _DEPTH_MM:
            return None
        px, py = self.image_of(dx, dy, dz)
        width, height = self.size_px
        return (px, py) if 0 <= px <= width and 0 <= py <= height else None

    def image_of(self, dx: float, dy: float, dz: float) -> Pixel:
        """Return the same wherever it is, in focus and in the picture or not.

        (0, 0) is the corner of the first pixel; its middle is (0.5, 0.5).
        """
        toward = math.radians(self.tilt_toward_deg)
        along_x, along_y = math.cos(toward), math.sin(toward)
        lean = math.radians(self.tilt_deg)
        # Along the lean, across it, and along the axis of the lens.
        out, across = dx * along_x + dy * along_y, dy * along_x - dx * along_y
        out, up = (
            out * math.cos(lean) - dz * math.sin(lean),
            out * math.sin(lean) + dz * math.cos(lean),
        )
        shrunk = LENS_MM / (LENS_MM + up)
        out, across = out * shrunk, across * shrunk
        x, y = out * along_x - across * along_y, out * along_y + across * along_x
        (a, b), (c, d) = self.mm_per_px
        area = a * d - b * c
        width, height = self.size_px
        return (d * x - b * y) / area + width / 2, (a * y - c * x) / area + height / 2


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
    """The answers of one camera's finder, picture by picture.

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
        """Return its answers in place of what it found of each mark.

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
        """Return the spot width found in the last picture, ``None`` if it is not reported."""
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


@dataclass(slots=True)
class CameraTruth:
    """A camera in the cell.

    Attributes:
        middle_mm: Point of the base that the middle of the image looks at, in focus.
        optics: What it does to a place.
        rng: Source of its errors.
        moved_mm: How far it has been moved from there since, X and Y of the base.
        finder: What looks for marks in its pictures.
    """

    middle_mm: XyzMm
    optics: CameraOptics
    rng: random.Random
    moved_mm: tuple[float, float] = (0.0, 0.0)
    finder: Finder = field(init=False)

    def __post_init__(self) -> None:
        """Let the finder's errors come from the same source."""
        self.finder = Finder(self.rng)

    def picture(self, places: Iterable[XyzMm]) -> tuple[Pixel, ...]:
        """Return where the finder finds each of some places in the image."""
        return tuple(pixel for pixel in self.finds(places) if pixel is not None)

    def finds(self, places: Iterable[XyzMm], *, exposes: bool = True) -> tuple[Pixel | None, ...]:
        """Return for each of some places where the finder finds it, ``None`` if it does not.

        Args:
            places: Where the marks are.
            exposes: Whether that is a new picture; not for a second search in the same.
        """
        optics, rng = self.optics, self.rng
        missed = rng.random() < optics.miss_share
        found = list[Pixel | None]()
        for place in places:
            pixel = optics.pixel(*self.beside(place))
            found.append(None if pixel is None or missed else self._found(pixel))
        return self.finder.answers(
            found, size_px=optics.size_px, noise_px=optics.noise_px, exposes=exposes
        )

    def beside(self, place: XyzMm) -> XyzMm:
        """Return where a place is, seen from the point that the camera looks at now, mm."""
        (x, y, z), (dx, dy) = self.middle_mm, self.moved_mm
        return place[0] - x - dx, place[1] - y - dy, place[2] - z

    def _found(self, pixel: Pixel) -> Pixel:
        optics, rng = self.optics, self.rng
        x, y = (rng.gauss(at, optics.noise_px) for at in pixel)
        if rng.random() < optics.outlier_share:
            way = rng.uniform(0.0, math.tau)
            x, y = x + optics.outlier_px * math.cos(way), y + optics.outlier_px * math.sin(way)
        return x, y


DRAWING_MM: Final = ((20.0, 12.5), (-20.0, 12.5), (-20.0, -12.5), (20.0, -12.5))
"""Fiducials of the simulated board in mm: the corners of a rectangle about its centre."""


@dataclass(frozen=True, slots=True)
class SimulatedBoard:
    """A board at the tip of a nozzle.

    Attributes:
        shift_mm: From the nozzle's tip to the board's middle, in the nozzle's axes.
        turn_deg: By how much the board is turned against the nozzle.
        drawing_mm: Its fiducials, about its middle.
    """

    shift_mm: tuple[float, float]
    turn_deg: float
    drawing_mm: tuple[tuple[float, float], ...] = DRAWING_MM

    @classmethod
    def grasped(cls, rng: random.Random) -> "SimulatedBoard":
        """Return a board as a nozzle takes it up: some tenths of a mm, and a degree, off."""
        x_mm, y_mm = (round(rng.uniform(-0.5, 0.5), 4) for _ in range(2))
        return cls((x_mm, y_mm), round(rng.uniform(-1.5, 1.5), 4))

    def frame(self, tip: ToolOffset) -> ToolOffset:
        """Return the board's frame on the flange, for a nozzle with its tip there."""
        return _moved(tip, (*self.shift_mm, 0.0), self.turn_deg)

    def fiducials(self, tip: ToolOffset) -> tuple[ToolOffset, ...]:
        """Return where the fiducials are on the flange."""
        frame = self.frame(tip)
        return tuple(_moved(frame, (x, y, 0.0), 0.0) for x, y in self.drawing_mm)


def _moved(tip: ToolOffset, by_mm: XyzMm, turn_deg: float) -> ToolOffset:
    """Return the frame that is shifted in a tool's own axes and turned about its Z."""
    if not tip.v_deg and not tip.w_deg:
        dx, dy = rotate_xy(*by_mm[:2], tip.u_deg)
        return replace(tip, x_mm=tip.x_mm + dx, y_mm=tip.y_mm + dy, u_deg=tip.u_deg + turn_deg)
    x_mm, y_mm, z_mm, u_deg, v_deg, w_deg = tip.components()
    there = Frame((x_mm, y_mm, z_mm), zyx(u_deg, v_deg, w_deg)) @ Frame(by_mm, zyx(turn_deg, 0, 0))
    return ToolOffset(*there.shift_mm, *printed_angles(there.rotation))
