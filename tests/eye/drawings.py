"""Drawings of tips from below, with their truth, on numpy alone.

Written beside, and not after, the ones with which the finder's limits were chosen: other faces,
lamps, backgrounds and other things that are no tips. ``drawing(seed)`` gives one; its kind follows
from the seed, everything else is drawn from it.
"""

import io
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

Array = Any

SIZE: Final = (640, 480)


@dataclass(frozen=True)
class Tip:
    """Where one was drawn.

    Attributes:
        x_px, y_px, radius_px: The outer edge of its face.
    """

    x_px: float
    y_px: float
    radius_px: float


@dataclass(frozen=True)
class Drawing:
    """A picture with its truth.

    Attributes:
        kind: What is difficult about it.
        grey: The picture.
        radius_px: Radius of its tips; of what would have been one where there is none.
        tips: What has to be found.
    """

    kind: str
    grey: Array
    radius_px: float
    tips: tuple[Tip, ...] = ()


class Canvas:
    """A picture in the making: grey levels as floats, and the dice."""

    def __init__(self, rng: Any, grey: Array, x: Array, y: Array):
        self.rng, self.grey, self.x, self.y = rng, grey, x, y
        self.height, self.width = grey.shape

    @classmethod
    def blank(cls, seed: int, size: tuple[int, int]) -> "Canvas":
        """Return a black one, its dice thrown anew."""
        width, height = size
        y, x = np.mgrid[0:height, 0:width].astype(np.float32)
        return cls(np.random.default_rng(seed), np.zeros((height, width), np.float32), x, y)

    def near(self, x: float, y: float, reach: float) -> "Canvas":
        """Return the part of it around a point, on the same pixels and with the same dice."""
        rows = slice(max(0, int(y - reach)), max(1, int(y + reach) + 2))
        columns = slice(max(0, int(x - reach)), max(1, int(x + reach) + 2))
        part = (rows, columns)
        return Canvas(self.rng, self.grey[part], self.x[part], self.y[part])

    def around(self, x: float, y: float) -> tuple[Array, Array]:
        """Return distance and angle of every pixel from a point."""
        dx, dy = self.x - np.float32(x), self.y - np.float32(y)
        return np.hypot(dx, dy), np.arctan2(dy, dx)

    def lay(self, level: Array | float, cover: Array) -> None:
        """Lay something on what is there."""
        self.grey += cover * (level - self.grey)


def soft(distance: Array, edge: Array | float, px: float = 0.6) -> Array:
    """Return the share of a pixel inside an edge."""
    return np.clip(0.5 - (distance - edge) / (2 * px), 0, 1)


def blurred(grey: Array, sigma: float) -> Array:
    """Return it blurred by a bell."""
    if sigma < 0.2:
        return grey
    half = math.ceil(3 * sigma)
    bell = np.exp(-0.5 * (np.arange(-half, half + 1) / sigma) ** 2).astype(np.float32)
    bell /= bell.sum()
    for _ in range(2):
        wide = np.pad(grey, ((half, half), (0, 0)), mode="edge")
        out = np.zeros_like(grey)
        for i, weight in enumerate(bell):
            out += weight * wide[i : i + len(grey)]
        grey = np.ascontiguousarray(out.T)
    return grey


def grain(canvas: Canvas, across: float, along: float, angle: float) -> Array:
    """Return brushed metal: noise that is long in one direction, of standard deviation 1."""
    rng = canvas.rng
    u = canvas.x * math.cos(angle) + canvas.y * math.sin(angle)
    v = -canvas.x * math.sin(angle) + canvas.y * math.cos(angle)
    table = rng.normal(0, 1, (257, 257)).astype(np.float32)
    out = sampled(table, u / along, v / across)
    return (out - out.mean()) / (out.std() + 1e-6)


def sampled(table: Array, u: Array, v: Array) -> Array:
    """Return a table that repeats itself, between its places by straight lines."""
    rows, columns = table.shape
    i, j = np.floor(u).astype(int), np.floor(v).astype(int)
    f, g = u - i, v - j
    i0, i1, j0, j1 = i % columns, (i + 1) % columns, j % rows, (j + 1) % rows
    upper = table[j0, i0] * (1 - f) + table[j0, i1] * f
    lower = table[j1, i0] * (1 - f) + table[j1, i1] * f
    return upper * (1 - g) + lower * g


