"""What is before a camera at one instant: where in its picture everything is, and how far off.

Taken in microseconds while the controller stands still for it; drawn later, by
:mod:`robolink_simulators.pictures.drawing`.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from robolink.model import ToolOffset
from robolink_simulators.cell.camera import LENS_MM, CameraTruth
from robolink_simulators.cell.frames import add, cross, scale
from robolink_simulators.cell.picture_settings import MarkShape
from robolink_simulators.cell.places import Direction, Pixel, XyzMm, axis_of
from robolink_simulators.cell.tip_looks import TipLook
from robolink_simulators.cell.workplace import MOUNTED_TOOL, Workplace

_PROBE_MM = 0.5
"""Half the length over which the scale of the picture at a place is taken."""

_HIDDEN_BELOW_MM = 20.0
"""Things nearer to the lens than this are not drawn: they would fill the picture (assumed)."""


@dataclass(frozen=True, slots=True)
class Placed:
    """A plane piece of something, and where it is in the picture.

    Attributes:
        at_px: Its middle; (0, 0) is the corner of the first pixel.
        axes_px: Pixels per mm along its own X and Y: columns of a matrix.
        above_mm: How far above the plane of focus it is.
    """

    at_px: Pixel
    axes_px: tuple[tuple[float, float], tuple[float, float]]
    above_mm: float

    @property
    def px_per_mm(self) -> float:
        """The mean scale."""
        (a, b), (c, d) = self.axes_px
        return math.sqrt(abs(a * d - b * c))

    @property
    def mm_per_px(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The inverse of ``axes_px``: from pixels about its middle to its own X and Y."""
        (a, b), (c, d) = self.axes_px
        area = a * d - b * c
        return ((d / area, -b / area), (-c / area, a / area))


@dataclass(frozen=True, slots=True)
class SeenTip:
    """One tip, with what is above it.

    Attributes:
        face: Its end.
        look: How it looks.
        rings: What is above it, the highest first: where, and its radius in mm.
    """

    face: Placed
    look: TipLook
    rings: tuple[tuple[Placed, float], ...]


@dataclass(frozen=True, slots=True)
class SeenBoard:
    """A held board.

    Attributes:
        middle: Its middle.
        half_mm: Half its width and height.
        marks: Its fiducials.
        mark: What they look like.
        mark_mm: How wide they are.
    """

    middle: Placed
    half_mm: tuple[float, float]
    marks: tuple[Placed, ...]
    mark: MarkShape
    mark_mm: float


@dataclass(frozen=True, slots=True)
class DrawnScene:
    """All that a camera sees at one instant.

    Attributes:
        size_px: Width and height of the picture.
        um_per_px: Length of a pixel, for the blur.
        tips: The tips.
        board: The board, which hides the tip that holds it.
    """

    size_px: tuple[int, int]
    um_per_px: float
    tips: tuple[SeenTip, ...] = ()
    board: SeenBoard | None = None
    taken_ns: int = field(default=0, compare=False)


def scene_of(world: Workplace, now_ns: int = 0) -> DrawnScene:
    """Return what the camera of a world sees now.

    Args:
        world: Advanced to the present, and held by the caller.
        now_ns: The present, for the record.
    """
    camera = world.camera
    optics = camera.optics
    um_per_px = math.sqrt(optics.um_per_px_x * optics.um_per_px_y)
    tips = tuple(_tips(world)) if world.board is None else ()
    return DrawnScene(optics.size_px, um_per_px, tips, _board(world), now_ns)


def _tips(world: Workplace) -> Iterator[SeenTip]:
    for tool in world.tips:
        yield from _tip(world, tool, world.seen_tip_mm(tool))
    second_mm = world.second_tip_mm()
    if second_mm is not None:
        yield from _tip(world, MOUNTED_TOOL, second_mm)


def _tip(world: Workplace, tool: int, at_mm: XyzMm) -> Iterator[SeenTip]:
    tip, look = world.tips.get(tool, ToolOffset()), world.look_of(tool)
    x, z = world.axis("x", tool), world.axis("z", tool)
    face = _placed(world.camera, at_mm, x, cross(z, x))
    if face is None:
        return
    # Z of a tool points up its shank, or out of it where the tip is beyond the flange.
    up = -1.0 if tip.z_mm > 0 else 1.0
    lean_x, lean_y = world.lean_of(tool)
    rings = list[tuple[Placed, float]]()
    for share in (2.0, 1.5, 1.0, 0.75, 0.5, 0.25):
        height_mm = look.cone_mm * share
        along = world.robot.turned((lean_x * height_mm, lean_y * height_mm, 0.0))
        there = add(add(at_mm, scale(z, up * height_mm)), along)
        radius_mm = look.radius_mm + (look.shank_mm - look.radius_mm) * min(1.0, share)
        ring = _placed(world.camera, there, x, cross(z, x))
        if ring is not None:
            rings.append((ring, radius_mm))
    yield SeenTip(face, look, tuple(rings))


def _board(world: Workplace) -> SeenBoard | None:
    board = world.board
    if board is None:
        return None
    nozzle = world.tips.get(MOUNTED_TOOL, ToolOffset())
    middle = _on_flange(world, board.frame(nozzle))
    marks = tuple(it for at in board.fiducials(nozzle) if (it := _on_flange(world, at)) is not None)
    if middle is None:
        return None
    half_mm = tuple(max(abs(at[axis]) for at in board.drawing_mm) + 5.0 for axis in (0, 1))
    said = world.parameters
    return SeenBoard(middle, (half_mm[0], half_mm[1]), marks, said.board_mark, said.board_mark_mm)


def _on_flange(world: Workplace, frame: ToolOffset) -> Placed | None:
    x, z = (world.robot.turned(axis_of(frame, axis)) for axis in ("x", "z"))
    return _placed(world.camera, world.robot.tip_mm(frame), x, cross(z, x))


def _placed(camera: CameraTruth, at_mm: XyzMm, x: Direction, y: Direction) -> Placed | None:
    if camera.beside(at_mm)[2] < _HIDDEN_BELOW_MM - LENS_MM:
        return None

    def image_of(place: XyzMm) -> Pixel:
        return camera.optics.image_of(*camera.beside(place))

    def along(axis: Direction) -> Pixel:
        ahead, behind = (image_of(add(at_mm, scale(axis, by))) for by in (_PROBE_MM, -_PROBE_MM))
        return ahead[0] - behind[0], ahead[1] - behind[1]

    (a, c), (b, d) = along(x), along(y)
    if abs(a * d - b * c) < 1e-9:  # seen from the side, edge on
        return None
    over = 2 * _PROBE_MM
    axes = ((a / over, b / over), (c / over, d / over))
    return Placed(image_of(at_mm), axes, camera.beside(at_mm)[2])
