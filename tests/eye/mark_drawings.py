"""Drawn pictures of boards with fiducials, and of what is taken for one; the truth is known.

numpy alone; nothing of the finders is used. A board has traces, vias, pads of other sizes, print
and scratches; light falls from one side; the lens blurs and the sensor has noise.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.float32]

SIZE_PX = (640, 480)

ROUND_KINDS = (
    *("clean",) * 4, *("parts",) * 6, *("faint",) * 3, *("blur",) * 3, *("noise",) * 3,
    *("dirt",) * 4, *("glare",) * 3, *("dark",) * 3, *("askew",) * 3, *("cut",) * 3,
    *("two",) * 3, *("none",) * 6, *("via",) * 4, *("square",) * 3, *("other size",) * 3,
    *("hex",) * 2, *("crossing",) * 2,
)  # fmt: skip
CROSS_KINDS = (
    *("clean",) * 4, *("parts",) * 6, *("faint",) * 3, *("blur",) * 3, *("noise",) * 3,
    *("dirt",) * 4, *("glare",) * 3, *("dark",) * 3, *("askew",) * 3, *("cut",) * 3,
    *("two",) * 3, *("none",) * 6, *("lines",) * 4, *("tee",) * 3, *("square",) * 3,
    *("other size",) * 3, *("star",) * 2,
)  # fmt: skip
ARUCO_KINDS = (
    *("clean",) * 4, *("parts",) * 6, *("faint",) * 3, *("blur",) * 3, *("noise",) * 3,
    *("dirt",) * 4, *("glare",) * 3, *("askew",) * 3, *("cut",) * 3, *("two",) * 3,
    *("none",) * 6, *("other id",) * 4, *("other size",) * 3, *("square",) * 3,
)  # fmt: skip
ABSENT = ("none", "cut", "via", "square", "other size", "hex", "lines", "tee", "star", "other id")
"""Kinds in which there is none that counts."""


@dataclass
class Drawn:
    """A picture and what is in it.

    Attributes:
        kind: What is drawn.
        half_px: Half the width of a mark.
        told_px: The same as a finder is told it: up to 8 % wrong.
        marks: Middles of the marks that count, in pixels.
    """

    kind: str
    grey: npt.NDArray[np.uint8]
    half_px: float
    told_px: float
    marks: list[tuple[float, float]] = field(default_factory=list)


@dataclass
class Board:
    """A picture that is being drawn: what is there, and a grid of its pixels."""

    rng: Any
    level: Image
    x: Image
    y: Image

    def paint(self, distance: Image, value: float | Image, soft_px: float = 0.5) -> None:
        """Give a value to all within a distance of nought or less."""
        cover = np.clip(0.5 - distance / (2 * soft_px), 0, 1)
        self.level = self.level * (1 - cover) + cover * np.float32(value)

    def disc(
        self, x: float, y: float, radius: float, squash: float = 1.0, turn: float = 0.0
    ) -> Any:
        """Return distances from a disc."""
        u, v = self.turned(x, y, turn)
        return (np.hypot(u, v / squash) - radius) * math.sqrt(squash)

    def box(self, x: float, y: float, half_u: float, half_v: float, turn: float) -> Any:
        """Return distances from a rectangle."""
        u, v = self.turned(x, y, turn)
        return np.maximum(abs(u) - half_u, abs(v) - half_v)

    def turned(self, x: float, y: float, turn: float) -> tuple[Image, Image]:
        """Return the coordinates about a place, turned."""
        c, s = math.cos(turn), math.sin(turn)
        dx, dy = self.x - x, self.y - y
        return dx * c + dy * s, dy * c - dx * s

    def somewhere(self, margin: float) -> tuple[float, float]:
        """Return a place that is not at the edge."""
        height, width = self.level.shape
        return (
            self.rng.uniform(margin, width - 1 - margin),
            self.rng.uniform(margin, height - 1 - margin),
        )


def board(
    rng: Any,
    size_px: tuple[int, int],
    *,
    parts: bool,
    half: float,
    keep: list[tuple[float, float]],
) -> Board:
    """Return a bare board with the parts that are beside its fiducials."""
    width, height = size_px
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    ground = rng.uniform(25, 80)
    made = Board(rng, np.full((height, width), ground, np.float32), x, y)
    if not parts:
        return made

    def far(place: tuple[float, float], reach: float) -> bool:
        return all(math.dist(place, other) > reach + 2.2 * half for other in keep)

    for _ in range(rng.integers(4, 10)):  # traces
        place, turn = made.somewhere(0), rng.choice([0, math.pi / 4, math.pi / 2, -math.pi / 4])
        wide, long = rng.uniform(2, 8), rng.uniform(30, 300)
        along = (math.cos(turn), math.sin(turn))
        steps = [
            (place[0] + t * along[0], place[1] + t * along[1]) for t in np.linspace(-long, long, 25)
        ]
        if all(far(step, wide) for step in steps):
            made.paint(made.box(*place, long, wide, turn), ground + rng.uniform(10, 40))
    for _ in range(rng.integers(4, 14)):  # vias, rectangular pads, holes
        place = made.somewhere(0)
        what, size = rng.integers(3), rng.uniform(0.25, 0.65) * half
        if not far(place, 2.2 * size):
            continue
        value = rng.uniform(110, 220)
        if what == 0:
            made.paint(made.disc(*place, size), value)
            made.paint(made.disc(*place, size * 0.5), rng.uniform(5, 30))
        elif what == 1:
            turn = rng.choice([0.0, math.pi / 2, math.pi / 4])
            made.paint(made.box(*place, size * 2, size, turn), value)
        else:
            made.paint(made.disc(*place, size), rng.uniform(3, 20))
    for _ in range(rng.integers(0, 3)):  # print: letters as strokes
        at = made.somewhere(0)
        for stroke in range(int(rng.integers(4, 9))):
            place = (at[0] + 9 * stroke, at[1] + rng.uniform(-6, 6))
            if far(place, 14):
                turn = rng.choice([0.0, math.pi / 2, 1.0])
                made.paint(made.box(*place, rng.uniform(3, 10), 1.5, turn), 200)
    return made


def finished(
    made: Board, kind: str, rng: Any, *, at: tuple[float, float] | None, half: float
) -> npt.NDArray[np.uint8]:
    """Return the picture with light, scratches, blur and noise."""
    level = made.level
    height, width = level.shape
    toward = rng.uniform(0, math.tau)
    slope = rng.uniform(0, 0.3)
    across = (made.x / width - 0.5) * math.cos(toward) + (made.y / height - 0.5) * math.sin(toward)
    level = level * (1 + slope * across)
    grain = rng.normal(0, rng.uniform(1, 5), (height // 8 + 2, width // 8 + 2)).astype(np.float32)
    level = level + blurred(np.kron(grain, np.ones((8, 8), np.float32))[:height, :width], 4)
    made.level = level.astype(np.float32)
    if kind == "dirt" and at is not None:
        for _ in range(rng.integers(1, 4)):
            way, size = rng.uniform(0, math.tau), half * rng.uniform(0.12, 0.4)
            x, y = at[0] + half * math.cos(way), at[1] + half * math.sin(way)
            made.paint(
                made.disc(x, y, size, rng.uniform(0.5, 1), rng.uniform(0, 3)),
                rng.uniform(10, 230), 1.5,
            )  # fmt: skip
    if kind == "glare" and at is not None:
        x, y = at[0] + rng.uniform(-1, 1) * half, at[1] + rng.uniform(-1, 1) * half
        reach = half * rng.uniform(0.4, 1.2)
        spot = np.exp(-0.5 * ((made.x - x) ** 2 + (made.y - y) ** 2) / reach**2)
        made.level = made.level + np.float32(rng.uniform(40, 140)) * spot
    for _ in range(int(rng.integers(0, 4)) if kind != "clean" else 0):  # scratches
        turn = rng.uniform(0, math.pi)
        made.paint(
            made.box(*made.somewhere(0), rng.uniform(20, 120), 0.6, turn),
            made.level + np.float32(rng.uniform(-30, 40)),
        )
    made.level = blurred(made.level, rng.uniform(2.5, 4.5) if kind == "blur" else
                         rng.uniform(0.6, 1.4))  # fmt: skip
    if kind == "faint":
        made.level = 30 + (made.level - 30) * rng.uniform(0.15, 0.3)
    sigma = rng.uniform(8, 16) if kind == "noise" else rng.uniform(1, 4)
    noisy = made.level + rng.standard_normal(made.level.shape, dtype=np.float32) * sigma
    grey: npt.NDArray[np.uint8] = np.clip(noisy + 0.5, 0, 255).astype(np.uint8)
    return grey


def blurred(level: Image, sigma: float) -> Image:
    """Return a picture through a Gaussian."""
    reach = math.ceil(3 * sigma)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    kernel = (kernel / kernel.sum()).astype(np.float32)
    for axis in (0, 1):
        rim = [(reach, reach) if axis == this else (0, 0) for this in (0, 1)]
        padded = np.pad(level, rim, mode="edge")
        count = level.shape[axis]
        level = sum(
            (weight * padded.take(range(k, k + count), axis) for k, weight in enumerate(kernel)),
            np.zeros_like(level),
        )
    return level


def _places(
    rng: Any, size_px: tuple[int, int], kind: str, half: float
) -> list[tuple[float, float]]:
    (width, height), margin = size_px, half * 1.6 + 8
    x, y = rng.uniform(margin, width - margin), rng.uniform(margin, height - margin)
    if kind == "cut":
        inside = rng.uniform(-0.5, 0.7) * half
        x, y = [(inside, y), (width - 1 - inside, y), (x, inside), (x, height - 1 - inside)][
            int(rng.integers(4))
        ]
    places = [(x, y)]
    for _ in range(200 if kind == "two" else 0):
        other = (rng.uniform(margin, width - margin), rng.uniform(margin, height - margin))
        if math.dist(other, places[0]) > 4 * half:
            return [*places, other]
    assert kind != "two", "there is no room for two"
    return places


def round_pad(seed: int, size_px: tuple[int, int] = SIZE_PX) -> Drawn:
    """Return a drawing of a board with a round pad, or with something else."""
    rng = np.random.default_rng(seed)
    kind = ROUND_KINDS[seed % len(ROUND_KINDS)]
    half = rng.uniform(10, 45)
    places = _places(rng, size_px, kind, half)
    made = board(rng, size_px, parts=kind not in ("clean",), half=half, keep=places)
    ground = float(made.level[0, 0])
    dark = kind == "dark"
    pad = rng.uniform(3, 18) if dark else rng.uniform(120, 235)
    if dark:
        made.level = made.level + np.float32(90)
    for x, y in places if kind != "none" else []:
        if rng.random() < 0.6 and not dark:  # an opening in the mask
            made.paint(
                made.disc(x, y, half * rng.uniform(1.5, 2.1)), ground * rng.uniform(0.4, 0.9)
            )
        squash = rng.uniform(0.94, 1.0) if kind == "askew" else rng.uniform(0.99, 1.0)
        turn, size = rng.uniform(0, math.pi), half
        if kind == "other size":
            size = half * float(rng.choice([0.62, 1.5]))
        if kind in ("square", "hex"):
            count = 4 if kind == "square" else 6
            ways = turn + np.arange(count) * math.tau / count
            u, v = made.x - x, made.y - y
            made.paint(
                np.max([u * math.cos(w) + v * math.sin(w) for w in ways], axis=0) - size * 0.95,
                pad,
            )
        elif kind == "crossing":  # a trace leads to it
            made.paint(made.disc(x, y, size), pad)
            made.paint(made.box(x + 2 * size, y, 1.6 * size, size * 0.2, 0), pad)
        else:
            made.paint(made.disc(x, y, size, squash, turn), pad)
        if kind == "via":
            made.paint(made.disc(x, y, size * rng.uniform(0.4, 0.7)), rng.uniform(3, 40))
    grey = finished(made, kind, rng, at=places[0], half=half)
    told = half * rng.uniform(0.92, 1.08)
    return Drawn(kind, grey, half, told, [] if kind in ABSENT else places)


def cross(seed: int, size_px: tuple[int, int] = SIZE_PX) -> Drawn:
    """Return a drawing of a board with a cross, or with something else."""
    rng = np.random.default_rng(seed)
    kind = CROSS_KINDS[seed % len(CROSS_KINDS)]
    half = rng.uniform(14, 50)
    places = _places(rng, size_px, kind, half)
    made = board(rng, size_px, parts=kind not in ("clean",), half=half, keep=places)
    ink = rng.uniform(3, 18) if kind == "dark" else rng.uniform(130, 235)
    if kind == "dark":
        made.level = made.level + np.float32(90)
    for x, y in places if kind != "none" else []:
        turn, wide = rng.uniform(0, math.pi / 2), half * rng.uniform(0.1, 0.22)
        lean = math.radians(rng.uniform(-3, 3)) if kind == "askew" else 0.0
        size = half
        if kind == "other size":
            size = half * float(rng.choice([0.6, 1.5]))
        if kind == "square":
            made.paint(made.box(x, y, size * 0.8, size * 0.8, turn), ink)
            continue
        if kind == "lines":
            size = 1000.0
        made.paint(made.box(x, y, size, wide, turn), ink)
        upright = turn + math.pi / 2 + lean
        if kind == "tee":
            made.paint(
                made.box(
                    x + size / 2 * math.cos(upright), y + size / 2 * math.sin(upright),
                    size / 2, wide, upright,
                ), ink,
            )  # fmt: skip
            continue
        made.paint(made.box(x, y, size, wide, upright), ink)
        if kind == "star":
            made.paint(made.box(x, y, size, wide, turn + math.pi / 4), ink)
            made.paint(made.box(x, y, size, wide, turn - math.pi / 4), ink)
    grey = finished(made, kind, rng, at=places[0], half=half)
    told = half * rng.uniform(0.92, 1.08)
    return Drawn(kind, grey, half, told, [] if kind in ABSENT else places)


def aruco(seed: int, bits_of: Any, number: int = 1, size_px: tuple[int, int] = SIZE_PX) -> Drawn:
    """Return a drawing of a board with an ArUco marker, or with something else.

    Args:
        seed: Which.
        bits_of: Returns the modules of a marker, border included, by its id; 1 is white.
        number: The id that is looked for.
        size_px: Width and height of the picture.
    """
    rng = np.random.default_rng(seed)
    kind = ARUCO_KINDS[seed % len(ARUCO_KINDS)]
    half = rng.uniform(22, 70)
    if kind == "two":
        half = min(half, 45.0)
    places = _places(rng, size_px, kind, half * 1.2)
    made = board(rng, size_px, parts=kind not in ("clean",), half=half * 1.6, keep=places)
    for x, y in places if kind != "none" else []:
        size = half * float(rng.choice([0.6, 1.5])) if kind == "other size" else half
        shown = number + 1 + int(rng.integers(8)) if kind == "other id" else number
        bits = np.zeros((6, 6)) if kind == "square" else np.asarray(bits_of(shown), float)
        turn = rng.uniform(0, math.tau)
        squash = rng.uniform(0.94, 1.0) if kind == "askew" else 1.0
        made.paint(made.box(x, y, size * 1.35, size * 1.35 * squash, turn), 210)
        count = len(bits)
        # Each pixel is the mean of 3 x 3 places.
        total = np.zeros_like(made.level)
        for du in (-1 / 3, 0, 1 / 3):
            for dv in (-1 / 3, 0, 1 / 3):
                u, v = made.turned(x + du, y + dv, turn)
                i = np.floor((u / size + 1) / 2 * count).astype(int)
                j = np.floor((v / squash / size + 1) / 2 * count).astype(int)
                inside = (i >= 0) & (i < count) & (j >= 0) & (j < count)
                value = bits[np.clip(j, 0, count - 1), np.clip(i, 0, count - 1)]
                total += np.where(inside, 15 + 195 * value, made.level)
        made.level = (total / 9).astype(np.float32)
    grey = finished(made, kind, rng, at=places[0], half=half)
    told = half * rng.uniform(0.92, 1.08)
    return Drawn(kind, grey, half, told, [] if kind in ABSENT else places)