def waves(canvas: Canvas, angle: Array, amplitude: float, knots: tuple[int, int]) -> Array:
    """Return a random function of the angle with so many knots on the way round."""
    count = int(canvas.rng.integers(*knots))
    values = canvas.rng.normal(0, amplitude, count)
    at = (angle + math.pi) / (2 * math.pi) * count
    low = np.floor(at).astype(int)
    share = at - low
    share = share * share * (3 - 2 * share)
    return values[low % count] * (1 - share) + values[(low + 1) % count] * share


def ground(canvas: Canvas) -> None:
    """Draw what is behind everything: plain, a gradient, brushed plate, or blots."""
    rng = canvas.rng
    canvas.grey += rng.uniform(5, 70)
    how = rng.integers(4)
    if how == 1:
        q = rng.uniform(0, 6.3)
        slope = rng.uniform(20, 90)
        canvas.grey += slope * (
            math.cos(q) * canvas.x / canvas.width + math.sin(q) * canvas.y / canvas.height
        )
    elif how == 2:
        canvas.grey += rng.uniform(2, 10) * grain(canvas, 2.5, 60, rng.uniform(0, 3.1))
    elif how == 3:
        for _ in range(rng.integers(1, 5)):
            far, _ = canvas.around(rng.uniform(0, canvas.width), rng.uniform(0, canvas.height))
            canvas.grey += rng.uniform(-30, 60) * np.exp(-((far / rng.uniform(30, 160)) ** 2))


def body(canvas: Canvas, x: float, y: float, r: float) -> None:
    """Draw what is behind a face: a hexagon or a shank, with a cone of turned steps."""
    rng, canvas = canvas.rng, canvas.near(x, y, 5.2 * r + 12)
    far, angle = canvas.around(x + rng.uniform(-0.1, 0.1) * r, y + rng.uniform(-0.1, 0.1) * r)
    outer = r * rng.uniform(2.6, 4.2)
    if rng.random() < 0.5:
        turn = rng.uniform(0, 1.05)
        flat = np.cos(np.mod(angle - turn, math.pi / 3) - math.pi / 6)
        plate = rng.uniform(40, 190) + rng.uniform(0, 14) * grain(
            canvas, 2.0, rng.uniform(2, 25), rng.uniform(0, 3.1)
        )
        canvas.lay(plate, soft(far * flat, outer, 2.5))
        outer *= rng.uniform(0.72, 0.85)
    level = rng.uniform(8, 85)
    canvas.lay(
        level * (1 + rng.uniform(-0.3, 0.3) * np.cos(angle - rng.uniform(0, 6.3))),
        soft(far, outer, 4.0),
    )
    if rng.random() < 0.5:  # the marks of turning, out of focus towards the outside
        pitch = r * rng.uniform(0.12, 0.3)
        canvas.lay(
            level * (1 + 0.25 * np.sin(2 * math.pi * far / pitch)),
            soft(far, outer * 0.95, 6.0) * (1 - soft(far, r * 1.25, 0.2 * r)) * 0.6,
        )


@dataclass
class Face:
    """How a face is drawn.

    Attributes:
        level, bore: Grey levels of the face and of its hole.
        ratio: Radius of the hole as a share of the face's.
        jag: How far its edge is from round, as a share of the radius.
        grain: Grey levels of its texture.
        turned: Whether the texture runs round.
        slant_deg: How far it leans.
        aside: How far the hole is beside the middle, as a share of the radius.
        chamfer: Where a second, duller step begins, as a share; 1 for none.
        scratches, drops: How many.
        shade: How much brighter one side is.
    """

    level: float
    bore: float
    ratio: float
    jag: float = 0.002
    grain: float = 2.0
    turned: bool = False
    slant_deg: float = 1.0
    aside: float = 0.01
    chamfer: float = 1.0
    scratches: int = 0
    drops: int = 0
    shade: float = 0.15


def face(canvas: Canvas, x: float, y: float, r: float, how: Face) -> Tip:
    """Draw a face with its hole; return the truth."""
    rng, canvas = canvas.rng, canvas.near(x, y, 1.4 * r + 6)
    lean, towards = math.radians(how.slant_deg), rng.uniform(0, 6.3)
    c, s = math.cos(towards), math.sin(towards)
    dx, dy = canvas.x - np.float32(x), canvas.y - np.float32(y)
    u, v = (dx * c + dy * s) / math.cos(lean), -dx * s + dy * c
    far, angle = np.hypot(u, v), np.arctan2(v, u)
    cover = soft(far, r * (1 + waves(canvas, angle, how.jag, (18, 50))))
    texture = (
        waves(canvas, angle, 0.3, (60, 140))
        + np.sin(2 * math.pi * far / max(2.2, 0.06 * r) + waves(canvas, angle, 1.0, (4, 9)))
        if how.turned
        else grain(canvas, max(1.2, 0.03 * r), max(1.2, 0.05 * r), rng.uniform(0, 3.1))
    )
    level = how.level * (1 + how.shade * np.cos(angle - rng.uniform(0, 6.3))) + how.grain * texture
    for _ in range(how.scratches):
        q, off = rng.uniform(0, 3.14), rng.uniform(-0.8, 0.8) * r
        line = np.abs(dx * math.cos(q) + dy * math.sin(q) - off)
        level = level + rng.uniform(-70, 90) * np.exp(-((line / rng.uniform(0.6, 1.5)) ** 2))
    canvas.lay(np.clip(level, 0, 255), cover)
    if how.chamfer < 1:
        ring = soft(far, r) * (1 - soft(far, r * how.chamfer, 0.8))
        canvas.lay(how.level * rng.uniform(0.5, 0.8), ring)
    q = rng.uniform(0, 6.3)
    hole, hole_angle = canvas.around(
        x + how.aside * r * math.cos(q), y + how.aside * r * math.sin(q)
    )
    depth = how.bore * (1 + 0.4 * np.cos(hole_angle - rng.uniform(0, 6.3)))
    edge = how.ratio * r * (1 + waves(canvas, hole_angle, how.jag, (12, 30)))
    canvas.lay(depth, soft(hole, edge))
    for _ in range(how.drops):
        q, at = rng.uniform(0, 6.3), r * rng.choice([how.ratio, 1.0])
        drop, _ = canvas.around(x + at * math.cos(q), y + at * math.sin(q))
        canvas.lay(rng.uniform(5, 240), soft(drop, r * rng.uniform(0.1, 0.3), 1.5))
    return Tip(x, y, r)


def bright_face(canvas: Canvas) -> Face:
    """Return an ordinary face: bright, with a dark hole."""
    rng = canvas.rng
    return Face(rng.uniform(120, 235), rng.uniform(2, 40), rng.uniform(0.3, 0.62))


def dark_face(canvas: Canvas) -> Face:
    """Return one that is darker than what is around it, its hole lit from above."""
    rng = canvas.rng
    return Face(rng.uniform(12, 45), rng.uniform(130, 235), rng.uniform(0.3, 0.62), grain=1.0)


def no_tip(canvas: Canvas, r: float, near: tuple[float, float] | None) -> None:
    """Draw things as sharp as a tip, some as large, that are none: nuts, screws, pins, letters."""
    rng, whole = canvas.rng, canvas
    for _ in range(rng.integers(1, 4)):
        for _ in range(40):
            x, y = rng.uniform(0, whole.width), rng.uniform(0, whole.height)
            if near is None or math.hypot(x - near[0], y - near[1]) > 5.5 * r:
                break
        else:
            return
        size = r * rng.uniform(0.85, 1.15)
        canvas = whole.near(x, y, 1.5 * size + 5)
        far, angle = canvas.around(x, y)
        level = rng.uniform(90, 235)
        kind = rng.integers(6)
        if kind == 0:  # a nut: six sides, a round hole
            six = far * np.cos(np.mod(angle - rng.uniform(0, 1), math.pi / 3) - math.pi / 6)
            canvas.lay(level, soft(six, size * 0.95))
            canvas.lay(level * 0.2, soft(far, size * rng.uniform(0.45, 0.6)))
        elif kind == 1:  # the head of a screw, slotted or crossed
            canvas.lay(level, soft(far, size))
            q = rng.uniform(0, 3.1)
            for turn in (0.0, math.pi / 2)[: rng.integers(1, 3)]:
                beside = np.abs(far * np.sin(angle - q - turn))
                canvas.lay(level * 0.25, soft(beside, size * 0.12) * soft(far, size * 0.9))
        elif kind == 2:  # a pin or a plug: a disc with nothing in it
            canvas.lay(level * (1 + 0.2 * np.cos(angle)), soft(far, size))
        elif kind == 3:  # a thin ring
            canvas.lay(level, soft(np.abs(far - size), size * rng.uniform(0.02, 0.07)))
        elif kind == 4:  # a square with a round hole
            square = np.maximum(np.abs(far * np.cos(angle)), np.abs(far * np.sin(angle)))
            canvas.lay(level, soft(square, size * 0.95))
            canvas.lay(level * 0.2, soft(far, size * 0.5))
        else:  # half a washer
            half = soft(np.abs(far - size * 0.75), size * 0.25)
            canvas.lay(level, half * (np.cos(angle - rng.uniform(0, 6.3)) > 0))


def rings(canvas: Canvas, x: float, y: float, r: float) -> None:
    """Draw threads or a ring of light around a tip: circles of other sizes about its middle."""
    rng, canvas = canvas.rng, canvas.near(x, y, 4.2 * r)
    far, _ = canvas.around(x, y)
    at = 1.6
    while at < 3.5:
        canvas.lay(rng.uniform(20, 200), soft(np.abs(far - at * r), 0.05 * r, 1.0))
        at += rng.uniform(0.2, 0.5)


def taken(canvas: Canvas, sigma: float, noise: float) -> Array:
    """Return what a sensor makes of it: blurred, noisy, eight bits."""
    seen = blurred(canvas.grey, sigma)
    seen = seen + canvas.rng.standard_normal(seen.shape, dtype=np.float32) * np.float32(noise)
    return np.clip(np.rint(seen), 0, 255).astype(np.uint8)


def compressed(grey: Array, quality: int) -> Array:
    """Return what JPEG leaves of it."""
    from PIL import Image

    kept = io.BytesIO()
    Image.fromarray(grey).save(kept, "JPEG", quality=quality)
    return np.asarray(Image.open(kept).convert("L"))


KINDS: Final = (
    *("plain",) * 4,
    *("brushed",) * 3,
    *("turned",) * 3,
    *("worn",) * 4,
    *("scratched",) * 2,
    *("dark face",) * 3,
    *("chamfer",) * 3,
    *("drops",) * 2,
    *("things beside",) * 5,
    *("rings",) * 2,
    *("jpeg",) * 2,
    *("vignette", "gamma", "interlaced", "moire", "blurred", "blurred", "noisy", "smeared"),
    *("needle",) * 3,
    "thin wall",
    *("cut",) * 3,
    *("two",) * 3,
    *("none",) * 4,
)
SMALL_NOISE: Final = (0.8, 3.5)


@dataclass
class _Plan:
    """What one drawing does beside the tip."""

    faces: list[Face] = field(default_factory=list)
    sigma: float = 1.0
    noise: float = 2.0
    after: Callable[[Array], Array] = lambda grey: grey


def drawing(seed: int, size: tuple[int, int] = SIZE) -> Drawing:
    """Return the drawing of a seed."""
    canvas = Canvas.blank(seed, size)
    rng, kind = canvas.rng, KINDS[seed % len(KINDS)]
    r = rng.uniform(12, 0.11 * size[1])
    x, y = (rng.uniform(1.25 * r + 4, side - 1.25 * r - 4) for side in size)
    if kind == "cut":
        edge = rng.uniform(-0.4, 0.6) * r
        x, y = [(edge, y), (size[0] - edge, y), (x, edge), (x, size[1] - edge)][rng.integers(4)]
    ground(canvas)
    tips: list[Tip] = []
    how, plan = (
        bright_face(canvas),
        _Plan(sigma=rng.uniform(0.5, 1.4), noise=rng.uniform(*SMALL_NOISE)),
    )
    if kind == "brushed":
        how.grain, how.jag = rng.uniform(10, 35), 0.006
    elif kind == "turned":
        how.grain, how.turned = rng.uniform(8, 25), True
    elif kind == "worn":
        how.jag, how.grain = rng.uniform(0.012, 0.035), rng.uniform(10, 40)
    elif kind == "scratched":
        how.scratches = int(rng.integers(3, 9))
    elif kind == "dark face":
        how = dark_face(canvas)
    elif kind == "chamfer":
        how.chamfer = rng.uniform(0.7, 0.9)
    elif kind == "drops":
        how.drops = int(rng.integers(1, 4))
    elif kind == "thin wall":
        how.ratio = rng.uniform(0.62, 0.7)
    elif kind == "blurred":
        plan.sigma = rng.uniform(2.5, 5.0)
        r = max(r, 5 * plan.sigma)
    elif kind == "noisy":
        plan.noise = rng.uniform(8, 18)
    if kind == "blurred":
        x, y = (min(max(at, r + 12), side - r - 12) for at, side in zip((x, y), size, strict=True))
    if kind not in ("needle", "thin wall", "none"):
        body(canvas, x, y, r)
        if kind == "dark face":
            lit = canvas.near(x, y, 1.8 * r + 12)
            lit.lay(rng.uniform(120, 210), soft(lit.around(x, y)[0], 1.8 * r, 5.0))
        if kind == "rings":
            rings(canvas, x, y, r)
    if kind in ("things beside", "none"):
        no_tip(canvas, r, None if kind == "none" else (x, y))
    if kind in ("needle", "thin wall"):
        how.shade = rng.uniform(0.1, 0.5)
    if kind != "none":
        tips.append(face(canvas, x, y, r, how))
    if kind == "two":
        for _ in range(200):
            x2, y2 = (rng.uniform(1.25 * r + 4, side - 1.25 * r - 4) for side in size)
            if math.hypot(x2 - x, y2 - y) > 5 * r:
                tips.append(face(canvas, x2, y2, r * rng.uniform(0.95, 1.05), bright_face(canvas)))
                break
    grey = taken(canvas, plan.sigma, plan.noise)
    if kind == "interlaced":  # every second line is one pixel to the right
        tips = [Tip(tip.x_px + 0.5, tip.y_px, tip.radius_px) for tip in tips]
    return Drawing(kind, distorted(canvas, kind, grey), r, () if kind == "cut" else tuple(tips))


def distorted(canvas: Canvas, kind: str, grey: Array) -> Array:
    """Return what lens, sensor and line do to the picture of this kind."""
    rng = canvas.rng
    if kind == "jpeg":
        return compressed(grey, int(rng.integers(20, 60)))
    if kind == "gamma":
        return (255 * (grey / 255.0) ** rng.choice([0.45, 2.2])).astype(np.uint8)
    if kind == "vignette":
        far, _ = canvas.around(canvas.width / 2, canvas.height / 2)
        return (grey * (1 - 0.7 * (far / far.max()) ** 2)).astype(np.uint8)
    if kind == "interlaced":  # half of the lines a little later and darker
        out = grey.copy()
        out[1::2] = np.roll(out[1::2], 1, axis=1) * 0.93
        return out
    if kind == "moire":
        q, pitch = rng.uniform(0, 3.1), rng.uniform(3, 9)
        wave = np.sin(2 * math.pi * (canvas.x * math.cos(q) + canvas.y * math.sin(q)) / pitch)
        return np.clip(grey + rng.uniform(4, 12) * wave, 0, 255).astype(np.uint8)
    if kind == "smeared":  # something moved during the exposure, by two pixels
        return ((grey.astype(np.uint16) + np.roll(grey, 1, 1) + np.roll(grey, -1, 1)) // 3).astype(
            np.uint8
        )
    return grey
